"""Finds the yaw of a ride from the sensor alone, and its yaw and forces over the steps of a track.

This needs no calibration, and the sensor may be mounted at any angle.

Up is the mean direction of the force in bends, because a motorcycle leans until the force points along its own up. The
rate about up is the yaw rate times the cosine of the lean.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..checks.log import CheckedLog
from ..common.messages import InputError
from ..signals import Array, Bools, binned, moving_mean
from .track import Course, Segments, without_trend

STEP_S = 0.05
_MOST_DPS = 20.0  # a bin with a higher rate gets no more weight when up is computed
_LONGEST_S = 100 * 3600.0  # longest ride; memory limits it
_MOST_SINE = 0.87  # largest sine of the lean; over 60 degrees, the speed or the rate is wrong


@dataclass
class BinMotion:
    """A ride in n bins of STEP_S from its first sample.

    force_g: mean force of each bin along the sensor's axes, shape (n, 3).
    rate_dps: mean rate of each bin about the sensor's axes, minus the gyro's bias, shape (n, 3).
    valid: False in a bin without samples or with frozen readings, shape (n). Its force and rate are 0.
    has_speed, has_positions: True if the log has them.
    """

    force_g: Array
    rate_dps: Array
    valid: Bools
    has_speed: bool
    has_positions: bool

    @property
    def t_s(self) -> Array:
        """The middle of each bin, in s since the first sample, shape (n)."""
        return np.arange(0.5, len(self.valid)) * STEP_S

    @property
    def seconds(self) -> float:
        """Duration of the ride."""
        return len(self.valid) * STEP_S

    @property
    def up(self) -> Array:
        """Return the bike's up in the sensor's axes, shape (3). The direction is exact to a few degrees only, because
        it includes the accelerometer's bias."""
        turning = np.minimum(np.linalg.norm(self.rate_dps, axis=1), _MOST_DPS)
        up: Array = turning @ self.force_g
        return up / max(float(np.linalg.norm(up)), 1e-9)


def motion(ride: CheckedLog) -> BinMotion:
    """The BinMotion of a checked log. Raises InputError if all readings are frozen, or for a ride that is too long."""
    log, measured = ride.log, ride.measured
    if log.t_s[-1] > _LONGEST_S:
        raise InputError(f"{log.name} is longer than {_LONGEST_S / 3600:.0f} hours: cut it first")
    part = log if np.all(measured) else log.part(measured)
    longest = round(_LONGEST_S / STEP_S) + 1
    bins = binned(part.t_s, STEP_S, [*part.accel_g.T, *part.gyro_dps.T], [], longest, longest)
    if bins is None:
        raise InputError(f"{log.name}: all readings are frozen: check the sensor")
    missing = np.zeros((bins.first, 6))  # stays 0 if the readings are frozen from the beginning
    means = np.vstack((missing, bins.means - np.append(np.zeros(3), np.nanmedian(bins.means[:, 3:], axis=0))))
    valid = np.append(missing[:, 0], bins.count) > 0
    means[~valid] = 0.0
    has_speed, has_positions = (bool(np.any(np.isfinite(values))) for values in (log.speed_mps, log.lat_deg))
    return BinMotion(means[:, :3], means[:, 3:], valid, has_speed, has_positions)


class Comparison:
    """Compares a ride with a track. A shift is the track's time at the ride's first sample, in s since the track's
    first point.

    given: the segments of the track that are within the ride for every shift within margin_s.
    """

    def __init__(self, motion: BinMotion, course: Course, segments: Segments, shift_s: float, margin_s: float) -> None:
        begin_s, end_s = segments.begin_s[:, 0] - shift_s, segments.end_s[:, -1] - shift_s
        within = (begin_s > margin_s) & (end_s < motion.seconds - margin_s)
        missing = np.append(0, np.cumsum(~motion.valid))
        first, last = (
            np.clip(np.rint(limit_s / STEP_S).astype(int), 0, len(motion.valid)) for limit_s in (begin_s, end_s)
        )
        within &= missing[last] - missing[first] <= 0.05 * (last - first)
        self.given = segments.part(within)
        self.middle_s = float(self.given.middle_s.mean()) if np.any(within) else 0.0
        self._sums = _double_sums(motion, course, shift_s)
        self._edges_s = np.arange(len(motion.valid) + 1) * STEP_S

    def turned(self, shift_s: float, drift: float = 0.0, axes: int = 3) -> Array:
        """Return the ride's rotation about its up and about two axes across it, in degrees, shape (axes, p, STEPS).

        Compare it with Segments.turned_deg. drift: seconds per second that the ride's clock loses against the
        track's."""
        return self._means(range(axes), shift_s, drift, self.given.course_weight)

    def sped_up(self, shift_s: float, drift: float = 0.0) -> Array:
        """Return the integral of the force along the sensor's axes, in m/s, shape (3, p, STEPS). Compare it with
        Segments.speed_mps."""
        return self._means(range(3, 6), shift_s, drift, self.given.speed_weight)

    def _means(self, columns: range, shift_s: float, drift: float, weight: Array) -> Array:
        track = self.given
        shift = shift_s + drift * (track.middle_s - self.middle_s)
        begin_s, end_s = track.begin_s - shift, track.end_s - shift
        means = []
        for column in columns:
            sums = self._sums[:, column]
            mean = np.interp(end_s, self._edges_s, sums) - np.interp(begin_s, self._edges_s, sums)
            means.append(without_trend(mean / (end_s - begin_s), weight, track.middle_s))
        return np.array(means)


def _double_sums(motion: BinMotion, course: Course, shift_s: float) -> Array:
    """Return six integrals over time, of angles and speeds, shape (n + 1, 6).

    The mean of an angle or a speed between two times is the difference of its integral, divided by the duration.

    Columns 0 to 2 integrate the rotation about up and about two axes across it, in degrees. Columns 3 to 5 integrate
    the speed that the force along the sensor's axes causes, in m/s. The rate about up is the yaw rate times the cosine
    of the lean. The lean of a balanced bike follows from the track's speed and the yaw rate.
    """
    up = motion.up
    across = np.asarray(np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))]), dtype=float)
    across /= np.linalg.norm(across)
    rates = motion.rate_dps @ np.vstack((up, across, np.cross(up, across))).T
    yaw_dps = moving_mean(rates[:, 0], round(1.0 / STEP_S))
    middle_s = (course.begin_s + course.end_s) / 2.0
    speed = np.interp(motion.t_s + shift_s, middle_s, np.where(course.good, course.speed_mps, 0.0))
    sine = np.minimum(np.abs(speed * np.radians(yaw_dps)) / STANDARD_GRAVITY, _MOST_SINE)
    cosine = np.asarray(np.sqrt(1.0 - sine * sine), dtype=float)
    angle_deg = _sums(rates / cosine[:, None])
    speed_mps = _sums(motion.force_g * STANDARD_GRAVITY)
    # subtract gravity, whose large sums would cost digits
    speed_mps -= np.linspace(0.0, 1.0, len(speed_mps))[:, None] * speed_mps[-1]
    at_edges = np.hstack((angle_deg, speed_mps))
    return _sums((at_edges[1:] + at_edges[:-1]) / 2.0)


def _sums(values: Array) -> Array:
    """Integrate each column from the first edge to each edge.

    values: one row per bin, shape (n, k). Returns one row per edge, shape (n + 1, k).
    """
    return np.vstack((np.zeros(values.shape[1]), np.cumsum(values * STEP_S, axis=0)))
