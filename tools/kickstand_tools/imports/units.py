"""Converts the units of apps to those of a log (g, deg/s, m/s, degrees), and times to nanoseconds. Times may be dates,
clocks, or numbers since any start or since 1970."""

import functools
import math
import re
from datetime import date
from typing import Any

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..common.messages import InputError
from ..logs.csv_text import Cells, as_text, filled, numbers_of
from ..signals import Array, Ints

ACCELERATIONS = {"g": 1.0, "m/s2": 1.0 / STANDARD_GRAVITY, "mg": 1e-3}
RATES = {"deg/s": 1.0, "rad/s": math.degrees(1.0), "mdeg/s": 1e-3, "mrad/s": math.degrees(1e-3)}
# Units that are used only if a name or the user states them
RARE_ACCELERATIONS = {"cm/s2": 0.01 / STANDARD_GRAVITY, "ft/s2": 0.3048 / STANDARD_GRAVITY}
RARE_RATES = {"rpm": 6.0, "rev/s": 360.0, "deg/h": 1.0 / 3600.0, "deg/min": 1.0 / 60.0}
SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704, "knots": 1852.0 / 3600.0}
TIMES = {"s": 10**9, "ms": 10**6, "us": 1000, "ns": 1, "min": 60 * 10**9, "h": 3600 * 10**9}  # in ns
TIMES |= {"d": 86400 * 10**9, "ticks": 100}  # ticks of Windows and .NET
ANGLES = {"deg": 1.0, "min": 1.0 / 60.0}
# Counts (LSB) per g and per deg/s of an MPU6050 at its ranges: register map, registers 0x3B to 0x48
COUNTS_PER_G = (16384.0, 8192.0, 4096.0, 2048.0)
COUNTS_PER_DPS = (131.0, 65.5, 32.8, 16.4)
_SPELLINGS = {
    "m/s2": "\u043c/\u04412 m/s/s m/sec2 mps2 ms2",
    "cm/s2": "gal cm/s/s",
    "ft/s2": "ft/s/s fps2",
    "rpm": "r/min rev/min u/min",
    "rev/s": "r/s rps",
    "deg/h": "°/h deg/hr dph",
    "g": "gs",
    "deg/s": "°/\u0441 dps °/s deg/sec degrees/s",
    "mdeg/s": "mdps",
    "mrad/s": "mrads mrps",
    "rad/s": "\u0440\u0430\u0434/\u0441 radians/s rad/sec rads",
    "km/h": "kmh kph km/hr",
    "m/s": "mps",
    "mph": "mi/h",
    "knots": "knot kn kt kts",
    "s": "sec secs second seconds",
    "ms": "msec msecs millis milliseconds",
    "us": "µs μs usec usecs micros microseconds",
    "ns": "nsec nsecs nanos nanoseconds",
    "deg": "° degrees",
    "min": "minutes minute mins",
    "h": "hours hour hrs hr",
    "d": "days day",
    "ticks": "100ns tick",
    "counts": "count lsb raw",
}
_SAME = {other: name for name, others in _SPELLINGS.items() for other in others.split()}
Nanoseconds = Ints

NO_TIME = np.iinfo(np.int64).min  # value for a cell without a time
REPEATED = NO_TIME + 1  # value for a row that repeats the sample of an earlier row
DATES = "date or clock"
EPOCH_NS = 10**17  # March 1973; a larger time counts from 1970
DAY_NS = 86400 * 10**9
_LATEST_NS = 4.0e18  # the year 2096; twice this value still fits into 64 bits
_WRAPS = 2**32, 2**16  # micros() of a microcontroller restarts from 0 after 71.6 minutes, millis() after 49.7 days
# 1970 in the units of other calendars, and the least time for which this is likely: ticks since the year 1 and since
# 1601, days since 1900 (spreadsheets), seconds since 1904 (LabVIEW)
_TICKS = (621_355_968 * 10**9, 116_444_736 * 10**9)
_CALENDARS = [("ticks", zero, zero) for zero in _TICKS] + [("d", 25_569, 25_569), ("s", 3 * 10**9, 2_082_844_800)]
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
# A date in any order, a clock of 12 or 24 hours, and a zone. Date, hours and zone may be missing.
_HALF = r"([AaPp])\.?[Mm]\.?"
MOMENT = re.compile(
    r"\s*(?:(\d{1,4}|[A-Za-z]{3,9})[-/. ]+(\d{1,2}|[A-Za-z]{3,9})[-/., ]+(\d{1,4})[-T_ ,]+)?"
    rf"(?:{_HALF}\s*)?(?:(\d{{1,3}})([:.]))?(\d{{1,2}})(?(6)\6|:)(\d{{1,2}})(?:[.,:](\d+))?\s*(?:{_HALF})?"
    r"\s*(Z|UTC|GMT|[+-]\d\d:?\d\d)?\s*"
)
_MORNING, _AFTERNOON = "上午|午前|오전", "下午|午後|오후"
TIME_NAME = re.compile(
    r"time|milli|micro|^(t|ts|ms|us|ns|s|sec|secs|seconds|elapsed\w*)$|epoch|utc|clock|stamp|^monitors$"
)
_COMPACT = re.compile(r"^\s*(\d{4})(\d\d)(\d\d)[T_ -]?(\d\d)(\d\d)(\d\d)\.?(\d*)")
_MULTIPLE = re.compile(r"(\d*\.?\d+(?:e-?\d+)?)([a-z]+)")  # 10ms, 1e-05s
_COUNTS = re.compile(r"(?:counts?|lsb|raw)/(\d+(?:\.\d+)?)")


