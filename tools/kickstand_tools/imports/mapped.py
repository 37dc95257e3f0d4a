"""Reads a table of an unknown app. Its columns are found from the values (findings.py), or named by the user."""

import re
import shlex
from collections.abc import Mapping

import numpy as np

from ..common.messages import InputError, Message, Remedy
from ..signals import Array
from . import findings
from .columns import completed, stated_unit
from .files import RecordingFile
from .findings import ACCEL, GYRO, OPTIONAL, REQUIRED, Findings
from .layout import FEWEST_CELLS, joined_sheet, sheet_in
from .recording import AppRecording, ReceiverTrack, RecordedSensor, Sheet, Taken, plain, rate_hz, track_of, unit_in
from .unit_fits import ImportPositions, doubt_of_positions, fit_rates, speed_of, turns_too_far
from .units import (
    ACCELERATIONS,
    ANGLES,
    COUNTS_PER_DPS,
    COUNTS_PER_G,
    EPOCH_NS,
    RATES,
    SPEEDS,
    TIMES,
    Nanoseconds,
    counts_per,
    factor,
    since_first_s,
    tick_ns,
    time_unit,
    unit,
)

NAME = "a table"
WORDS = {"t": "time"} | {f"a{axis}": f"acceleration along {axis}" for axis in "xyz"}
WORDS |= {f"g{axis}": f"rate about {axis}" for axis in "xyz"}
WORDS |= {"speed": "speed", "lat": "latitude", "lon": "longitude", "temp": "temperature"}
UNIT_KEYS = {"t": TIMES, "a": ACCELERATIONS, "g": RATES, "speed": SPEEDS, "lat": ANGLES, "lon": ANGLES}
UNIT_KEYS |= dict.fromkeys(ACCEL, ACCELERATIONS) | dict.fromkeys(GYRO, RATES)
COUNTS = "counts"  # raw counts; the number per g or per deg/s is found from the values
_TIMES_OFF = 3.0  # a unit is refused if the turns of gravity show a unit that differs by more than this factor


def read_mapped(
    sheet: Sheet, columns: Mapping[str, str], units: Mapping[str, str], why: Findings | None = None
) -> AppRecording:
    """Read a table whose columns are known: t, ax to az, gx to gz and optionally speed, lat, lon and temp.

    columns: for each of these keys, the column's name in the file, or its number as #1, #2 ...
    units: by the keys t, a (for ax to az) or ax, ay, az, g (for gx to gz) or gx, gy, gz, speed, lat, lon. A - before a
        unit reverses the sign. A missing unit is read from the brackets in the column's name.
    why: the findings that gave the columns.

    Raises InputError, for example if the rates do not explain the turns of gravity.
    """
    check_keys(columns, units)
    places = _places(sheet, columns)
    units = _units(sheet, places, units)
    stated = unit(units["t"])
    t_unit = time_unit(sheet.cells[places["t"]], stated if tick_ns(stated) else "")
    time_ns = sheet.times(places["t"], t_unit)
    if not tick_ns(stated) and why is None and rate_hz(time_ns) > findings.DOUBTED_HZ:
        raise InputError(
            f"{sheet.name}: {rate_hz(time_ns):.0f} samples per second: add the unit of t, as in --units t=min"
        )
    _find_counts(sheet, time_ns, places, units)
    force, rates = (_scaled(sheet, places, units, axes) for axes in (ACCEL, GYRO))
    _check_rates(sheet.name, since_first_s(time_ns), force, rates)
    accel = _sensor(sheet, time_ns, places, units, "accelerometer", force)
    accel.taken.insert(0, Taken("time", sheet.named([places["t"]]), t_unit))
    gyro = _sensor(sheet, time_ns, places, units, "gyro", rates)
    track, notices = _track(sheet, time_ns, places, units, checked=why is not None)
    temp_c = sheet.numbers(places["temp"]) if "temp" in places else None
    utc_ns = 0 if len(time_ns) and int(np.median(time_ns)) > EPOCH_NS else None
    sign_changed = any(units[axis].startswith("-") for axis in ACCEL)  # the user's sign is not checked
    recording = AppRecording(NAME, accel, gyro, track, temp_c, notices, utc_ns=utc_ns, sign_known=sign_changed)
    if why is not None:
        for taken, key in zip(recording.taken, ("t", "a", "g")):
            taken.why = why.found[key].why
    return recording


