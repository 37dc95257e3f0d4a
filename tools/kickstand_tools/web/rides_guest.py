"""`kickstand report`, `plot`, `smooth`, `import` and `calibrate ride` in the browser: their own code on CPython for
WebAssembly. page/rides/worker.mjs runs it, in a folder of its own.

Each function returns JSON: what its docstring says, or {"refused": why}, the line that the command would say.
"""

import functools
import json
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis import report
from ..analysis.overview import overview
from ..analysis.plot.page import page
from ..analysis.ride import open_ride
from ..calibration.file import calibration_beside, calibration_path, write_calibration
from ..calibration.ride.fit import fit_ride
from ..errors import InputError
from ..imports.importing import app_of, import_recording, write_imported
from ..logs.reader import check_first_line
from ..refusals import sentence
from ..smoothing.smooth import smooth_to_csv

PLOTLY = "./plotly/plotly.min.js"  # the page of a ride loads it from the site
TOGETHER = "recording"  # the folder of files that are one recording
TOO_LONG = "this ride is too long for the memory of a browser: kickstand cut takes a part of it"


def told(function: Callable[..., Any]) -> Callable[..., str]:
    """With the result as JSON, or why there is none."""

    @functools.wraps(function)
    def as_json(*given):
        try:
            return json.dumps(function(*given))
        except InputError as error:
            return json.dumps({"refused": str(error)})
        except MemoryError:
            return json.dumps({"refused": TOO_LONG})

    return as_json


@told
def rides(given):
    """[{"log": name, "calibration": name or ""}, ...]: the logs in the folder `given`, each with the calibration beside
    it, or the only one there if that is beside no other log. Files of an app that are one recording together count as
    one log.

    The files are linked to from here, where others can be made beside them.
    """
    for old in Path().iterdir():
        shutil.rmtree(old) if old.is_dir() else old.unlink()
    names = sorted(path.name for path in Path(given).iterdir())
    _link(given, names, Path())
    calibrations = [name for name in names if name.lower().endswith(".json")]
    logs = [name for name in names if name not in calibrations]
    if not logs:
        raise InputError("no log among these files: a ride is RIDE.csv or RIDE.csv.gz, with its RIDE.cal.json")
    if len(logs) > 1 and not any(map(_is_log, logs)):
        together = TOGETHER
        while together in names:
            together += "_"
        Path(together).mkdir()
        _link(given, logs, Path(together))
        logs = [together] if _app(together) else logs
    beside = {log: calibration_path(Path(log)).name for log in logs}
    only = calibrations[0] if len(calibrations) == 1 and calibrations[0] not in beside.values() else ""
    return [{"log": log, "calibration": beside[log] if beside[log] in names else only} for log in logs]


@told
def take(log, _tell):
    """{"log": log}; for a recording of an app {"log": the one that `import` makes of it, "path": likewise, "app": whose
    it is, "warnings": [...]}."""
    if _is_log(log):
        return {"log": log}
    if not _app(log):
        check_first_line(Path(log))  # says what is wrong
    found = import_recording(log)
    out = f"{log.partition('.')[0]}.log.csv"
    write_imported(out, found)
    warnings = [sentence(notice) for notice in found.notices]
    return {"log": out, "path": out, "app": found.app, "warnings": warnings}


@told
def look(log, calibration, tell):
    """What `report` says and `plot` draws of a log: {"words": report.Words, "json": report.as_data(), "warnings":
    [...], "page": HTML, "plotly": the script that the page loads, "stem": the name without suffixes}. calibration: its
    file, "" for the one beside the log. tell(done, total): the progress."""
    ride = open_ride(Path(log), _calibration(log, calibration), smoothed=True)
    seen = overview(ride, tell)
    notices = [*seen.notices, *([seen.exchanged] if seen.exchanged else [])]
    return {
        "words": asdict(report.words(seen)) | {"units": report.STOPS_UNITS, "title": report.STOPS_TITLE},
        "json": report.as_data(seen),
        "warnings": [sentence(notice) for notice in notices],
        "page": page(seen, f'<script src="{PLOTLY}"></script>'),
        "plotly": PLOTLY,
        "stem": ride.stem,
    }


@told
def smooth(log, calibration, tell):
    """{"path": of LEAN.csv as `smooth` writes it}."""
    out = Path(f"{log}.lean.csv")
    ride = open_ride(Path(log), _calibration(log, calibration))
    smooth_to_csv(Path(log), ride.calibration, out, tell)
    return {"path": str(out)}


@told
def align(log, tell):
    """{"path": of the calibration that `calibrate ride` finds, "roll_deg", "pitch_deg", "yaw_deg": how well}."""
    found = fit_ride(Path(log), progress=tell)
    out = calibration_path(Path(log))
    write_calibration(out, found.calibration)
    known = {name: round(getattr(found, name), 1) for name in ("roll_deg", "pitch_deg", "yaw_deg")}
    return {"path": str(out), **known}


def _link(given, names, place):
    for name in names:
        (place / name).symlink_to(Path(given, name))


def _is_log(name):
    """As far as its first line tells."""
    try:
        check_first_line(Path(name))
        return True
    except InputError:
        return False


def _app(log):
    """app_of(), "" too for what cannot be read."""
    try:
        return app_of(log)
    except InputError:
        return ""


def _calibration(log, calibration):
    return Path(calibration) if calibration else calibration_beside(Path(log))


def raising(function):
    """A function of numpy.linalg that again raises LinAlgError for a singular matrix.

    numpy learns of it from the processor's flags of floating-point errors. WebAssembly has none: the result is NaN.
    """

    @functools.wraps(function)
    def checked(*matrices):
        found = function(*matrices)
        if np.any(np.isnan(found)) and all(np.all(np.isfinite(matrix)) for matrix in matrices):
            raise np.linalg.LinAlgError("Singular matrix")
        return found

    return checked


def prepare():
    """To be called once, before all others."""
    np.linalg.inv, np.linalg.solve = raising(np.linalg.inv), raising(np.linalg.solve)
