"""Checks that the source's speed is the vehicle's speed in m/s and arrives in time."""

from math import sqrt

from ..errors import AlignmentError
from ..units import const

_NEGATIVE_MPS = const(-0.5)  # a speed of 0 to this may be noise of a standing vehicle
# A second is lively if its mean force differs by more than _LIVELY_G from the mean force of the previous second. At
# standstill no second is lively. While driving, most seconds are lively.
_LIVELY_G = const(0.03)
# A second with a larger yaw rate and the second after it do not count, because the force changes in a bend too.
_TURNING_DPS = const(5.0)
# The speed is stuck if it has not changed for at least _STUCK_S lively seconds, and at least _STUCK_SHARE of all
# seconds since its last change are lively. Four braking events together have 8 lively seconds.
_STUCK_S = const(8)
_STUCK_SHARE = const(0.15)
# Limits of the ratio between the change of force and the change of speed. The ratio should be 1. The pitch of a braking
# vehicle and a coarsely rounded speed shift the ratio by 0.2.
MIN_FORCE_RATIO, MAX_FORCE_RATIO = 0.75, 1.35
MAX_LAG_S = 1.9


def speed_unit_problem(force_ratio):
    """Return the AlignmentError for changes of speed that do not fit the force.

    Args:
        force_ratio: change of force per change of speed.
    """
    return AlignmentError("speed-unit", min(1.0 / max(force_ratio, 0.01), 99.9))


def fit_problem(lag_s, force_ratio):
    """Return an AlignmentError if the regression of force on change of speed shows a fault of the speed, else None.

    Args:
        lag_s: lag of the speed in seconds.
        force_ratio: change of force per change of speed.
    """
    if lag_s >= MAX_LAG_S:
        return AlignmentError("speed-late", lag_s)
    if not MIN_FORCE_RATIO < force_ratio < MAX_FORCE_RATIO:
        return speed_unit_problem(force_ratio)
    return None


class SpeedCheck:
    """Finds a negative or stuck speed. The check does not need to know forward.

    Attributes:
        problem: an AlignmentError, or None.
    """

    def __init__(self):
        self.problem = None
        self._speed = None
        self._start_count()
        self._force_before = None
        self._force_us = [0.0] * 3
        self._turned = self._yaw_dps_before = 0.0
        self._sums_us = 0

    def _start_count(self):
        """Restart the count of lively seconds, because the speed has changed."""
        self._seconds = self._lively_seconds = 0

    def measure(self, speed_mps):
        """Take a new value of the speed source."""
        if not speed_mps >= _NEGATIVE_MPS:  # also rejects NaN
            self.problem = AlignmentError("speed-negative", speed_mps)
        if speed_mps != self._speed:
            self._speed = speed_mps
            self._start_count()

    def update(self, force, yaw_dps, dt_us):
        """Take the means over the last dt_us.

        Args:
            force: mean force, 3 values in g.
            yaw_dps: mean yaw rate in deg/s.
            dt_us: microseconds.
        """
        sums = self._force_us
        for i in range(3):
            sums[i] += force[i] * dt_us
        self._turned += abs(yaw_dps) * dt_us
        self._sums_us += dt_us
        if self._sums_us >= 1_000_000:
            self.update_second([total / self._sums_us for total in sums], self._turned / self._sums_us)
            self._turned = 0.0
            self._sums_us = 0
            for i in range(3):
                sums[i] = 0.0

    def update_second(self, force, yaw_dps=0.0):
        """Take the means over the last second.

        Args:
            force: mean force, 3 values in g.
            yaw_dps: mean absolute yaw rate in deg/s.
        """
        previous, self._force_before = self._force_before, list(force)
        turning = max(yaw_dps, self._yaw_dps_before) > _TURNING_DPS
        self._yaw_dps_before = yaw_dps
        if previous is None or self._speed is None or turning:
            return
        d0, d1, d2 = force[0] - previous[0], force[1] - previous[1], force[2] - previous[2]
        self._seconds += 1
        if sqrt(d0 * d0 + d1 * d1 + d2 * d2) > _LIVELY_G:
            self._lively_seconds += 1
        if self._lively_seconds >= _STUCK_S and self._lively_seconds >= _STUCK_SHARE * self._seconds:
            self.problem = AlignmentError("speed-stuck", self._speed)
