"""Is the speed a speed? What can be seen of it without knowing where forward is."""

from math import sqrt

from ..errors import AlignmentError

NEGATIVE_MPS = -0.5  # noise around zero is not negative
LIVELY_G = 0.03  # between the means of two seconds: standing never, driving most of the time
TURNING_DPS = 5.0  # a turn at a steady speed is lively too
STUCK_S = 8  # so many lively seconds at the very same speed: the begins and ends of four brakings; and
STUCK_SHARE = 0.15  # this share of all the seconds it lasted


class SpeedCheck:
    """problem: an AlignmentError, or None."""

    def __init__(self):
        self.problem = None
        self._speed = None
        self._changed()
        self._before = None
        self._sums = [0.0] * 3
        self._turned = self._turned_before = 0.0
        self._sums_us = 0

    def _changed(self):
        self._seconds = self._lively = 0

    def measure(self, speed_mps):
        """A new value."""
        if not speed_mps >= NEGATIVE_MPS:  # also not-a-number
            self.problem = AlignmentError("speed-negative", speed_mps)
        if speed_mps != self._speed:
            self._speed = speed_mps
            self._changed()

    def update(self, force, yaw_dps, dt_us):
        """Mean force (3, g) and rate about the vertical (deg/s) of the last dt_us."""
        sums = self._sums
        for i in range(3):
            sums[i] += force[i] * dt_us
        self._turned += abs(yaw_dps) * dt_us
        self._sums_us += dt_us
        if self._sums_us >= 1_000_000:
            self.second([total / self._sums_us for total in sums], self._turned / self._sums_us)
            self._turned = 0.0
            self._sums_us = 0
            for i in range(3):
                sums[i] = 0.0

    def second(self, force, yaw_dps=0.0):
        """Mean force (3, g) and rate of turning (deg/s) of the last second."""
        before, self._before = self._before, list(force)
        turning = max(yaw_dps, self._turned_before) > TURNING_DPS
        self._turned_before = yaw_dps
        if before is None or self._speed is None or turning:
            return
        d0, d1, d2 = force[0] - before[0], force[1] - before[1], force[2] - before[2]
        self._seconds += 1
        if sqrt(d0 * d0 + d1 * d1 + d2 * d2) > LIVELY_G:
            self._lively += 1
        if self._lively >= STUCK_S and self._lively >= STUCK_SHARE * self._seconds:
            self.problem = AlignmentError("speed-stuck", self._speed)
