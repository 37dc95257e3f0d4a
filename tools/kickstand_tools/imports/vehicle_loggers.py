"""Reads Kickstand's own files, and the exports of loggers for racing. Most of them have the vehicle's axes."""

import io
import re
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from ..common.installation import extra
from ..common.messages import InputError
from ..logs.csv_text import COLUMNS, MOST_CELLS, columns_of
from .files import RecordingFile
from .recording import (
    App,
    AppRecording,
    RecordedSensor,
    Sheet,
    cells_in,
    each_file,
    first_names,
    names_line,
    plain,
    read_sheet,
    sensors_of,
    track_of,
    unit_in,
)
from .unit_fits import speed_of
from .units import ACCELERATIONS, EPOCH_NS, RATES, SPEEDS, Nanoseconds, factor, of_day, unit

_PARQUET = b"PAR1"
_FORCES = ("left_g", "up_g", "forward_g")
_RATES = ("pitch_rate_dps", "yaw_rate_dps", "roll_rate_dps")
# Rates about the vehicle's axes, converted to left, up, forward: pitch is positive nose up, and yaw, in the files of
# others, clockwise
_NOSE_UP, _NOSE_UP_CLOCKWISE = np.array([-1.0, 1.0, 1.0]), np.array([-1.0, -1.0, 1.0])
_BOX = "box's x forward, y left, z up; +1 g up"


def _is_own(file: RecordingFile) -> bool:
    head = set(first_names(file))
    return file.content.startswith(_PARQUET) or head.issuperset(COLUMNS) or head.issuperset(("t_s", *_FORCES))


def _read_own(files: list[RecordingFile], name: str) -> AppRecording:
    """Read Kickstand's logs, also if saved by a spreadsheet, and the CSV or Parquet files of `kickstand export`.

    _read_racechrono() reads exports in RaceChrono's format. An exported VBO cannot be imported, because it has neither
    the vertical force nor the pitch rate. Raises InputError for the output of a replay, which lacks readings.
    """
    sheet = _parquet(files[0]) if files[0].content.startswith(_PARQUET) else read_sheet(files[0])
    time_ns = sheet.times(sheet.columns.index("t_s"))
    log, no_log = sheet.axes(*COLUMNS[1:])
    exported, no_export = sheet.axes(*_FORCES, *_RATES)
    if no_log and no_export:
        raise InputError(f"{name} contains a lean but no readings: give the log that it was made from")
    along_vehicle = "left, up, forward"
    sensors = (
        sensors_of(sheet, time_ns, exported, (along_vehicle, along_vehicle), turns=(1.0, _NOSE_UP))
        if no_log
        else sensors_of(sheet, time_ns, log, ("+1 g up", "right-handed"))
    )
    speed, lat, lon = (sheet.place(column) for column in ("speed_mps", "lat_deg", "lon_deg"))
    track = track_of(sheet, time_ns, speed, lat, lon)
    utc_ns, utc_s = None, sheet.numbers(sheet.place("utc_s"))
    valid = np.isfinite(utc_s)
    if len(time_ns) and float(np.median(time_ns)) > EPOCH_NS:
        utc_ns = 0
    elif np.any(valid):
        utc_ns = int(np.median(utc_s[valid] * 1e9 - time_ns[valid]))
    temp_c = sheet.numbers(sheet.place("temp_c"))
    return AppRecording(OWN.name, *sensors, track, temp_c, utc_ns=utc_ns, vehicle_axes=bool(no_log))


