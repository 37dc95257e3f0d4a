"""Averages a stretch of a ride over windows of a fifth of a second, which removes the vibration of the engine."""

from dataclasses import dataclass, replace

import numpy as np

from ..signals import Array, Bools, Ints, cell_numbers, rotated
from ..signals.leaning import WINDOW_S

GAP_S = 0.17  # after a longer step between two samples, readings are missing


@dataclass
class Windows:
    """n successive windows. A time of missing readings is one window with `gap` True.

    edges (n + 1, s): times of the windows' starts and ends. rate (n, 3, rad/s), force (n, 3, g): means, along the
    vehicle's axes. jolt (n, rad/s): largest difference of a sample's rate from its window's mean. speed (n, m/s): NaN
    if unknown. warm (n, C): temperature minus that at the start of the log, 0 if unknown. gap (n): True without
    readings. Per sample: number, the index of its window; before and after (s): the time before and after it that the
    sample represents.
    """

    edges: Array
    rate: Array
    force: Array
    jolt: Array
    speed: Array
    warm: Array
    gap: Bools
    number: Ints
    before: Array
    after: Array

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def seconds(self) -> Array:
        """(n) duration of each window, s."""
        return np.diff(self.edges)

    @property
    def covered(self) -> Array:
        """(n) duration of the readings in each window, s; 0 in gaps."""
        return np.where(self.gap, 0.0, self.seconds)

    @property
    def known_speed(self) -> Array:
        """(n) m/s, interpolated between the logged values; NaN everywhere if there are fewer than two."""
        there, middle = ~np.isnan(self.speed), 0.5 * (self.edges[1:] + self.edges[:-1])
        if np.count_nonzero(there) < 2:
            return np.full(len(self), np.nan)
        return np.interp(middle, middle[there], self.speed[there])

    def turned(self, matrix: Array, bias: Array | float = 0.0) -> "Windows":
        """A copy with `bias` (3, rad/s) subtracted from the rates, then rates and forces along the rows of `matrix`
        (3, 3)."""
        rate, force = rotated(matrix, self.rate - bias, self.force)
        return replace(self, rate=rate, force=force)

    def padded(self, length: int) -> "Windows":
        """A copy whose number of windows is a multiple of `length`, with gaps of zero duration appended."""
        more = -len(self) % length

        def longer(values: Array, fill: float = 0.0) -> Array:
            return np.concatenate((values, np.full((more, *values.shape[1:]), fill)))

        return replace(
            self,
            edges=longer(self.edges, self.edges[-1]),
            speed=longer(self.speed, np.nan),
            gap=np.append(self.gap, np.ones(more, dtype=bool)),
            rate=longer(self.rate),
            force=longer(self.force),
            jolt=longer(self.jolt),
            warm=longer(self.warm),
        )


def windows_of(t_s: Array, force: Array, rate: Array, speed: Array, warm: Array, aligned: bool = False) -> Windows:
    """The Windows of samples: t_s (s), force (samples, 3, g), rate (samples, 3, rad/s), speed (m/s, NaN for no new
    value), warm (C, see Windows).

    Each sample represents the time up to half way to its neighbours, so the sum over a window is the integral. aligned:
    the axes are left, up, forward. Then each sample is expressed in the axes that the bike has in the middle of the
    window. If a bike rolls by 20 degrees in a window, means along rolling axes would be 0.5 % too small.
    """
    step = np.diff(t_s)
    usual = float(np.median(step)) if len(step) else WINDOW_S
    lost = step > max(GAP_S, 1.5 * usual)
    half = np.where(lost, 0.5 * usual, 0.5 * step)
    before, after = np.append(0.5 * usual, half), np.append(half, 0.5 * usual)
    begins = np.append(True, lost)  # True for the first sample of each stretch without missing readings
    since = t_s - t_s[begins][np.cumsum(begins) - 1]
    starts = np.flatnonzero(np.append(True, (np.diff(cell_numbers(since, WINDOW_S)) != 0) | lost))
    weight = before + after
    length = np.add.reduceat(weight, starts)

    def mean(values: Array) -> Array:
        return np.add.reduceat(values * weight[:, None], starts, axis=0) / length[:, None]

    there = np.flatnonzero(~np.isnan(speed))
    place = np.searchsorted(starts, np.arange(len(t_s)), side="right") - 1
    if aligned:
        rolled = np.cumsum(rate[:, 2] * weight)
        whole = np.add.reduceat(rate[:, 2] * weight, starts)
        rolled -= 0.5 * rate[:, 2] * weight + (np.cumsum(whole) - 0.5 * whole)[place]
        force, rate = _rolled_back(force, rolled), _rolled_back(rate, rolled)
    in_window = np.full(len(starts), np.nan)
    in_window[place[there]] = speed[there]
    mean_rate = mean(rate)
    jolt = np.maximum.reduceat(np.linalg.norm(rate - mean_rate[place], axis=1), starts)
    at = np.flatnonzero(begins[starts])[1:]  # indices of the windows after missing readings
    ends = np.append(starts[1:], len(t_s)) - 1
    edges = np.insert((t_s - before)[starts], at, (t_s + after)[ends[at - 1]])
    return Windows(
        np.append(edges, t_s[-1] + after[-1]),
        np.insert(mean_rate, at, 0.0, axis=0),
        np.insert(mean(force), at, 0.0, axis=0),
        np.insert(jolt, at, 0.0),
        np.insert(in_window, at, np.nan),
        np.insert(warm[starts], at, 0.0),
        np.insert(np.zeros(len(starts), dtype=bool), at, True),
        place + np.searchsorted(at, place, side="right"),
        before,
        after,
    )


def _rolled_back(vectors: Array, roll: Array) -> Array:
    """Express vectors (samples, 3: left, up, forward) in the axes before the bike rolled to the right by roll (samples,
    rad)."""
    (left, up, forward), c, s = vectors.T, np.cos(roll), np.sin(roll)
    return np.column_stack((c * left - s * up, s * left + c * up, forward))
