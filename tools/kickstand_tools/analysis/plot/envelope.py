"""A long line drawn with few points that look the same: the smallest and the largest value of each stretch."""

import numpy as np

from ...logs.table import Array


def envelope(time: Array, values: Array, points: int) -> tuple[Array, Array]:
    """At most about this many of the samples, in their order; all of them if they are no more. Skips NaN."""
    there = ~np.isnan(values)
    time, values = time[there], values[there]
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