def _parquet(file: RecordingFile) -> Sheet:
    try:
        from pyarrow import parquet

        size = parquet.ParquetFile(io.BytesIO(file.content)).metadata
        if size.num_rows * size.num_columns > MOST_CELLS:
            raise InputError(f"{file.name} is too large: over {MOST_CELLS / 1e6:.0f} million cells")
        table = parquet.read_table(io.BytesIO(file.content))
    except ImportError as error:
        raise InputError("Parquet needs pyarrow: " + extra("rides")) from error
    except (ValueError, OSError, NotImplementedError, KeyError, TypeError) as error:
        raise InputError(f"{file.name} is damaged or cut short: copy it again") from error
    columns = [str(column) for column in table.column_names]
    if "t_s" not in columns:
        raise InputError(f"{file.name}: not a ride that kickstand has exported: its columns are {', '.join(columns)}")
    return Sheet(file.name, columns, [column.to_numpy() for column in table.columns])


OWN = App("Kickstand", each_file(_is_own), _read_own)


# VBO

_CHANNELS = {  # channels along and about the vehicle's left, up, forward
    "Y_Accel": ("yaccel", "yacceleration", "imuyaccel"),
    "Z_Accel": ("zaccel", "zacceleration", "imuzaccel"),
    "X_Accel": ("xaccel", "xacceleration", "imuxaccel"),
    "PitchRate": ("pitchrate", "imupitchrate"),
    "YawRate": ("yawrate", "imuyawrate"),
    "RollRate": ("rollrate", "imurollrate"),
}
# RaceBox's names (box: x forward, y left, z up), in the order of _CHANNELS
_BOX_CHANNELS = (
    ("LatAcc", "LateralAcc"),
    ("VertAcc", "VerticalAcc"),
    ("LongAcc", "LongitudinalAcc"),
    ("y-rotation-gyroscope", "GyroY"),
    ("z-rotation-gyroscope", "GyroZ"),
    ("x-rotation-gyroscope", "GyroX"),
)
# As RaceChrono writes them, with the source after a hyphen: x_acc-acc
_DEVICE_CHANNELS = [f"{axis}{what}" for what in ("acc", "rateofrotation") for axis in "xyz"]
_SECTION = re.compile(r"^\[([^\]]+)\]\s*$")


def _is_vbo(file: RecordingFile) -> bool:
    return "[column names]" in file.text[:20000].lower() and "[data]" in file.text


def _read_vbo(files: list[RecordingFile], name: str) -> AppRecording:
    """Read Racelogic's VBO, with the channels of an inertial unit such as the IMU04.

    Sections and standard channels follow
    https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format. Latitude and longitude are in minutes,
    and longitude is positive in the west. The signs of the IMU04's channels are in "CAN Output - IMU04" at
    en.racelogic.support. Acceleration is x forward, y to the left, z up, including gravity. The yaw rate is positive
    clockwise, the pitch rate positive nose up, so the rates are about axes forward, right and down.
    """
    sections = _sections(files[0])
    columns = " ".join(sections.get("column names", [])).split()
    rows = [line.split() for line in sections.get("data", []) if line]
    if not columns or not rows:
        raise InputError(f"{files[0].name}: no rows under [data]: was anything recorded?")
    sheet = Sheet(files[0].name, columns, columns_of([row for row in rows if len(row) == len(columns)], len(columns)))
    clock = sheet.place("time")
    if clock is None:
        raise InputError(f"{name}: no column time in it")
    time_ns = of_day(sheet.numbers(clock))
    sensors, of_vehicle = _vbo_sensors(sheet, time_ns, _channel_units(sections, len(columns)), name)
    title = next((line.lower() for line in sections.get("header", []) if line.lower().startswith("velocity")), "")
    stated = unit(title.removeprefix("velocity").strip())
    speed, lat, lon = sheet.place("velocity"), sheet.place("lat", "latitude"), sheet.place("long", "longitude", "lon")
    speed_unit = stated if stated in SPEEDS else "km/h"
    track = track_of(sheet, time_ns, speed, lat, lon, speed_unit, (1.0 / 60.0, -1.0 / 60.0))
    for taken in track.taken if track else []:
        taken.unit = "minutes, west positive" if taken.quantity == "position" else taken.unit
    utc_ns = _midnight_ns(sections)
    return AppRecording(VBO.name, *sensors, track, utc_ns=utc_ns, vehicle_axes=of_vehicle, sign_known=of_vehicle)


