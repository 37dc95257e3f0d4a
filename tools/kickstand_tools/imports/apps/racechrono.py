"""Reads RaceChrono's CSV, versions 2 and 3: three axes of an accelerometer and a gyro, and the data of a receiver.

Version 3 has three heading lines (names, units, sources), and some names twice. Examples:
Short_RaceChrono_Offical_App_Data.csv of https://github.com/jLynx/RaceChrono-to-CSV, and, with x_acc to z_acc of "101:
acc" in G and x_rate_of_rotation of "102: gyro" in deg/s, https://github.com/ClassicMiniDIY/UltraLog/pull/85.
lateral_acc and longitudinal_acc are calculated from positions and do not contain gravity. The axes are those of the
phone or the box. Kickstand's own export also has this format.
"""

from ...common.messages import InputError
from ..files import RecordingFile
from ..recording import AppRecording, names_in, names_line, plain, read_sheet, sensor_of, track_of

NAME = "RaceChrono"
_FIRST = "This file is created using RaceChrono"
_TIMES = ("timestamp", "elapsedtime", "time")


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """Each file that names RaceChrono as its author is a recording."""
    return [[file] for file in files if file.text[:200].lstrip().startswith(_FIRST)]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    header = names_line(files[0], _is_header)
    if header is None:
        raise InputError(f"{name}: no line with the names of its columns: export it again as CSV v3")
    lines = files[0].text.split("\n", header + 3)
    units, more = _units([names_in(line) for line in lines[header : header + 3]])
    sheet = read_sheet(files[0], header, more)
    accel, no_accel = sheet.axes(*((f"{axis}_acc", f"{axis} acceleration", f"{axis}-acceleration") for axis in "xyz"))
    rates = ((f"{axis}_rate_of_rotation", f"{axis} rate of rotation", f"gyro {axis}") for axis in "xyz")
    gyro, no_gyro = sheet.axes(*rates)
    if no_accel or no_gyro:
        raise InputError(
            f"{name}: no x_acc to z_acc and x_rate_of_rotation to z_rate_of_rotation in it; its lateral_acc is "
            "calculated from positions, without gravity: record an accelerometer and a gyro, and export all channels"
        )
    by_kickstand = "by Kickstand" in lines[0]
    time_place = next(place for place, column in enumerate(sheet.columns) if plain(column) in _TIMES)
    time_ns = sheet.times(time_place)
    accel_unit, rate_unit = units.get(accel[0], "g").lower(), units.get(gyro[0], "deg/s").lower()
    up = "left, up, forward" if by_kickstand else "+1 g up"
    speed = next((place for place, column in enumerate(sheet.columns) if _is_speed(column)), None)
    return AppRecording(
        NAME,
        sensor_of(sheet, time_ns, accel, "accelerometer", accel_unit, up),
        sensor_of(sheet, time_ns, gyro, "gyro", rate_unit, "right-handed"),
        track_of(sheet, time_ns, speed, sheet.place("latitude"), sheet.place("longitude")),
        utc_ns=0 if plain(sheet.columns[time_place]) == "timestamp" else None,
        vehicle_axes=by_kickstand,
        sign_known=by_kickstand,
    )


def _is_header(cells: list[str]) -> bool:
    return len(cells) > 4 and any(plain(cell) in _TIMES for cell in cells[:5])


def _units(lines: list[list[str]]) -> tuple[dict[int, str], int]:
    """The units by column number, and the number of header lines after the first. lines: the cells of these lines."""
    names, *below = lines
    if len(below) == 2 and below[0][:1] == ["unix time"]:
        return {place: cell for place, cell in enumerate(below[0]) if cell}, 2
    return {place: name.rpartition("(")[2].rstrip(")") for place, name in enumerate(names) if name.endswith(")")}, 0


def _is_speed(column: str) -> bool:
    """True for a column of the speed. Version 2 has the speed in three units, version 3 in m/s."""
    return plain(column) == "speed" and ("(" not in column or "m/s" in column)
