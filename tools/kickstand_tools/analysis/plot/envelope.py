"""A long line drawn with few points that look the same: the smallest and the largest value of each stretch."""

import numpy as np

from ...logs.table import Array

GAP_S = 1.0  # a line is not drawn over a longer time without a value,
SPEED_GAP_S = 5.0  # that of the speed, which comes seldom


def envelope(time: Array, values: Array, points: int, gap_s: float = np.inf) -> tuple[Array, Array]:
    """At most about this many of the samples, in their order; all of them if they are no more.

    Leaves out NaN, except for one in the middle of each time of over gap_s without a value, which breaks the line.
    """
    there = ~np.isnan(values)
    time, values = time[there], values[there]
    before = np.flatnonzero(np.diff(time) > gap_s)
    middles = (time[before] + time[before + 1]) / 2.0
    time, values = _fewer(time, values, points)
    place = np.searchsorted(time, middles)
    return np.insert(time, place, middles), np.insert(values, place, np.nan)


def _fewer(time: Array, values: Array, points: int) -> tuple[Array, Array]:
    if len(values) <= points:
        return time, values
    size = -(-len(values) * 2 // points)
    starts = np.arange(0, len(values), size)
    whole = len(values) // size
    block = values[: whole * size].reshape(whole, size)
    places = [starts[:whole] + np.argmin(block, axis=1), starts[:whole] + np.argmax(block, axis=1)]
    if whole < len(starts):
        rest = values[whole * size :]
        places.append(whole * size + np.array([int(np.argmin(rest)), int(np.argmax(rest))]))
    kept = np.unique(np.concatenate(places))
    return time[kept], values[kept]