def _vbo_sensors(
    sheet: Sheet, time_ns: Nanoseconds, units: dict[int, str], name: str
) -> tuple[tuple[RecordedSensor, RecordedSensor], bool]:
    """The accelerometer and the gyro, and True if they have the vehicle's axes. Raises InputError without them.

    units: by the number of the column.
    """
    without_source = replace(sheet, columns=[column.partition("-")[0] for column in sheet.columns])
    device, no_device = without_source.axes(*_DEVICE_CHANNELS)
    channels, no_channel = sheet.axes(*_CHANNELS.values())
    box, no_box = sheet.axes(*_BOX_CHANNELS)
    if not no_device:
        places, signs, turn = device, ("+1 g up", "right-handed"), 1.0
    elif not no_channel:
        signs = "x forward, y left, z up; +1 g up", "yaw clockwise, pitch nose up: turned"
        places, turn = channels, _NOSE_UP_CLOCKWISE
    elif not no_box:
        places, signs, turn = box, (_BOX, "right-handed"), 1.0
    else:
        lacking = ", ".join(name for name, names in _CHANNELS.items() if names[0] in no_channel)
        raise InputError(
            f"{name}: no channel {lacking}: without three accelerations, gravity in them, and three rates there is no "
            "lean; log an inertial unit, too (of Kickstand's own export take the log that it was made from)"
        )
    sensor_units = units.get(places[0]) or "g", units.get(places[3]) or "deg/s"
    return sensors_of(sheet, time_ns, places, signs, sensor_units, (1.0, turn)), bool(no_device)


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


def _channel_units(sections: dict[str, list[str]], count: int) -> dict[int, str]:
    """The units of the last columns. [channel units] has one line for each non-standard channel."""
    units = sections.get("channel units", [])
    while units and not units[-1]:
        units = units[:-1]
    first = (len([line for line in sections.get("header", []) if line]) or count) - len(units)
    known = {first + k: unit(text) for k, text in enumerate(units)}
    return {place: text for place, text in known.items() if text in ACCELERATIONS | RATES}


def _midnight_ns(sections: dict[str, list[str]]) -> int | None:
    """The start of the day on which the file was created, ns since 1970. The rows' times are the UTC time of this
    day."""
    match = re.search(r"(\d{1,2})/(\d{1,2})/(\d{4})", " ".join(sections[""][:3]))
    try:
        day = datetime(int(match[3]), int(match[2]), int(match[1]), tzinfo=UTC) if match else None
    except ValueError:
        return None
    return None if day is None else int(day.timestamp()) * 10**9


VBO = App("VBO", each_file(_is_vbo), _read_vbo)


# AiM

_AIM_CHANNELS = ("LateralAcc", "VerticalAcc", "InlineAcc", "PitchRate", "YawRate", "RollRate")


