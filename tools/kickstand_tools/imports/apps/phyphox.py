"""phyphox: a CSV for each sensor in a folder or a zip, or one CSV with them all; signs as on Android on every phone.

Names of files and columns as in the app's own template, UI/MainView/CreateExperiment/SimpleExperimentTemplete.swift of
https://github.com/phyphox/phyphox-ios, and the "Raw Data" of https://github.com/phyphox/phyphox-experiments. On an
iPhone the app multiplies Core Motion's acceleration and gravity by -9.81 (ExperimentSensorInput.swift).
"""

import re

import numpy as np

from ...errors import InputError
from ..cells import as_text
from ..files import Piece
from ..join import added
from ..recording import Recording, Sensor, Taken, Track, sensor_of, track_of
from ..sheets import Sheet, cells_of, plain, read_sheet, unit_in
from ..times import EPOCH_NS, Nanoseconds, of_seconds, times_ns
from ..units import ACCELERATIONS, RATES, factor, unit

NAME = "phyphox"
_AXIS = re.compile(r"^(?:(.*\S)\s+)?([xyz])\s*\(([^)]*)\)$", re.IGNORECASE)
_SIGN = "+1 g up, on every phone"
_WITHOUT_GRAVITY = "linear"  # stands in the name of a sensor from which gravity has been taken


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """The recordings among these files: one a folder; meta/ belongs to the folder that it is in."""
    by_folder: dict[str, list[Piece]] = {}
    for piece in pieces:
        folder = piece.folder.removesuffix("meta").removesuffix("/") if _is_meta(piece) else piece.folder
        by_folder.setdefault(folder, []).append(piece)
    return [files for files in by_folder.values() if any(_is_ours(piece) for piece in files)]


def read(pieces: list[Piece], name: str) -> Recording:
    """Raises InputError for what is missing."""
    found: dict[str, tuple[Sensor, Taken]] = {}
    track: Track | None = None
    places: list[Taken] = []
    pauses = _Pauses(pieces)
    for piece in pieces:
        if _is_meta(piece) or not _is_ours(piece):
            continue
        sheet = read_sheet(piece)
        for kind, sensor, taken in _sensors(sheet, piece.stem, pauses):
            found.setdefault(kind, (sensor, taken))
        if track is None:
            track, places = _location(sheet, pauses)
    accel = _accelerometer(found, name)
    if "gyro" not in found:
        raise InputError(f"{name}: no gyroscope: add it to the experiment, and give all files of the export")
    gyro, gyro_taken = found["gyro"]
    return Recording(NAME, accel[0], gyro, track, None, [*accel[1], gyro_taken, *places], utc_ns=pauses.utc_ns)


def _is_meta(piece: Piece) -> bool:
    return piece.folder == "meta" or piece.folder.endswith("/meta")


def _is_ours(piece: Piece) -> bool:
    """Does its first line name a time in s and then quantities with their units in brackets?"""
    first = cells_of(next(iter(piece.first_lines(1)), ""))
    if _is_meta(piece) or len(first) < 2 or not re.fullmatch(r"(.*\s)?time \(s\)", first[0], re.IGNORECASE):
        return False
    known = [_AXIS.match(column) for column in first]
    return any(match and unit(match[3]) in ACCELERATIONS | RATES for match in known) or "latitude" in map(plain, first)


