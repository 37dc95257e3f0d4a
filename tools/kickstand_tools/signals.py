"""Functions on arrays of samples: means, bins of time, lags, rotations and distances. They use only numpy."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.integer[Any]]


# Moving means and integrals of evenly spaced samples. A running sum makes their cost independent of the window's
# length.


def window_means(values: Array, n: int) -> Array:
    """Average each window of n successive values: (m, ...) -> (m - n + 1, ...)."""
    sums = np.zeros((len(values) + 1, *values.shape[1:]))
    np.cumsum(values, axis=0, out=sums[1:])
    return (sums[n:] - sums[:-n]) / n


def window_spreads(values: Array, n: int) -> Array:
    """Compute the standard deviation of each window of n successive values: (m, ...) -> (m - n + 1, ...)."""
    # Subtract the mean first, because the rounding errors of large squares would hide a small standard deviation
    values = values - np.mean(values, axis=0)
    squared = window_means(values, n)
    squared *= -squared
    values *= values
    squared += window_means(values, n)
    return np.sqrt(np.maximum(0.0, squared, out=squared), out=squared)


def moving_mean(values: Array, n: int) -> Array:
    """Compute the moving mean over the n values from value i - n // 2 on. The end values continue beyond the ends."""
    return values if n < 2 or not len(values) else window_means(_padded(values, n), n)


def moving_spread(values: Array, n: int) -> Array:
    """Compute the moving standard deviation over the same n values as in moving_mean()."""
    return np.zeros(values.shape) if n < 2 or not len(values) else window_spreads(_padded(values, n), n)


def smoothed(values: Array, time_s: Array, over_s: float) -> Array:
    """Compute the moving mean of values, shape (m), over an odd number of samples that last about over_s seconds."""
    if len(values) < 2:
        return values
    return moving_mean(values, 2 * round(0.5 * over_s / float(np.median(np.diff(time_s)))) + 1)


def integral(time_s: Array, values: Array) -> Array:
    """Integrate values from the first sample to each sample, shape (m), by the trapezoidal rule."""
    return np.append(0.0, np.cumsum(np.diff(time_s) * (values[1:] + values[:-1]) / 2.0))


