"""Reads AiM's CSV from RaceStudio: InlineAcc, LateralAcc, VerticalAcc in g, RollRate, PitchRate, YawRate in deg/s.

Column names and signs were found from the session tests/test_data/SFJ/*_0101.csv of
https://github.com/m3rlin45/libxrk: at rest VerticalAcc is -1. LateralAcc and YawRate are positive in a right turn,
InlineAcc when speeding up. The axes are therefore forward, right and down. If VerticalAcc is +1 at rest,
VerticalAcc points up and keeps its sign. The signs of the other channels do not depend on the sign of VerticalAcc.
"""

import numpy as np

from ...common.messages import InputError
from ..files import RecordingFile
from ..recording import AppRecording, names_in, names_line, plain, read_sheet, sensor_of, track_of, unit_in
from ..units import SPEEDS, unit

NAME = "AiM"
_ACCEL = ("LateralAcc", "VerticalAcc", "InlineAcc")
_RATES = ("PitchRate", "YawRate", "RollRate")


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """Each file with AiM's heading is a recording."""
    return [[file] for file in files if "AiM CSV File" in file.text[:200]]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    header = names_line(files[0], lambda cells: cells[:1] == ["Time"] and sum(map(bool, cells)) > 3)
    if header is None:
        raise InputError(f"{name}: no line with the names of its channels: export it again as AiM CSV")
    below = names_in("".join(files[0].text.split("\n", header + 2)[header + 1 : header + 2]))
    units = dict(enumerate(below)) if unit("".join(below[:1])) in ("s", "ms") else {}
    sheet = read_sheet(files[0], header, 1 if units else 0)
    places, missing = sheet.axes(*_ACCEL, *_RATES)
    if missing:
        raise InputError(
            f"{name}: no channel {', '.join(missing)}: export the accelerometer's and the gyro's three channels each"
        )
    time_ns = sheet.times(0)
    vertical = sheet.numbers(places[1])
    down = bool(np.nanmedian(vertical) < 0.0) if np.any(np.isfinite(vertical)) else True
    accel_unit, rate_unit = units.get(places[0]) or "g", units.get(places[3]) or "deg/s"
    words, turn = ("forward, right, down: turned", -1.0) if down else ("forward, right, up: turned", 1.0)
    accel = sensor_of(sheet, time_ns, places[:3], "accelerometer", accel_unit, words, np.array([-1.0, turn, 1.0]))
    turned = "gyro", rate_unit, "forward, right, down: turned", np.array([-1.0, -1.0, 1.0])
    gyro = sensor_of(sheet, time_ns, places[3:], *turned)
    speed, speed_unit = sheet.place("GPS Speed", "Speed GPS"), "km/h"
    if speed is not None:
        speed_unit = unit(units.get(speed) or unit_in(sheet.columns[speed])) or speed_unit
    if speed_unit not in SPEEDS:
        raise InputError(f"{name}: the unit of {plain(sheet.columns[speed or 0])} is not known: {speed_unit!a}")
    track = track_of(sheet, time_ns, speed, sheet.place("GPS Latitude"), sheet.place("GPS Longitude"), speed_unit)
    return AppRecording(NAME, accel, gyro, track, vehicle_axes=True)