def unit(text: str) -> str:
    """A unit in the spelling of the tables above: "m/s^2" becomes "m/s2". Other units are unchanged."""
    short = re.sub(r"[\s^*·()]", "", text.strip().lower()).replace("²", "2").replace("s-2", "/s2").replace("//", "/")
    return _SAME.get(short, short)


def tick_ns(text: str) -> float:
    """The ns in a unit of time, which may be a multiple of another unit, such as 10ms; 0 for another unit."""
    name = unit(text)
    match = _MULTIPLE.fullmatch(name)
    return TIMES.get(name) or (float(match[1]) * TIMES.get(unit(match[2]), 0) if match else 0)


def factor(text: str, kinds: dict[str, float], where: str) -> float:
    """The factor for a value in a unit; a - before the unit changes the sign. Raises InputError for an unknown unit.

    A unit of accelerations or rates may be counts/N: N counts per g or per deg/s.

    >>> factor("-m/s^2", {"g": 1.0, "m/s2": 0.102}, "ax")
    -0.102
    >>> factor("counts/16384", {"g": 1.0}, "ax") * 16384
    1.0
    """
    sign, bare = (-1.0, text.strip()[1:]) if text.strip().startswith("-") else (1.0, text)
    name = unit(bare)
    rare = RARE_ACCELERATIONS if "g" in kinds else RARE_RATES if "deg/s" in kinds else {}
    scale = kinds.get(name) or rare.get(name) or (tick_ns(name) if "ticks" in kinds else 0.0)
    if scale:
        return sign * scale
    if counts_per(name) and ("g" in kinds or "deg/s" in kinds):
        return sign / counts_per(name)
    raise InputError(f"{where}: unit {text!a} is not known: write one of {', '.join(kinds)}")


def counts_per(text: str) -> float:
    """The number N of the unit counts/N; 0 for another unit."""
    match = _COUNTS.fullmatch(text.strip().lower().lstrip("-"))
    return float(match[1]) if match and float(match[1]) > 0.0 else 0.0


def times_ns(cells: Cells, unit_name: str = "", where: str = "the recording") -> Nanoseconds:
    """Return the times of cells in ns, shape (n), NO_TIME for a cell without a time.

    unit_name: unit of numbers, or "" to find it from their size and steps. where: name of the times in messages.
    Raises InputError if few cells are times.
    """
    if not _are_dates(cells, unit_name):
        return _set_once(_of_numbers(numbers_of(cells), unit_name, where))
    moments = [moment_of(text) for text in as_text(cells)]
    if sum(moment is not None for moment in moments) <= np.count_nonzero(filled(cells)) // 2:
        sample = ascii(str(cells[0])[:30]) if len(cells) else "empty"
        raise InputError(f"{where}: {sample} is no time: numbers, or dates such as 2024-05-17T09:30:00.25Z, are needed")
    dated = any(moment is not None and moment[1] for moment in moments)
    ns = [NO_TIME if moment is None or moment[1] is not dated else moment[0] for moment in moments]
    return _set_once(np.array(ns, dtype=np.int64)) if dated else _after_midnight(np.array(ns, dtype=np.int64))


