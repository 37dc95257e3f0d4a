"""Sensor Kinetics (Innoventions): NAME_accm.csv, NAME_gyrm.csv and so on, with a time in s from the start, rounded.

Names of the files: https://rotoview.com/multi-sensor-file-system.html and the recordings in
https://github.com/Intelligent-Systems-Phystech/MobileSensorData, some of which have semicolons and decimal commas, in
m/s2 and rad/s, at rest with the screen up +9.8 in z.
"""

import re

from ...errors import InputError
from ..files import Piece
from ..join import added
from ..recording import Recording, Sensor, Taken, sensor_of
from ..sheets import cells_of, read_sheet
from ..times import times_ns
from ..units import ACCELERATIONS, RATES

NAME = "Sensor Kinetics"
_HEAD = ["time", "x_value", "y_value", "z_value"]
_SENSOR = re.compile(r"^(.*?)[_.]?(acc|gyr|grv|lac|mag|rot)m?$")  # the end of a file's name


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """The recordings among these files: those whose names are alike but for the sensor's."""
    alike: dict[str, list[Piece]] = {}
    for piece in pieces:
        head = [cell.lower() for cell in cells_of(next(iter(piece.first_lines(1)), ""))]
        if head == _HEAD:
            alike.setdefault(f"{piece.folder}/{_parts(piece)[0]}", []).append(piece)
    return list(alike.values())


def read(pieces: list[Piece], name: str) -> Recording:
    """Raises InputError for what is missing."""
    files = {_parts(piece)[1]: piece for piece in pieces}
    up = "+1 g up, as on Android"
    taken: list[Taken]
    if "acc" in files:
        accel, first = _sensor(files["acc"], "accelerometer", ACCELERATIONS["m/s2"], "m/s2", up)
        taken = [first]
    elif "lac" in files and "grv" in files:
        user, first = _sensor(
            files["lac"], "accelerometer", ACCELERATIONS["m/s2"], "m/s2", "without gravity: gravity added"
        )
        gravity, second = _sensor(files["grv"], "accelerometer", ACCELERATIONS["m/s2"], "m/s2", up)
        accel, taken = added(user, gravity, name), [first, second]
    elif "lac" in files:
        raise InputError(
            f"{name}: gravity has been taken off its linear acceleration, and without it there is no lean: give the "
            "file of the accelerometer (_accm), or of gravity (_grvm), too"
        )
    else:
        raise InputError(f"{name}: no accelerometer: give the folder or the zip with NAME_accm.csv and NAME_gyrm.csv")
    if "gyr" not in files:
        raise InputError(f"{name}: no gyroscope: give the folder or the zip with NAME_accm.csv and NAME_gyrm.csv")
    gyro, gyro_taken = _sensor(files["gyr"], "gyro", RATES["rad/s"], "rad/s", "right-handed")
    return Recording(NAME, accel, gyro, taken=[*taken, gyro_taken], sign_known=False)


def _parts(piece: Piece) -> tuple[str, str]:
    """What the names of a recording's files have in common, and the sensor."""
    match = _SENSOR.match(piece.stem)
    return (match[1], match[2]) if match else (piece.stem, "")


def _sensor(piece: Piece, quantity: str, scale: float, unit: str, sign: str) -> tuple[Sensor, Taken]:
    sheet = read_sheet(piece)
    return sensor_of(sheet, times_ns(sheet.cells[0], "s", sheet.name), [1, 2, 3], scale, (quantity, unit, sign))
