"""A ride in numbers, for its report and its pictures: maxima, times, and how far the aligned axes are off.

The errors of the axes are estimated from the forces.
* roll: on a straight, a balanced bike is upright, so the mean force points along the bike's own up axis.
* yaw: on a straight, braking and speeding up push along the bike's own forward axis.
* pitch: between two standstills on level ground, speeding up and braking cancel out. The remaining mean forward force
  shows the pitch error.
* gravity: at standstill, the force must be 1 g.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from kickstand.lean.kalman import MAX_TRIM
from kickstand.lean.meter import HELD_US
from kickstand.units import GAP_US, LOST_US

from ..calibration.mount import ForwardExchanged
from ..checks.log import FrozenReadings
from ..common.messages import Message
from ..logs.source import Progress
from ..signals import Array, Bools, smoothed
from .ride import Channels, Ride, downsampled, joined, spacing_s
from .stops import RATE_S, Stop, standing, stops_of

LEANS_DEG = (30.0, 40.0)
BIN_DEG = 1.0
HELD_S = 2e-6 * HELD_US  # a maximum of the lean must last this long, as on the display
BINS_DEG = np.arange(-70.0, 70.0 + BIN_DEG, BIN_DEG)

# Each error of the axes causes an error of the shown lean, measured with simulated rides and rotated calibrations.
# * With a yaw error, pitching looks like rolling: measured roll rate = roll rate cos(yaw) + pitch rate sin(yaw). The
#   error of the lean is then the bike's pitching times sin(yaw).
# * With a pitch error, yawing looks like rolling in the same way, but the filter corrects most of this error.
# * A roll error adds to the lean, but the filter corrects up to MAX_TRIM of it while riding.
YAW_COSTS_DEG, PITCH_COSTS_DEG = 3.0, 5.0  # rms error of the lean, divided by the sine of the angle

SMOOTH_S = 0.5
STRAIGHT_DPS, STRAIGHT_DEG = 2.0, 8.0  # largest yaw rate and largest lean on a straight
ENOUGH_S = 10.0  # a shorter time of straight riding does not show roll and yaw
LEVEL_S = 60.0  # in a longer time of riding, uphill and downhill roughly cancel out
ENOUGH_G = 0.05  # a smaller standard deviation of the forward force on straights does not show yaw

# Columns of the course that are not kept. In a long ride, they would use a quarter of the memory.
_NOT_KEPT = ("lean_formula_deg", "roll_rate_dps", "temp_c", "shown_g", "lean_sigma_deg", "utc_s")
# Averaging time of rates and forces that show whether a vehicle has moved. An idling engine at standstill shakes as
# much as a road, but the means over OVER_S hardly change.
OVER_S = 1.0
TURNS_DPS, PUSHES_G = 3.0, 0.05
MOVES_MPS = 1.0


@dataclass
class Peak:
    """The largest value so far, 0 without a value, and its time in the log."""

    value: float = 0.0
    time_s: float | None = None

    def add(self, t_s: Array, values: Array) -> None:
        """Add values and their times, both of shape (n). A value that does not count is NaN."""
        if len(values) and np.nanmax(values, initial=-np.inf) > self.value:
            index = int(np.nanargmax(values))
            self.value, self.time_s = float(values[index]), float(t_s[index])


@dataclass
class Summary:
    """A ride in numbers. Call add() block by block. Maxima of lean and force count only where a lean is shown."""

    samples: int = 0
    duration_s: float = 0.0  # time from the first to the last sample
    left_deg: Peak = field(default_factory=Peak)  # largest lean to the left that lasted for HELD_S
    right_deg: Peak = field(default_factory=Peak)  # largest lean to the right that lasted for HELD_S
    brake_g: Peak = field(default_factory=Peak)  # largest force backward, smoothed as on the display
    accel_g: Peak = field(default_factory=Peak)  # largest force forward, smoothed as on the display
    speed_mps: Peak = field(default_factory=Peak)
    # time in which the lean filter finds no rest. Unlike Overview.riding_s, it includes stops with a shaking engine.
    riding_s: float = 0.0
    # time at or above each lean in degrees
    beyond_s: dict[float, float] = field(default_factory=lambda: dict.fromkeys(LEANS_DEG, 0.0))
    # time at the leans of each bin of BINS_DEG, while riding with a trusted lean
    histogram_s: Array = field(default_factory=lambda: np.zeros(len(BINS_DEG) - 1))
    not_sure_s: float = 0.0  # time in which the display would not show the lean
    missing_s: float = 0.0  # total length of the gaps in the readings, each longer than LOST_US and 4 usual steps
    frozen_s: float = 0.0  # the part of missing_s with frozen readings
    _begin_s: float = 0.0
    _last_t_s: Array = field(default_factory=lambda: np.zeros(0))  # the last samples of the previous block
    _last_deg: Array = field(default_factory=lambda: np.zeros(0))

    def add(self, block: Channels) -> None:
        t = block.t_s
        self._begin_s = t[0] if not self.samples else self._begin_s
        step = np.diff(t, prepend=self._begin_s + self.duration_s)
        longest_s = max(LOST_US / 1e6, 4.0 * float(np.median(step)))  # at a low sample rate, long steps are no gaps
        self.missing_s += float(np.sum(step[step > longest_s]))
        step = np.where(step * 1e6 > GAP_US, 0.0, step)  # readings were missing
        self.samples += len(t)
        self.duration_s = float(t[-1] - self._begin_s)
        sure = block.trusted
        lean = np.where(sure, block.lean_deg, np.nan)
        forward = np.where(sure, block.shown_g, np.nan)
        self._update_maxima(t, lean)
        self.accel_g.add(t, forward)
        self.brake_g.add(t, -forward)
        self.speed_mps.add(t, block.speed_mps)
        for limit in self.beyond_s:
            self.beyond_s[limit] += float(np.sum(step[np.abs(lean) >= limit]))
        riding = block.resting < 0.5
        self.riding_s += float(np.sum(step[riding]))
        self.not_sure_s += float(np.sum(step[~sure]))
        held = riding & sure
        self.histogram_s += np.histogram(block.lean_deg[held], BINS_DEG, weights=step[held])[0]

    def _update_maxima(self, t_s: Array, lean: Array) -> None:
        """Update the maxima of the lean that last for HELD_S. lean: NaN where it is not trusted."""
        if not len(t_s):
            return
        step_s = float(np.median(np.diff(t_s))) if len(t_s) > 1 else HELD_S
        n = max(1, round(HELD_S / max(step_s, 1e-6)))
        t_s, lean = np.append(self._last_t_s, t_s), np.append(self._last_deg, lean)
        self._last_t_s, self._last_deg = t_s[-n:], lean[-n:]
        if len(lean) > n:
            for peak, values in ((self.right_deg, lean), (self.left_deg, -lean)):
                windows = np.lib.stride_tricks.sliding_window_view(values, n + 1)  # each window has n steps
                least = np.min(windows, axis=1)
                best = int(np.argmax(np.where(np.isnan(least), -np.inf, least)))
                index = best + int(np.argmin(windows[best]))
                peak.add(t_s[index : index + 1], least[best : best + 1])


def summary(channels: Channels) -> Summary:
    """Summarise a ride in numbers, from its channels (see vehicle_channels).

    >>> log = Log(np.arange(251) / 100.0, np.tile([0.0, 1.0, 0.0], (251, 1)), np.zeros((251, 3)))
    >>> total = summary(vehicle_channels(log, CalibrationFile(aligned=True)))
    >>> total.samples, total.duration_s, total.speed_mps.time_s
    (251, 2.5, None)
    """
    total = Summary()
    total.add(channels)
    return total


@dataclass
class Quality:
    """Angles by which the aligned axes seem to be off. An angle is None if the ride does not show it."""

    roll_deg: float | None  # positive if the aligned up axis leans to the right of the bike's own up
    pitch_deg: float | None  # positive if the aligned forward axis points up
    # positive if the aligned forward axis points to the right of the direction in which the bike speeds up
    yaw_deg: float | None
    gravity_g: float | None  # mean force at rest; None without a standstill
    straight_s: float  # seconds of straight riding, which show roll and yaw
    lateral_g: Array  # forces during straight riding, averaged over SMOOTH_S
    forward_g: Array  # as lateral_g


@dataclass
class LeanCost:
    """The approximate rms error of the shown lean, in degrees, that each angle causes. None for an unknown angle."""

    roll_deg: float | None
    pitch_deg: float | None
    yaw_deg: float | None


def lean_cost(quality: Quality) -> LeanCost:
    """Return the errors of a motorcycle's shown lean that these errors of the axes cause."""

    roll, pitch, yaw = quality.roll_deg, quality.pitch_deg, quality.yaw_deg
    return LeanCost(
        None if roll is None else max(0.0, abs(roll) - float(np.degrees(MAX_TRIM))),
        None if pitch is None else PITCH_COSTS_DEG * abs(float(np.sin(np.radians(pitch)))),
        None if yaw is None else yaw_cost_deg(yaw),
    )


