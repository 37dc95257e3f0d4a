"""Integrals and means along time."""

import numpy as np

from ..logs.table import Array

SMOOTH_S = 0.2


def integral(time: Array, values: Array) -> Array:
    """From the first sample to each, by the trapezoidal rule."""
    steps = np.diff(time) * (values[1:] + values[:-1]) / 2.0
    return np.concatenate(([0.0], np.cumsum(steps)))


def smoothed(values: Array, time: Array, over_s: float = SMOOTH_S) -> Array:
    """Mean over over_s seconds around each sample."""
    if len(values) < 2:
        return values
    half = max(0, round(0.5 * over_s / float(np.median(np.diff(time)))))
    padded = np.concatenate((np.full(half, values[0]), values, np.full(half, values[-1])))
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")
