"""Reads Sensor Kinetics (Innoventions): NAME_accm.csv, NAME_gyrm.csv and so on, with a rounded time in s from the
start.

The names of the files are described in https://rotoview.com/multi-sensor-file-system.html. Example recordings, some
with semicolons and decimal commas, are in https://github.com/Intelligent-Systems-Phystech/MobileSensorData. Units are
m/s2 and rad/s. At rest with the screen up, z is +9.8.
"""

import re

from ...common.messages import InputError
from ..files import RecordingFile
from ..join import with_gravity
from ..recording import AppRecording, RecordedSensor, first_names, read_sheet, sensor_of

NAME = "Sensor Kinetics"
_HEAD = ["time", "x_value", "y_value", "z_value"]
_UP = "+1 g up, as on Android"
_KINDS = {"acc": "total", "lac": "user", "grv": "gravity", "gyr": "gyro"}
_SENSOR = re.compile(r"^(.*?)[_.]?(acc|gyr|grv|lac|mag|rot)m?$")  # the end of a file name


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """The recordings among these files: the names of a recording's files differ only in the sensor."""
    groups: dict[str, list[RecordingFile]] = {}
    for file in files:
        head = [cell.lower() for cell in first_names(file)]
        if head == _HEAD:
            groups.setdefault(f"{file.folder}/{_parts(file)[0]}", []).append(file)
    return list(groups.values())


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    by_kind = {_KINDS.get(_parts(file)[1], ""): file for file in files}

    def sensor(kind: str) -> RecordedSensor:
        sheet = read_sheet(by_kind[kind])
        what = ("gyro", "rad/s", "right-handed") if kind == "gyro" else ("accelerometer", "m/s2", _UP)
        return sensor_of(sheet, sheet.times(0), [1, 2, 3], *what)

    give = "give the folder or the zip with NAME_accm.csv and NAME_gyrm.csv"
    remedy = "give the file of the accelerometer (_accm), or of gravity (_grvm), too"
    accel = with_gravity(by_kind, sensor, name, "linear acceleration", remedy, f"no accelerometer: {give}")
    if "gyro" not in by_kind:
        raise InputError(f"{name}: no gyroscope: {give}")
    return AppRecording(NAME, accel, sensor("gyro"), sign_known=False)


def _parts(file: RecordingFile) -> tuple[str, str]:
    """The common part of the names of a recording's files, and the sensor of this file."""
    match = _SENSOR.match(file.stem)
    return (match[1], match[2]) if match else (file.stem, "")