def _sensors(sheet: Sheet, stem: str, pauses: "_Pauses") -> list[tuple[str, Sensor, Taken]]:
    """The sensors of one file; each has the time that stands before it."""
    groups: dict[tuple[int, str, str], dict[str, int]] = {}
    time_place = 0
    for place, column in enumerate(sheet.columns):
        match = _AXIS.match(column)
        if plain(column).endswith("time"):
            time_place = place
        elif match:
            key = time_place, (match[1] or stem).lower(), match[3]
            groups.setdefault(key, {}).setdefault(match[2].lower(), place)
    sensors = []
    for (time, what, unit_name), axes in groups.items():
        if len(axes) < 3 or unit(unit_name) not in ACCELERATIONS | RATES:
            continue
        places = [axes[axis] for axis in "xyz"]
        kind = "gyro" if unit(unit_name) in RATES else _kind(what)
        time_ns = pauses.after(times_ns(sheet.cells[time], "s", sheet.name))
        kinds = RATES if kind == "gyro" else ACCELERATIONS
        scale = factor(unit_name, kinds, sheet.name)
        quantity = "gyro" if kind == "gyro" else "accelerometer"
        sign = "right-handed" if kind == "gyro" else _SIGN
        sensors.append((kind, *sensor_of(sheet, time_ns, places, scale, (quantity, unit(unit_name), sign))))
    return sensors


def _kind(what: str) -> str:
    if "gravity" in what:
        return "gravity"
    return "user" if _WITHOUT_GRAVITY in what or "without g" in what else "total"


def _accelerometer(found: dict[str, tuple[Sensor, Taken]], name: str) -> tuple[Sensor, list[Taken]]:
    if "total" in found:
        return found["total"][0], [found["total"][1]]
    if "user" in found and "gravity" in found:
        taken = [found["user"][1], found["gravity"][1]]
        taken[0].sign = "without gravity: gravity added"
        return added(found["user"][0], found["gravity"][0], name), taken
    if "user" in found:
        raise InputError(
            f"{name}: gravity has been taken off its acceleration, and without it there is no lean: record "
            "Acceleration (with g), or Gravity beside it"
        )
    raise InputError(f"{name}: no acceleration: add the accelerometer, and give all files of the export")


def _location(sheet: Sheet, pauses: "_Pauses") -> tuple[Track | None, list[Taken]]:
    lat, lon = sheet.place("Latitude"), sheet.place("Longitude")
    speed = sheet.place("Velocity", "Speed")
    time = next((place for place, column in enumerate(sheet.columns) if plain(column).endswith("time")), 0)
    if lat is None and speed is None:
        return None, []
    time_ns = pauses.after(times_ns(sheet.cells[time], "s", sheet.name))
    unit_name = unit(unit_in(sheet.columns[speed])) if speed is not None else "m/s"
    return track_of(sheet, time_ns, speed, lat, lon, unit_name or "m/s")


class _Pauses:
    """meta/time.csv: when the experiment was started and paused. Its own time stands still in a pause, UTC does not."""

    def __init__(self, pieces: list[Piece]) -> None:
        self.utc_ns: int | None = None
        self._resumed: list[tuple[int, int]] = []  # the experiment's time, and how long it had been paused, ns
        piece = next((piece for piece in pieces if _is_meta(piece) and piece.stem == "time"), None)
        if piece is None or len(piece.first_lines(2)) < 2:
            return
        sheet = read_sheet(piece)
        own, utc = sheet.place("experiment time"), sheet.place("system time")
        if own is None or utc is None or sheet.columns[0].lower() != "event":
            return
        events = [event.upper() for event in as_text(sheet.cells[0])]
        at = of_seconds(sheet.numbers(own)).tolist()
        clock = of_seconds(sheet.numbers(utc)).tolist()
        starts = [k for k, event in enumerate(events) if event == "START" and k < len(clock)]
        starts = [k for k in starts if 0 <= at[k] < EPOCH_NS < clock[k]]
        if starts:
            self.utc_ns = clock[starts[0]] - at[starts[0]]
            self._resumed = [(at[k], max(0, clock[k] - clock[starts[0]] - (at[k] - at[starts[0]]))) for k in starts[1:]]

    def after(self, time_ns: Nanoseconds) -> Nanoseconds:
        """The experiment's times with its pauses in them."""
        moved = time_ns.copy()
        for at, paused in self._resumed:
            moved = np.where(time_ns >= at, time_ns + paused, moved)
        return moved
