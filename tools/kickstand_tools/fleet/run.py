"""A whole fleet: what is new is worked on, everything is written to a directory, at any time and again at the end."""

import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from kickstand import __version__

from ..errors import InputError, cause
from ..output import check_directory
from . import files, page, plot, schema, tables
from .cluster import Cluster
from .journal import Journal
from .manifest import Period
from .period import PeriodResult, failed, work_on_period

RESULTS_VERSION = 1  # another one makes all results of before obsolete
SIGNALS = "signals"
TIMEOUT_S = 600.0  # for one mount of one vehicle
_WRITE_S, _SHARE = 15.0, 20.0  # tables are written so often, and at most every so many times what writing takes


@dataclass
class FleetRun:
    """statuses: how many are aligned, refused, error, by status; reasons: by reason. new: how many were worked on now,
    the others were finished before. moved, brake_tests, errors: rows in these tables."""

    vehicles: int
    new: int
    statuses: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    moved: int = 0
    brake_tests: int = 0
    errors: int = 0


def run_fleet(
    periods: list[Period],
    out: Path | str,
    scheduler: str | None = None,
    workers: int | None = None,
    with_signals: bool = False,
    timeout_s: float = TIMEOUT_S,
    progress: Callable[[int, int], None] | None = None,
) -> FleetRun:
    """Work on all periods (see read_manifest), and write tables (see schema.TABLES), pictures and index.html to out.

    scheduler: the address of a Dask cluster, None for workers on this computer: so many, or one a processor.
    with_signals: also write each log's accelerations along the vehicle's axes, to out/signals. timeout_s: for one
    period. progress: called with (done, all). What an earlier run into the same directory has finished is not done
    again, as long as its logs have not changed. Raises InputError; what is finished is kept and shown then, too.
    """
    directory = Path(out)
    tables.check()
    check_directory(directory)
    try:
        (directory / "plots").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{directory} cannot be made: {cause(error)}") from error
    keys = _keys(periods, with_signals)
    signals_to = str(directory.resolve() / SIGNALS) if with_signals else None
    with Journal(directory / "journal.jsonl") as journal:
        todo = [k for k, key in enumerate(keys) if key not in journal]
        done = len(keys) - len(todo)
        if progress:
            progress(done, len(keys))
        last_s, pause_s = time.monotonic(), _WRITE_S
        with ExitStack() as stack:
            stack.callback(lambda: write_results(directory, journal.results(keys), len(keys)))
            if todo:
                cluster = stack.enter_context(Cluster(scheduler, workers, timeout_s))
                items = [(periods[k], signals_to) for k in todo]
                for index, result, reason, message in cluster.run(work_on_period, items):
                    k = todo[index]
                    _keep(directory, journal, keys[k], periods[k], result, reason, message)
                    done += 1
                    if progress:
                        progress(done, len(keys))
                    if time.monotonic() - last_s > pause_s:
                        journal.sync()
                        before_s = time.monotonic()
                        write_results(directory, journal.results(keys), len(keys))
                        last_s = time.monotonic()
                        pause_s = max(_WRITE_S, _SHARE * (last_s - before_s))
        return _counted(journal.results(keys), len(keys), len(todo))


def write_results(directory: Path, results: Iterable[PeriodResult], expected: int) -> None:
    """Write the tables and the page of the results so far. expected: how many there will be. Raises InputError."""
    known = list(results)
    for table in schema.TABLES:
        tables.write_table(directory / f"{table}.parquet", table, tables.rows_of(known, table))
    page.write_page(directory / "index.html", known, expected)


def _keep(
    directory: Path,
    journal: Journal,
    key: str,
    period: Period,
    result: PeriodResult | None,
    reason: str,
    message: str,
) -> None:
    kept = result or failed(period, reason, message)
    if kept.alignment["status"] == "aligned":
        kept.alignment["plot"] = f"plots/{plot.file_name(period.vehicle, period.mount)}"
        plot.write_plot(directory / kept.alignment["plot"], kept)
    journal.add(key, kept, again=result is None)


def _keys(periods: list[Period], with_signals: bool) -> list[str]:
    """What tells the result of each period from that of other logs, other options and other versions."""
    marks = files.identities(dict.fromkeys(path for period in periods for path in period.paths))
    keys = []
    for period in periods:
        logs = [(path, marks[path]) for path in period.paths]
        told = [RESULTS_VERSION, __version__, period.vehicle, period.mount, period.kind, logs, with_signals]
        keys.append(hashlib.sha256(json.dumps(told).encode()).hexdigest()[:32])
    return keys


def _counted(results: Iterable[PeriodResult], vehicles: int, new: int) -> FleetRun:
    found = FleetRun(vehicles, new)
    for result in results:
        found.statuses[result.alignment["status"]] += 1
        if result.alignment["reason"]:
            found.reasons[result.alignment["reason"]] += 1
        found.moved += len(result.moved)
        found.brake_tests += len(result.brake_tests)
        found.errors += len(result.errors)
    return found
