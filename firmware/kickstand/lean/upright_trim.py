"""Estimates the trim: the correction of the roll misalignment, because the alignment's upright pose was not quite
upright.

A bike in balance has no specific force to the side. The mean force to the side on straights comes from the roll
misalignment and from the accelerometer's drift, so both effects are subtracted from the lean. In bends wide tyres and a
rider who hangs off add a force whose sign differs between left and right bends. The trim is the part that left and
right bends have in common.
"""

from math import radians, sin

from ..units import const

# rad: largest trim, the sum of 2 degrees for an inexact upright pose, and the accelerometer's remaining errors
MAX_TRIM = radians(3.5)
# The comment of each parameter has its unit, its meaning and, after "Larger:", the effect of a larger value.

# rad: standard deviation of the trim after new poses. Larger: the trim is found sooner, and varies more.
SIGMA_START = radians(2.5)
# rad: standard deviation of a trim from an earlier ride, because the sensor was colder or hotter then. Larger: the trim
# is found sooner, and varies more.
SIGMA_KEPT = radians(0.7)
# rad: force to the side divided by force up on straights, caused by rider, camber and wind. Larger: the trim is found
# later.
SIGMA_STRAIGHT = radians(1.5)
# ratio: standard deviation of the force to the side in bends, divided by sin(lean). Tyres and rider cause this force.
# Larger: bends to one side count less.
_SIGMA_LEAN_SHARE = const(0.15)
# ratio: variation of the force to the side from bend to bend, divided by sin(lean). The rider causes it. Larger: bends
# count less.
_SIGMA_TURN = const(0.04)
# rad per rad/s: additional measurement noise, divided by the yaw rate. Larger: bends count less.
_SIGMA_YAW_S = const(0.03)
# ratio: largest innovation that counts. Larger: a sensor in a hand counts as a balanced bike.
_MAX_SIDEWAYS = const(0.1)
_DISTURBANCE_S = const(2.0)  # s: duration of wind or camber. Larger: the trim is found later, and varies less.
# rad per square root of a second: process noise of the trim. Larger: a change of the trim is found sooner.
NOISE = radians(0.01)


class UprightTrim:
    """A Kalman filter of two states.

    Args:
        angle: the trim found on earlier rides, in rad, or 0.

    Read-only attributes:
        angle: the trim in rad, within MAX_TRIM. The trim is subtracted from the lean.
        variance: the variance of the trim in rad^2.
    """

    def __init__(self, angle):
        self.angle = angle
        self.variance = (SIGMA_START if angle == 0.0 else SIGMA_KEPT) ** 2
        # The second state: tyres and rider make a bike lean more or less than balance requires, equally on both sides
        self._lean_share = 0.0  # times sin(lean)
        self._share_variance = _SIGMA_LEAN_SHARE**2
        self._covariance = 0.0

    def unexplained(self, sideways, lean):
        """Return the part of a force to the side that trim, tyres and rider do not explain.

        Arguments as in update()."""
        return sideways - self.angle - sin(lean - self.angle) * self._lean_share

    def update(self, sideways, lean, yaw_rate, seconds):
        """Update the angle with one measurement made while riding.

        Args:
            sideways: force to the left divided by force up.
            lean: in rad. Lean and yaw rate increase the noise in bends.
            yaw_rate: in rad/s.
            seconds: time since the previous update.
        """
        sine = sin(lean - self.angle)
        innovation = sideways - self.angle - sine * self._lean_share
        if not -_MAX_SIDEWAYS < innovation < _MAX_SIDEWAYS:
            return
        turn = _SIGMA_TURN * sine
        yaw = _SIGMA_YAW_S * yaw_rate
        noise = (SIGMA_STRAIGHT**2 + turn * turn + yaw * yaw) * 2.0 * _DISTURBANCE_S / seconds
        self.variance += NOISE**2 * seconds
        # P H^T of the measurement sideways = angle + lean_share sin(lean), H = (1, sin(lean))
        angle_gain = self.variance + sine * self._covariance
        share_gain = self._covariance + sine * self._share_variance
        expected = angle_gain + sine * share_gain + noise
        innovation /= expected
        self.angle = max(-MAX_TRIM, min(MAX_TRIM, self.angle + angle_gain * innovation))
        self._lean_share += share_gain * innovation
        self.variance -= angle_gain * angle_gain / expected
        self._covariance -= angle_gain * share_gain / expected
        self._share_variance -= share_gain * share_gain / expected
