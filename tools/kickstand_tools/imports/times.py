"""Times as apps write them, as nanoseconds: numbers in s, ms, us or ns, from any start or from 1970, dates, clocks."""

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .sheets import numbers_of
from .units import TIMES, unit

if TYPE_CHECKING:
    from pandas import Series

Nanoseconds = NDArray[np.int64]

NO_TIME = np.iinfo(np.int64).min  # of a cell that holds none
DATES = "date or clock"
EPOCH_NS = 10**17  # 1973: a later time counts from 1970
DAY_NS = 86400 * 10**9
_LATEST_NS = 4.0e18  # the year 2096; twice as much still fits into 64 bits
_CLOCK = re.compile(r"^\s*(?:(\d+):)?(\d{1,2}):(\d{1,2}(?:\.\d+)?)\s*$")


def times_ns(cells: "Series", unit_name: str = "", where: str = "the recording") -> Nanoseconds:
    """Times (n) in ns, NO_TIME for a cell that holds none.

    unit_name: of numbers, "" if it is to be told from their size and steps. Raises InputError where few cells are
    times. where: what messages call them.
    """
    import pandas

    numbers = numbers_of(cells)
    filled = int(np.count_nonzero(cells.notna()))
    if np.count_nonzero(np.isfinite(numbers)) > filled // 2:
        return _of_numbers(numbers, unit_name, where)
    texts = cells.astype(str)
    clocks = [_CLOCK.match(str(text)) for text in texts.tolist()]
    if sum(map(bool, clocks)) > filled // 2:
        parts = [[float(part or 0.0) for part in match.groups()] if match else [np.nan] * 3 for match in clocks]
        return _after_midnight(np.array(parts) @ np.array([3600.0, 60.0, 1.0]))
    zoned = texts.str.replace(r"\s+(?=[+-]\d\d:?\d\d$)", "", regex=True).str.replace(" UTC", "+00:00", regex=False)
    dates = pandas.to_datetime(zoned, errors="coerce", utc=True, format="ISO8601")
    known = np.asarray(dates.notna(), dtype=bool)
    if np.count_nonzero(known) <= filled // 2:
        shown = ascii(str(cells.iloc[0])[:30]) if len(cells) else "empty"
        raise InputError(f"{where}: {shown} is no time: numbers, or dates such as 2024-05-17T09:30:00.25Z, are needed")
    return np.where(known, np.asarray(dates.dt.tz_localize(None), dtype="datetime64[ns]").astype(np.int64), NO_TIME)


def time_unit(cells: "Series", given: str = "") -> str:
    """The unit of times, told from their size and steps where it is not given; "date or clock" where they are these."""
    numbers = numbers_of(cells)
    if np.count_nonzero(np.isfinite(numbers)) <= np.count_nonzero(cells.notna()) // 2:
        return DATES
    return unit(given) if given else _guessed(numbers.astype(float))


def of_seconds(seconds: NDArray[np.float64]) -> Nanoseconds:
    """Seconds (n) as ns; NO_TIME for what is no number."""
    good = np.abs(seconds) < _LATEST_NS * 1e-9
    whole = np.floor(np.where(good, seconds, 0.0))
    part = np.where(good, seconds, 0.0) - whole
    return np.where(good, whole.astype(np.int64) * 10**9 + np.rint(part * 1e9).astype(np.int64), NO_TIME)


def of_day(clock: NDArray[np.float64]) -> Nanoseconds:
    """HHMMSS.SS as numbers (n), the time of a day, as ns; a day later after midnight."""
    whole = np.floor(clock)
    return _after_midnight(whole // 10000 * 3600.0 + whole // 100 % 100 * 60.0 + whole % 100 + (clock - whole))


def _after_midnight(seconds: NDArray[np.float64]) -> Nanoseconds:
    ns = of_seconds(seconds)
    good = ns != NO_TIME
    back = np.diff(ns[good], prepend=ns[good][:1]) < -DAY_NS // 2
    ns[good] += np.cumsum(back) * DAY_NS
    return ns


def _of_numbers(values: NDArray[Any], unit_name: str, where: str) -> Nanoseconds:
    known = unit(unit_name) if unit_name else _guessed(values.astype(float))
    if known not in TIMES:
        raise InputError(f"{where}: unit {unit_name!a} is not known: write one of {', '.join(TIMES)}")
    scale = TIMES[known]
    if values.dtype.kind in "iu":
        good = np.abs(values.astype(float)) < _LATEST_NS / scale
        return np.where(good, values.astype(np.int64) * scale, NO_TIME)
    good = np.abs(values) < _LATEST_NS / scale
    whole = np.floor(np.where(good, values, 0.0))
    part = np.where(good, values, 0.0) - whole
    return np.where(good, whole.astype(np.int64) * scale + np.rint(part * scale).astype(np.int64), NO_TIME)


def _guessed(values: NDArray[np.float64]) -> str:
    """The unit of times without one: those from 1970 by their size, others by their steps."""
    good = values[np.isfinite(values)]
    size = float(np.median(np.abs(good)))
    if size > 1e8 and size < 1e10:
        return "s"
    for name, from_1970 in (("ns", 1e17), ("us", 1e14), ("ms", 1e11)):
        if size > from_1970:
            return name
    steps = np.diff(good)
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    return "s" if step < 0.9 else "ms" if step < 600.0 else "us" if step < 600e3 else "ns"
