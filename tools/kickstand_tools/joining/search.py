"""Where two signals fit: their correlation at every shift against each other, in one go by Fourier transforms."""

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array


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


def evidence(correlation: Array, count: Array, per_sample: float) -> Array:
    """How much likelier (natural logarithm) the signals belong together than not; 0 for a negative correlation.

    per_sample: independent samples in each.
    """
    r = np.clip(correlation, 0.0, 0.999)
    return -0.5 * per_sample * count * np.log1p(-r * r)


def peaks(values: Array, apart: int, most: int) -> list[int]:
    """The places of the largest values, the largest first, at least `apart` from each other."""
    left, found = values.copy(), []
    while len(found) < most and np.max(left) > 0.0:
        place = int(np.argmax(left))
        found.append(place)
        left[max(0, place - apart) : place + apart + 1] = 0.0
    return found
