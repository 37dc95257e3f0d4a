"""Reads SensorLog (Bernd Thomas) from an iPhone or a Watch: one wide CSV. Each sensor has a time since the start of
iOS.

The columns are the same as in the example logs at http://sensorlog.berndthomas.net. Values come from Core Motion.
Accelerations are in g, and read -1 along the axis that points up at rest
(https://developer.apple.com/reference/uikit/uiacceleration). These accelerations are the sum of gravity and the user's
acceleration, which the file also contains. Rates are in rad/s, right-handed.
"""

import numpy as np

from ...common.messages import InputError
from ..files import RecordingFile
from ..join import with_gravity
from ..recording import (
    AppRecording,
    ReceiverTrack,
    RecordedSensor,
    Sheet,
    first_names,
    read_sheet,
    sensor_of,
    track_of,
)
from ..units import NO_TIME, REPEATED, Nanoseconds

NAME = "SensorLog"
_UP = "Core Motion, -1 g up: sign turned"
_ACCEL = [f"accelerometerAcceleration{axis}" for axis in "XYZ"]
_GYRO = [f"gyroRotation{axis}" for axis in "XYZ"]
_USER = [f"motionUserAcceleration{axis}" for axis in "XYZ"]
_GRAVITY = [f"motionGravity{axis}" for axis in "XYZ"]
_KINDS = {"total": ("accelerometer", _ACCEL), "user": ("motion", _USER), "gravity": ("motion", _GRAVITY)}
_RATE = [f"motionRotationRate{axis}" for axis in "XYZ"]


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """Return each file with a column of SensorLog as a recording of its own."""
    return [[file] for file in files if _is_ours(file)]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    sheet = read_sheet(files[0])
    places = {kind: _axis_columns(sheet, names) for kind, (_, names) in _KINDS.items()}

    def acceleration(kind: str) -> RecordedSensor:
        return sensor_of(sheet, _clock(sheet, _KINDS[kind][0]), places[kind], "accelerometer", "g", _UP, -1.0)

    kinds = [kind for kind, columns in places.items() if columns]
    remedy = "log the accelerometer, or gravity beside the user's acceleration"
    accel = with_gravity(kinds, acceleration, name, "acceleration", remedy, f"no acceleration: {remedy}")
    return AppRecording(NAME, accel, _gyro(sheet, name), _location(sheet), utc_ns=_utc_ns(sheet))


def _is_ours(file: RecordingFile) -> bool:
    head = first_names(file)
    return any(cell.startswith((_ACCEL[0], _USER[0])) for cell in head)


def _axis_columns(sheet: Sheet, names: list[str]) -> list[int]:
    """The columns of three axes; an empty list if one is missing or empty."""
    axes, missing = sheet.axes(*names)
    return axes if not missing and np.any(np.isfinite(sheet.table(axes)).all(axis=1)) else []


def _clock(sheet: Sheet, sensor: str) -> Nanoseconds:
    """A sensor's own times. Rows repeat old samples; only the first row of each sample gets a time."""
    time_ns = _times(sheet, sensor)
    return np.where(np.diff(time_ns, prepend=NO_TIME) == 0, REPEATED, time_ns)


def _times(sheet: Sheet, sensor: str) -> Nanoseconds:
    place = sheet.place(f"{sensor}Timestamp_sinceReboot", "accelerometerTimestamp_sinceReboot", "loggingTime")
    if place is None:
        raise InputError(f"{sheet.name}: no column {sensor}Timestamp_sinceReboot(s): export it with the timestamps")
    return sheet.times(place)


def _gyro(sheet: Sheet, name: str) -> RecordedSensor:
    for sensor, names in (("gyro", _GYRO), ("motion", _RATE)):
        places = _axis_columns(sheet, names)
        if places:
            return sensor_of(sheet, _clock(sheet, sensor), places, "gyro", "rad/s", "right-handed")
    raise InputError(f"{name}: no gyroRotation or motionRotationRate in it: log the gyro, too")


def _utc_ns(sheet: Sheet) -> int | None:
    """UTC minus the time since the start of iOS, from the times at which the rows were logged."""
    logged = sheet.place("loggingTime")
    if logged is None:
        return None
    try:
        written = sheet.times(logged, "")
    except InputError:
        return None
    own = _times(sheet, "accelerometer" if _axis_columns(sheet, _ACCEL) else "motion")
    both = (written != NO_TIME) & (own != NO_TIME)
    return int(np.median(written[both] - own[both])) if np.any(both) else None


def _location(sheet: Sheet) -> ReceiverTrack | None:
    """The positions and speeds. A row has a new fix if the fix's own time has changed."""
    row_ns = _times(sheet, "accelerometer" if _axis_columns(sheet, _ACCEL) else "motion")
    fix = sheet.place("locationTimestamp_since1970")
    if fix is not None:
        values = sheet.numbers(fix)
        row_ns = np.where(np.diff(values, prepend=np.nan) == 0.0, NO_TIME, row_ns)
    lat, lon = sheet.place("locationLatitude"), sheet.place("locationLongitude")
    return track_of(sheet, row_ns, sheet.place("locationSpeed"), lat, lon)