def _track(
    sheet: Sheet, time_ns: Nanoseconds, places: Mapping[str, int], units: Mapping[str, str], checked: bool
) -> tuple[ReceiverTrack | None, list[Message]]:
    """Speed and position, and remarks. checked: True to leave positions out that do not fit the speed."""
    per_degree = factor(units.get("lat", "deg"), ANGLES, "lat"), factor(units.get("lon", "deg"), ANGLES, "lon")
    speed, lat, lon = (places.get(key) for key in ("speed", "lat", "lon"))
    stated = unit(units.get("speed", ""))
    speed, speed_unit, notices = speed_of(sheet, time_ns, speed, stated, lat, lon, per_degree)
    if checked and lat is not None and lon is not None:
        north, east = (sheet.numbers(place) * size for place, size in zip((lat, lon), per_degree))
        doubt = doubt_of_positions(time_ns, sheet.numbers(speed) * SPEEDS[speed_unit], north, east)
        if doubt:
            notices.append(ImportPositions(sheet.named([lat, lon]), doubt))
            lat = lon = None
    return track_of(sheet, time_ns, speed, lat, lon, speed_unit, per_degree), notices


def table_in(files: list[RecordingFile]) -> Findings | None:
    """The findings in the table of sensors in these files; None without one. The largest of several tables is used if
    they do not belong together."""
    sheet = sheet_in(max(files, key=lambda file: len(file.text)))
    result = None if sheet is None else findings.find(completed(sheet))
    if len(files) > 1 and (result is None or result.lacking):
        joined = joined_sheet(files)
        of_all = None if joined is None else findings.find(completed(joined))
        if of_all and (result is None or len(of_all.lacking) < len(result.lacking)):
            of_all.joined = True
            return of_all
    if result is None or not ({"a", "g"} & set(result.found) or len(result.sheet.columns) >= len(REQUIRED)):
        return None
    return result


def sheet_of(files: list[RecordingFile], name: str, columns: Mapping[str, str]) -> Sheet:
    """The table with these columns, from one file or joined from several. name: for messages. Raises InputError."""
    wanted = [column.strip() for column in columns.values() if not column.strip().startswith("#")]
    sheet = sheet_in(files[0], wanted) if len(files) == 1 else joined_sheet(files)
    sheet = sheet and completed(sheet)
    if len(files) > 1 and (sheet is None or not set(wanted) <= set(sheet.columns)):
        raise InputError(f"{name} holds {len(files)} files: give --columns with one, such as {files[0].name}")
    if sheet is None:
        raise InputError(f"{name}: no table of sensors: no two lines have {FEWEST_CELLS} numbers in as many cells")
    return sheet


def read_table(result: Findings, units: Mapping[str, str]) -> AppRecording | None:
    """The recording of a table; None if a column, or a unit that the user does not give, is uncertain. Raises
    InputError."""
    uncertain = {key for key in ("t", "a", "g") if key not in result.found or not result.found[key].certain}
    if result.lacking or not uncertain <= set(units):
        return None
    return read_mapped(result.sheet, result.columns, result.units | dict(units), result)


def unknown(files: list[RecordingFile], source: str, result: Findings | None = None) -> InputError:
    """The error for a file of an unknown app, with the missing columns, the file's columns, and the command to type."""
    result = result or table_in(files)
    if result is None:
        shown = next((line for file in files for line in file.first_lines(1)), "")[:60]
        return InputError(
            f"{source}: not a file of an app that is known, and no table of sensors ({shown!a}): give the file, the "
            "folder or the zip that an app has exported as CSV"
        )
    several = f" (of {len(files)} files, the largest is {result.sheet.name})" if len(files) > 1 else ""
    columns, lacking = result.sheet.columns, result.lacking_words
    shown = ", ".join(columns[:40]) + (", ..." if len(columns) > 40 else "")
    start = f"{source}: not a file of an app that is known{several}"
    named = not all(name.startswith("#") for name in columns)
    if "gyro" in result.lacking and not result.sheet.unread and ("a" in result.found or (named and not result.single)):
        return InputError(
            f"{start}, and no gyro found in it: without one there is no lean. Record the gyroscope as well. Its "
            f"columns are {shown}"
        )
    if result.remarks:
        return InputError(f"{start}{lacking}: {result.remarks[0]}")
    if result.lacking == ["time"]:
        return InputError(
            f"{start}, and no time found in it: write the time of each row, such as millis(), or switch the time "
            "stamps of the serial monitor on"
        )
    where = source if len(files) == 1 or result.joined else f"{source}/{result.sheet.name}"
    ask = "Replace each ?" if set(REQUIRED) - set(result.columns) else "Correct what is wrong"
    reasons = f" ({result.reasons})" if result.reasons else ""
    return InputError(
        f"{start}{lacking}",
        Remedy(
            f"its columns are {shown}. {ask}{reasons}, and type: {_command(where, result)}",
            "needed are a time, the acceleration along three axes and the rates of a gyro about them",
        ),
    )


