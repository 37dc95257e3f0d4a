"""By how much one signal is later than another, as a satellite receiver's speed is later than the force.

Either some lags are tried, and that of the largest correlation is taken (cross-correlation). Or, where nothing is known
of the shift, all are tried at once by Fourier transforms.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import Array


@dataclass
class Correlation:
    """value: 0 to 1. direction (k): unit vector in which the cause goes with the effect most."""

    value: float
    direction: Array


def correlation(effect: Array, cause: Array, whole: bool = False) -> Correlation:
    """Of effect (n) with cause (n, k) along the direction in which their covariance is largest.

    whole: in parts of all of the cause, not of what it does along that direction; this is less where it does much
    across.
    """
    effect, cause = effect - np.mean(effect), cause - np.mean(cause, axis=0)
    both = effect @ cause
    direction = both / max(float(np.linalg.norm(both)), 1e-12)
    along = cause @ direction
    size = float(np.sqrt((effect @ effect) * (np.sum(cause * cause) if whole else along @ along)))
    return Correlation(float(effect @ along) / size if size > 0.0 else 0.0, direction)


@dataclass
class Lag(Correlation):
    """lag_s: by which the effect is later. inside: it is neither the first nor the last of those tried."""

    lag_s: float
    inside: bool


def best_lag(
    lags_s: Iterable[float], pair_at: Callable[[float], tuple[Array, Array] | None], whole: bool = False
) -> Lag | None:
    """The lag of the largest correlation, between those tried by a parabola through the squares beside it.

    lags_s: evenly spaced, increasing. pair_at: the effect (n) and the cause (n, k) so much earlier, None where there is
    too little to say. whole: see correlation(). None if pair_at gives None everywhere.
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
    """The correlation of two signals of zero mean, and how many samples it comes from, at each shift.

    first (n), second (m) on one clock rate, good where they count. Returns two arrays (n + m - 1): entry j is for
    second[i] beside first[i + j - (m - 1)].
    """
    size = 1 << int(np.ceil(np.log2(len(first) + len(second))))
    a, b = np.where(first_good, first, 0.0), np.where(second_good, second, 0.0)

    def crossed(x: Array, y: Array) -> Array:
        whole = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        return np.concatenate((whole[size - len(second) + 1 :], whole[: len(first)]))

    there, other = first_good.astype(float), second_good.astype(float)
    count = np.maximum(np.rint(crossed(there, other)), 0.0)
    # The squares' sums are differences of large numbers: below a share of the whole they are rounding
    square = np.maximum(crossed(a * a, other), 1e-9 * (a @ a)) * np.maximum(crossed(there, b * b), 1e-9 * (b @ b))
    return crossed(a, b) / np.sqrt(np.maximum(square, 1e-30)), count


def log_likelihood_ratio(correlation: Array, count: Array, per_sample: float) -> Array:
    """Natural logarithm of how much likelier two normal signals are with this correlation than without any; 0 for a
    negative one. correlation, count: of correlations(). per_sample: independent samples in each."""
    r = np.clip(correlation, 0.0, 0.999)
    return -0.5 * per_sample * count * np.log1p(-r * r)


def peaks(values: Array, apart: int, most: int) -> list[int]:
    """The places of the largest values over 0, the largest first, at least `apart` from each other."""
    left, found = values.copy(), []
    while len(found) < most and np.max(left) > 0.0:
        place = int(np.argmax(left))
        found.append(place)
        left[max(0, place - apart) : place + apart + 1] = 0.0
    return found
