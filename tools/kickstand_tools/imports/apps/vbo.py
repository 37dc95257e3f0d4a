"""Racelogic's VBO, with the channels of an inertial unit such as the IMU04.

Sections and standard channels: https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format; latitude
and longitude in minutes, longitude positive in the west. Signs of the IMU04's channels, "CAN Output - IMU04" at
en.racelogic.support: acceleration x forward, y to the left, z up, with gravity in it; yaw rate positive clockwise and
pitch rate nose up, so the rates are those about axes forward, right and down.
"""

import re
from datetime import UTC, datetime

import numpy as np

from ...errors import InputError
from ..cells import columns_of
from ..files import Piece
from ..recording import Recording, Taken, sensor_of, track_of
from ..sheets import Sheet, plain
from ..times import of_day
from ..units import ACCELERATIONS, RATES, SPEEDS, factor, unit

NAME = "VBO"
_ACCEL = {"forward": ("xaccel", "xacceleration", "imuxaccel"), "left": ("yaccel", "yacceleration", "imuyaccel")}
_ACCEL |= {"up": ("zaccel", "zacceleration", "imuzaccel")}
_RATES = {"forward": ("rollrate", "imurollrate"), "left": ("pitchrate", "imupitchrate")}
_RATES |= {"up": ("yawrate", "imuyawrate")}
_AXES = ("left", "up", "forward")
_SIGNS = {"left": -1.0, "up": -1.0, "forward": 1.0}  # of the rates
_DEVICE = [[f"{axis}{what}" for axis in "xyz"] for what in ("acc", "rateofrotation")]  # as RaceChrono writes them
_SECTION = re.compile(r"^\[([^\]]+)\]\s*$")


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """Each file with VBO's sections is a recording."""
    return [[piece] for piece in pieces if "[column names]" in piece.text[:20000].lower() and "[data]" in piece.text]


def read(pieces: list[Piece], name: str) -> Recording:
    """Raises InputError for what is missing."""
    sections = _sections(pieces[0])
    sheet = _sheet(pieces[0].name, sections)
    units = _units(sections, sheet)
    clock = sheet.place("time")
    if clock is None:
        raise InputError(f"{name}: no column time in it")
    time_ns = of_day(sheet.numbers(clock))
    vehicle = _places(sheet, _ACCEL), _places(sheet, _RATES)
    device = [[_first(sheet, axis) for axis in axes] for axes in _DEVICE]
    taken: list[Taken]
    if all(place is not None for places in device for place in places):
        accel, gyro = ([place for place in places if place is not None] for places in device)
        signs, text = np.ones(3), ("+1 g up", "right-handed")
    elif None not in vehicle[0] and None not in vehicle[1]:
        accel, gyro = ([place for place in places if place is not None] for places in vehicle)
        signs = np.array([_SIGNS[axis] for axis in _AXES])
        text = ("x forward, y left, z up; +1 g up", "yaw clockwise, pitch nose up: turned")
    else:
        raise InputError(f"{name}: {_lacking(vehicle)}")
    accel_unit, rate_unit = units.get(accel[0]) or "g", units.get(gyro[0]) or "deg/s"
    scale = factor(accel_unit, ACCELERATIONS, name)
    accel_sensor, first = sensor_of(sheet, time_ns, accel, scale, ("accelerometer", accel_unit, text[0]))
    scale = factor(rate_unit, RATES, name)
    gyro_sensor, second = sensor_of(sheet, time_ns, gyro, signs * scale, ("gyro", rate_unit, text[1]))
    lat, lon = sheet.place("lat", "latitude"), sheet.place("long", "longitude", "lon")
    for place, sign in ((lat, 1.0), (lon, -1.0)):
        if place is not None:
            sheet.cells[place] = sign * sheet.numbers(place) / 60.0
    track, places = track_of(sheet, time_ns, sheet.place("velocity"), lat, lon, _speed_unit(sections))
    taken = [first, second, *places]
    for one in taken:
        one.unit = "minutes, west positive" if one.quantity == "position" else one.unit
    known = text[0] != "+1 g up"
    utc_ns = _midnight_ns(sections)
    return Recording(NAME, accel_sensor, gyro_sensor, track, None, taken, [], utc_ns, known, known)


def _sections(piece: Piece) -> dict[str, list[str]]:
    """The lines of each section by its name in small letters; "" has those before the first."""
    sections: dict[str, list[str]] = {"": []}
    lines = sections[""]
    for line in piece.text.split("\n"):
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
    """The units of the last columns: [channel units] has one line for each that is no standard channel."""
    units = sections.get("channel units", [])
    while units and not units[-1]:
        units = units[:-1]
    titles = [line for line in sections.get("header", []) if line]
    first = len(titles or sheet.columns) - len(units)
    known = {first + k: unit(text) for k, text in enumerate(units)}
    return {place: text for place, text in known.items() if text in ACCELERATIONS | RATES}


def _first(sheet: Sheet, name: str) -> int | None:
    """The column of a name, also with its source after a hyphen: x_acc-acc."""
    found = [plain(column.partition("-")[0]) for column in sheet.columns]
    return found.index(name) if name in found else None


def _places(sheet: Sheet, names: dict[str, tuple[str, ...]]) -> list[int | None]:
    return [sheet.place(*names[axis]) for axis in _AXES]


def _lacking(vehicle: tuple[list[int | None], list[int | None]]) -> str:
    wanted = [_ACCEL[axis][0] for axis in _AXES] + [_RATES[axis][0] for axis in _AXES]
    named = dict(zip(wanted, ("Y_Accel", "Z_Accel", "X_Accel", "PitchRate", "YawRate", "RollRate")))
    missing = [named[name] for name, place in zip(wanted, [*vehicle[0], *vehicle[1]]) if place is None]
    return (
        f"no channel {', '.join(missing)}: without three accelerations, gravity in them, and three rates there is no "
        "lean; log an inertial unit, too (of Kickstand's own export take the log that it was made from)"
    )


def _speed_unit(sections: dict[str, list[str]]) -> str:
    title = next((line for line in sections.get("header", []) if line.lower().startswith("velocity")), "")
    said = unit(title.lower().removeprefix("velocity").strip())
    return said if said in SPEEDS else "km/h"


def _midnight_ns(sections: dict[str, list[str]]) -> int | None:
    """The start of the day on which the file was created, from 1970: the rows' times are UTC of that day."""
    match = re.search(r"(\d{1,2})/(\d{1,2})/(\d{4})", " ".join(sections[""][:3]))
    try:
        day = datetime(int(match[3]), int(match[2]), int(match[1]), tzinfo=UTC) if match else None
    except ValueError:
        return None
    return None if day is None else int(day.timestamp()) * 10**9