def yaw_cost_deg(yaw_deg: float) -> float:
    """Return the average rms error of the shown lean that a yaw error of the alignment causes, in degrees."""
    return YAW_COSTS_DEG * abs(float(np.sin(np.radians(yaw_deg))))


def quality(ride: Channels, standing: Bools) -> Quality:
    """Compute the Quality from a whole ride of evenly spaced samples, and where the vehicle stands still in it.

    The module's docstring explains how each error shows.
    """
    step_s = spacing_s(ride)
    per_window = min(max(1, round(SMOOTH_S / step_s)), len(ride.t_s))
    count = len(ride.t_s) // per_window

    def means(values: Array) -> Array:
        return np.mean(values[: count * per_window].reshape(count, per_window), axis=1)

    left, up, forward = means(ride.left_g), means(ride.up_g), means(ride.forward_g)
    lateral, yaw_rate = means(ride.lateral_g), means(ride.yaw_rate_dps)
    moving = means(standing.astype(float)) == 0.0
    still = means(standing.astype(float)) == 1.0
    static = np.degrees(np.arctan2(left, up))
    not_turning = moving & (np.abs(yaw_rate) < STRAIGHT_DPS)
    usual = float(np.median(static[not_turning])) if np.any(not_turning) else 0.0  # measured lean of an upright bike
    straight = not_turning & (np.abs(static - usual) < STRAIGHT_DEG)
    straight_s = float(np.count_nonzero(straight)) * per_window * step_s
    roll = pitch = yaw = None
    if straight_s >= ENOUGH_S:
        roll = float(np.mean(static[straight]))
        change = forward[straight] - np.mean(forward[straight])
        if np.std(change) > ENOUGH_G:
            yaw = float(np.degrees(np.arctan(np.mean(change * left[straight]) / np.mean(change * change))))
    if standing[0] and standing[-1] and np.count_nonzero(moving) * per_window * step_s > LEVEL_S:
        mean_forward = float(np.mean(forward[moving]))  # from standstill to standstill, braking cancels speeding up
        pitch = float(np.degrees(np.arcsin(mean_forward))) if abs(mean_forward) < 1.0 else None
    sizes = np.sqrt(left * left + up * up + forward * forward)[still]
    gravity = float(np.mean(sizes)) if len(sizes) else None
    return Quality(roll, pitch, yaw, gravity, straight_s, lateral_g=lateral[straight], forward_g=forward[straight])