def _read_aim(files: list[RecordingFile], name: str) -> AppRecording:
    """Read AiM's CSV from RaceStudio: InlineAcc, LateralAcc, VerticalAcc in g, RollRate, PitchRate, YawRate in deg/s.

    Column names and signs were found from the session tests/test_data/SFJ/*_0101.csv of
    https://github.com/m3rlin45/libxrk: at rest VerticalAcc is -1. LateralAcc and YawRate are positive in a right turn,
    InlineAcc when speeding up. The axes are therefore forward, right and down. If VerticalAcc is +1 at rest,
    VerticalAcc points up and keeps its sign. The signs of the other channels do not depend on the sign of VerticalAcc.
    """
    header = names_line(files[0], lambda cells: cells[:1] == ["Time"] and sum(map(bool, cells)) > 3)
    if header is None:
        raise InputError(f"{name}: no line with the names of its channels: export it again as AiM CSV")
    below = cells_in("".join(files[0].text.split("\n", header + 2)[header + 1 : header + 2]))
    units = dict(enumerate(below)) if unit("".join(below[:1])) in ("s", "ms") else {}
    sheet = read_sheet(files[0], header, 1 if units else 0)
    places, missing = sheet.axes(*_AIM_CHANNELS)
    if missing:
        raise InputError(
            f"{name}: no channel {', '.join(missing)}: export the accelerometer's and the gyro's three channels each"
        )
    time_ns = sheet.times(0)
    vertical = sheet.numbers(places[1])
    down = not np.any(np.isfinite(vertical)) or bool(np.nanmedian(vertical) < 0.0)
    signs = f"forward, right, {'down' if down else 'up'}: turned", "forward, right, down: turned"
    turns = np.array([-1.0, -1.0 if down else 1.0, 1.0]), _NOSE_UP_CLOCKWISE
    sensor_units = units.get(places[0]) or "g", units.get(places[3]) or "deg/s"
    sensors = sensors_of(sheet, time_ns, places, signs, sensor_units, turns)
    speed, speed_unit = sheet.place("GPS Speed", "Speed GPS"), "km/h"
    if speed is not None:
        speed_unit = unit(units.get(speed) or unit_in(sheet.columns[speed])) or speed_unit
    if speed_unit not in SPEEDS:
        raise InputError(f"{name}: the unit of {plain(sheet.columns[speed or 0])} is not known: {speed_unit!a}")
    track = track_of(sheet, time_ns, speed, sheet.place("GPS Latitude"), sheet.place("GPS Longitude"), speed_unit)
    return AppRecording(AIM.name, *sensors, track, vehicle_axes=True)


AIM = App("AiM", each_file(lambda file: "AiM CSV File" in file.text[:200]), _read_aim)


# RaceChrono

_TIMES = ("timestamp", "elapsedtime", "time")


def _read_racechrono(files: list[RecordingFile], name: str) -> AppRecording:
    """Read RaceChrono's CSV, versions 2 and 3: three axes of an accelerometer and a gyro, and the data of a receiver.

    Version 3 has three heading lines (names, units, sources), and some names twice. Version 2 has the speed in three
    units, version 3 in m/s. Examples: Short_RaceChrono_Offical_App_Data.csv of
    https://github.com/jLynx/RaceChrono-to-CSV, and, with x_acc to z_acc of "101: acc" in G and x_rate_of_rotation of
    "102: gyro" in deg/s, https://github.com/ClassicMiniDIY/UltraLog/pull/85. lateral_acc and longitudinal_acc are
    calculated from positions and do not contain gravity. The axes are those of the phone or the box. Kickstand's own
    export also has this format.
    """
    sheet, units = _racechrono_sheet(files[0], name)
    places, missing = sheet.axes(
        *((f"{axis}_acc", f"{axis} acceleration", f"{axis}-acceleration") for axis in "xyz"),
        *((f"{axis}_rate_of_rotation", f"{axis} rate of rotation", f"gyro {axis}") for axis in "xyz"),
    )
    if missing:
        raise InputError(
            f"{name}: no x_acc to z_acc and x_rate_of_rotation to z_rate_of_rotation in it; its lateral_acc is "
            "calculated from positions, without gravity: record an accelerometer and a gyro, and export all channels"
        )
    columns = [plain(column) for column in sheet.columns]
    clock = next(place for place, column in enumerate(columns) if column in _TIMES)
    time_ns = sheet.times(clock)
    by_kickstand = "by Kickstand" in files[0].text.partition("\n")[0]
    signs = "left, up, forward" if by_kickstand else "+1 g up", "right-handed"
    sensor_units = units.get(places[0], "g").lower(), units.get(places[3], "deg/s").lower()
    speeds = [place for place, column in enumerate(columns) if column == "speed"]
    speeds = [place for place in speeds if "(" not in sheet.columns[place] or "m/s" in sheet.columns[place]]
    speed, lat, lon = next(iter(speeds), None), sheet.place("latitude"), sheet.place("longitude")
    return AppRecording(
        RACECHRONO.name,
        *sensors_of(sheet, time_ns, places, signs, sensor_units),
        track_of(sheet, time_ns, speed, lat, lon),
        utc_ns=0 if columns[clock] == "timestamp" else None,
        vehicle_axes=by_kickstand,
        sign_known=by_kickstand,
    )


