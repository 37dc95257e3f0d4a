"""Checks the cells of a CSV log, and finds the line of a mistake."""

import csv
import math
from pathlib import Path

import numpy as np

from ..common.messages import InputError, Remedy
from ..signals import Array
from .csv_reader import cells_of, number_of

COLUMNS = ("t_s", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps")
# Columns from a satellite receiver. Only some rows have values, because the receiver is slower than the sensor.
TRACK = ("speed_mps", "lat_deg", "lon_deg", "utc_s")
OPTIONAL = (*TRACK, "temp_c")  # columns that may be missing or have empty cells

# The sensor's widest ranges are 16 g and 2000 deg/s. Values over these limits are in another unit (m/s2, counts).
MOST_G, MOST_DPS = 20.0, 2500.0
_LIMITS = {"t_s": 1e10, "ax_g": MOST_G, "ay_g": MOST_G, "az_g": MOST_G, "temp_c": 200.0, "speed_mps": 200.0}
_LIMITS |= {"gx_dps": MOST_DPS, "gy_dps": MOST_DPS, "gz_dps": MOST_DPS}
_LIMITS |= {"lat_deg": 90.0, "lon_deg": 180.0, "utc_s": 1e10}
_UNITS = {"t_s": "seconds", "temp_c": "degrees Celsius", "speed_mps": "m/s"}
_UNITS |= {"ax_g": "g", "ay_g": "g", "az_g": "g", "gx_dps": "deg/s", "gy_dps": "deg/s", "gz_dps": "deg/s"}
_UNITS |= {"lat_deg": "degrees", "lon_deg": "degrees", "utc_s": "seconds since 1970"}


_AS_EXPORTED = "give it as the app has exported it"


def check_text(log: str, content: bytes, lines_before: int) -> None:
    """Raise InputError if the bytes are not UTF-8. log: the log's name in messages."""
    try:
        content.decode()
    except UnicodeDecodeError as error:
        line = lines_before + content.count(b"\n", 0, error.start) + 1
        if content.startswith(b"PK\x03\x04"):
            import_it = Remedy("if an app has exported it, kickstand import makes a log of it", _AS_EXPORTED)
            raise InputError(f"{log} is a zip", import_it) from None
        raise InputError(f"{log}, line {line}: not text: give a log as CSV or as .csv.gz") from error


def header(log: str, line: str) -> list[str]:
    """The names of the columns. Raises InputError if one is missing or present twice."""
    try:
        names = [name.strip() for name in cells_of(line)]
    except csv.Error as error:
        raise InputError(f"{log}, line 1: not CSV ({error}): is it a log?") from error
    missing = [name for name in COLUMNS if name not in names]
    if missing and log.lower().endswith((".gpx", ".fit")):
        raise InputError(f"{log} is a track: kickstand join adds it to a ride")
    if missing and log.lower().endswith(".json"):
        raise InputError(f"{log} is not a log: give the ride, and a calibration with --calibration")
    if missing and "lean_deg" in names:
        what = f"{log} contains a lean but no readings"
        raise InputError(f"{what}: give the log that it was made from{_made_from(log)}")
    if missing and any(mark in "".join(names) for mark in ";\t"):
        raise InputError(f"{log}, line 1: values are separated by ; or tab: save it with commas between them")
    if missing:
        raise InputError(
            f"{log}, line 1: no column {', '.join(missing)}, and a log starts with {','.join(COLUMNS)}",
            Remedy("an app's export has to go through kickstand import first", _AS_EXPORTED),
        )
    for name in COLUMNS + OPTIONAL:
        if names.count(name) > 1:
            raise InputError(f"{log}, line 1: column {name} exists twice: remove one")
    return names


def _made_from(log: str) -> str:
    """Return ", RIDE.csv" if the log's folder has exactly one other ride with a calibration, otherwise ""."""
    rides = [
        path.with_name(path.name.removesuffix(".cal.json") + ending)
        for path in Path(log).parent.glob("*.cal.json")
        for ending in (".csv", ".csv.gz")
    ]
    logs = [path for path in rides if path.is_file() and path != Path(log)]
    return f", {logs[0]}" if len(logs) == 1 else ""


def plausible(table: Array, names: list[str], before_us: int | None) -> bool:
    """Return True if read() would accept these values.

    table: one column per name, NaN for an empty cell, shape (n, number of names).
    before_us: time of the previous sample, None for the first.
    """
    for k, name in enumerate(names):
        within = np.abs(table[:, k]) <= _LIMITS[name]
        if not np.all(within | np.isnan(table[:, k]) if name in OPTIONAL else within):
            return False
    time_us = np.rint(table[:, 0] * 1e6)
    return bool(np.all(np.diff(time_us) >= 0) and (before_us is None or time_us[0] >= before_us))


def read(log: str, text: str, width: int, places: dict[str, int], lines_before: int, before_us: int | None) -> Array:
    """Convert the text of n rows to numbers. An empty cell in an optional column becomes NaN.

    Args:
        log: the log's name in messages.
        width: number of cells per row.
        places: index of each column in a row, by its name.
        lines_before: number of lines before the text.
        before_us: time of the previous sample, None for the first.

    Returns the columns in the order of places, shape (n, number of places). Raises InputError for the first mistake
    and names its line.
    """
    columns = [(index, name, _LIMITS[name]) for name, index in places.items()]
    values = []
    for number, line in enumerate(text.split("\n"), lines_before + 1):
        if not line.strip():
            continue  # the text often ends in a line feed
        try:
            cells = cells_of(line)
            if len(cells) != width:
                raise _Mistake(f"{len(cells)} values under {width} column names: is the line cut?")
            value = [_number(cells[index], name, limit) for index, name, limit in columns]
            now = round(value[0] * 1e6)
            if before_us is not None and now < before_us:
                text_s = cells[places["t_s"]].strip()
                raise _Mistake(f"time goes back from {before_us / 1e6:.6f} at {text_s} s: it must increase")
        except csv.Error as error:
            raise InputError(f"{log}, line {number}: not CSV ({error}): is it a log?") from error
        except _Mistake as mistake:
            raise InputError(f"{log}, line {number}: {mistake}") from None
        before_us = now
        values.append(value)
    return np.reshape(np.array(values, dtype=float), (-1, len(places)))


class _Mistake(Exception):
    """A mistake in a row, with a text for the user."""


def _number(cell: str, name: str, limit: float) -> float:
    """The value of a cell; NaN for an empty cell in a column of OPTIONAL. Raises _Mistake."""
    value = number_of(cell)
    if value is not None and abs(value) <= limit:
        return value
    if name in OPTIONAL and not cell.strip():
        return math.nan
    if value is None:
        raise _Mistake(f"{name} is {_shown(cell)}, not a number")
    if not math.isfinite(value):
        raise _Mistake(f"{name} is {_shown(cell)}: a number is needed")
    raise _Mistake(f"{name} is {_shown(cell)}, past any reading: its unit is {_UNITS[name]}")


def _shown(cell: str) -> str:
    text = cell.strip()
    return ascii(text if len(text) <= 20 else text[:20] + "...") if text else "empty"