@dataclass
class Overview:
    """The data of a ride for its report and its pictures."""

    ride: Ride
    summary: Summary  # of all samples
    # channels averaged over RATE_S. Columns that neither report nor pictures need are NaN; vehicle_channels() has
    # them.
    course: Channels
    stops: list[Stop]  # as in a brake test; empty if forward and backward are exchanged
    quality: Quality  # how far the aligned axes seem to be off
    riding_s: float  # time without the standstills of standing(), in s, as shown by `report`
    notices: list[Message]  # remarks about the log, and contradictions to the calibration

    @property
    def exchanged(self) -> Message | None:
        """The notice that forward and backward are exchanged; None without this notice."""
        return next((notice for notice in self.notices if isinstance(notice, ForwardExchanged)), None)

    @property
    def has_speed(self) -> bool:
        """True if the log has a speed that is not always 0."""
        return self.summary.speed_mps.time_s is not None


def overview(ride: Ride, progress: Progress | None = None, keep: Callable[[Array], None] | None = None) -> Overview:
    """Read a ride of open_ride() part by part, so the memory hardly grows with the ride's length. Raises InputError.

    keep: called with the smoothed lean of successive samples, see Ride.read().

    >>> log = Log(np.arange(251) / 100.0, np.tile([0.0, 1.0, 0.0], (251, 1)), np.zeros((251, 3)))
    >>> seen = overview(open_ride(log, CalibrationFile(aligned=True)))
    >>> seen.summary.duration_s, seen.stops
    (2.5, [])
    """
    total = Summary()
    reading = ride.read(progress, keep)

    def parts() -> Iterator[Channels]:
        for part in reading.parts():
            total.add(part)
            yield replace(part, **dict.fromkeys(_NOT_KEPT, np.full(len(part.t_s), np.nan)))

    course = joined(downsampled(parts(), RATE_S))
    notices = reading.notices()
    # A speed that is always 0 does not prove a standstill, because a broken contact at the wheel also gives 0.
    if total.speed_mps.time_s is None:
        course = replace(course, speed_mps=np.broadcast_to(np.nan, len(course.t_s)))
    frozen_s = sum((notice.seconds for notice in notices if isinstance(notice, FrozenReadings)), 0.0)
    # The notice is about the whole log, even if the ride is a stretch of the log.
    total.frozen_s = min(frozen_s, total.missing_s) if ride.is_stretch else frozen_s
    still = standing(course)
    alignment = quality(course, still)
    # In a stretch, a vehicle may go straight ahead, or keep the same turn, from start to end
    moved = ride.is_stretch or _has_moved(course)
    moved_s = min(total.riding_s, float(np.count_nonzero(~still)) * spacing_s(course)) if moved else 0.0
    notices = [replace(n, roll_deg=alignment.roll_deg) if isinstance(n, ForwardExchanged) else n for n in notices]
    result = Overview(ride, total, course, [], alignment, moved_s, notices)
    if not result.exchanged:
        result.stops = stops_of(course, still)
    return result


def _has_moved(ride: Channels) -> bool:
    if np.any(~np.isnan(ride.speed_mps)):
        return bool(np.nanmax(ride.speed_mps) > MOVES_MPS)
    half = round(0.5 * OVER_S / spacing_s(ride))
    if len(ride.t_s) <= 2 * half:
        return False
    inner = slice(half, len(ride.t_s) - half)  # near the ends, a mean contains mostly the first or the last sample
    turns, pushes = (smoothed(values, ride.t_s, OVER_S)[inner] for values in (ride.yaw_rate_dps, ride.forward_g))
    return _changes(turns) > TURNS_DPS or _changes(pushes) > PUSHES_G


def _changes(means: Array) -> float:
    """Return the largest difference of the means from their median, which is the gyro's bias or the ground's slope."""
    return float(np.max(np.abs(means - np.median(means))))