def _command(where: str, result: Findings) -> str:
    """The command that imports the table from this file or folder, with ? for unknown columns."""
    keys = [key for key in (*REQUIRED, *OPTIONAL) if key in (*REQUIRED, *result.columns)]
    columns = ",".join(f"{key}={_column_as_typed(result, key)}" for key in keys)
    units = ",".join(f"{key}={name}" for key, name in result.units.items())
    options = f"--out RIDE.csv --columns {shlex.quote(columns)} --units {units}"
    return f"kickstand import {shlex.quote(where)} {options}"


def _column_as_typed(result: Findings, key: str) -> str:
    """The column of a key as the user types it: its name, its number if the name would be misread, ? if unknown."""
    name, all_names = result.columns.get(key, "?"), result.sheet.columns
    if name != "?" and (any(mark in name for mark in ",=") or all_names.count(name) > 1):
        return f"#{all_names.index(name) + 1}"
    return name


def check_keys(columns: Mapping[str, str], units: Mapping[str, str]) -> None:
    """Raise InputError for a key or a unit that does not exist, and for a missing column."""
    strange = [key for key in columns if key not in (*REQUIRED, *OPTIONAL)]
    if strange:
        raise InputError(f"--columns: {strange[0]!a} is not one of {', '.join((*REQUIRED, *OPTIONAL))}")
    missing = [key for key in REQUIRED if key not in columns]
    if missing:
        raise InputError(f"--columns: {', '.join(missing)} is missing: three axes of both sensors are needed, and t")
    check_units(units)


def check_units(units: Mapping[str, str]) -> None:
    """Raise InputError for a key or a unit of --units that does not exist."""
    strange = [key for key in units if key not in UNIT_KEYS]
    if strange:
        raise InputError(f"--units: {strange[0]!a} is not one of {', '.join(UNIT_KEYS)}")
    for key, text in units.items():
        if not (_is_counts(text) and key[0] in "ag"):
            factor(text, UNIT_KEYS[key], key)  # raises InputError for an unknown unit


def _is_counts(text: str) -> bool:
    return unit(text.strip().lstrip("-")) == COUNTS


def _places(sheet: Sheet, columns: Mapping[str, str]) -> dict[str, int]:
    """The number of each key's column. Raises InputError if it is missing, or another key's."""
    places: dict[str, int] = {}
    for key, name in columns.items():
        place = _place(sheet, key, name.strip())
        other = next((k for k in places if places[k] == place), None)
        if other is not None:
            raise InputError(
                f"--columns: {columns[other]!a} is given for {other} and for {key}: each has its own column"
            )
        places[key] = place
    return places


def _place(sheet: Sheet, key: str, name: str) -> int:
    if name in sheet.columns:
        return sheet.columns.index(name)
    if re.fullmatch(r"#\d+", name) and 0 < int(name[1:]) <= len(sheet.columns):
        return int(name[1:]) - 1
    place = sheet.place(name) if plain(name) else None
    if place is None:
        have = ", ".join(sheet.columns[:40])
        raise InputError(f"{sheet.name}: no column {name!a} for {key}: its columns are {have}")
    return place


