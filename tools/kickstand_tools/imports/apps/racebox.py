"""Reads RaceBox's CSV: GForceX to Z in g, GyroX to Z in deg/s; x forward, y left, z up; GForceZ is +1 at rest.

The column names of the presets are in the docs of https://github.com/beadon/RacePlex. The axes (X forward, Y left, Z
up, GyroZ positive in a left turn) were found from the ride src/lib/__fixtures__/racebox-session.csv there. The
quantities are described in https://www.racebox.pro/products/mini-micro-protocol-documentation. The column Speed has no
unit; the unit is found from the positions.
"""

from collections.abc import Mapping

from ...common.messages import InputError
from ..files import RecordingFile
from ..recording import AppRecording, names_line, plain, read_sheet, sensor_of, track_of, unit_in
from ..unit_fits import speed_of
from ..units import SPEEDS, factor, unit

NAME = "RaceBox"
ASKS = frozenset({"speed"})  # the quantities whose unit the user may give: see importing.py
_AXES = [f"{sensor}{axis}" for sensor in ("GForce", "Gyro") for axis in "YZX"]  # left, up, forward


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """Each file that has RaceBox's columns is a recording."""
    return [[file] for file in files if _header(file) is not None]


def read(files: list[RecordingFile], name: str, units: Mapping[str, str] = {}) -> AppRecording:
    """Read a recording. units: "speed" is the unit of the column Speed. Without this entry, the unit is found from the
    positions. Raises InputError for a missing column and for a unit that is not a unit of speed.
    """
    stated = units.get("speed", "")
    if stated:
        factor(stated, SPEEDS, "speed")
    sheet = read_sheet(files[0], _header(files[0]) or 0)
    places, missing = sheet.axes(*_AXES)
    if {"GForceY", "GForceZ"} & set(missing):
        raise InputError(f"{name}: no GForceY or GForceZ, as in its motorcycle mode: export it with that mode off")
    if missing:
        raise InputError(f"{name}: no GyroX to GyroZ: export it from RaceBox's app on the phone, which writes them")
    time_ns = sheet.times(sheet.place("Time") or 0, "")
    box = "box's x forward, y left, z up; +1 g up"
    accel = sensor_of(sheet, time_ns, places[:3], "accelerometer", "g", box)
    gyro = sensor_of(sheet, time_ns, places[3:], "gyro", "deg/s", "right-handed")
    lat, lon, speed = sheet.place("Latitude"), sheet.place("Longitude"), sheet.place("Speed", "KPH")
    if speed is not None and not stated:
        column = sheet.columns[speed]
        stated = "km/h" if plain(column) == "kph" else unit_in(column)
    speed, speed_unit, notices = speed_of(sheet, time_ns, speed, unit(stated), lat, lon)
    track = track_of(sheet, time_ns, speed, lat, lon, speed_unit)
    return AppRecording(NAME, accel, gyro, track, notices=notices, utc_ns=0, vehicle_axes=True)


def _header(file: RecordingFile) -> int | None:
    """The number of the line of column names. Lines about the laps may come before this line."""
    return names_line(file, lambda cells: {"gforcex", "gforcez", "time"} <= set(map(plain, cells)), 200)
