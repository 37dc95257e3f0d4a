"""Lean angle from forces and yaw rate in the vehicle frame (A. Nicolae, section 5, signs put right).

With lean t > 0 to the right, s the centripetal acceleration in g (> 0 in a left turn) and forces in g:
    A_up cos t + A_left sin t = 1        (22)
    A_left cos t - A_up sin t = s        (23, corrected)
    A_left^2 + A_up^2 = 1 + s^2          (24)
"""

from math import acos, asin, atan2, degrees, sqrt

from .rotation import vector

_TOO_SMALL = 0.01  # (0.1 g)^2: in free fall no force tells a direction


def lean_acos_deg(force):
    """Lean of a standing bike by (21), acos(A_up / g), as the paper has it: no sign, blind near upright.
    0..180 degrees."""
    size = sqrt(force[0] * force[0] + force[1] * force[1])
    if size * size < _TOO_SMALL:
        return 0.0
    return degrees(acos(max(-1.0, min(1.0, force[1] / size))))


def static_lean_deg(force):
    """Lean of a standing bike in degrees, > 0 to the right: (21) with a sign, and exact near upright."""
    return degrees(atan2(force[0], force[1]))


def centripetal_g(left_g, up_g, yaw_rate):
    """s in g by (26): its size from the force, its sign from the yaw rate about up (left turn > 0; none
    gives 0)."""
    excess = left_g * left_g + up_g * up_g - 1.0
    if excess <= 0.0 or yaw_rate == 0.0:
        return 0.0
    return sqrt(excess) if yaw_rate > 0.0 else -sqrt(excess)


def formula_lean_deg(force, yaw_rate):
    """Nicolae's lean (25)-(26) in degrees, > 0 to the right. force: left, up, forward in g; yaw rate in any
    unit.

    Right on average and noisy near upright: 1 % of vibration is 8 degrees. In free fall (under 0.1 g) it
    says 0.
    """
    left, up = force[0], force[1]
    square = left * left + up * up
    if square < _TOO_SMALL:
        return 0.0
    sine = (left - centripetal_g(left, up, yaw_rate) * up) / square
    return degrees(asin(max(-1.0, min(1.0, sine))))


class SmoothedLean:
    """Nicolae's lean made readable: averaged, and kept up to date by the roll rate.

    Forces and yaw rate are averaged before the square root of (26), which turns noise of either sign into lean.
    s is bounded by what the yaw rate allows at TOP_SPEED, so a bike that does not turn, standing or straight,
    shows its static lean whatever the vibration. The lean of the averages is late by the averaging; so it is
    compared with what was shown equally long ago, and what is shown follows the roll rate at once.
    """

    AVERAGE_US = 300_000  # time constant of the averages
    CORRECTION_US = 1_000_000  # time constant of the way back to them; 1 deg/s of gyro bias costs a degree
    TOP_SPEED_G_PER_DPS = 70.0 / 9.80665 / 57.29578  # s = v * yaw rate at 70 m/s

    def __init__(self):
        self.force = vector()  # averaged: left, up, forward in g
        self._yaw_rate = 0.0  # averaged, deg/s
        self._lean = 0.0
        self._late_lean = 0.0  # averaged like the forces
        self._count = 0

    def update(self, force, rate, dt_us):
        """Take one sample dt_us after the one before (0 for the first); return lean in degrees, > 0 to the right.

        force (g) and rate (deg/s): left, up, forward.
        """
        if dt_us > self.AVERAGE_US:  # a gap: what came before is too old to average with
            self._count = 0
        self._count += 1
        gain = max(dt_us / (self.AVERAGE_US + dt_us), 1.0 / self._count)  # a plain mean at first
        mean = self.force
        for i in range(3):
            mean[i] += gain * (force[i] - mean[i])
        self._yaw_rate += gain * (rate[1] - self._yaw_rate)
        self._lean += rate[2] * (dt_us * 1e-6)
        self._late_lean += gain * (self._lean - self._late_lean)
        limit = abs(self._yaw_rate) * self.TOP_SPEED_G_PER_DPS
        s = max(-limit, min(limit, centripetal_g(mean[0], mean[1], self._yaw_rate)))
        # (22)-(24) say that the force lies atan(s) beyond the lean: the same as (25), and defined for every force
        averaged_lean = degrees(atan2(mean[0], mean[1]) - atan2(s, 1.0))
        if gain * self._count <= 1.0:
            self._lean = self._late_lean = averaged_lean
        else:
            self._lean += dt_us / self.CORRECTION_US * (averaged_lean - self._late_lean)
        return self._lean
