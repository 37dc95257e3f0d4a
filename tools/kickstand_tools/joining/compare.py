"""Computes a ride's yaw and forces over the steps of a track, for any shift between their clocks."""

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array, moving_mean
from .motion import STEP_S, BinMotion
from .track import Course, Segments, without_trend

_MOST_SINE = 0.87  # largest sine of the lean; over 60 degrees, the speed or the rate is wrong


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
    """Return six integrals over time, shape (n + 1, 6). Their differences give means between two times.

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
    turned = _sums(rates / cosine[:, None])
    sped_up = _sums(motion.force_g * STANDARD_GRAVITY)
    # subtract gravity, whose large sums would cost digits
    sped_up -= np.linspace(0.0, 1.0, len(sped_up))[:, None] * sped_up[-1]
    once = np.hstack((turned, sped_up))
    return _sums((once[1:] + once[:-1]) / 2.0)


def _sums(values: Array) -> Array:
    """Integrate each column from the first edge to each edge.

    values: one row per bin, shape (n, k). Returns one row per edge, shape (n + 1, k).
    """
    return np.vstack((np.zeros(values.shape[1]), np.cumsum(values * STEP_S, axis=0)))
