"""Sensor Kinetics (Innoventions): NAME_accm.csv, NAME_gyrm.csv and so on, with a time in s from the start, rounded.

Names of the files: https://rotoview.com/multi-sensor-file-system.html and the recordings in
https://github.com/Intelligent-Systems-Phystech/MobileSensorData, some of which have semicolons and decimal commas, in
m/s2 and rad/s, at rest with the screen up +9.8 in z.
"""

import re

from ...errors import InputError
from ..files import Piece
from ..join import with_gravity
from ..recording import Recording, Sensor, sensor_of
from ..sheets import names_in, read_sheet

NAME = "Sensor Kinetics"
_HEAD = ["time", "x_value", "y_value", "z_value"]
_UP = "+1 g up, as on Android"
_KINDS = {"acc": "total", "lac": "user", "grv": "gravity", "gyr": "gyro"}
_SENSOR = re.compile(r"^(.*?)[_.]?(acc|gyr|grv|lac|mag|rot)m?$")  # the end of a file's name


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """The recordings among these files: those whose names are alike but for the sensor's."""
    alike: dict[str, list[Piece]] = {}
    for piece in pieces:
        head = [cell.lower() for cell in names_in(next(iter(piece.first_lines(1)), ""))]
        if head == _HEAD:
            alike.setdefault(f"{piece.folder}/{_parts(piece)[0]}", []).append(piece)
    return list(alike.values())


def read(pieces: list[Piece], name: str) -> Recording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    files = {_KINDS.get(_parts(piece)[1], ""): piece for piece in pieces}

    def sensor(kind: str) -> Sensor:
        sheet = read_sheet(files[kind])
        what = ("gyro", "rad/s", "right-handed") if kind == "gyro" else ("accelerometer", "m/s2", _UP)
        return sensor_of(sheet, sheet.times(0), [1, 2, 3], *what)

    give = "give the folder or the zip with NAME_accm.csv and NAME_gyrm.csv"
    remedy = "give the file of the accelerometer (_accm), or of gravity (_grvm), too"
    accel = with_gravity(files, sensor, name, "linear acceleration", remedy, f"no accelerometer: {give}")
    if "gyro" not in files:
        raise InputError(f"{name}: no gyroscope: {give}")
    return Recording(NAME, accel, sensor("gyro"), sign_known=False)


def _parts(piece: Piece) -> tuple[str, str]:
    """The common part of the names of a recording's files, and the sensor of this one."""
    match = _SENSOR.match(piece.stem)
    return (match[1], match[2]) if match else (piece.stem, "")
