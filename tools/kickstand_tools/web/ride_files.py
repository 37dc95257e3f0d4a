"""Identifies the files given to the page Rides: logs, recordings of an app, tables, calibrations, tracks."""

import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ..calibration.file import calibration_path, read_calibration
from ..common.messages import InputError
from ..imports import mapped
from ..imports.files import RecordingFile, read_files
from ..imports.findings import Findings
from ..imports.importing import recordings
from ..joining.track import read_track
from ..logs.reader import is_log


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
    track = ""
    calibrations = []
    for name in names:
        try:
            if name.lower().endswith(".json"):
                read_calibration(Path(name))
                calibrations.append(name)
                inputs.kinds[name] = "calibration"
            elif name.lower().endswith((".gpx", ".fit")):
                read_track(Path(name))
                track, inputs.kinds[name] = name, "track"
            elif is_log(Path(name)):
                inputs.rides.append(FilesOfRide(name, [name]))
                inputs.kinds[name] = "log"
            else:
                files = read_files(Path(name))
                if any(file.name.endswith(".parquet") for file in files):
                    raise InputError(f"{name} is Parquet, which this page cannot read: give the ride as CSV")
                if zipfile.is_zipfile(name):
                    _add(inputs, name, [name], files)
                else:
                    loose += files
        except InputError as error:
            inputs.refused[name] = error
    for name, files in _recordings_among(loose):
        _add(inputs, name, [file.name for file in files], files)
    inputs.rides.sort(key=lambda ride: _by_number(ride.log))
    default_names = {ride.log: calibration_path(Path(ride.log)).name for ride in inputs.rides}
    free = [name for name in calibrations if name not in default_names.values()]
    for ride in inputs.rides:
        name = default_names[ride.log]
        ride.calibration = name if name in calibrations else next(reversed(free), "")
        ride.track = track
    return inputs


def _in_folder(name: str, files: list[RecordingFile]) -> str:
    """Write files to a new folder, and return its name."""
    while Path(name).exists():
        name += "_"
    Path(name).mkdir()
    for file in files:
        Path(name, file.name).write_bytes(file.content)  # no link, because imports skip links to outside
    return name


def _recordings_among(files: list[RecordingFile]) -> Iterator[tuple[str, list[RecordingFile]]]:
    """Yield the name and the files of each recording among single files.

    Several files of one recording are written to a new folder, whose name is the recording's.
    """
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