def _racechrono_sheet(file: RecordingFile, name: str) -> tuple[Sheet, dict[int, str]]:
    """The table, and the units by the number of the column."""
    header = names_line(file, lambda cells: len(cells) > 4 and any(plain(cell) in _TIMES for cell in cells[:5]))
    if header is None:
        raise InputError(f"{name}: no line with the names of its columns: export it again as CSV v3")
    names, *below = (cells_in(line) for line in file.text.split("\n", header + 3)[header : header + 3])
    if len(below) == 2 and below[0][:1] == ["unix time"]:  # version 3
        return read_sheet(file, header, 2), {place: cell for place, cell in enumerate(below[0]) if cell}
    return read_sheet(file, header), {place: unit_in(name) for place, name in enumerate(names) if name.endswith(")")}


RACECHRONO = App(
    "RaceChrono",
    each_file(lambda file: file.text[:200].lstrip().startswith("This file is created using RaceChrono")),
    _read_racechrono,
)


# RaceBox

_RACEBOX_AXES = [f"{sensor}{axis}" for sensor in ("GForce", "Gyro") for axis in "YZX"]  # left, up, forward


def _racebox_names(file: RecordingFile) -> int | None:
    """The number of the line of column names. Lines about the laps may come before this line."""
    return names_line(file, lambda cells: {"gforcex", "gforcez", "time"} <= set(map(plain, cells)), 200)


def _read_racebox(files: list[RecordingFile], name: str, speed_unit: str = "") -> AppRecording:
    """Read RaceBox's CSV: GForceX to Z in g, GyroX to Z in deg/s; x forward, y left, z up; GForceZ is +1 at rest.

    The column names of the presets are in the docs of https://github.com/beadon/RacePlex. The axes (X forward, Y left,
    Z up, GyroZ positive in a left turn) were found from the ride src/lib/__fixtures__/racebox-session.csv there. The
    quantities are described in https://www.racebox.pro/products/mini-micro-protocol-documentation. The column Speed has
    no unit. If speed_unit is "", the unit is found from the positions.
    """
    if speed_unit:
        factor(speed_unit, SPEEDS, "speed")  # raises InputError for an unknown unit
    sheet = read_sheet(files[0], _racebox_names(files[0]) or 0)
    places, missing = sheet.axes(*_RACEBOX_AXES)
    if {"GForceY", "GForceZ"} & set(missing):
        raise InputError(f"{name}: no GForceY or GForceZ, as in its motorcycle mode: export it with that mode off")
    if missing:
        raise InputError(f"{name}: no GyroX to GyroZ: export it from RaceBox's app on the phone, which writes them")
    time_ns = sheet.times(sheet.place("Time") or 0, "")
    sensors = sensors_of(sheet, time_ns, places, (_BOX, "right-handed"))
    lat, lon, speed = sheet.place("Latitude"), sheet.place("Longitude"), sheet.place("Speed", "KPH")
    if speed is not None and not speed_unit:
        column = sheet.columns[speed]
        speed_unit = "km/h" if plain(column) == "kph" else unit_in(column)
    speed, speed_unit, notices = speed_of(sheet, time_ns, speed, unit(speed_unit), lat, lon)
    track = track_of(sheet, time_ns, speed, lat, lon, speed_unit)
    return AppRecording(RACEBOX.name, *sensors, track, notices=notices, utc_ns=0, vehicle_axes=True)


RACEBOX = App("RaceBox", each_file(lambda file: _racebox_names(file) is not None), _read_racebox, asks_speed=True)
APPS = OWN, VBO, AIM, RACECHRONO, RACEBOX
