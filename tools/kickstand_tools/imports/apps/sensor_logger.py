"""Reads Sensor Logger (Kelvin Choi): one CSV per sensor, times in ns since 1970, signs as in the phone's system.

In https://github.com/tszheichoi/awesome-sensor-logger, UNITS.md describes files and units, and COORDINATES.md and
CROSSPLATFORM.md describe the signs. Accelerometer.csv does not contain gravity. An iPhone's
acceleration and gravity have the opposite sign, and AccelerometerUncalibrated is in g, unless "Standardise Units &
Frames" was on.
"""

from ...common.messages import InputError
from ..files import RecordingFile
from ..join import with_gravity
from ..recording import AppRecording, RecordedSensor, first_names, names_in, read_sheet, sensor_of, track_of

NAME = "Sensor Logger"
_TOTAL, _RAW, _USER, _GRAVITY = "totalacceleration", "accelerometeruncalibrated", "accelerometer", "gravity"
_KINDS = {"total": (_TOTAL, _RAW), "user": (_USER,), "gravity": (_GRAVITY,)}  # if both exist, the first is used
_GYROS = ("gyroscope", "gyroscopeuncalibrated")


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """The recordings among these files, one per folder."""
    folders = dict.fromkeys(file.folder for file in files if _is_ours(file))
    return [[file for file in files if file.folder == folder] for folder in folders]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    by_stem = {file.stem: file for file in files}
    apple, standard = _platform(by_stem)
    turned = apple is not False and not standard
    if turned and apple is None and (_RAW in by_stem or _GRAVITY in by_stem):
        raise InputError(
            f"{name}: Metadata.csv is missing, which says whether an iPhone or an Android phone recorded this: their "
            "accelerations have opposite signs; give all files of the export"
        )
    up = "iPhone, -1 g up: sign turned" if turned else "+1 g up, standardised" if apple else "Android, +1 g up"

    def acceleration(kind: str) -> RecordedSensor:
        stem = next(stem for stem in _KINDS[kind] if stem in by_stem)
        raw = turned and stem == _RAW
        return _sensor(by_stem[stem], "accelerometer", "g" if raw else "m/s2", up, -1.0 if turned else 1.0)

    kinds = [kind for kind, stems in _KINDS.items() if any(stem in by_stem for stem in stems)]
    remedy = "record Gravity, or Total Acceleration, beside it"
    none = "no acceleration: switch Accelerometer and Gravity on, and give all files of the export"
    accel = with_gravity(kinds, acceleration, name, "Accelerometer.csv", remedy, none)
    gyro_file = next((by_stem[stem] for stem in _GYROS if stem in by_stem), None)
    if gyro_file is None:
        raise InputError(f"{name}: no Gyroscope.csv: switch the gyroscope on, and give all files of the export")
    track = None
    if "location" in by_stem and len(by_stem["location"].first_lines(2)) > 1:
        sheet = read_sheet(by_stem["location"])
        time_ns = sheet.times(sheet.place("time") or 0, "ns")
        speed, lat, lon = (sheet.place(column) for column in ("speed", "latitude", "longitude"))
        track = track_of(sheet, time_ns, speed, lat, lon)
    return AppRecording(NAME, accel, _sensor(gyro_file, "gyro", "rad/s", "right-handed"), track, utc_ns=0)


def _is_ours(file: RecordingFile) -> bool:
    first = first_names(file)
    return first[:2] == ["time", "seconds_elapsed"] and file.stem in (_TOTAL, _RAW, _USER, _GRAVITY, *_GYROS)


def _platform(by_stem: dict[str, RecordingFile]) -> tuple[bool | None, bool]:
    """True for an iPhone (None: unknown), and True if units and signs were standardised."""
    if "metadata" in by_stem and len(by_stem["metadata"].first_lines(2)) > 1:
        names, values = (names_in(line) for line in by_stem["metadata"].first_lines(2))
        metadata = {name.lower(): value.lower() for name, value in zip(names, values)}
        if metadata.get("platform"):
            return metadata["platform"] == "ios", metadata.get("standardisation") == "true"
    return (False, False) if _TOTAL in by_stem else (None, False)  # only Android has that file


def _sensor(file: RecordingFile, quantity: str, unit: str, sign: str, turn: float = 1.0) -> RecordedSensor:
    sheet = read_sheet(file)
    places, missing = sheet.axes("time", "x", "y", "z")
    if missing:
        raise InputError(f"{sheet.name}: no columns time, x, y and z: export it again")
    time_ns = sheet.times(places[0], "ns")
    return sensor_of(sheet, time_ns, places[1:], quantity, unit, sign, turn)
