"""`kickstand report`, `plot`, `smooth`, `import`, `join` and `calibrate ride` in the browser: their own code on CPython
for WebAssembly. page/rides/worker.mjs runs it, in a separate folder.

Each function returns JSON as described in its docstring, or {"refused": reason}: the command's message in the words of
a page.
"""

import functools
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis import report
from ..analysis.overview import overview
from ..analysis.plot.page import page
from ..analysis.ride import Ride, open_ride
from ..calibration.file import calibration_path, write_calibration
from ..common.errors import InputError
from ..estimation.alignment import fit_ride
from ..estimation.smooth import COLUMNS, DIGITS, smooth_to_csv
from ..imports import mapped
from ..imports.importing import import_recording, write_imported
from ..joining.joined import join_track, write_joined
from ..logs.csv_lines import write_lean
from ..logs.reader import read_blocks
from .rides_given import sorted_out

PLOTLY = "./plotly/plotly.min.js"  # the page of a ride loads it from the site
MADE = Path("../made")  # not in the folder of the given files, which may have any name
_smoothed: dict[str, list] = {}  # of the last shown ride: results of smooth_blocks(), block by block
TOO_LONG = "this ride is too long for the memory of a browser: give a part of it"


def in_json(function: Callable[..., Any]) -> Callable[..., str]:
    """A decorator: return the result as JSON, or the reason for a refusal."""

    @functools.wraps(function)
    def as_json(*given):
        try:
            return json.dumps(function(*given))
        except InputError as error:
            return json.dumps({"refused": _one_line(error.line(page=True))})
        except MemoryError:
            return json.dumps({"refused": TOO_LONG})

    return as_json


@in_json
def rides(given, names):
    """Identify the files of these names (JSON, in the order given) in the folder `given`.

    {"rides": [{"log", "isLog": true unless it is an app's recording, "calibration" and "track": name or "", "files":
    [names], "table": asked_for() of an unknown table}, ...], sorted by name; "kinds": {name: kind}; "why": {name:
    reason why it cannot be used}}.
    """
    _smoothed.clear()
    for old in Path().iterdir():
        shutil.rmtree(old) if old.is_dir() else old.unlink()
    names = json.loads(names)
    for name in names:
        Path(name).symlink_to(Path(given, name))
    found = sorted_out(names)
    rides = [
        vars(one) | {"isLog": found.kinds.get(one.log) == "log", "table": one.table and asked_for(one.table)}
        for one in found.rides
    ]
    refused = {name: _one_line(error.line(page=True)) for name, error in found.refused.items()}
    return {"rides": rides, "kinds": found.kinds, "why": refused}


def asked_for(table: mapped.MappedTable) -> dict[str, Any]:
    """The questions of the page about a table: {"columns": all, "keys": [[key, words, required, probable column or ""],
    ...], "units": [[key, words, [[unit, words], ...], probable unit, reason], ...], "lacking": missing columns in
    words, "certain": true if all required columns are certain, "picture": Table.first_seconds()}."""
    keys = [[key, words, key in mapped.REQUIRED, table.found.get(key, "")] for key, words in mapped.WORDS.items()]
    found = table.findings
    units = []
    for key, words in (("t", "time"), ("a", "acceleration"), ("g", "rates"), ("speed", "speed")):
        likely, why = table.units.get(key, ""), found.found[key].why if key in found.found else ""
        choices = [*mapped.UNIT_KEYS[key], *([mapped.COUNTS] if key in "ag" else [])]
        if likely and likely not in choices:
            choices.insert(0, likely)
        units.append([key, f"unit of the {words}", [[unit, unit] for unit in choices], likely, why])
    units[1][2] += [[f"-{unit}", f"{unit}, all of the opposite sign"] for unit, _ in list(units[1][2])]
    words = {"lacking": table.lacking, "certain": found.decided, "picture": table.first_seconds()}
    return {"columns": table.columns, "keys": keys, "units": units} | words


