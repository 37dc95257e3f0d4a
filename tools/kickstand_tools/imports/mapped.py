"""Reads any other table: its columns are named by the user, or guessed for the command line that is suggested."""

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..errors import InputError
from .files import RecordingFile
from .recording import Recording, Sensor, Sheet, Taken, names_in, plain, rate_hz, read_sheet, track_of, unit_in
from .units import ACCELERATIONS, ANGLES, EPOCH_NS, RATES, SPEEDS, TIMES, Nanoseconds, factor, time_unit, unit

NAME = "a table"
ACCEL, GYRO = ("ax", "ay", "az"), ("gx", "gy", "gz")
REQUIRED = ("t", *ACCEL, *GYRO)
OPTIONAL = ("speed", "lat", "lon", "temp")
WORDS = {"t": "time"} | {f"a{axis}": f"acceleration along {axis}" for axis in "xyz"}
WORDS |= {f"g{axis}": f"rate about {axis}" for axis in "xyz"}
WORDS |= {"speed": "speed", "lat": "latitude", "lon": "longitude", "temp": "temperature"}
UNIT_KEYS = {"t": TIMES, "a": ACCELERATIONS, "g": RATES, "speed": SPEEDS, "lat": ANGLES, "lon": ANGLES}
UNIT_KEYS |= dict.fromkeys(ACCEL, ACCELERATIONS) | dict.fromkeys(GYRO, RATES)
_AXIS = r"(?:^|[^a-z]){0}(?:$|[^a-z])|{0}$"
_ACCEL_NAME = re.compile(r"acc|gforce|^a_?[xyz]\b")
_GYRO_NAME = re.compile(r"gyr|rotation|omega|angular|^[gw]_?[xyz]\b")
_UNIT_END = re.compile(r"_(g|mps2|ms2|dps|rads?|rps)$")
_NUMBER = re.compile(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?")
# Nine tenths of a ride's readings are below these: 4 g, and 172 deg/s in rad/s
_FORCES = {"g": 4.0, "m/s2": 4.0 * STANDARD_GRAVITY, "mg": np.inf}
_TURNS = {"rad/s": 3.0, "deg/s": 500.0, "mdeg/s": np.inf}
_HEADER_LINES = 60  # number of lines in which the line of names is searched
FEWEST_NUMBERS = 4  # least numbers in a row, a time and three axes: text with commas in it has none


def read_mapped(file: RecordingFile, columns: Mapping[str, str], units: Mapping[str, str]) -> Recording:
    """A table with the columns named for t, ax to az, gx to gz and, as there are, speed, lat, lon and temp.

    columns: by these, the name of each in the file, or #1, #2 ... for its number. units: of t, a (all of ax to az) or
    ax, ay, az, g (of gx to gz) or gx, gy, gz, speed, lat, lon; a - before one turns the sign. A unit that is not given
    is the one in brackets in the column's name. Raises InputError.
    """
    _check_keys(columns, units)
    sheet = read_sheet(file, header_line(file, columns))
    places = {key: _place(sheet, key, wanted) for key, wanted in columns.items()}
    for key, place in places.items():
        if same := [other for other in places if other != key and places[other] == place]:
            raise InputError(f"{key} and {same[0]} are both column {sheet.columns[place]}: give each its own column")
    _check_units(sheet, places, units)
    t_unit = units.get("t") or unit_in(sheet.columns[places["t"]])
    t_unit = time_unit(sheet.cells[places["t"]], t_unit if unit(t_unit) in TIMES else "")
    time_ns = sheet.times(places["t"], t_unit)
    accel = _sensor(sheet, time_ns, places, units, "accelerometer")
    accel.taken.insert(0, Taken("time", sheet.named([places["t"]]), t_unit))
    gyro = _sensor(sheet, time_ns, places, units, "gyro")
    lat, lon = (factor(units.get(key, "deg"), ANGLES, key) for key in ("lat", "lon"))
    speed_unit = "m/s"
    if "speed" in places:
        speed_unit = unit(_unit(units, ("speed",), sheet.columns[places["speed"]]))
    track = track_of(sheet, time_ns, places.get("speed"), places.get("lat"), places.get("lon"), speed_unit, (lat, lon))
    temp_c = sheet.numbers(places["temp"]) if "temp" in places else None
    utc_ns = 0 if len(time_ns) and int(np.median(time_ns)) > EPOCH_NS else None
    return Recording(NAME, accel, gyro, track, temp_c, utc_ns=utc_ns, sign_known=_turned(units))


@dataclass
class Table:
    """A table of sensors of an unknown app. columns: their names in it; found: the columns that seem to be those of
    REQUIRED and OPTIONAL; units: their probable units, by UNIT_KEYS."""

    name: str
    columns: list[str]
    found: dict[str, str]
    units: dict[str, str]

    @property
    def missing(self) -> list[str]:
        """The columns of REQUIRED that are not found."""
        return [key for key in REQUIRED if key not in self.found]

    @property
    def lacking(self) -> str:
        """The missing columns in words, "" for none."""
        missing = self.missing
        lacking = ["time"] if "t" in missing else []
        lacking += [word for word, axes in (("acceleration", ACCEL), ("gyro", GYRO)) if set(axes) & set(missing)]
        return f", and no {', '.join(lacking)} found in it" if lacking else ""


def table_in(files: list[RecordingFile]) -> Table | None:
    """The largest of these files, None where that is no table of sensors."""
    file = max(files, key=lambda file: len(file.text))
    number = header_line(file, {})
    lines = [line for line in file.text.split("\n", _HEADER_LINES + 3)[number:] if line.strip()]
    columns = names_in(lines[0])
    found = guessed(columns)
    numbers = max((_numbers(names_in(line)) for line in lines[1:3]), default=0)
    if numbers < (FEWEST_NUMBERS if found else len(REQUIRED)):
        return None
    units = {
        "a": _seems_in(found.get("ax", ""), ACCELERATIONS, _by_size(file, number, found, ACCEL, _FORCES) or "m/s2")
    }
    units["g"] = _seems_in(found.get("gx", ""), RATES, _by_size(file, number, found, GYRO, _TURNS) or "rad/s")
    if "speed" in found:
        units["speed"] = _seems_in(found["speed"], SPEEDS, "km/h")
    return Table(file.name, columns, found, units)


def _seems_in(column: str, kinds: Mapping[str, float], usual: str) -> str:
    """The unit, one of kinds, in brackets or behind the last _ of a column's name, else `usual`."""
    stated = (unit(unit_in(column)), unit(column.rpartition("_")[2]))
    return next((name for name in stated if name in kinds), usual)


def _by_size(
    file: RecordingFile, header: int, found: Mapping[str, str], axes: tuple[str, ...], limits: Mapping[str, float]
) -> str:
    """The unit in which nine tenths of the readings of three axes are below its limit, "" where an axis is missing."""
    if not set(axes) <= set(found):
        return ""
    try:
        sheet = read_sheet(file, header)
        with np.errstate(over="ignore"):
            sizes = np.sqrt(sum(sheet.numbers(sheet.columns.index(found[axis])) ** 2 for axis in axes))
    except (InputError, ValueError):
        return ""
    sizes = sizes[np.isfinite(sizes)]
    most = float(np.percentile(sizes, 90.0)) if len(sizes) else np.nan
    return next((name for name, limit in limits.items() if most < limit), "")


def unknown(files: list[RecordingFile], source: str) -> InputError:
    """The error for a file of an unknown app: missing columns, its columns, and the command line to type."""
    table = table_in(files)
    if table is None:
        shown = next((line for file in files for line in file.first_lines(1)), "")[:60]
        return InputError(
            f"{source}: not a file of an app that is known, and no table of sensors ({shown!a}): give the file, the "
            "folder or the zip that an app has exported as CSV"
        )
    several = f" (of {len(files)} files, the largest is {table.name})" if len(files) > 1 else ""
    shown = ", ".join(table.columns[:40]) + (", ..." if len(table.columns) > 40 else "")
    given = [f"{key}={table.found.get(key, '?')}" for key in REQUIRED]
    given += [f"{key}={table.found[key]}" for key in OPTIONAL if key in table.found]
    units = ",".join(f"{key}={name}" for key, name in table.units.items())
    where = source if len(files) == 1 else f"{source}/{table.name}"
    ask = "Put in what the ? stand for" if table.missing else "Put in what is not right"
    return InputError(
        f"{source}: not a file of an app that is known{several}{table.lacking}",
        "name_columns",
        f"its columns are {shown}. {ask}, and type: kickstand import {shlex.quote(where)} --out RIDE.csv "
        f"--columns {shlex.quote(','.join(given))} --units {units}",
    )


def header_line(file: RecordingFile, columns: Mapping[str, str]) -> int:
    """Number of the line of names: the first that holds all that are asked for, else the widest before the numbers."""
    wanted = {name.strip() for name in columns.values() if not name.strip().startswith("#")}
    widest, width = 0, 0
    for number, line in enumerate(file.text.split("\n", _HEADER_LINES)[:_HEADER_LINES]):
        cells = names_in(line)
        if wanted and wanted <= set(cells):
            return number
        numbers = _numbers(cells)
        if len(cells) > width and numbers < len(cells) / 2:
            widest, width = number, len(cells)
    return widest


def _numbers(cells: list[str]) -> int:
    return sum(bool(_NUMBER.fullmatch(cell)) for cell in cells)


def guessed(columns: list[str]) -> dict[str, str]:
    """The columns that seem to be those of REQUIRED and OPTIONAL, by these."""
    found: dict[str, str] = {}
    for column in columns:
        low, bare = _UNIT_END.sub("", column.lower()), plain(column)
        if any(mark in column for mark in ",="):
            continue
        sensor = "g" if _GYRO_NAME.search(low) else "a" if _ACCEL_NAME.search(low) else ""
        axis = next((axis for axis in "xyz" if re.search(_AXIS.format(axis), re.sub(r"[(\[].*", "", low).strip())), "")
        if sensor and axis:
            found.setdefault(sensor + axis, column)
        elif re.search(r"time|milli|micro|^(t|ts|ms|us|ns|s|sec|seconds)$|epoch|utc|clock", bare):
            found.setdefault("t", column)
        elif re.search(r"speed|velocity|kmh|kph", bare) and "accuracy" not in bare:
            found.setdefault("speed", column)
        elif bare.startswith("lat") and "acc" not in bare:
            found.setdefault("lat", column)
        elif bare.startswith("lon") and "acc" not in bare:
            found.setdefault("lon", column)
    return found


def _check_keys(columns: Mapping[str, str], units: Mapping[str, str]) -> None:
    strange = [key for key in columns if key not in (*REQUIRED, *OPTIONAL)]
    if strange:
        raise InputError(f"--columns: {strange[0]!a} is not one of {', '.join((*REQUIRED, *OPTIONAL))}")
    missing = [key for key in REQUIRED if key not in columns]
    if missing:
        raise InputError(f"--columns: {', '.join(missing)} is missing: three axes of both sensors are needed, and t")
    strange = [key for key in units if key not in UNIT_KEYS]
    if strange:
        raise InputError(f"--units: {strange[0]!a} is not one of {', '.join(UNIT_KEYS)}")
    for key, text in units.items():
        factor(text, UNIT_KEYS[key], key)  # raises for another unit


def _place(sheet: Sheet, key: str, wanted: str) -> int:
    wanted = wanted.strip()
    if re.fullmatch(r"#\d+", wanted) and 0 < int(wanted[1:]) <= len(sheet.columns):
        return int(wanted[1:]) - 1
    if wanted in sheet.columns:
        return sheet.columns.index(wanted)
    place = sheet.place(wanted) if plain(wanted) else None
    if place is None:
        have = ", ".join(sheet.columns[:40])
        raise InputError(f"{sheet.name}: no column {wanted!a} for {key}: its columns are {have}")
    return place


def _sensor(
    sheet: Sheet, time_ns: Nanoseconds, places: dict[str, int], units: Mapping[str, str], quantity: str
) -> Sensor:
    axes, all_of, kinds = (ACCEL, "a", ACCELERATIONS) if quantity == "accelerometer" else (GYRO, "g", RATES)
    names = [_unit(units, (axis, all_of), sheet.columns[places[axis]]) for axis in axes]
    scale = np.array([factor(text, kinds, axis) for text, axis in zip(names, axes)])
    values = sheet.table([places[axis] for axis in axes]) * scale
    source = sheet.named([places[axis] for axis in axes])
    sign = "as it is" if np.all(scale > 0.0) else "turned" if np.all(scale < 0.0) else "turned in part"
    shown = ", ".join(dict.fromkeys(text.lstrip("-") for text in names))
    return Sensor(quantity, time_ns, values, sheet.left_out, [Taken(quantity, source, shown, rate_hz(time_ns), sign)])


def _check_units(sheet: Sheet, places: Mapping[str, int], units: Mapping[str, str]) -> None:
    """Raise InputError naming every column whose unit is neither given nor in brackets in its name."""
    unknown: dict[str, list[str]] = {}
    for key in (*ACCEL, *GYRO, "speed"):
        if key in places:
            column, all_of = sheet.columns[places[key]], key if key == "speed" else key[0]
            if key not in units and all_of not in units and unit(unit_in(column)) not in UNIT_KEYS[key]:
                unknown.setdefault(all_of, []).append(column)
    if unknown:
        ask = ",".join(f"{key}={next(iter(UNIT_KEYS[key]))}" for key in unknown)
        choice = "; ".join(f"{key} is one of {', '.join(UNIT_KEYS[key])}" for key in unknown)
        columns = ", ".join(column for of_one in unknown.values() for column in of_one)
        raise InputError(f"{sheet.name}: the unit is not known of {columns}", "name_units", ask, choice)


def _unit(units: Mapping[str, str], keys: tuple[str, ...], column: str) -> str:
    """The unit that is given for one of the keys, else the one in brackets in the column's name."""
    return next((units[key] for key in keys if key in units), unit_in(column))


def _turned(units: Mapping[str, str]) -> bool:
    """True if the user has asked for a change of sign, which is then not judged."""
    return any(units.get(key, "").startswith("-") for key in ("a", *ACCEL))
