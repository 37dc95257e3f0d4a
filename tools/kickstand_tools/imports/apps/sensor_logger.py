"""Sensor Logger (Kelvin Choi): a CSV for each sensor, times in ns since 1970; signs as the phone's system has them.

Files and units: UNITS.md, signs: COORDINATES.md and CROSSPLATFORM.md of
https://github.com/tszheichoi/awesome-sensor-logger. Accelerometer.csv has no gravity in it. An iPhone's acceleration
and gravity have the opposite sign, and AccelerometerUncalibrated is in g, unless "Standardise Units & Frames" was on.
"""

from ...errors import InputError
from ..files import Piece
from ..join import added
from ..recording import Recording, Sensor, Taken, sensor_of, track_of
from ..sheets import cells_of, read_sheet
from ..times import times_ns
from ..units import ACCELERATIONS, RATES

NAME = "Sensor Logger"
_TOTAL, _RAW, _USER, _GRAVITY = "totalacceleration", "accelerometeruncalibrated", "accelerometer", "gravity"
_GYROS = ("gyroscope", "gyroscopeuncalibrated")


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """The recordings among these files, one a folder."""
    folders = dict.fromkeys(piece.folder for piece in pieces if _is_ours(piece))
    return [[piece for piece in pieces if piece.folder == folder] for folder in folders]


def read(pieces: list[Piece], name: str) -> Recording:
    """Raises InputError for what is missing."""
    files = {piece.stem: piece for piece in pieces}
    apple, standard = _platform(files)
    turned = apple is not False and not standard
    if turned and apple is None and (_RAW in files or _GRAVITY in files):
        raise InputError(
            f"{name}: Metadata.csv is missing, which says whether an iPhone or an Android phone recorded this: their "
            "accelerations have opposite signs; give all files of the export"
        )
    sign = -1.0 if turned else 1.0
    said = "iPhone, -1 g up: sign turned" if turned else "+1 g up, standardised" if apple else "Android, +1 g up"
    accel, taken = _accelerometer(files, sign, said, "g" if turned else "m/s2", name)
    gyro_file = next((files[stem] for stem in _GYROS if stem in files), None)
    if gyro_file is None:
        raise InputError(f"{name}: no Gyroscope.csv: switch the gyroscope on, and give all files of the export")
    gyro, gyro_taken = _sensor(gyro_file, "gyro", RATES["rad/s"], "rad/s", "right-handed")
    track, places = None, []
    if "location" in files and len(files["location"].first_lines(2)) > 1:
        sheet = read_sheet(files["location"])
        time_ns = times_ns(sheet.cells[sheet.place("time") or 0], "ns", sheet.name)
        track, places = track_of(
            sheet, time_ns, sheet.place("speed"), sheet.place("latitude"), sheet.place("longitude")
        )
    return Recording(NAME, accel, gyro, track, None, [*taken, gyro_taken, *places], utc_ns=0)


def _is_ours(piece: Piece) -> bool:
    first = cells_of(next(iter(piece.first_lines(1)), ""))
    return first[:2] == ["time", "seconds_elapsed"] and piece.stem in (_TOTAL, _RAW, _USER, _GRAVITY, *_GYROS)


def _platform(files: dict[str, Piece]) -> tuple[bool | None, bool]:
    """Was it an iPhone (None: not known), and were its units and signs standardised?"""
    if "metadata" in files and len(files["metadata"].first_lines(2)) > 1:
        names, values = (cells_of(line) for line in files["metadata"].first_lines(2))
        said = {name.lower(): value.lower() for name, value in zip(names, values)}
        if said.get("platform"):
            return said["platform"] == "ios", said.get("standardisation") == "true"
    return (False, False) if _TOTAL in files else (None, False)  # only Android has that file


def _accelerometer(
    files: dict[str, Piece], sign: float, said: str, raw_unit: str, name: str
) -> tuple[Sensor, list[Taken]]:
    metres = sign * ACCELERATIONS["m/s2"]
    if _TOTAL in files:
        sensor, taken = _sensor(files[_TOTAL], "accelerometer", metres, "m/s2", said)
        return sensor, [taken]
    if _RAW in files:
        scale = sign * ACCELERATIONS[raw_unit]
        sensor, taken = _sensor(files[_RAW], "accelerometer", scale, raw_unit, said)
        return sensor, [taken]
    if _USER in files and _GRAVITY in files:
        user, user_taken = _sensor(files[_USER], "accelerometer", metres, "m/s2", "without gravity: gravity added")
        gravity, gravity_taken = _sensor(files[_GRAVITY], "accelerometer", metres, "m/s2", said)
        return added(user, gravity, name), [user_taken, gravity_taken]
    if _USER in files:
        raise InputError(
            f"{name}: gravity has been taken off its Accelerometer.csv, and without it there is no lean: record "
            "Gravity, or Total Acceleration, beside it"
        )
    raise InputError(f"{name}: no acceleration: switch Accelerometer and Gravity on, and give all files of the export")


def _sensor(piece: Piece, quantity: str, scale: float, unit: str, sign: str) -> tuple[Sensor, Taken]:
    sheet = read_sheet(piece)
    places = [sheet.place(axis) for axis in "xyz"]
    if None in places or sheet.place("time") is None:
        raise InputError(f"{sheet.name}: no columns time, x, y and z: export it again")
    time_ns = times_ns(sheet.cells[sheet.place("time") or 0], "ns", sheet.name)
    return sensor_of(sheet, time_ns, [place for place in places if place is not None], scale, (quantity, unit, sign))
