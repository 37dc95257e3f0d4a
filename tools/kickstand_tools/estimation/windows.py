"""Averages a stretch of a ride over windows of a fifth of a second, which removes the vibration of the engine."""

from dataclasses import dataclass, replace

import numpy as np

from ..signals import Array, Bools, Ints, bin_numbers, rotated
from ..signals.leaning import WINDOW_S

GAP_S = 0.17  # if the time between two samples is longer, readings are missing


@dataclass
class Windows:
    """n successive windows. A stretch without readings is one window whose `gap` is True.

    edges: times at which the windows start and end, shape (n + 1), in s.
    rate: mean rates along the vehicle's axes, shape (n, 3), in rad/s.
    force: mean forces along the vehicle's axes, shape (n, 3), in g.
    jolt: largest difference of a sample's rate from the mean of its window, shape (n), in rad/s.
    speed: shape (n), in m/s; NaN if unknown.
    warm: temperature minus the temperature at the start of the log, shape (n), in C; 0 if unknown.
    gap: True where readings are missing, shape (n).
    number: index of each sample's window, shape (samples).
    before, after: time that each sample represents before and after it, shape (samples), in s.
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
        """Duration of each window, shape (n), in s."""
        return np.diff(self.edges)

    @property
    def covered(self) -> Array:
        """Duration of the readings in each window, shape (n), in s; 0 in gaps."""
        return np.where(self.gap, 0.0, self.seconds)

    @property
    def known_speed(self) -> Array:
        """Speed in each window, interpolated between the logged speeds, shape (n), in m/s.

        All values are NaN if the log has fewer than two speeds.
        """
        logged, middle = ~np.isnan(self.speed), 0.5 * (self.edges[1:] + self.edges[:-1])
        if np.count_nonzero(logged) < 2:
            return np.full(len(self), np.nan)
        return np.interp(middle, middle[logged], self.speed[logged])

    def turned(self, matrix: Array, bias: Array | float = 0.0) -> "Windows":
        """Return a copy with corrected rates, in other axes.

        matrix: the rows are the new axes, shape (3, 3).
        bias: subtracted from the rates before they are rotated, shape (3), in rad/s.
        """
        rate, force = rotated(matrix, self.rate - bias, self.force)
        return replace(self, rate=rate, force=force)

    def padded(self, length: int) -> "Windows":
        """Return a copy with gaps of zero duration appended, so the number of windows is a multiple of `length`."""
        extra = -len(self) % length

        def longer(values: Array, fill: float = 0.0) -> Array:
            return np.concatenate((values, np.full((extra, *values.shape[1:]), fill)))

        return replace(
            self,
            edges=longer(self.edges, self.edges[-1]),
            speed=longer(self.speed, np.nan),
            gap=np.append(self.gap, np.ones(extra, dtype=bool)),
            rate=longer(self.rate),
            force=longer(self.force),
            jolt=longer(self.jolt),
            warm=longer(self.warm),
        )


def windows_of(t_s: Array, force: Array, rate: Array, speed: Array, warm: Array, aligned: bool = False) -> Windows:
    """Average samples over windows.

    Each sample represents the time up to half way to its neighbours, so the sum over a window is the integral.

    t_s: times of the samples, in s.
    force: shape (samples, 3), in g.
    rate: shape (samples, 3), in rad/s.
    speed: shape (samples), in m/s; NaN for no new value.
    warm: shape (samples), in C; see Windows.
    aligned: True if the axes are left, up, forward. Then each sample is expressed in the axes that the bike has in the
        middle of the window. If a bike rolls by 20 degrees in a window, means along rolling axes would be 0.5 % too
        small.
    """
    step = np.diff(t_s)
    usual = float(np.median(step)) if len(step) else WINDOW_S
    lost = step > max(GAP_S, 1.5 * usual)
    half = np.where(lost, 0.5 * usual, 0.5 * step)
    lead, trail = np.append(0.5 * usual, half), np.append(half, 0.5 * usual)
    begins = np.append(True, lost)  # True for the first sample of each stretch without missing readings
    since = t_s - t_s[begins][np.cumsum(begins) - 1]
    starts = np.flatnonzero(np.append(True, (np.diff(bin_numbers(since, WINDOW_S)) != 0) | lost))
    weight = lead + trail
    length = np.add.reduceat(weight, starts)

    def mean(values: Array) -> Array:
        return np.add.reduceat(values * weight[:, None], starts, axis=0) / length[:, None]

    logged = np.flatnonzero(~np.isnan(speed))
    window = np.searchsorted(starts, np.arange(len(t_s)), side="right") - 1
    if aligned:
        rolled = np.cumsum(rate[:, 2] * weight)
        turns = np.add.reduceat(rate[:, 2] * weight, starts)
        rolled -= 0.5 * rate[:, 2] * weight + (np.cumsum(turns) - 0.5 * turns)[window]
        force, rate = _rolled_back(force, rolled), _rolled_back(rate, rolled)
    in_window = np.full(len(starts), np.nan)
    in_window[window[logged]] = speed[logged]
    mean_rate = mean(rate)
    jolt = np.maximum.reduceat(np.linalg.norm(rate - mean_rate[window], axis=1), starts)
    gaps = np.flatnonzero(begins[starts])[1:]  # indices of the windows after missing readings
    ends = np.append(starts[1:], len(t_s)) - 1
    edges = np.insert((t_s - lead)[starts], gaps, (t_s + trail)[ends[gaps - 1]])
    return Windows(
        np.append(edges, t_s[-1] + trail[-1]),
        np.insert(mean_rate, gaps, 0.0, axis=0),
        np.insert(mean(force), gaps, 0.0, axis=0),
        np.insert(jolt, gaps, 0.0),
        np.insert(in_window, gaps, np.nan),
        np.insert(warm[starts], gaps, 0.0),
        np.insert(np.zeros(len(starts), dtype=bool), gaps, True),
        window + np.searchsorted(gaps, window, side="right"),
        lead,
        trail,
    )


def _rolled_back(vectors: Array, roll: Array) -> Array:
    """Express vectors in the axes that the bike had before it rolled.

    vectors: left, up and forward components, shape (samples, 3).
    roll: angle by which the bike has rolled to the right, shape (samples), in rad.
    """
    (left, up, forward), c, s = vectors.T, np.cos(roll), np.sin(roll)
    return np.column_stack((c * left - s * up, s * left + c * up, forward))
