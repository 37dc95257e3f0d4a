"""Runs `kickstand report`, `plot`, `smooth`, `import`, `join` and `calibrate ride` in the browser. Identifies the files
that the page Rides is given: logs, recordings of an app, tables, calibrations, tracks.

page/rides/worker.mjs calls this module on CPython for WebAssembly, in a separate working directory.

Each function returns JSON as described in its docstring, or {"refused": reason}. The reason is the command's message,
worded for a page.
"""

import functools
import json
import re
import shutil
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis import report
from ..analysis.overview import overview
from ..analysis.page import page
from ..analysis.ride import open_ride
from ..calibration.file import calibration_path, read_calibration, write_calibration
from ..common.messages import InputError
from ..estimation.alignment import fit_ride
from ..estimation.smooth import COLUMNS, DIGITS, smooth_to_csv
from ..imports import mapped
from ..imports.files import RecordingFile, read_files
from ..imports.findings import Findings
from ..imports.importing import import_recording, recordings, write_imported
from ..joining.joined import join_track, write_joined
from ..joining.track import read_track
from ..logs.csv_text import write_lean
from ..logs.reader import is_log, read_log, time_texts
from ..logs.source import log_stem

PLOTLY = "./plotly/plotly.min.js"  # the page of a ride loads plotly from the site
MADE = Path("../made")  # results are not written beside the given files, because names could collide
_smoothed: dict[str, list] = {}  # {name of the last shown ride: its smoothed lean, one array per part}
TOO_LONG = "this ride is too long for the memory of a browser: give a part of it"


def in_json(function: Callable[..., Any]) -> Callable[..., str]:
    """A decorator: return the result as JSON, or the reason for a refusal."""

    @functools.wraps(function)
    def as_json(*arguments):
        try:
            return json.dumps(function(*arguments))
        except InputError as error:
            return json.dumps({"refused": _one_line(error.line(page=True))})
        except MemoryError:
            return json.dumps({"refused": TOO_LONG})

    return as_json


@in_json
def rides(folder, names):
    """Identify the given files.

    folder: the folder of the files.
    names: JSON list of their names, in the order in which the user chose them.
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


@dataclass
class FilesOfRide:
    """A ride among the given files."""

    log: str  # a file, or a folder with the files of one recording
    files: list[str]  # names of all its files
    calibration: str = ""  # name of its calibration file, or ""
    track: str = ""  # name of a .gpx or .fit file to join with the ride, or ""
    # The table whose columns the user must choose; None if the columns are known
    table: Findings | None = None


@dataclass
class RideFiles:
    """The result of sorted_out()."""

    rides: list[FilesOfRide] = field(default_factory=list)  # sorted by name
    kinds: dict[str, str] = field(default_factory=dict)  # {name of a file: its kind}
    refused: dict[str, InputError] = field(default_factory=dict)  # {name of a file: the reason why it cannot be used}


def sorted_out(names: list[str]) -> RideFiles:
    """Identify files in the working directory. names: in the order in which the user chose them.

    A calibration belongs to a ride if its name matches the ride's name. Other rides get the last calibration that
    belongs to no ride. Every ride gets the last track.
    """
    inputs, loose = RideFiles(), []
    for name in names:
        try:
            loose += _sort_in(inputs, name)
        except InputError as error:
            inputs.refused[name] = error
    for name, files in _recordings_among(loose):
        _add(inputs, name, [file.name for file in files], files)
    inputs.rides.sort(key=lambda ride: _by_number(ride.log))
    calibrations = [name for name, kind in inputs.kinds.items() if kind == "calibration"]
    tracks = [name for name, kind in inputs.kinds.items() if kind == "track"]
    default_names = {ride.log: calibration_path(Path(ride.log)).name for ride in inputs.rides}
    free = [name for name in calibrations if name not in default_names.values()]
    for ride in inputs.rides:
        name = default_names[ride.log]
        ride.calibration = name if name in calibrations else next(reversed(free), "")
        ride.track = next(reversed(tracks), "")
    return inputs


def _sort_in(inputs: RideFiles, name: str) -> list[RecordingFile]:
    """Add a file to inputs, or return it if it may be one file of several of a ride. Raises InputError."""
    if name.lower().endswith(".json"):
        read_calibration(Path(name))
        inputs.kinds[name] = "calibration"
    elif name.lower().endswith((".gpx", ".fit")):
        read_track(Path(name))
        inputs.kinds[name] = "track"
    elif is_log(Path(name)):
        inputs.rides.append(FilesOfRide(name, [name]))
        inputs.kinds[name] = "log"
    else:
        files = read_files(Path(name))
        if any(file.name.endswith(".parquet") for file in files):
            raise InputError(f"{name} is Parquet, which this page cannot read: give the ride as CSV")
        if not zipfile.is_zipfile(name):
            return files
        _add(inputs, name, [name], files)
    return []


def _in_folder(name: str, files: list[RecordingFile]) -> str:
    """Write files to a new folder, and return its name."""
    while Path(name).exists():
        name += "_"
    Path(name).mkdir()
    for file in files:
        Path(name, file.name).write_bytes(file.content)  # no link, because imports skip links to outside
    return name


def _recordings_among(files: list[RecordingFile]) -> Iterator[tuple[str, list[RecordingFile]]]:
    """Yield name and files of each recording among single files. Several files of one are written to a new folder."""
    matches = recordings(files)
    used = {id(file) for _, group in matches for file in group}
    for app, group in matches:
        yield group[0].name if len(group) == 1 else _in_folder(f"{app.name} recording", group), group
    remaining = [file for file in files if id(file) not in used]
    table = mapped.table_in(remaining) if len(remaining) > 1 else None
    if table is not None and table.joined and not table.lacking:
        yield _in_folder("recording", remaining), remaining
    else:
        yield from ((file.name, [file]) for file in remaining)


def _add(inputs: RideFiles, log: str, names: list[str], files: list[RecordingFile]) -> None:
    """Add a ride, or the reason why the files are not a ride."""
    parts = recordings(files)
    table = None if parts else mapped.table_in(files)
    if not parts and (table is None or len(table.sheet.columns) < len(mapped.REQUIRED)):
        inputs.refused |= dict.fromkeys(names, mapped.unknown(files, log))
        return
    inputs.rides.append(FilesOfRide(log, names, table=table))
    inputs.kinds |= dict.fromkeys(names, f"of {parts[0][0].name}" if parts else "table")


def _by_number(name: str) -> list[tuple[int, str]]:
    """Sort key: ride-2 comes before ride-10."""
    return [(int(part or 0), "") if k % 2 else (0, part) for k, part in enumerate(re.split(r"(\d+)", name.lower()))]


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
        pairs = [[unit, unit] for unit in choices]
        if key == "a":  # some apps write accelerations with the opposite sign
            pairs += [[f"-{unit}", f"{unit}, all of the opposite sign"] for unit in choices]
        units.append([key, f"unit of the {words}", pairs, likely, reason])
    result = {"columns": findings.sheet.columns, "keys": keys, "units": units, "lacking": findings.lacking_words}
    return result | {"certain": findings.decided, "picture": findings.first_seconds()}


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
    """Write a calibration as `calibrate ride` does. Returns its path, and the standard errors in deg."""
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

    numpy detects it from the processor's flags of floating-point errors, which WebAssembly does not have.
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
