"""Processes a whole fleet: computes the missing results, and writes all results during the run and at its end."""

import contextlib
import hashlib
import json
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from kickstand import __version__
from kickstand_tools.common.messages import InputError
from kickstand_tools.common.output import check_directory, new_directory

from . import KEPT, files, plot, tables
from .cluster import run_tasks
from .journal import Journal
from .manifest import Period
from .page import FleetSummary
from .period import AFTERWARDS, CHANGED, DISK_FULL, PeriodResult, failed, work_on_period

RESULTS_VERSION = 4  # version of the results; a new number makes the next run recompute all earlier results
PLOTS, SIGNALS = "plots", "signals"
TIMEOUT_S = 600.0  # longest time for the logs of one mount of one vehicle
# Shortest pause before the tables are written again during a run: _WRITE_S seconds, and _SHARE times the duration of
# the last writing
_WRITE_S, _SHARE = 15.0, 20.0


@dataclass
class FleetRun:
    """The numbers of results in a run, and their summary.

    vehicles: Number of results, one for each mount of each vehicle.
    new: Number of results that this run computed. Earlier runs computed the remaining results.
    damaged: Number of earlier results that could not be read and are recomputed.
    seen: Summary of all results.
    """

    vehicles: int
    new: int
    damaged: int
    seen: FleetSummary


def run_fleet(
    periods: list[Period],
    out: Path | str,
    scheduler: str | None = None,
    workers: int | None = None,
    with_signals: bool = False,
    timeout_s: float = TIMEOUT_S,
    progress: Callable[[int, int], None] | None = None,
) -> FleetRun:
    """Process all periods, and write tables (see tables.TABLES), pictures and index.html.

    If earlier results are in the same directory, they are reused unless their logs have changed.

    Args:
        periods: The periods of read_manifest() or by_pattern().
        out: Directory, or address in a store (s3://...).
        scheduler: Address of a Dask cluster. None starts workers on this computer.
        workers: Number of workers on this computer. None starts one per processor.
        with_signals: Also write each log's accelerations along the vehicle's axes to out/signals.
        timeout_s: Longest time for one period.
        progress: Function that is called with the number of finished periods and the number of all.

    Raises:
        InputError: If the run cannot continue. Finished results are kept, and written to the tables.

    A script must call this function below `if __name__ == "__main__":`, because workers on this computer import the
    script.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     run = run_fleet([], directory)
    ...     run.new, run.seen.count, sorted(path.name for path in Path(directory).glob("*.parquet"))
    (0, 0, ['alignments.parquet', 'brake_tests.parquet', 'errors.parquet', 'moved.parquet'])
    """
    with contextlib.ExitStack() as opened:
        if files.is_remote(str(out)):
            directory = str(out).rstrip("/")
        else:
            check_directory(Path(out))
            directory = str(Path(out).resolve())  # absolute, because workers may have another working directory
            opened.enter_context(new_directory(Path(directory) / PLOTS))
        journal = Journal(files.join(directory, "journal"))
        marks = files.identities(dict.fromkeys(path for period in periods for path in period.paths))
        keys = _keys(periods, marks, with_signals)
        todo = [(key, period) for key, period in zip(keys, periods) if key not in journal]

        def report(finished: int) -> None:
            if progress:
                progress(len(keys) - len(todo) + finished, len(keys))

        def write() -> FleetSummary:
            return write_results(directory, journal.results(keys), len(keys))

        report(0)
        written_s, pause_s = time.monotonic(), _WRITE_S
        signals_to = files.join(directory, SIGNALS) if with_signals else None
        tasks = [(period, signals_to) for _, period in todo]
        outcomes = run_tasks(work_on_period, tasks, scheduler, workers, timeout_s)
        try:
            for finished, (index, result, reason, message) in enumerate(outcomes, 1):
                key, period = todo[index]
                outcome = result or failed(period, reason, message)
                changed = _note_changed(period, marks, outcome)
                _keep(directory, journal, key, outcome, again=result is None or changed)
                report(finished)
                if time.monotonic() - written_s > pause_s:
                    begin_s = time.monotonic()
                    write()
                    written_s = time.monotonic()
                    pause_s = max(_WRITE_S, _SHARE * (written_s - begin_s))
        except BaseException:  # including Ctrl-C
            # An InputError is ignored: if the disk is full, the first error already reports it
            with contextlib.suppress(InputError):
                if next(journal.results(keys), None):
                    write()
            raise
        return FleetRun(len(keys), len(todo), journal.damaged, write())


def write_results(directory: str, results: Iterable[PeriodResult], expected: int) -> FleetSummary:
    """Write the tables and the page of the results so far. Return their summary. Raises InputError.

    expected: number of results at the end of the run.
    """
    summary = FleetSummary()

    def counted() -> Iterator[PeriodResult]:
        for result in results:
            summary.add(result)
            yield result

    tables.write_tables(directory, counted())
    files.write_bytes(files.join(directory, "index.html"), summary.page(expected).encode())
    return summary


def _note_changed(period: Period, marks: dict[str, str], result: PeriodResult) -> bool:
    """Add a row of errors to the result for each log that was replaced since the run began. True if there is one.

    Logs in a store are not checked: a file read from a store is always one complete version.
    """
    current = files.identities(path for path in period.paths if not files.is_remote(path))
    changed = [path for path, mark in current.items() if mark != marks[path]]
    for path in map(files.printable, changed):
        whose = {"vehicle": period.vehicle, "mount": period.mount, "log": path, "reason": CHANGED}
        result.errors.append(whose | {"message": f"{path} has changed during the run: run the command again"})
    return bool(changed)


def _keep(directory: str, journal: Journal, key: str, result: PeriodResult, again: bool) -> None:
    """Save a result in the journal, and write its picture. again: True if the next run should recompute it.

    Raises InputError if a file cannot be written, or if the disk was full when the signals were written.
    """
    missing = [row for row in result.errors if row["reason"] in (AFTERWARDS, DISK_FULL)]
    unshown = None  # raised after the result is saved, because the result must not be lost with its picture
    if result.picture:
        path = f"{PLOTS}/{plot.file_name(result.alignment['vehicle'], result.alignment['mount'])}"
        try:
            files.write_bytes(files.join(directory, path), plot.draw(result).encode())
            result.alignment["plot"] = path
        except InputError as error:
            unshown = error
    try:
        journal.add(key, result, again or bool(missing) or unshown is not None)
    except InputError as error:
        raise InputError(f"{error}; {KEPT}") from error
    if unshown:
        raise unshown
    full = next((row for row in missing if row["reason"] == DISK_FULL), None)
    if full:
        raise InputError(f"{full['message']}; {KEPT}")


def _keys(periods: list[Period], marks: dict[str, str], with_signals: bool) -> list[str]:
    """Return a key for each period. The key changes if a log, an option or the version changes."""
    keys = []
    for period in periods:
        logs = [(path, marks[path]) for path in period.paths]
        version = [RESULTS_VERSION, __version__, with_signals]
        exact = json.dumps([*version, period.vehicle, period.mount, period.kind, logs])
        keys.append(hashlib.sha256(exact.encode()).hexdigest()[:32])
    return keys
