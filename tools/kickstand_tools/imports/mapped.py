"""Reads a table of an unknown app. Its columns are found from the values (findings.py), or named by the user."""

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..common.errors import InputError
from ..common.messages import Message, Remedy
from ..signals import Array
from . import findings
from .files import RecordingFile
from .findings import ACCEL, GYRO, OPTIONAL, REQUIRED, Findings
from .layout import FEWEST_CELLS, joined_sheet, sheet_in
from .rate_fit import fit_rates, turns_too_far
from .recording import AppRecording, RecordedSensor, Sheet, Taken, plain, rate_hz, track_of, unit_in
from .speeds import ImportPositions, ImportSpeedUnit, doubt_of_positions, unit_by_positions
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


@dataclass
class MappedTable:
    """A table of sensors of an unknown app, with its probable columns. joined: True if joined from several files."""

    name: str
    sheet: Sheet
    findings: Findings
    joined: bool = False

    @property
    def missing(self) -> list[str]:
        """The columns of REQUIRED that are not found."""
        return [key for key in REQUIRED if key not in self.findings.columns]

    def first_seconds(self, seconds: float = 10.0, points: int = 300) -> dict[str, list[float] | list[list[float]]]:
        """The first seconds of the found time (t, s), accelerometer (a) and gyro (g), reduced to `points` points, in
        the table's units. Empty without a time."""
        parts = self.findings.found
        if "t" not in parts:
            return {}
        columns = self.sheet.columns
        since = since_first_s(self.sheet.times(columns.index(parts["t"].columns[0]), parts["t"].unit.strip("?")))
        rows = np.flatnonzero(since <= seconds)
        rows = rows[:: max(1, len(rows) // points)]
        picture: dict[str, list[float] | list[list[float]]] = {"t": since[rows].round(3).tolist()}
        for key in ("a", "g"):
            if key in parts:
                values = self.sheet.table([columns.index(name) for name in parts[key].columns])[rows]
                picture[key] = np.nan_to_num(values).round(5).T.tolist()
        return picture

    @property
    def lacking(self) -> str:
        """The missing columns in words, or ""."""
        lacking = self.findings.lacking
        return f", and no {', no '.join(lacking)} found in it" if lacking else ""


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
    places = {key: _place(sheet, key, wanted) for key, wanted in columns.items()}
    _check_apart(places, columns)
    _check_units(sheet, places, units)
    stated = unit(_unit(units, ("t",), sheet.columns[places["t"]]))
    t_unit = time_unit(sheet.cells[places["t"]], stated if tick_ns(stated) else "")
    time_ns = sheet.times(places["t"], t_unit)
    if not tick_ns(stated) and why is None and rate_hz(time_ns) > findings.DOUBTED_HZ:
        raise InputError(
            f"{sheet.name}: {rate_hz(time_ns):.0f} samples per second: add the unit of t, as in --units t=min"
        )
    units = _with_counts(sheet, time_ns, places, dict(units))
    force, rates = (_scaled(sheet, places, units, axes) for axes in (ACCEL, GYRO))
    _check_rates(sheet.name, since_first_s(time_ns), force, rates)
    time = Taken("time", sheet.named([places["t"]]), t_unit)
    accel, gyro = (
        RecordedSensor(
            quantity, time_ns, values, sheet.left_out, _taken(sheet, time_ns, places, units, quantity, values)
        )
        for quantity, values in (("accelerometer", force), ("gyro", rates))
    )
    accel.taken.insert(0, time)
    lat, lon = (factor(units.get(key, "deg"), ANGLES, key) for key in ("lat", "lon"))
    speed, speed_unit, notices = _speed(sheet, time_ns, places, units, (lat, lon))
    if why is not None and "lat" in places and "lon" in places:
        north, east = sheet.numbers(places["lat"]) * lat, sheet.numbers(places["lon"]) * lon
        speed_mps = sheet.numbers(speed) * SPEEDS[speed_unit]
        doubt = doubt_of_positions(time_ns, speed_mps, north, east)
        if doubt:
            notices.append(ImportPositions(sheet.named([places.pop("lat"), places.pop("lon")]), doubt))
    track = track_of(sheet, time_ns, speed, places.get("lat"), places.get("lon"), speed_unit, (lat, lon))
    temp_c = sheet.numbers(places["temp"]) if "temp" in places else None
    utc_ns = 0 if len(time_ns) and int(np.median(time_ns)) > EPOCH_NS else None
    recording = AppRecording(NAME, accel, gyro, track, temp_c, notices, utc_ns=utc_ns, sign_known=_sign_changed(units))
    if why is not None:
        for taken, key in zip(recording.taken, ("t", "a", "g")):
            taken.why = why.found[key].why
    return recording


def table_in(files: list[RecordingFile]) -> MappedTable | None:
    """Return the table of sensors in these files, or None without one. If the tables of several files do not belong
    together, return the largest."""
    largest = max(files, key=lambda file: len(file.text))
    sheet = sheet_in(largest)
    result = None if sheet is None else findings.find(findings.completed(sheet))
    if len(files) > 1 and (result is None or result.lacking):
        joined = joined_sheet(files)
        of_all = None if joined is None else findings.find(findings.completed(joined))
        if joined and of_all and (result is None or len(of_all.lacking) < len(result.lacking)):
            return MappedTable(joined.name, joined, of_all, True)
    if sheet is None or result is None or not ({"a", "g"} & set(result.found) or len(sheet.columns) >= len(REQUIRED)):
        return None
    return MappedTable(largest.name, sheet, result)


def sheet_of(files: list[RecordingFile], name: str, columns: Mapping[str, str]) -> Sheet:
    """The table with these columns, from one file or joined from several. name: for messages. Raises InputError."""
    wanted = [column.strip() for column in columns.values() if not column.strip().startswith("#")]
    sheet = sheet_in(files[0], wanted) if len(files) == 1 else joined_sheet(files)
    sheet = sheet and findings.completed(sheet)
    if len(files) > 1 and (sheet is None or not set(wanted) <= set(sheet.columns)):
        raise InputError(f"{name} holds {len(files)} files: give --columns with one, such as {files[0].name}")
    if sheet is None:
        raise InputError(f"{name}: no table of sensors: no two lines have {FEWEST_CELLS} numbers in as many cells")
    return sheet


def read_table(table: MappedTable, units: Mapping[str, str]) -> AppRecording | None:
    """The recording of a table, or None if a column or unit is uncertain. units: units given by the user.

    Raises InputError.
    """
    result = table.findings
    uncertain = {key for key in ("t", "a", "g") if key not in result.found or not result.found[key].certain}
    if result.lacking or not uncertain <= set(units):
        return None
    return read_mapped(table.sheet, result.columns, result.units | dict(units), result)


def unknown(files: list[RecordingFile], source: str, table: MappedTable | None = None) -> InputError:
    """The error for a file of an unknown app. The error names the missing columns, the file's columns, and the command
    to type."""
    table = table or table_in(files)
    if table is None:
        shown = next((line for file in files for line in file.first_lines(1)), "")[:60]
        return InputError(
            f"{source}: not a file of an app that is known, and no table of sensors ({shown!a}): give the file, the "
            "folder or the zip that an app has exported as CSV"
        )
    several = f" (of {len(files)} files, the largest is {table.name})" if len(files) > 1 else ""
    columns, result = table.sheet.columns, table.findings
    shown = ", ".join(columns[:40]) + (", ..." if len(columns) > 40 else "")
    start = f"{source}: not a file of an app that is known{several}"
    named = not all(name.startswith("#") for name in columns)
    if "gyro" in result.lacking and not table.sheet.unread and ("a" in result.found or (named and not result.single)):
        return InputError(
            f"{start}, and no gyro found in it: without one there is no lean. Record the gyroscope as well. Its "
            f"columns are {shown}"
        )
    if result.remarks:
        return InputError(f"{start}{table.lacking}: {result.remarks[0]}")
    if result.lacking == ["time"]:
        return InputError(
            f"{start}, and no time found in it: write the time of each row, such as millis(), or switch the time "
            "stamps of the serial monitor on"
        )
    keys = [key for key in (*REQUIRED, *OPTIONAL) if key in (*REQUIRED, *result.columns)]
    typed = [f"{key}={_column_as_typed(table, key)}" for key in keys]
    units = ",".join(f"{key}={name}" for key, name in result.units.items())
    where = source if len(files) == 1 or table.joined else f"{source}/{table.name}"
    ask = "Replace each ?" if table.missing else "Correct what is wrong"
    reasons = f" ({result.reasons})" if result.reasons else ""
    return InputError(
        f"{start}{table.lacking}",
        Remedy(
            f"its columns are {shown}. {ask}{reasons}, and type: kickstand import {shlex.quote(where)} --out RIDE.csv "
            f"--columns {shlex.quote(','.join(typed))} --units {units}",
            "needed are a time, the acceleration along three axes and the rates of a gyro about them",
        ),
    )


def _column_as_typed(table: MappedTable, key: str) -> str:
    """Return the column of a key as the user types it: its name, or its number if the name would be misread. Return ?
    if the column is unknown."""
    name, columns = table.findings.columns.get(key, "?"), table.sheet.columns
    if name != "?" and (any(mark in name for mark in ",=") or columns.count(name) > 1):
        return f"#{columns.index(name) + 1}"
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


def _check_apart(places: Mapping[str, int], columns: Mapping[str, str]) -> None:
    """Raise InputError if two axes have the same column."""
    for key, place in places.items():
        other = next((k for k in places if k != key and places[k] == place), None)
        if other is not None:
            raise InputError(f"--columns: {columns[key]!a} is given for {key} and for {other}: each has its own column")


def _with_counts(
    sheet: Sheet, time_ns: Nanoseconds, places: Mapping[str, int], units: dict[str, str]
) -> dict[str, str]:
    """Replace "counts" without a number in units by counts/N. Raises InputError if the values do not show N."""
    if not any(map(_is_counts, units.values())):
        return units
    force, rates = (sheet.table([places[axis] for axis in axes]) for axes in (ACCEL, GYRO))
    seconds = since_first_s(time_ns)
    accel = findings.accelerometer(force, seconds)
    likely = {"a": accel.unit, "g": findings.gyro(force, rates, accel, seconds).unit}
    for key, text in units.items():
        if _is_counts(text):
            if not counts_per(likely[key[0]]):
                what, sizes = ("g", COUNTS_PER_G) if key[0] == "a" else ("deg/s", COUNTS_PER_DPS)
                raise InputError(
                    f"{sheet.name}: nothing shows how many counts are 1 {what}: write {key}=counts/N, for an MPU6050 "
                    f"with N one of {', '.join(f'{size:g}' for size in sizes)}"
                )
            units[key] = ("-" if text.strip().startswith("-") else "") + likely[key[0]]
    return units


def _check_rates(name: str, seconds: Array, force: Array, rates: Array) -> None:
    """Raise InputError if rates do not fit the turns of gravity: if another unit fits, or if gravity keeps its
    direction although the rates would turn it."""
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


def _speed(
    sheet: Sheet,
    time_ns: Nanoseconds,
    places: Mapping[str, int],
    units: Mapping[str, str],
    degrees: tuple[float, float],
) -> tuple[int | None, str, list[Message]]:
    """Return the number of the speed's column, its unit, and notices.

    A missing unit is found from the positions. If the positions do not show the unit, the speed is left out: the number
    is None.
    """
    place = places.get("speed")
    if place is None:
        return None, "m/s", []
    speed_unit = unit(_unit(units, ("speed",), sheet.columns[place]))
    if speed_unit not in SPEEDS:
        speed_unit = unit_by_positions(sheet, time_ns, place, places.get("lat"), places.get("lon"), degrees)
    if not speed_unit:
        return None, "m/s", [ImportSpeedUnit(sheet.columns[place])]
    return place, speed_unit, []


def _place(sheet: Sheet, key: str, wanted: str) -> int:
    wanted = wanted.strip()
    if wanted in sheet.columns:
        return sheet.columns.index(wanted)
    if re.fullmatch(r"#\d+", wanted) and 0 < int(wanted[1:]) <= len(sheet.columns):
        return int(wanted[1:]) - 1
    place = sheet.place(wanted) if plain(wanted) else None
    if place is None:
        have = ", ".join(sheet.columns[:40])
        raise InputError(f"{sheet.name}: no column {wanted!a} for {key}: its columns are {have}")
    return place


def _scaled(sheet: Sheet, places: Mapping[str, int], units: Mapping[str, str], axes: tuple[str, ...]) -> Array:
    """Return the readings of three axes in g or deg/s, shape (n, 3)."""
    names = {axis: _unit(units, (axis, axis[0]), sheet.columns[places[axis]]) for axis in axes}
    scale = np.array([factor(name, UNIT_KEYS[axis], axis) for axis, name in names.items()])
    return sheet.table([places[axis] for axis in axes]) * scale


def _taken(
    sheet: Sheet,
    time_ns: Nanoseconds,
    places: Mapping[str, int],
    units: Mapping[str, str],
    quantity: str,
    values: Array,
) -> list[Taken]:
    axes = ACCEL if quantity == "accelerometer" else GYRO
    names = [_unit(units, (axis, axis[0]), sheet.columns[places[axis]]) for axis in axes]
    turned = [name.startswith("-") for name in names]
    sign = "turned" if all(turned) else "turned in part" if any(turned) else "as it is"
    shown = ", ".join(dict.fromkeys(text.lstrip("-") for text in names))
    hz = rate_hz(time_ns[np.all(np.isfinite(values), axis=1)])
    return [Taken(quantity, sheet.named([places[axis] for axis in axes]), shown, hz, sign)]


def _check_units(sheet: Sheet, places: Mapping[str, int], units: Mapping[str, str]) -> None:
    """Raise InputError if the unit of a column is neither given nor in its name. The error names all such columns."""
    unknown: dict[str, list[str]] = {}
    for key in (*ACCEL, *GYRO):
        column = sheet.columns[places[key]]
        if key not in units and key[0] not in units and unit(_unit({}, (), column)) not in UNIT_KEYS[key]:
            unknown.setdefault(key[0], []).append(column)
    if unknown:
        ask = ",".join(f"{key}={next(iter(UNIT_KEYS[key]))}" for key in unknown)
        choice = "; ".join(f"{key} is one of {', '.join(UNIT_KEYS[key])}" for key in unknown)
        columns = ", ".join(column for of_one in unknown.values() for column in of_one)
        name_them = Remedy(f"add --units {ask} ({choice})", "choose them")
        raise InputError(f"{sheet.name}: the unit is not known of {columns}", name_them)


def _unit(units: Mapping[str, str], keys: tuple[str, ...], column: str) -> str:
    """The unit given for one of the keys, otherwise the unit in the column's name, in brackets or at its end."""
    return next((units[key] for key in keys if key in units), unit_in(column) or findings.stated_unit(column))


def _sign_changed(units: Mapping[str, str]) -> bool:
    """True if the user has asked for a change of sign. The sign is then not checked."""
    return any(units.get(key, "").startswith("-") for key in ("a", *ACCEL))
