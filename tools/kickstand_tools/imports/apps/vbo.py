"""Reads Racelogic's VBO, with the channels of an inertial unit such as the IMU04.

Sections and standard channels follow
https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format. Latitude and longitude are in minutes, and
longitude is positive in the west. The signs of the IMU04's channels are in "CAN Output - IMU04" at
en.racelogic.support. Acceleration is x forward, y to the left, z up, including gravity. The yaw rate is positive
clockwise, the pitch rate positive nose up, so the rates are about axes forward, right and down.
"""

import re
from datetime import UTC, datetime

import numpy as np

from ...common.messages import InputError
from ...logs.csv_text import columns_of
from ..files import RecordingFile
from ..recording import AppRecording, Sheet, plain, sensor_of, track_of
from ..units import ACCELERATIONS, RATES, SPEEDS, of_day, unit

NAME = "VBO"
_CHANNELS = {  # channels along and about the vehicle's left, up, forward
    "Y_Accel": ("yaccel", "yacceleration", "imuyaccel"),
    "Z_Accel": ("zaccel", "zacceleration", "imuzaccel"),
    "X_Accel": ("xaccel", "xacceleration", "imuxaccel"),
    "PitchRate": ("pitchrate", "imupitchrate"),
    "YawRate": ("yawrate", "imuyawrate"),
    "RollRate": ("rollrate", "imurollrate"),
}
# RaceBox's names (box: x forward, y left, z up), in the order of _CHANNELS
_BOX = (
    ("LatAcc", "LateralAcc"),
    ("VertAcc", "VerticalAcc"),
    ("LongAcc", "LongitudinalAcc"),
    ("y-rotation-gyroscope", "GyroY"),
    ("z-rotation-gyroscope", "GyroZ"),
    ("x-rotation-gyroscope", "GyroX"),
)
_RATE_SIGNS = np.array([-1.0, -1.0, 1.0])
_VEHICLE = "x forward, y left, z up; +1 g up"
_DEVICE = [f"{axis}{what}" for what in ("acc", "rateofrotation") for axis in "xyz"]  # as RaceChrono writes them
_LACKING = (
    "without three accelerations, gravity in them, and three rates there is no lean; log an inertial unit, too (of "
    "Kickstand's own export take the log that it was made from)"
)
_SECTION = re.compile(r"^\[([^\]]+)\]\s*$")


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """Each file with VBO's sections is a recording."""
    return [[file] for file in files if "[column names]" in file.text[:20000].lower() and "[data]" in file.text]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing section or column."""
    sections = _sections(files[0])
    sheet = _sheet(files[0].name, sections)
    units = _units(sections, sheet)
    clock = sheet.place("time")
    if clock is None:
        raise InputError(f"{name}: no column time in it")
    time_ns = of_day(sheet.numbers(clock))
    device = [place for place in (_first(sheet, axis) for axis in _DEVICE) if place is not None]
    of_device = len(device) == len(_DEVICE)
    places, missing = (device, []) if of_device else sheet.axes(*_CHANNELS.values())
    of_box, lacking = sheet.axes(*_BOX)
    if missing and not lacking:
        places, missing = of_box, []
    if missing:
        named = ", ".join(name for name, names in _CHANNELS.items() if names[0] in missing)
        raise InputError(f"{name}: no channel {named}: {_LACKING}")
    up, turned = ("+1 g up", "right-handed") if of_device else (_VEHICLE, "yaw clockwise, pitch nose up: turned")
    accel_unit, rate_unit = units.get(places[0]) or "g", units.get(places[3]) or "deg/s"
    turn = 1.0 if of_device else _RATE_SIGNS
    if places == of_box and not lacking:
        up, turned, turn = "box's x forward, y left, z up; +1 g up", "right-handed", 1.0
    track = track_of(
        sheet,
        time_ns,
        sheet.place("velocity"),
        sheet.place("lat", "latitude"),
        sheet.place("long", "longitude", "lon"),
        _speed_unit(sections),
        (1.0 / 60.0, -1.0 / 60.0),
    )
    for taken in track.taken if track else []:
        taken.unit = "minutes, west positive" if taken.quantity == "position" else taken.unit
    return AppRecording(
        NAME,
        sensor_of(sheet, time_ns, places[:3], "accelerometer", accel_unit, up),
        sensor_of(sheet, time_ns, places[3:], "gyro", rate_unit, turned, turn),
        track,
        utc_ns=_midnight_ns(sections),
        vehicle_axes=not of_device,
        sign_known=not of_device,
    )


def _sections(file: RecordingFile) -> dict[str, list[str]]:
    """The lines of each section, by its name in lower case; "" for the lines before the first section."""
    sections: dict[str, list[str]] = {"": []}
    lines = sections[""]
    for line in file.text.split("\n"):
        match = _SECTION.match(line)
        if match:
            lines = sections.setdefault(match[1].strip().lower(), [])
        else:
            lines.append(line.rstrip())
    return sections


def _sheet(name: str, sections: dict[str, list[str]]) -> Sheet:
    columns = " ".join(sections.get("column names", [])).split()
    rows = [line.split() for line in sections.get("data", []) if line]
    if not columns or not rows:
        raise InputError(f"{name}: no rows under [data]: was anything recorded?")
    whole = [row for row in rows if len(row) == len(columns)]
    return Sheet(name, columns, columns_of(whole, len(columns)))


def _units(sections: dict[str, list[str]], sheet: Sheet) -> dict[int, str]:
    """The units of the last columns. [channel units] has one line for each non-standard channel."""
    units = sections.get("channel units", [])
    while units and not units[-1]:
        units = units[:-1]
    titles = [line for line in sections.get("header", []) if line]
    first = len(titles or sheet.columns) - len(units)
    known = {first + k: unit(text) for k, text in enumerate(units)}
    return {place: text for place, text in known.items() if text in ACCELERATIONS | RATES}


def _first(sheet: Sheet, name: str) -> int | None:
    """The first column with this name. The source may follow after a hyphen, as in x_acc-acc."""
    found = [plain(column.partition("-")[0]) for column in sheet.columns]
    return found.index(name) if name in found else None


def _speed_unit(sections: dict[str, list[str]]) -> str:
    title = next((line for line in sections.get("header", []) if line.lower().startswith("velocity")), "")
    said = unit(title.lower().removeprefix("velocity").strip())
    return said if said in SPEEDS else "km/h"


def _midnight_ns(sections: dict[str, list[str]]) -> int | None:
    """The start of the day on which the file was created, ns since 1970. The rows' times are the UTC time of this
    day."""
    match = re.search(r"(\d{1,2})/(\d{1,2})/(\d{4})", " ".join(sections[""][:3]))
    try:
        day = datetime(int(match[3]), int(match[2]), int(match[1]), tzinfo=UTC) if match else None
    except ValueError:
        return None
    return None if day is None else int(day.timestamp()) * 10**9