@in_json
def take(log, is_log, columns, units, track, progress):
    """{"log": log} for a log. For an app's recording (`import`) or with a track (`join`), {"log": the new log, "path":
    the same, "warnings": [...], "words": how it was joined or ""}. columns, units: of a table, as JSON of the values of
    --columns and --units, otherwise "{}". track: a .gpx, a .fit or ""."""
    if is_log and not track:
        return {"log": log}
    out, warnings, words = log, [], ""
    if not is_log:
        found = import_recording(log, json.loads(columns) or None, json.loads(units))
        out = str(_result_path(log, f"{log.partition('.')[0]}.csv"))
        write_imported(out, found)
        warnings = [notice.line(page=True) for notice in [*found.notices, *found.shortfalls]]
    if track:
        try:
            joined = join_track(Path(out), Path(track), progress)
            out = str(_result_path(log, f"{log.partition('.')[0]}.joined.csv"))
            write_joined(out, joined)
            match = joined.match
            words = f"{track} is joined: correlation {match.correlation:.2f}, known to {match.sigma_s:.2f} s."
        except InputError as error:
            warnings.append(f"{track} is not joined: {_one_line(error.line(page=True))}")
    made = {"path": out} if out != log else {}
    return {"log": out, "warnings": warnings, "words": words} | made


class _Keeping(Ride):
    """Keeps the smoothed lean, because computing it again would take as long."""

    def _read(self, log, progress, notices):
        for block, found in super()._read(log, progress, notices):
            _smoothed.setdefault(self.name, []).append(found)
            yield block, found


@in_json
def look(log, calibration, progress):
    """The results of `report` and `plot` for a log with the calibration of a file: {"words": report.Words, "json":
    report.as_data(), "warnings": [...], "page": HTML, "plotly": the script that the page loads, "stem": the name
    without suffixes}. progress(done, total): the progress."""
    opened = open_ride(Path(log), Path(calibration), smoothed=True)
    _smoothed.clear()
    ride = _Keeping(opened.log, opened.calibration, opened.smoothed)
    seen = overview(ride, progress)
    table = {"units": report.STOPS_UNITS, "title": report.STOPS_TITLE, "terms": report.STOPS_TERMS}
    return {
        "words": asdict(report.words(seen, on_page=True)) | table,
        "json": report.as_data(seen) | {"ride": Path(log).name},
        "warnings": [notice.line(page=True) for notice in seen.notices],
        "page": page(seen, f'<script src="{PLOTLY}"></script>', "'self'"),
        "plotly": PLOTLY,
        "stem": ride.stem,
    }


@in_json
def smooth(log, calibration, progress):
    """{"path": of LEAN.csv as written by `smooth`}. Results of look() are reused."""
    ride = open_ride(Path(log), Path(calibration))
    out = _result_path(log, f"{ride.stem}.lean.csv")
    kept = _smoothed.get(ride.name, [None])
    if any(found is None for found in kept):
        smooth_to_csv(Path(log), ride.calibration, out, progress)
    else:
        write_lean(out, COLUMNS, DIGITS, _blocks_with(np.concatenate(kept), ride, progress))
    return {"path": str(out)}


def _blocks_with(values, ride, progress):
    """Blocks of the ride's log, each with its rows of values (n samples, columns)."""
    at = 0
    for block in read_blocks(ride.log, 2, progress, calibration=ride.calibration):
        at, begin = at + len(block.time_us), at
        yield block, values[begin:at]


@in_json
def align(log, progress):
    """{"path": of the calibration from `calibrate ride`, "roll_deg", "pitch_deg", "yaw_deg": its standard errors}."""
    found = fit_ride(Path(log), progress=progress)
    out = _result_path(log, calibration_path(Path(log)).name)
    write_calibration(out, found.calibration)
    known = {name: round(getattr(found, name), 1) for name in ("roll_deg", "pitch_deg", "yaw_deg")}
    return {"path": str(out), **known}


def _result_path(log, name):
    """A path for a result of a log. Another log may have a result of the same name."""
    folder = Path(log).parent if MADE in Path(log).parents else MADE / log
    folder.mkdir(parents=True, exist_ok=True)
    return folder / name


def _one_line(text):
    """The message without the folder of results, which is an internal path."""
    return re.sub(rf"{re.escape(str(MADE))}/[^/]*/", "", " ".join(text.split()))


def raising(function):
    """A decorator for functions of numpy.linalg: they then raise LinAlgError for a singular matrix, as elsewhere.

    numpy detects it by the processor's flags of floating-point errors. WebAssembly has none: the result is NaN.
    """

    @functools.wraps(function)
    def checked(*matrices):
        found = function(*matrices)
        if np.any(np.isnan(found)) and all(np.all(np.isfinite(matrix)) for matrix in matrices):
            raise np.linalg.LinAlgError("Singular matrix")
        return found

    return checked


def prepare():
    """Prepare the module. Call it once, before all other functions."""
    np.linalg.inv, np.linalg.solve = raising(np.linalg.inv), raising(np.linalg.solve)
