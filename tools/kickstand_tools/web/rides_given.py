"""Identifies the files given to the page Rides: logs, recordings of an app, tables, calibrations, tracks."""

import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ..calibration.file import calibration_path, read_calibration
from ..common.errors import InputError
from ..imports import mapped
from ..imports.files import RecordingFile, read_files
from ..imports.importing import recordings
from ..joining.track_files import read_track
from ..logs.reader import is_log


@dataclass
class GivenRide:
    """A ride among the given files.

    log: a file, or a folder with the files of one recording.
    files: names of all its files.
    calibration: name of its calibration file, or "".
    track: name of a .gpx or .fit file to join with the ride, or "".
    table: the table whose columns the user must choose; None if the columns are known.
    """

    log: str
    files: list[str]
    calibration: str = ""
    track: str = ""
    table: mapped.MappedTable | None = None


@dataclass
class Given:
    """The result of sorted_out().

    rides: sorted by name.
    kinds: {name of a file: its kind}.
    refused: {name of a file: the reason why it cannot be used}.
    """

    rides: list[GivenRide] = field(default_factory=list)
    kinds: dict[str, str] = field(default_factory=dict)
    refused: dict[str, InputError] = field(default_factory=dict)


def sorted_out(names: list[str]) -> Given:
    """Identify files in the working directory.

    A calibration belongs to a ride if its name matches the ride's name. Other rides get the last calibration that
    belongs to no ride. Every ride gets the last track.

    names: names of the files, in the order in which the user chose them.
    """
    found, loose = Given(), []
    track = ""
    calibrations = []
    for name in names:
        try:
            if name.lower().endswith(".json"):
                read_calibration(Path(name))
                calibrations.append(name)
                found.kinds[name] = "calibration"
            elif name.lower().endswith((".gpx", ".fit")):
                read_track(Path(name))
                track, found.kinds[name] = name, "track"
            elif is_log(Path(name)):
                found.rides.append(GivenRide(name, [name]))
                found.kinds[name] = "log"
            else:
                files = read_files(Path(name))
                if any(file.name.endswith(".parquet") for file in files):
                    raise InputError(f"{name} is Parquet, which this page cannot read: give the ride as CSV")
                if zipfile.is_zipfile(name):
                    _add(found, name, [name], files)
                else:
                    loose += files
        except InputError as error:
            found.refused[name] = error
    for name, files in _recordings_among(loose):
        _add(found, name, [file.name for file in files], files)
    found.rides.sort(key=lambda ride: _by_number(ride.log))
    beside = {ride.log: calibration_path(Path(ride.log)).name for ride in found.rides}
    free = [name for name in calibrations if name not in beside.values()]
    for ride in found.rides:
        ride.calibration = beside[ride.log] if beside[ride.log] in calibrations else next(reversed(free), "")
        ride.track = track
    return found


def _in_folder(name: str, files: list[RecordingFile]) -> str:
    """Write files to a new folder, and return its name."""
    while Path(name).exists():
        name += "_"
    Path(name).mkdir()
    for file in files:
        Path(name, file.name).write_bytes(file.content)  # no link, because imports skip links to outside
    return name


def _recordings_among(files: list[RecordingFile]) -> Iterator[tuple[str, list[RecordingFile]]]:
    """Find the recordings among single files.

    Yields the name and the files of each recording. The files of a recording with several files are written to a new
    folder, and its name is the folder's name.
    """
    found = recordings(files)
    used = {id(file) for _, group in found for file in group}
    for app, group in found:
        yield group[0].name if len(group) == 1 else _in_folder(f"{app.NAME} recording", group), group
    left = [file for file in files if id(file) not in used]
    table = mapped.table_in(left) if len(left) > 1 else None
    if table is not None and table.joined and not table.findings.lacking:
        yield _in_folder("recording", left), left
    else:
        yield from ((file.name, [file]) for file in left)


def _add(found: Given, log: str, names: list[str], files: list[RecordingFile]) -> None:
    """Add a ride, or the reason why the files are not a ride."""
    known = recordings(files)
    table = None if known else mapped.table_in(files)
    if not known and (table is None or len(table.sheet.columns) < len(mapped.REQUIRED)):
        found.refused |= dict.fromkeys(names, mapped.unknown(files, log))
        return
    found.rides.append(GivenRide(log, names, table=table))
    found.kinds |= dict.fromkeys(names, f"of {known[0][0].NAME}" if known else "table")


def _by_number(name: str) -> list[tuple[int, str]]:
    """Sort key: ride-2 comes before ride-10."""
    return [(int(part or 0), "") if k % 2 else (0, part) for k, part in enumerate(re.split(r"(\d+)", name.lower()))]
