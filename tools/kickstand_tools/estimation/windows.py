"""Averages a ride over windows of a fifth of a second, and finds standstills, hands, rough lean and speed in them."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..checks.leaning import WINDOW_S, averaged, moving_deviation
from ..signals import STANDING_MPS, Array, Bools, Ints, bin_numbers, rotated

GAP_S = 0.17  # if the time between two samples is longer, readings are missing

STILL_S = 1.6  # least length of a standstill; a shorter standstill looks like smooth riding
STILL_RADPS, STILL_G = np.radians(0.35), 0.010  # largest standard deviations over STILL_S on a standing bike
STANDS = 4.0  # factor on both limits if the speed is under STANDING_MPS
BIAS_RADPS = np.radians(4.0)  # largest bias of the gyro since its calibration; a higher mean rate is a bend
MOUNTED_S, MOUNTED_DEG = 10.0, 35.0  # largest angle between up and the mean force over MOUNTED_S, for a mounted sensor
BETWEEN_S = 20.0  # a shorter time between two movements in a hand also counts as time in the hand
SURELY_S = 4.0  # a movement longer than this is certainly in a hand; a shorter movement may be riding or a fall
SLOW_S = 4.0  # changes of lean slower than this are computed from the yaw rate, faster changes from the roll rate
TURNS_S = 40.0  # the speed is computed from the bends within this time
# The prior of the speed from the bends is USUAL_MPS. The prior has the weight of bends with the yaw rate USUAL_RADPS.
USUAL_MPS, USUAL_RADPS = 10.0, 0.14


@dataclass
class Windows:
    """n successive windows. A stretch without readings is one window whose `gap` is True."""

    edges: Array  # times at which the windows start and end, shape (n + 1), in s
    rate: Array  # mean rates along the vehicle's axes, shape (n, 3), in rad/s
    force: Array  # mean forces along the vehicle's axes, shape (n, 3), in g
    jolt: Array  # largest difference of a sample's rate from the mean of its window, shape (n), in rad/s
    speed: Array  # shape (n), in m/s; NaN if unknown
    warm: Array  # temperature minus the temperature at the start of the log, shape (n), in C; 0 if unknown
    gap: Bools  # True where readings are missing, shape (n)
    number: Ints  # index of each sample's window, shape (samples)
    before: Array  # time that each sample represents before it, shape (samples), in s
    after: Array  # time that each sample represents after it, shape (samples), in s

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
        """Speed in each window, interpolated between the logged speeds, in m/s; NaN with fewer than two speeds."""
        logged, middle = ~np.isnan(self.speed), 0.5 * (self.edges[1:] + self.edges[:-1])
        if np.count_nonzero(logged) < 2:
            return np.full(len(self), np.nan)
        return np.interp(middle, middle[logged], self.speed[logged])

    def turned(self, matrix: Array, bias: Array | float = 0.0) -> "Windows":
        """Return a copy in the axes that are the rows of `matrix`, with the bias (rad/s) subtracted from the rates."""
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
    """Average samples over windows. Each sample represents the time up to half way to its neighbours.

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
        # how far the bike has rolled since the middle of the window
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
        edges=np.append(edges, t_s[-1] + trail[-1]),
        rate=np.insert(mean_rate, gaps, 0.0, axis=0),
        force=np.insert(mean(force), gaps, 0.0, axis=0),
        jolt=np.insert(jolt, gaps, 0.0),
        speed=np.insert(in_window, gaps, np.nan),
        warm=np.insert(warm[starts], gaps, 0.0),
        gap=np.insert(np.zeros(len(starts), dtype=bool), gaps, True),
        number=window + np.searchsorted(gaps, window, side="right"),
        before=lead,
        after=trail,
    )


def _rolled_back(vectors: Array, roll: Array) -> Array:
    """Express vectors (left, up, forward) in the axes that the bike had before it rolled to the right, by rad."""
    (left, up, forward), c, s = vectors.T, np.cos(roll), np.sin(roll)
    return np.column_stack((c * left - s * up, s * left + c * up, forward))


def standing(w: Windows) -> Bools:
    """Find the windows in which the bike stands still, shape (n), for zero-velocity updates."""
    return calm(w) & (np.linalg.norm(averaged(w.rate, STILL_S), axis=1) < BIAS_RADPS)


def calm(w: Windows) -> Bools:
    """Find the windows around which the readings hardly change, so that the bike seems to stand still, shape (n).

    A constant rate is calm, because it may be a bias. In a steady bend the rate is constant too, so the caller must
    also check the mean rate.
    """
    speed = w.known_speed
    allowed, still = np.where(speed < STANDING_MPS, STANDS, 1.0), ~w.gap & ~(speed >= STANDING_MPS)
    still &= moving_deviation(w.rate, STILL_S) < allowed * STILL_RADPS
    return still & (moving_deviation(w.force, STILL_S) < allowed * STILL_G)


def in_hand(w: Windows) -> tuple[Bools, Bools]:
    """Find the windows in which a hand moves the sensor, or the bike has fallen: up is far from its usual direction.

    On a balanced bike, the force points along the bike's own up at any lean. Returns True where this is certain, and
    also in the seconds around, because the bike may not be riding there, both of shape (n).
    """
    valid = ~w.gap
    mean = averaged(w.force * valid[:, None], MOUNTED_S)
    tilted = valid & (mean[:, 1] < np.cos(np.radians(MOUNTED_DEG)) * np.linalg.norm(mean, axis=1))
    moved = np.flatnonzero(tilted)
    # If the time between two movements in a hand is short, the sensor was perhaps in the hand all this time. The same
    # holds for the time from the beginning of the log to the first movement, and from the last movement to the end.
    if len(moved):
        ends = np.concatenate(([0], moved, [len(w) - 1]))
        for begin, end in itertools.pairwise(ends):
            if w.edges[end + 1] - w.edges[begin] < BETWEEN_S:
                tilted[begin : end + 1] = True
    share = tilted.astype(float)
    return averaged(share, SURELY_S) > 0.99, averaged(share, MOUNTED_S) > 0.01


def lean_and_speed(w: Windows, still: Bools) -> tuple[Array, Array]:
    """Approximate the lean, in rad, and the speed, in m/s, in n windows. still: see standing().

    Without a speed in the log, the bends give it: in balance, the force is 1 / cos(lean) in g, and speed x yaw rate =
    g tan(lean).
    """
    log_speed, yaw = w.known_speed, w.rate[:, 1]
    force = averaged(np.linalg.norm(w.force[:, :2], axis=1), 2.0)
    steep = np.tan(np.arccos(np.clip(1.0 / np.maximum(force, 0.1), 0.3, 1.0)))
    turning = np.abs(averaged(yaw, 1.0))
    weighted = averaged(steep * turning, TURNS_S) * STANDARD_GRAVITY + USUAL_RADPS**2 * USUAL_MPS
    speed = np.clip(weighted / (averaged(turning**2, TURNS_S) + USUAL_RADPS**2), 3.0, 50.0)
    speed = np.where(still, 0.0, np.where(np.isnan(log_speed), speed, log_speed))
    slow = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    slow = np.where(still, np.arctan2(w.force[:, 0], w.force[:, 1]), slow)
    rolled = np.cumsum(w.rate[:, 2] * w.seconds)
    return np.clip(rolled - averaged(averaged(rolled - slow, SLOW_S), SLOW_S), -1.3, 1.3), speed
