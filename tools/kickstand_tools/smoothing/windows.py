"""A stretch of a ride as means over a fifth of a second, in which the vibration of the engine averages out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array

WINDOW_S = 0.2
GAP_S = 0.17  # a longer step between two samples: readings are missing


@dataclass
class Windows:
    """n windows, one following on the other; where readings are missing a window without readings lies between two.

    edges (n + 1, s): their times. rate (n, 3, rad/s), force (n, 3, g): means, along the vehicle's axes. shaken (n, 3):
    variance of the force within the window, g^2. speed (n): m/s, NaN where there is none. gap (n): True where there are
    no readings. number (samples): in which window each sample lies.
    """

    edges: Array
    rate: Array
    force: Array
    shaken: Array
    speed: Array
    gap: NDArray[np.bool_]
    number: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def seconds(self) -> Array:
        """(n) how long each is."""
        return np.diff(self.edges)


def windows_of(t_s: Array, force: Array, rate: Array, speed: Array) -> Windows:
    """Of n samples: t_s (n), force (n, 3, g), rate (n, 3, rad/s), speed (n, m/s, NaN where there is no new one).

    Each sample stands for the time until half way to its neighbours, so that the sum over a window is the integral.
    """
    step = np.diff(t_s)
    usual = float(np.median(step)) if len(step) else WINDOW_S
    lost = step > max(GAP_S, 1.5 * usual)
    half = np.where(lost, 0.5 * usual, 0.5 * step)
    before, after = np.append(0.5 * usual, half), np.append(half, 0.5 * usual)
    share = before + after
    begins = np.append(True, lost)  # of a stretch without missing readings
    stretch = np.cumsum(begins) - 1
    since = t_s - t_s[begins][stretch]
    cell = np.floor(since / WINDOW_S + 1e-6).astype(np.int64)
    starts = np.flatnonzero(np.append(True, (np.diff(cell) != 0) | lost))

    def total(values: Array) -> Array:
        return np.add.reduceat(values, starts, axis=0)

    length = total(share)
    weight = share[:, None]
    mean_rate, mean_force = total(rate * weight) / length[:, None], total(force * weight) / length[:, None]
    shaken = np.maximum(total(force * force * weight) / length[:, None] - mean_force**2, 0.0)
    there = np.flatnonzero(~np.isnan(speed))
    given = np.full(len(starts), np.nan)
    given[np.searchsorted(starts, there, side="right") - 1] = speed[there]
    begin, end = t_s[starts] - before[starts], (t_s + after)[np.append(starts[1:], len(t_s)) - 1]
    missing = np.flatnonzero(begins[starts][1:])  # a gap follows on these windows
    at = missing + 1
    gap = np.insert(np.zeros(len(starts), dtype=bool), at, True)
    edges = np.append(np.insert(begin, at, end[missing]), end[-1])

    def spread(values: Array, fill: float) -> Array:
        return np.insert(values, at, fill, axis=0)

    number = np.cumsum(np.append(0, np.diff(np.searchsorted(starts, np.arange(len(t_s)), side="right") - 1)))
    number = number + np.searchsorted(missing + 1, number, side="right")
    return Windows(
        edges,
        spread(mean_rate, 0.0),
        spread(mean_force, 0.0),
        spread(shaken, 0.0),
        spread(given, np.nan),
        gap,
        number,
    )
