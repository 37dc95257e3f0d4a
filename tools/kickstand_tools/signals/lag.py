"""The lag of one signal behind another, such as that of a satellite receiver's speed behind the force.

Either some lags are tried, and the one with the largest correlation is taken (cross-correlation). Or, where the shift
may be anything, all are tried at once by Fourier transforms.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import Array


@dataclass
class Correlation:
    """value: correlation, 0 to 1. direction (k): unit vector along which the cause's covariance with the effect is
    largest."""

    value: float
    direction: Array


def correlation(effect: Array, cause: Array, whole: bool = False) -> Correlation:
    """The correlation of effect (n) with the component of cause (n, k) along the direction of their largest covariance.

    whole: normalise by the variance of all components of the cause, not only of the one along `direction`. The value is
    then smaller where the cause also varies across that direction.
    """
    effect, cause = effect - np.mean(effect), cause - np.mean(cause, axis=0)
    both = effect @ cause
    direction = both / max(float(np.linalg.norm(both)), 1e-12)
    along = cause @ direction
    size = float(np.sqrt((effect @ effect) * (np.sum(cause * cause) if whole else along @ along)))
    return Correlation(float(effect @ along) / size if size > 0.0 else 0.0, direction)


@dataclass
class Lag(Correlation):
    """lag_s: delay of the effect against the cause. inside: it is neither the first nor the last of the lags tried."""

    lag_s: float
    inside: bool


def best_lag(
    lags_s: Iterable[float], pair_at: Callable[[float], tuple[Array, Array] | None], whole: bool = False
) -> Lag | None:
    """The lag of the largest correlation, interpolated by a parabola through its square and the two beside it.

    lags_s: evenly spaced, increasing. pair_at: called with a lag, returns the effect (n) and the cause (n, k) that much
    earlier, or None if there are too few values. whole: see correlation(). Returns None if pair_at always does.
    """
    tried = [(lag_s, pair_at(lag_s)) for lag_s in lags_s]
    found = [(lag_s, correlation(*pair, whole)) for lag_s, pair in tried if pair is not None]
    if not found:
        return None
    values = np.array([each.value for _, each in found])
    best = int(np.argmax(values))
    lag_s, at = found[best]
    inside = 0 < best < len(found) - 1
    if inside:
        lag_s += peak_offset(values[best - 1 : best + 2] ** 2) * (found[best + 1][0] - lag_s)
    return Lag(at.value, at.direction, float(lag_s), inside)


def peak_offset(three: Array) -> float:
    """Where the parabola through three neighbours (3) is highest, in steps from the middle one, -0.5 to 0.5."""
    before, here, after = three
    bend = before - 2.0 * here + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0


def correlations(
    first: Array, first_good: NDArray[np.bool_], second: Array, second_good: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """The correlation of two signals of zero mean, and the number of samples in it, at each shift.

    first (n), second (m): at the same sample rate. first_good, second_good: True for samples that are used. Returns two
    arrays (n + m - 1): entry j is for second[i] beside first[i + j - (m - 1)].
    """
    size = 1 << int(np.ceil(np.log2(len(first) + len(second))))
    a, b = np.where(first_good, first, 0.0), np.where(second_good, second, 0.0)

    def crossed(x: Array, y: Array) -> Array:
        whole = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        return np.concatenate((whole[size - len(second) + 1 :], whole[: len(first)]))

    there, other = first_good.astype(float), second_good.astype(float)
    count = np.maximum(np.rint(crossed(there, other)), 0.0)
    # The transforms' rounding errors are a share of the whole sums of squares: smaller results mean nothing
    square = np.maximum(crossed(a * a, other), 1e-9 * (a @ a)) * np.maximum(crossed(there, b * b), 1e-9 * (b @ b))
    return crossed(a, b) / np.sqrt(np.maximum(square, 1e-30)), count


def log_likelihood_ratio(correlation: Array, count: Array, per_sample: float) -> Array:
    """Natural logarithm of the likelihood ratio of two normal signals: with this correlation over with none; 0 for a
    negative correlation. correlation, count: see correlations(). per_sample: independent values per sample."""
    r = np.clip(correlation, 0.0, 0.999)
    return -0.5 * per_sample * count * np.log1p(-r * r)


def peaks(values: Array, apart: int, most: int) -> list[int]:
    """Indices of the largest values over 0, at most `most`, the largest first, each over `apart` from the others."""
    left, found = values.copy(), []
    while len(found) < most and np.max(left) > 0.0:
        place = int(np.argmax(left))
        found.append(place)
        left[max(0, place - apart) : place + apart + 1] = 0.0
    return found