def _padded(values: Array, n: int) -> Array:
    head, tail = np.repeat(values[:1], n // 2, 0), np.repeat(values[-1:], n - 1 - n // 2, 0)
    return np.concatenate((head, values, tail))


# Means of samples over bins of time. Such means remove vibration and need little memory.


def bin_numbers(time_s: Array, bin_s: float, rounded: bool = False) -> Ints:
    """Return the number of the bin that contains each time, shape (n).

    A time on the border of two bins belongs to the later bin, even if rounding made it slightly smaller.

    rounded: the middles of the bins are multiples of bin_s, and not their beginnings.
    """
    number = time_s / bin_s  # in place from here on: a log has millions of samples
    number += 0.5 * rounded
    number += 1e-6
    return np.floor(number, out=number).astype(np.int32)


def runs(values: NDArray[np.generic]) -> Ints:
    """Return the first index of each run of equal values, shape (m). There must be at least one value."""
    return np.flatnonzero(np.append(True, values[1:] != values[:-1]))


def intervals(true: Bools) -> Ints:
    """Find the runs of True: the first index of each of m runs, and the index after its end, shape (m, 2)."""
    return np.flatnonzero(np.diff(np.concatenate(([False], true, [False])))).reshape(-1, 2)


def run_means(values: Array, starts: Ints) -> Array:
    """Return the mean of each of m runs without its NaN, shape (m); NaN if there is nothing else."""
    valid = ~np.isnan(values)
    count = np.add.reduceat(valid, starts, dtype=float)
    total = np.add.reduceat(np.where(valid, values, 0.0), starts)
    return np.divide(total, count, out=np.full(len(starts), np.nan), where=count > 0)


def run_latest(values: Array, starts: Ints) -> Array:
    """Return the last value of each of m runs that is not NaN, shape (m); NaN if there is none."""
    last = np.maximum.reduceat(np.where(np.isnan(values), -1, np.arange(len(values))), starts)
    return np.where(last >= 0, values[last], np.nan)


@dataclass
class Bins:
    """n successive bins of time. Some may have no samples."""

    first: int  # number of the first bin
    count: Array  # number of samples in each bin, shape (n)
    means: Array  # averaged values of each bin, shape (n, k); NaN in a bin without samples
    latest: Array  # last values of each bin, shape (n, j); NaN in a bin without this value

    def merged(self, by: int) -> "Bins":
        """Merge the bins into longer bins that begin at multiples of `by`, with the first `latest` value in each."""
        lead = self.first % by
        trail = -(lead + len(self.count)) % by

        def grouped(values: Array, fill: float) -> Array:
            width = ((lead, trail), *[(0, 0)] * (values.ndim - 1))
            return np.pad(values, width, constant_values=fill).reshape(-1, by, *values.shape[1:])

        count = grouped(self.count, 0.0)
        total = np.sum(count, axis=1)
        sums = np.sum(np.nan_to_num(grouped(self.means, 0.0)) * count[:, :, None], axis=1)
        means = np.divide(sums, total[:, None], out=np.full_like(sums, np.nan), where=total[:, None] > 0.0)
        latest = grouped(self.latest, np.nan)
        row = np.argmax(~np.isnan(latest), axis=1)[:, None]
        return Bins(self.first // by, total, means, np.take_along_axis(latest, row, axis=1)[:, 0])


def binned(
    time_s: Array, bin_s: float, means: Sequence[Array], latest: Sequence[Array], most: int, longest: int
) -> Bins | None:
    """Average n samples over bins of bin_s. The columns are used one by one, to save memory.

    time_s: increasing, shape (n), in s.
    means: the k columns to average, each of shape (n).
    latest: j other columns, each of shape (n). Each bin keeps the last value that is not NaN.
    most: number of bins with samples to use, the last ones.
    longest: largest number of all bins.
    Returns None without samples, or if gaps make more than `longest` bins.
    """
    if not len(time_s):
        return None
    number = bin_numbers(time_s, bin_s)
    starts = runs(number)[-most:]
    used = slice(int(starts[0]), None)
    number, starts = number[used], starts - starts[0]
    row = number[starts] - number[0]
    if row[-1] >= longest:
        return None
    count = np.zeros(row[-1] + 1)
    count[row] = np.diff(np.append(starts, len(number)))
    averages, last = np.full((len(count), len(means)), np.nan), np.full((len(count), len(latest)), np.nan)
    for k, values in enumerate(means):
        averages[row, k] = run_means(values[used], starts)
    for k, values in enumerate(latest):
        last[row, k] = run_latest(values[used], starts)
    return Bins(int(number[0]), count, averages, last)


# The lag of one signal behind another. For example, the speed of a satellite receiver is later than the force.
# best_lag() tries some lags, and returns the lag with the largest correlation (cross-correlation). correlations() tries
# all shifts at once by Fourier transforms.


@dataclass
class Correlation:
    """The correlation of a cause with its effect."""

    value: float  # 0 to 1
    direction: Array  # unit vector along which the cause has the largest covariance with the effect, shape (k)


def correlation(effect: Array, cause: Array, whole: bool = False) -> Correlation:
    """Correlate an effect, shape (n), with the component of its cause, shape (n, k), of the largest covariance with it.

    whole: True to normalise by the variance of all components of the cause, not only of the component along
        `direction`. The value is then smaller if the cause also varies in other directions.
    """
    effect, cause = effect - np.mean(effect), cause - np.mean(cause, axis=0)
    covariance = effect @ cause
    direction = covariance / max(float(np.linalg.norm(covariance)), 1e-12)
    along = cause @ direction
    size = float(np.sqrt((effect @ effect) * (np.sum(cause * cause) if whole else along @ along)))
    return Correlation(float(effect @ along) / size if size > 0.0 else 0.0, direction)


@dataclass
class Lag(Correlation):
    """The delay of an effect against its cause."""

    lag_s: float  # the delay, in s
    inside: bool  # True if the delay is neither the first nor the last of the tried lags


def best_lag(
    lags_s: Iterable[float], pair_at: Callable[[float], tuple[Array, Array] | None], whole: bool = False
) -> Lag | None:
    """Find the lag with the largest correlation, interpolated by a parabola through three squared correlations.

    lags_s: lags to try, evenly spaced and increasing.
    pair_at: returns for a lag the effect, shape (n), and the cause earlier by this lag, shape (n, k); None if there are
        too few values.
    whole: see correlation().
    Returns None if pair_at returns None for all lags.
    """
    tried = [(lag_s, pair_at(lag_s)) for lag_s in lags_s]
    candidates = [(lag_s, correlation(*pair, whole)) for lag_s, pair in tried if pair is not None]
    if not candidates:
        return None
    values = np.array([each.value for _, each in candidates])
    best = int(np.argmax(values))
    lag_s, peak = candidates[best]
    inside = 0 < best < len(candidates) - 1
    if inside:
        lag_s += peak_offset(values[best - 1 : best + 2] ** 2) * (candidates[best + 1][0] - lag_s)
    return Lag(peak.value, peak.direction, float(lag_s), inside)


def peak_offset(three: Array) -> float:
    """Find the maximum of the parabola through three neighbouring values, in steps from the middle one, -0.5 to 0.5."""
    first, middle, last = three
    bend = first - 2.0 * middle + last
    return float(np.clip(0.5 * (first - last) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0


def correlations(first: Array, first_good: Bools, second: Array, second_good: Bools) -> tuple[Array, Array]:
    """Correlate two signals of zero mean and equal sample rate, shapes (n) and (m), at each shift.

    At shift j, sample second[i] is compared with sample first[i + j - (m - 1)].

    first_good, second_good: True for the samples to use.
    Returns the correlation at each shift, and the number of samples in it, both of shape (n + m - 1).
    """
    size = 1 << int(np.ceil(np.log2(len(first) + len(second))))
    first, second = np.where(first_good, first, 0.0), np.where(second_good, second, 0.0)

    def sums_of_products(x: Array, y: Array) -> Array:
        """Return the sum of x[i + j - (m - 1)] * y[i] over all i at each shift j, shape (n + m - 1)."""
        products = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        # x is circular in the transforms, so the sums with x at negative indices are the last ones
        return np.concatenate((products[size - len(second) + 1 :], products[: len(first)]))

    first_mask, second_mask = first_good.astype(float), second_good.astype(float)
    count = np.maximum(np.rint(sums_of_products(first_mask, second_mask)), 0.0)
    # The transforms have rounding errors, about 1e-9 of the total sum of squares or less. A sum below this is only
    # rounding error, so it is replaced by the limit.
    first_energy = np.maximum(sums_of_products(first * first, second_mask), 1e-9 * (first @ first))
    second_energy = np.maximum(sums_of_products(first_mask, second * second), 1e-9 * (second @ second))
    energy = np.maximum(first_energy * second_energy, 1e-30)  # a signal may be 0 everywhere
    return sums_of_products(first, second) / np.sqrt(energy), count


def log_likelihood_ratio(correlation: Array, count: Array, per_sample: float) -> Array:
    """Compute the evidence that two signals belong together, as the natural logarithm of a likelihood ratio.

    It compares two normal signals with this correlation to two independent signals. It is 0 for a negative correlation.

    correlation, count: see correlations().
    per_sample: number of independent values per sample.
    """
    r = np.clip(correlation, 0.0, 0.999)
    return -0.5 * per_sample * count * np.log1p(-r * r)


def peaks(values: Array, apart: int, most: int) -> list[int]:
    """Return the indices of at most `most` maxima over 0, the largest first, more than `apart` indices apart."""
    remaining, indices = values.copy(), []
    while len(indices) < most and np.max(remaining) > 0.0:
        index = int(np.argmax(remaining))
        indices.append(index)
        remaining[max(0, index - apart) : index + apart + 1] = 0.0
    return indices


# Rotation vectors and rotation matrices. A rotation vector is the axis times the angle in rad. The functions convert
# any number of rotations at once, by the exponential map and its inverse. See Sola, "Quaternion kinematics for the
# error-state Kalman filter" (2017), section 2.3.


def rotated(matrix: Array, *vectors: Array) -> tuple[Array, ...]:
    """Express vectors, each of shape (n, 3), along other axes: the rows of `matrix`, as in vehicle_from_sensor."""
    return tuple(vector @ matrix.T for vector in vectors)


def cross_matrix(vector: Array) -> Array:
    """Return the skew-symmetric matrices of vectors, shape (..., 3): matrix @ other = vector x other."""
    matrix = np.zeros((*vector.shape, 3))
    x, y, z = np.moveaxis(vector, -1, 0)
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def rotation_matrix(vector: Array) -> Array:
    """Convert rotation vectors in rad, shape (..., 3), to matrices by Rodrigues' formula (the exponential map)."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None] / np.pi
    cross = cross_matrix(vector)
    # numpy's sinc(x) is sin(pi x) / (pi x), which is exact near 0
    return np.eye(3) + np.sinc(angle) * cross + 0.5 * np.sinc(angle / 2.0) ** 2 * (cross @ cross)


def rotation_vector(matrix: Array) -> Array:
    """Convert rotation matrices to rotation vectors in rad (the logarithm). Each rotation must be under 180 degrees."""
    axis = _twice_the_sine(matrix)
    return axis / np.maximum(np.linalg.norm(axis, axis=-1), 1e-12)[..., None] * rotation_angle(matrix)[..., None]


def rotation_angle(matrix: Array) -> Array:
    """Return the angles of rotation matrices in rad, from 0 to pi. They are exact for 180 degrees, too."""
    sine = np.linalg.norm(_twice_the_sine(matrix), axis=-1)
    return np.arctan2(sine, np.trace(matrix, axis1=-2, axis2=-1) - 1.0)


def _twice_the_sine(matrix: Array) -> Array:
    """Return the axes of rotation matrices. Their length is twice the sine of the angle."""
    return np.stack([matrix[..., i, j] - matrix[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=-1)


STANDING_MPS = 0.3  # speed under which a vehicle counts as standing, because a receiver's speed is never exactly 0

# Distances on the Earth.

EARTH_M = 6_371_000.0


def distance_m(lat: Array, lon: Array, next_lat: Array, next_lon: Array) -> tuple[Array, Array]:
    """Return the metres to the east and to the north of the next positions (degrees), exact for some kilometres."""
    apart_deg = (next_lon - lon + 180.0) % 360.0 - 180.0  # correct also across the meridian of 180 degrees
    east = np.radians(apart_deg) * np.cos(np.radians(lat)) * EARTH_M
    return east, np.radians(next_lat - lat) * EARTH_M