def time_unit(cells: Cells, stated: str = "") -> str:
    """Return the stated unit of times, or the one that their size and steps show. It is DATES for dates and clocks."""
    if _are_dates(cells, stated) or (not stated and _is_of_day(numbers_of(cells).astype(float))):
        return DATES
    return unit(stated) if stated else _likely_unit(numbers_of(cells).astype(float))


def _are_dates(cells: Cells, stated: str) -> bool:
    """True for texts, and for numbers of the form YYYYMMDDHHMMSS, which may end in milliseconds."""
    numbers = numbers_of(cells)
    valid = numbers[np.isfinite(numbers)]
    if len(valid) <= np.count_nonzero(filled(cells)) // 2:
        return True
    if stated not in ("", DATES) or not 1.97e13 < float(valid[0]) < 2.1e16:
        return False
    seconds = valid // (1 if valid[0] < 2.1e13 else 1000)
    fields = [seconds // 10**power % 100 for power in (8, 6, 4, 2, 0)]
    limits = ((1, 12), (1, 31), (0, 23), (0, 59), (0, 59))
    return bool(all(np.all((low <= field) & (field <= high)) for field, (low, high) in zip(fields, limits)))


def moment_of(text: str) -> tuple[int, bool] | None:
    """Return ns since 1970 and True for a date and a clock, ns since midnight and False for a clock, otherwise None.

    A date without a zone is in UTC.
    """
    if not text.isascii():
        text = re.sub(_AFTERNOON, "PM ", re.sub(_MORNING, "AM ", text))
    match = MOMENT.fullmatch(_COMPACT.sub(r"\1-\2-\3T\4:\5:\6.\g<7>0", text))
    if match is None:
        return None
    first, month, last, half_before, hours, _, minutes, seconds, fraction, half_after, zone = match.groups()
    half = half_before or half_after
    hours = int(hours or 0) % 12 + 12 * (half in "Pp") if half else int(hours or 0)
    ns = (3600 * hours + 60 * int(minutes) + int(seconds)) * 10**9 + int((fraction or "0").ljust(9, "0")[:9])
    if first is None:
        return ns, False
    days = _days(first, month, last, bool(half))
    if days is None:
        return None
    ahead = zone.replace(":", "") if zone and zone[0] in "+-" else "+0000"
    return ns + days * DAY_NS - TIMES["h"] * int(ahead[:3]) - TIMES["min"] * int(ahead[0] + ahead[3:]), True


@functools.lru_cache
def _days(first: str, month: str, last: str, month_first: bool) -> int | None:
    """The number of days from 1970 to a date; None for an impossible date, and after the year 2200."""
    if first.isalpha() or (len(first) < 3 and month.isdigit() and (int(month) > 12 or month_first)):
        first, month = month, first
    if month.isalpha():
        month = str((*_MONTHS, month[:3].lower()).index(month[:3].lower()) + 1)
    year, day = (first, last) if len(first) > 2 else (last, first)
    try:
        days = (date(int(year) + 2000 * (len(year) < 3), int(month), int(day)) - date(1970, 1, 1)).days
    except ValueError:
        return None
    return days if abs(days) < 2.0 * _LATEST_NS / DAY_NS else None


def _set_once(ns: Nanoseconds) -> Nanoseconds:
    """If a clock was set by over a day, let the earlier times end one second before the later times begin."""
    row = np.flatnonzero(ns > REPEATED)
    steps = np.diff(ns[row])
    jumps = np.flatnonzero(np.abs(steps.astype(float)) > DAY_NS)
    if len(jumps) == 1 and 1 < jumps[0] < len(steps) - 2:
        ns[row[: jumps[0] + 1]] += steps[jumps[0]] - 10**9
    return ns


def of_seconds(seconds: Array) -> Nanoseconds:
    """Convert seconds to ns, shape (n), NO_TIME for a value that is not a number."""
    return _scaled(seconds, TIMES["s"])


def since_first_s(time_ns: Nanoseconds) -> Array:
    """Return the seconds since the first time, shape (n), NaN for a missing time."""
    valid = time_ns > REPEATED
    return np.where(valid, (time_ns - (time_ns[valid][0] if np.any(valid) else 0)) * 1e-9, np.nan)


def of_day(clock: Array) -> Nanoseconds:
    """Return times of day in ns. clock: numbers of the form HHMMSS.SS, shape (n). After midnight a day is added."""
    floor = np.floor(clock)
    seconds = floor // 10000 * 3600.0 + floor // 100 % 100 * 60.0 + floor % 100 + (clock - floor)
    return _after_midnight(of_seconds(seconds))


def _is_of_day(values: Array) -> bool:
    """True for numbers of the form HHMMSS.SS: no minute and no second is over 59, and a minute ends."""
    valid = values[np.isfinite(values)]
    fields = bool(np.all((valid >= 0.0) & (valid < 240_000.0) & (valid % 100 < 60.0) & (valid // 100 % 100 < 60.0)))
    return fields and bool(np.any(np.diff(valid) >= 40.0) and np.median(np.diff(valid)) < 2.0)


def _after_midnight(ns: Nanoseconds) -> Nanoseconds:
    """Add a day after midnight, or half a day to a clock of 12 hours without AM and PM."""
    valid = ns != NO_TIME
    steps = np.diff(ns[valid], prepend=ns[valid][:1])
    half = np.abs(steps + DAY_NS // 2) < TIMES["min"]
    ns[valid] += np.cumsum(np.where(half, DAY_NS // 2, np.where(steps < -DAY_NS // 2, DAY_NS, 0)))
    return ns


def _of_numbers(values: NDArray[Any], unit_name: str, where: str) -> Nanoseconds:
    """Convert numbers to times. unit_name: "" to find the unit. where: for messages. Raises InputError."""
    if unit_name in ("", DATES) and _is_of_day(values.astype(float)):
        return of_day(values.astype(float))
    name = unit(unit_name) if unit_name else _likely_unit(values.astype(float))
    scale = tick_ns(name)
    if not scale:
        raise InputError(f"{where}: unit {unit_name!a} is not known: write one of {', '.join(TIMES)}")
    values = unwrapped(values)
    middle = float(np.median(values[np.isfinite(values)])) if np.any(np.isfinite(values)) else 0.0
    values = values - next((zero for of, least, zero in _CALENDARS if of == name and middle > least), 0)
    if np.abs(middle) >= _LATEST_NS / scale and name != "ticks":  # since an unknown year
        values = values - np.nanmin(values)
    if values.dtype.kind in "iu" and scale == int(scale):
        valid = np.abs(values.astype(float)) < _LATEST_NS / scale
        return np.where(valid, values.astype(np.int64) * int(scale), NO_TIME)
    return _scaled(values, scale)


def unwrapped(values: NDArray[Any]) -> NDArray[Any]:
    """Continue the counts of a clock of 32 or 16 bits after it overflows, shape (n)."""
    steps = np.diff(values)
    for size in _WRAPS if len(steps) else ():
        low = -size // 2 if np.nanmin(values) < 0 else 0
        wraps = steps < -0.9 * size
        if np.any(wraps) and np.nanmin(values) >= low and np.nanmax(values) < low + size:
            return values + np.concatenate(([0], np.cumsum(wraps))).astype(values.dtype) * size
    return values


def _scaled(values: Array, scale: float) -> Nanoseconds:
    valid = np.abs(values) < _LATEST_NS / scale
    floor = np.floor(np.where(valid, values, 0.0))
    fraction = np.where(valid, values, 0.0) - floor
    ns = floor.astype(np.int64) * int(scale) if scale == int(scale) else np.rint(floor * scale).astype(np.int64)
    return np.where(valid, ns + np.rint(fraction * scale).astype(np.int64), NO_TIME)


def _likely_unit(values: Array) -> str:
    """The unit of times, by their size if they count from 1970, otherwise by their steps."""
    valid = unwrapped(values[np.isfinite(values)])
    size = float(np.median(np.abs(valid)))
    steps = np.abs(np.diff(valid))
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    if 20_000.0 < size < 80_000.0 and step < 5e-5:  # days of a spreadsheet, since 1900
        return "d"
    # with steps of 100 or more, the clock counts microseconds and has run for minutes
    if 1e8 < size < _LATEST_NS / 1e9 and step < 100.0:
        return "s"
    if any(1.0 < size / zero < 1.4 - 0.3 * (zero == _TICKS[0]) for zero in _TICKS):  # until the year 2100
        return "ticks"
    for name, from_1970 in (("ns", 1e17), ("us", 1e14), ("ms", 1e11)):
        if size > from_1970:
            return name
    return "s" if step < 0.9 else "ms" if step < 600.0 else "us" if step < 600e3 else "ns"
