"""Moving means and integrals of evenly spaced samples.

All are made of one running sum, so their cost does not grow with the window.
"""

import numpy as np

from . import Array


def window_means(values: Array, n: int) -> Array:
    """(m - n + 1, ...) the means of all n successive ones of m values (m, ...)."""
    sums = np.zeros((len(values) + 1, *values.shape[1:]))
    np.cumsum(values, axis=0, out=sums[1:])
    return (sums[n:] - sums[:-n]) / n


def window_spreads(values: Array, n: int) -> Array:
    """(m - n + 1, ...) the standard deviations of all n successive ones of m values (m, ...)."""
    values = values - np.mean(values, axis=0)  # or rounding of large squares would hide the spread
    squared = window_means(values, n)
    squared *= -squared
    values *= values
    squared += window_means(values, n)
    return np.sqrt(np.maximum(0.0, squared, out=squared), out=squared)


def moving_mean(values: Array, n: int) -> Array:
    """(m, ...) for each of m values (m, ...) the mean of the n values that begin n // 2 before it. Beyond the ends the
    first and the last value are repeated."""
    return values if n < 2 or not len(values) else window_means(_padded(values, n), n)


def moving_spread(values: Array, n: int) -> Array:
    """(m, ...) for each value the standard deviation of the n values that moving_mean() takes."""
    return np.zeros(values.shape) if n < 2 or not len(values) else window_spreads(_padded(values, n), n)


def smoothed(values: Array, time_s: Array, over_s: float) -> Array:
    """(m) moving mean over an odd number of samples that last about over_s seconds. time_s (m): the samples' times."""
    if len(values) < 2:
        return values
    return moving_mean(values, 2 * round(0.5 * over_s / float(np.median(np.diff(time_s)))) + 1)


def integral(time_s: Array, values: Array) -> Array:
    """(m) the integral of values (m) over time_s (m), from the first sample to each, by the trapezoidal rule."""
    return np.append(0.0, np.cumsum(np.diff(time_s) * (values[1:] + values[:-1]) / 2.0))


def _padded(values: Array, n: int) -> Array:
    before, after = np.repeat(values[:1], n // 2, 0), np.repeat(values[-1:], n - 1 - n // 2, 0)
    return np.concatenate((before, values, after))
