"""Runs `kickstand report`, `plot`, `smooth`, `import`, `join` and `calibrate ride` in the browser.

page/rides/worker.mjs calls this module on CPython for WebAssembly, in a separate working directory.

Each function returns JSON as described in its docstring, or {"refused": reason}. The reason is the command's message,
worded for a page.
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
from ..analysis.ride import open_ride
from ..calibration.file import calibration_path, read_calibration, write_calibration
from ..common.messages import InputError
from ..estimation.alignment import fit_ride
from ..estimation.smooth import COLUMNS, DIGITS, smooth_to_csv
from ..imports import mapped
from ..imports.findings import Findings
from ..imports.importing import import_recording, write_imported
from ..joining.joined import join_track, write_joined
from ..logs.csv_text import write_lean
from ..logs.reader import read_log, time_texts
from ..logs.source import log_stem
from .ride_files import sorted_out

PLOTLY = "./plotly/plotly.min.js"  # the page of a ride loads plotly from the site
MADE = Path("../made")  # results are not written beside the given files, because names could collide
_smoothed: dict[str, list] = {}  # {name of the last shown ride: its smoothed lean, one array per part}
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
def rides(folder, names):
    """Identify the given files.

    folder: the folder of the files. names: JSON list of their names, in the order in which the user chose them.
    Returns:
        rides: sorted by name. Each has the fields of FilesOfRide, "table" as from asked_for(), and "isLog".
        kinds: {name: kind of the file}.
        why: {name: reason why the file cannot be used}.
    """
    _smoothed.clear()
    for old in Path().iterdir():
        shutil.rmtree(old) if old.is_dir() else old.unlink()
    names = json.loads(names)
    for name in names:
        Path(name).symlink_to(Path(folder, name))
    inputs = sorted_out(names)
    rides = [
        vars(ride) | {"isLog": inputs.kinds.get(ride.log) == "log", "table": ride.table and asked_for(ride.table)}
        for ride in inputs.rides
    ]
    refused = {name: _one_line(error.line(page=True)) for name, error in inputs.refused.items()}
    return {"rides": rides, "kinds": inputs.kinds, "why": refused}


def asked_for(findings: Findings) -> dict[str, Any]:
    """Prepare the page's questions about the columns and units of a table.

    Returns:
        columns: names of all columns.
        keys: list of [key, words, required, probable column or ""].
        units: list of [key, words, choices as [unit, words], probable unit, reason].
        lacking: the missing columns in words.
        certain: true if all required columns are certain.
        picture: see Findings.first_seconds().
    """
    keys = [[key, words, key in mapped.REQUIRED, findings.columns.get(key, "")] for key, words in mapped.WORDS.items()]
    units = []
    for key, words in (("t", "time"), ("a", "acceleration"), ("g", "rates"), ("speed", "speed")):
        likely, reason = findings.units.get(key, ""), findings.found[key].why if key in findings.found else ""
        choices = [*mapped.UNIT_KEYS[key], *([mapped.COUNTS] if key in "ag" else [])]
        if likely and likely not in choices:
            choices.insert(0, likely)
        units.append([key, f"unit of the {words}", [[unit, unit] for unit in choices], likely, reason])
    units[1][2] += [[f"-{unit}", f"{unit}, all of the opposite sign"] for unit, _ in list(units[1][2])]
    words = {"lacking": findings.lacking_words, "certain": findings.decided, "picture": findings.first_seconds()}
    return {"columns": findings.sheet.columns, "keys": keys, "units": units} | words


@in_json
def take(log, is_log, columns, units, track, progress):
    """Import a recording that is not a log, and join a track if there is one.

    log: name of the log or recording. is_log: True for a log of Kickstand.
    columns, units: JSON of the values of --columns and --units for a table, else "{}".
    track: name of a .gpx or .fit file, or "".
    Returns {"log": log} for a log without a track, otherwise:
        log: path of the log to use.
        path: the same for a new log; missing without one.
        warnings: list of messages.
        words: a sentence about the quality of the join, or "".
    """
    if is_log and not track:
        return {"log": log}
    out, warnings, words = log, [], ""
    if not is_log:
        imported = import_recording(log, json.loads(columns) or None, json.loads(units))
        out = str(_result_path(log, f"{log.partition('.')[0]}.csv"))
        write_imported(out, imported)
        warnings = [notice.line(page=True) for notice in [*imported.notices, *imported.shortfalls]]
    if track:
        try:
            joined = join_track(Path(out), Path(track), progress)
            out = str(_result_path(log, f"{log.partition('.')[0]}.joined.csv"))
            write_joined(out, joined)
            match = joined.match
            words = f"{track} is joined: correlation {match.correlation:.2f}, known to {match.sigma_s:.2f} s."
        except InputError as error:
            warnings.append(f"{track} is not joined: {_one_line(error.line(page=True))}")
    entry = {"path": out} if out != log else {}
    return {"log": out, "warnings": warnings, "words": words} | entry


@in_json
def look(log, calibration, progress):
    """Compute the results of `report` and `plot`. log, calibration: names of the files.

    Returns:
        words: the fields of report.Words, with the units, title and terms of the table of stops.
        json: result of report.as_data(), with the name of the ride.
        warnings: list of messages.
        page: HTML of the plot. plotly: address of the script that this HTML loads.
        stem: name of the ride without suffixes.
    """
    _smoothed.clear()
    ride = open_ride(Path(log), Path(calibration), smoothed=True)
    ride_overview = overview(ride, progress, _smoothed.setdefault(log, []).append)
    table = {"units": report.STOPS_UNITS, "title": report.STOPS_TITLE, "terms": report.STOPS_TERMS}
    return {
        "words": asdict(report.words(ride_overview, on_page=True)) | table,
        "json": report.as_data(ride_overview) | {"ride": Path(log).name},
        "warnings": [notice.line(page=True) for notice in ride_overview.notices],
        "page": page(ride_overview, f'<script src="{PLOTLY}"></script>', "'self'"),
        "plotly": PLOTLY,
        "stem": ride.stem,
    }


@in_json
def smooth(log, calibration, progress):
    """Write LEAN.csv as `smooth` does, from the lean of look() if that was of this ride. Returns {"path": its path}."""
    file, out = Path(log), _result_path(log, f"{log_stem(log)}.lean.csv")
    smoothed = _smoothed.get(log)
    if smoothed:
        write_lean(out, COLUMNS, DIGITS, time_texts(file, read_log(file)), smoothed)
    else:
        smooth_to_csv(file, read_calibration(Path(calibration)), out, progress)
    return {"path": str(out)}


@in_json
def align(log, progress):
    """Write a calibration as `calibrate ride` does. Returns its path, and its standard errors roll_deg, pitch_deg,
    yaw_deg.
    """
    fit = fit_ride(Path(log), progress=progress)
    out = _result_path(log, calibration_path(Path(log)).name)
    write_calibration(out, fit.calibration)
    errors = {name: round(getattr(fit, name), 1) for name in ("roll_deg", "pitch_deg", "yaw_deg")}
    return {"path": str(out), **errors}


def _result_path(log, name):
    """Return the path for a result of a log. Each log has its own folder, so equal names do not collide."""
    folder = Path(log).parent if MADE in Path(log).parents else MADE / log
    folder.mkdir(parents=True, exist_ok=True)
    return folder / name


def _one_line(text):
    """Return a message on one line, without the path of the internal folder of results."""
    return re.sub(rf"{re.escape(str(MADE))}/[^/]*/", "", " ".join(text.split()))


def raising(function):
    """A decorator that makes a function of numpy.linalg raise LinAlgError for a singular matrix.

    Elsewhere numpy detects it from the processor's flags of floating-point errors, which WebAssembly does not have.
    """

    @functools.wraps(function)
    def checked(*matrices):
        result = function(*matrices)
        if np.any(np.isnan(result)) and all(np.all(np.isfinite(matrix)) for matrix in matrices):
            raise np.linalg.LinAlgError("Singular matrix")
        return result

    return checked


def prepare():
    """Prepare the module. Call this function once, first."""
    np.linalg.inv, np.linalg.solve = raising(np.linalg.inv), raising(np.linalg.solve)
