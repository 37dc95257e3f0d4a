"""AiM's CSV from RaceStudio: InlineAcc, LateralAcc and VerticalAcc in g, RollRate, PitchRate and YawRate in deg/s.

Heads and signs as measured on the session tests/test_data/SFJ/*_0101.csv of https://github.com/m3rlin45/libxrk: at rest
VerticalAcc is -1, LateralAcc and YawRate are positive in a right turn and InlineAcc when speeding up, so the axes are
forward, right and down. A logger whose VerticalAcc is +1 has its up turned alone.
"""

import numpy as np

from ...errors import InputError
from ..files import Piece
from ..recording import Recording, sensor_of, track_of
from ..sheets import cells_of, plain, read_sheet, unit_in
from ..times import times_ns
from ..units import ACCELERATIONS, RATES, SPEEDS, factor, unit

NAME = "AiM"
_ACCEL = ("LateralAcc", "VerticalAcc", "InlineAcc")
_RATES = ("PitchRate", "YawRate", "RollRate")


def finds(pieces: list[Piece]) -> list[list[Piece]]:
    """Each file that says it is AiM's is a recording."""
    return [[piece] for piece in pieces if "AiM CSV File" in piece.text[:200]]


def read(pieces: list[Piece], name: str) -> Recording:
    """Raises InputError for what is missing."""
    lines = [cells_of(line) for line in pieces[0].text.split("\n", 60)[:60]]
    header = next(
        (k for k, cells in enumerate(lines) if cells and cells[0] == "Time" and sum(map(bool, cells)) > 3), None
    )
    if header is None:
        raise InputError(f"{name}: no line with the names of its channels: export it again as AiM CSV")
    following = lines[header + 1] if header + 1 < len(lines) else []
    has_units = bool(following) and unit(following[0]) in ("s", "ms")
    units = dict(enumerate(following)) if has_units else {}
    sheet = read_sheet(pieces[0], header, 1 if has_units else 0)
    accel, rates = ([sheet.place(channel) for channel in channels] for channels in (_ACCEL, _RATES))
    if None in accel or None in rates:
        wanted = zip((*_ACCEL, *_RATES), (*accel, *rates))
        missing = ", ".join(channel for channel, place in wanted if place is None)
        raise InputError(f"{name}: no channel {missing}: export the accelerometer's and the gyro's three channels each")
    accel_places, rate_places = ([place for place in places if place is not None] for places in (accel, rates))
    time_ns = times_ns(sheet.cells[0], "s", sheet.name)
    vertical = sheet.numbers(accel_places[1])
    down = bool(np.nanmedian(vertical) < 0.0) if np.any(np.isfinite(vertical)) else True
    accel_unit, rate_unit = units.get(accel_places[0]) or "g", units.get(rate_places[0]) or "deg/s"
    scale = np.array([-1.0, -1.0 if down else 1.0, 1.0]) * factor(accel_unit, ACCELERATIONS, name)
    said = "forward, right, down: turned" if down else "forward, right, up: turned"
    accel_sensor, first = sensor_of(sheet, time_ns, accel_places, scale, ("accelerometer", accel_unit, said))
    scale = np.array([-1.0, -1.0, 1.0]) * factor(rate_unit, RATES, name)
    gyro_sensor, second = sensor_of(
        sheet, time_ns, rate_places, scale, ("gyro", rate_unit, "forward, right, down: turned")
    )
    speed, speed_unit = sheet.place("GPS Speed", "Speed GPS"), "km/h"
    if speed is not None:
        speed_unit = unit(units.get(speed) or unit_in(sheet.columns[speed])) or speed_unit
    if speed_unit not in SPEEDS:
        raise InputError(f"{name}: the unit of {plain(sheet.columns[speed or 0])} is not known: {speed_unit!a}")
    track, places = track_of(
        sheet, time_ns, speed, sheet.place("GPS Latitude"), sheet.place("GPS Longitude"), speed_unit
    )
    return Recording(NAME, accel_sensor, gyro_sensor, track, None, [first, second, *places], vehicle_axes=True)