def _units(sheet: Sheet, places: Mapping[str, int], given: Mapping[str, str]) -> dict[str, str]:
    """The unit of each key's column: the given one, otherwise the one in its name. Positions may be without a unit.
    Raises InputError, which names all axes whose unit is unknown."""
    units, unknown = {key: given[key] for key in ("lat", "lon") if key in given}, dict[str, list[str]]()
    for key in places.keys() & {"t", "speed", *ACCEL, *GYRO}:
        column = sheet.columns[places[key]]
        stated = given.get(key, given.get(key[0] if key in (*ACCEL, *GYRO) else key))
        units[key] = stated or unit_in(column) or stated_unit(column)
    for key in (*ACCEL, *GYRO):
        if not {key, key[0]} & given.keys() and unit(units[key]) not in UNIT_KEYS[key]:
            unknown.setdefault(key[0], []).append(sheet.columns[places[key]])
    if unknown:
        ask = ",".join(f"{key}={next(iter(UNIT_KEYS[key]))}" for key in unknown)
        choice = "; ".join(f"{key} is one of {', '.join(UNIT_KEYS[key])}" for key in unknown)
        columns = ", ".join(column for of_one in unknown.values() for column in of_one)
        name_them = Remedy(f"add --units {ask} ({choice})", "choose them")
        raise InputError(f"{sheet.name}: the unit is not known of {columns}", name_them)
    return units


def _find_counts(sheet: Sheet, time_ns: Nanoseconds, places: Mapping[str, int], units: dict[str, str]) -> None:
    """Replace "counts" without a number in units by counts/N. Raises InputError if the values do not show N."""
    if not any(map(_is_counts, units.values())):
        return
    force, rates = (sheet.table([places[axis] for axis in axes]) for axes in (ACCEL, GYRO))
    seconds = since_first_s(time_ns)
    accel = findings.accelerometer(force, seconds)
    likely = {"a": accel.unit, "g": findings.gyro(force, rates, accel, seconds).unit}
    for key in filter(lambda key: _is_counts(units[key]), (*ACCEL, *GYRO)):
        if not counts_per(likely[key[0]]):
            what, sizes = ("g", COUNTS_PER_G) if key[0] == "a" else ("deg/s", COUNTS_PER_DPS)
            raise InputError(
                f"{sheet.name}: nothing shows how many counts are 1 {what}: write {key[0]}=counts/N, for an MPU6050 "
                f"with N one of {', '.join(f'{size:g}' for size in sizes)}"
            )
        units[key] = ("-" if units[key].strip().startswith("-") else "") + likely[key[0]]


def _check_rates(name: str, seconds: Array, force: Array, rates: Array) -> None:
    """Raise InputError if rates do not fit the turns of gravity."""
    fit = fit_rates(seconds, force, rates)
    scale = float(np.degrees(fit.factor))
    if fit.decides and not 1.0 / _TIMES_OFF < scale < _TIMES_OFF:
        error = f"{scale:.3g} times too little" if scale > 1.0 else f"{1.0 / scale:.3g} times too far"
        raise InputError(f"{name}: in this unit the rates turn gravity {error}: check the unit of the gyro")
    if turns_too_far(seconds, force, rates):
        raise InputError(
            f"{name}: gravity keeps its direction while the rates, in this unit, turn it round: check the unit of the "
            "gyro"
        )


def _scaled(sheet: Sheet, places: Mapping[str, int], units: Mapping[str, str], axes: tuple[str, ...]) -> Array:
    """The readings of three axes in g or deg/s, shape (n, 3)."""
    scale = np.array([factor(units[axis], UNIT_KEYS[axis], axis) for axis in axes])
    return sheet.table([places[axis] for axis in axes]) * scale


def _sensor(
    sheet: Sheet,
    time_ns: Nanoseconds,
    places: Mapping[str, int],
    units: Mapping[str, str],
    quantity: str,
    values: Array,
) -> RecordedSensor:
    """Make a sensor of three columns. values: in g or deg/s, shape (n, 3)."""
    axes = ACCEL if quantity == "accelerometer" else GYRO
    turned = [units[axis].startswith("-") for axis in axes]
    sign = "turned" if all(turned) else "turned in part" if any(turned) else "as it is"
    shown = ", ".join(dict.fromkeys(units[axis].lstrip("-") for axis in axes))
    hz = rate_hz(time_ns[np.all(np.isfinite(values), axis=1)])
    taken = Taken(quantity, sheet.named([places[axis] for axis in axes]), shown, hz, sign)
    return RecordedSensor(quantity, time_ns, values, sheet.left_out, [taken])
