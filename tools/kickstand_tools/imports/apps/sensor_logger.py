"""Sensor Logger (Kelvin Choi): a CSV for each sensor, times in ns since 1970; signs as the phone's system has them.

Files and units: UNITS.md, signs: COORDINATES.md and CROSSPLATFORM.md of
https://github.com/tszheichoi/awesome-sensor-logger. Accelerometer.csv has no gravity in it. An iPhone's acceleration
and gravity have the opposite sign, and AccelerometerUncalibrated is in g, unless "Standardise Units & Frames" was on.
"""

from ...errors import InputError
from ..files import Piece
from ..join import with_gravity
from ..recording import Recording, Sensor, sensor_of, track_of
from ..sheets import names_in, read_sheet

NAME = "Sensor Logger"
_TOTAL, _RAW, _USER, _GRAVITY = "totalacceleration", "accelerometeruncalibrated", "accelerometer", "gravity"
_KINDS = {"total": (_TOTAL, _RAW), "user": (_USER,), "gravity": (_GRAVITY,)}  # of two, the first one counts
_GYROS = ("gyroscope", "gyroscopeuncalibrated")


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """The recordings among these files, one a folder."""
    folders = dict.fromkeys(piece.folder for piece in pieces if _is_ours(piece))
    return [[piece for piece in pieces if piece.folder == folder] for folder in folders]


def read(pieces: list[Piece], name: str) -> Recording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    files = {piece.stem: piece for piece in pieces}
    apple, standard = _platform(files)
    turned = apple is not False and not standard
    if turned and apple is None and (_RAW in files or _GRAVITY in files):
        raise InputError(
            f"{name}: Metadata.csv is missing, which says whether an iPhone or an Android phone recorded this: their "
            "accelerations have opposite signs; give all files of the export"
        )
    up = "iPhone, -1 g up: sign turned" if turned else "+1 g up, standardised" if apple else "Android, +1 g up"

    def acceleration(kind: str) -> Sensor:
        stem = next(stem for stem in _KINDS[kind] if stem in files)
        raw = turned and stem == _RAW
        return _sensor(files[stem], "accelerometer", "g" if raw else "m/s2", up, -1.0 if turned else 1.0)

    there = [kind for kind, stems in _KINDS.items() if any(stem in files for stem in stems)]
    remedy = "record Gravity, or Total Acceleration, beside it"
    none = "no acceleration: switch Accelerometer and Gravity on, and give all files of the export"
    accel = with_gravity(there, acceleration, name, "Accelerometer.csv", remedy, none)
    gyro_file = next((files[stem] for stem in _GYROS if stem in files), None)
    if gyro_file is None:
        raise InputError(f"{name}: no Gyroscope.csv: switch the gyroscope on, and give all files of the export")
    track = None
    if "location" in files and len(files["location"].first_lines(2)) > 1:
        sheet = read_sheet(files["location"])
        time_ns = sheet.times(sheet.place("time") or 0, "ns")
        speed, lat, lon = (sheet.place(column) for column in ("speed", "latitude", "longitude"))
        track = track_of(sheet, time_ns, speed, lat, lon)
    return Recording(NAME, accel, _sensor(gyro_file, "gyro", "rad/s", "right-handed"), track, utc_ns=0)


def _is_ours(piece: Piece) -> bool:
    first = names_in(next(iter(piece.first_lines(1)), ""))
    return first[:2] == ["time", "seconds_elapsed"] and piece.stem in (_TOTAL, _RAW, _USER, _GRAVITY, *_GYROS)


def _platform(files: dict[str, Piece]) -> tuple[bool | None, bool]:
    """True for an iPhone (None: unknown), and True if units and signs were standardised."""
    if "metadata" in files and len(files["metadata"].first_lines(2)) > 1:
        names, values = (names_in(line) for line in files["metadata"].first_lines(2))
        said = {name.lower(): value.lower() for name, value in zip(names, values)}
        if said.get("platform"):
            return said["platform"] == "ios", said.get("standardisation") == "true"
    return (False, False) if _TOTAL in files else (None, False)  # only Android has that file


def _sensor(piece: Piece, quantity: str, unit: str, sign: str, turn: float = 1.0) -> Sensor:
    sheet = read_sheet(piece)
    places, missing = sheet.axes("time", "x", "y", "z")
    if missing:
        raise InputError(f"{sheet.name}: no columns time, x, y and z: export it again")
    time_ns = sheet.times(places[0], "ns")
    return sensor_of(sheet, time_ns, places[1:], quantity, unit, sign, turn)
