"""Makes the times of a log even again if the recorder rounded them.

A sensor takes samples at even intervals. Some recorders round times, or write the same time for several samples that
they received together. Each time is replaced by the mean of the recorded times around it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..common.messages import InputError, kind
from ..signals import Array, Ints, window_means

COARSE = 0.05  # share of the time between samples; times with a smaller tick are not changed
# If more than this share of the times repeats the previous time, the recorder writes one time for several samples
OFTEN = 0.05
# If at least this share of the steps is equal, the times are already even, and only some samples are missing
EXACT = 0.98
GAP = 1.5  # a step is a gap if it is longer than 1.5 median steps plus a tick
# The mean around a sample uses at least AROUND samples and at least TICKS ticks.
AROUND = 64
TICKS = 8
# A clock has stopped if more than CROWD samples have the same time, and also more than CROWDED times the usual number
# of samples per tick.
CROWDED = 10.0
CROWD = 50
# Largest change of a time, in ticks. Rounding explains half a tick. The rest is a margin for the ends of the log, where
# the mean is less exact.
ALLOWED = 0.6
SHORTEST_S = 2e-6  # shortest step, in s, which stays over 0 if times are rounded to microseconds

TimesSpread = kind(
    "times-spread",
    "repeated samples shift_s",  # number of times that equal the previous one, number of all times, largest change in s
    "the times are rounded ({repeated} of {samples} repeat the previous one): they are spread evenly, by up to "
    "{shift_s:.3f} s",
)


def even_times(t_s: ArrayLike, name: str = "the log") -> Array:
    """Make the times of n samples, in s, even if rounding has made them uneven or equal.

    Each result is within 0.6 ticks of the recorded time. The tick is the largest step of which all recorded steps are
    multiples. If many times are repeated, it is at least the usual step between different times. All steps of the
    result are over 0. Gaps remain, and times with a fine tick are not changed.

    name: the log's name in messages.
    Raises InputError for a time that decreases or is not a number, and for a clock that has stopped.

    >>> even_times([0.0, 0.01, 0.01, 0.02, 0.03, 0.03, 0.04]).round(4).tolist()
    [0.0007, 0.0071, 0.0136, 0.02, 0.0264, 0.0329, 0.0393]
    """
    recorded = np.asarray(t_s, dtype=float)
    if len(recorded) < 2:
        return recorded
    if not np.all(np.isfinite(recorded)):
        raise InputError(f"{name}: some times are not numbers")
    time_us = np.rint(recorded * 1e6).astype(np.int64)
    between_us = np.diff(time_us)
    if np.any(between_us < 0):
        time_s = recorded[int(np.argmax(between_us < 0)) + 1]
        raise InputError(f"{name}: time goes back at {time_s:g} s: it must increase")
    if np.all(between_us > 0) and _is_even(between_us, float(np.median(between_us))):
        return recorded  # the usual log, without further arrays
    starts = np.flatnonzero(np.diff(time_us, prepend=time_us[0] - 1))  # first sample of each time
    if len(starts) == 1:
        raise InputError(f"{name}: the time is the same in all samples: it must increase")
    counts = np.diff(np.append(starts, len(recorded)))
    between_us = np.diff(time_us[starts])
    usual_us = float(np.median(between_us))
    near = between_us <= 5.0 * usual_us  # without the gaps
    period_us = float(np.sum(between_us[near])) / float(np.sum(counts[:-1][near]))  # of a sample
    repeated = len(recorded) - len(starts)
    tick_us = float(np.gcd.reduce(between_us))
    if repeated > OFTEN * len(recorded):
        tick_us = max(tick_us, usual_us)
    if np.any((counts > CROWD) & (counts > CROWDED * tick_us / period_us)):
        time_s = recorded[starts[int(np.argmax(counts))]]
        raise InputError(f"{name}: time stands still at {time_s:g} s, in {np.max(counts)} samples: it must increase")
    times = _spread_repeated(recorded, starts, counts, period_us * 1e-6)
    if tick_us >= COARSE * period_us:
        times = _smooth(recorded, times, tick_us * 1e-6, period_us * 1e-6)
    order = SHORTEST_S * np.arange(len(times))  # keeps each step at SHORTEST_S or more
    return np.asarray(np.maximum.accumulate(times - order) + order, dtype=float)


def _is_even(between_us: Ints, usual_us: float) -> bool:
    """Return True if the clock's tick is fine, or nearly all steps between different times are equal."""
    if np.count_nonzero(between_us == usual_us) >= EXACT * len(between_us):
        return True
    near = between_us <= 5.0 * usual_us
    return bool(np.gcd.reduce(between_us) < COARSE * np.sum(between_us, where=near) / np.count_nonzero(near))


def _spread_repeated(recorded: Array, starts: Ints, counts: Ints, period_s: float) -> Array:
    """Spread samples with the same time up to the next recorded time, with steps of at most one usual sample period.

    starts, counts: first sample of each recorded time, and number of samples with it.
    """
    until = np.append(recorded[starts[1:]], np.inf)
    longest = np.minimum((until - recorded[starts]) / counts, np.maximum(period_s, 0.0))
    number = np.arange(len(recorded)) - np.repeat(starts, counts)
    return recorded + number * np.repeat(longest, counts)


def _smooth(recorded: Array, times: Array, tick_s: float, period_s: float) -> Array:
    """Replace each time by the mean around it, never across a gap, and by at most ALLOWED ticks.

    A sample alone between two gaps keeps its time in `times`.
    """
    half = max(AROUND, round(TICKS * tick_s / period_s)) // 2
    cuts = np.flatnonzero(np.diff(recorded) > GAP * period_s + tick_s) + 1
    result = times.copy()
    for begin, end in zip([0, *cuts], [*cuts, len(times)]):
        part = recorded[begin:end]
        if len(part) > 1:
            mean = _mean(_mean(part, half), half)
            result[begin:end] = np.clip(mean, part - ALLOWED * tick_s, part + ALLOWED * tick_s)
    return result


def _mean(values: Array, half: int) -> Array:
    """Moving mean over `half` samples on each side. Straight lines continue the values beyond both ends."""
    n = len(values)
    span = min(n, 2 * half + 1)
    k = np.arange(n, dtype=float)
    first, last = _line(k[:span], values[:span]), _line(k[-span:], values[-span:])
    if n <= 2 * half:
        return first(k)
    head, tail = first(np.arange(-half, 0.0)), last(np.arange(n, n + half, dtype=float))
    base = values[0]  # subtracted before summing, because sums of small numbers have smaller rounding errors
    return base + window_means(np.concatenate((head, values, tail)) - base, 2 * half + 1)


def _line(k: Array, values: Array) -> Callable[[Array], Array]:
    """Fit a straight line to values at positions k. Returns the line as a function of the position."""
    middle, mean = float(np.mean(k)), float(np.mean(values))
    away = k - middle
    slope = float(away @ (values - mean)) / max(float(away @ away), 1e-12)
    return lambda at: mean + slope * (at - middle)
