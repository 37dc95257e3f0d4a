"""The lean of an upright pose that was not quite upright, found while riding straight.

A bike in balance feels no force to the side: what it feels on straights, on average, is how far the
alignment's upright is from the balance, plus what has drifted in the accelerometer. Both are to be taken off
the lean.
"""

from math import radians, sin

MAX_TRIM = radians(3.5)  # a pose off by 2 degrees, and what is left of the accelerometer's errors
START_SIGMA = radians(2.5)
FOUND_SIGMA = radians(0.7)  # of a trim kept from the ride before: the sensor is colder now
SIGMA_STRAIGHT = radians(1.5)  # rider, camber and wind
SIGMA_TURN = 0.4  # of the sine of the lean: tyre width and a rider hanging off add to the force in turns
SIGMA_YAW_S = 0.2  # per rad/s of yaw rate
MAX_SIDEWAYS = 0.1  # more than that is no bike in balance: it is being pushed, or the sensor is in a hand
LASTS_S = 2.0  # how long such a disturbance lasts
GROW = radians(0.01)  # per square root of a second


class UprightTrim:
    """A scalar Kalman filter. angle: radians to take off the lean, within MAX_TRIM. variance: its
    uncertainty."""

    def __init__(self):
        self.start(0.0)

    def start(self, angle):
        """Begin with what was found on earlier rides; 0 if nothing was."""
        self.angle = angle
        self.variance = (START_SIGMA if angle == 0.0 else FOUND_SIGMA) ** 2

    def update(self, sideways, lean, yaw_rate, seconds):
        """sideways: lateral over vertical force while riding; lean (rad), yaw_rate (rad/s): how straight it
        is."""
        if not -MAX_SIDEWAYS < sideways < MAX_SIDEWAYS:
            return
        turn = SIGMA_TURN * sin(lean - self.angle)
        yaw = SIGMA_YAW_S * yaw_rate
        noise = (SIGMA_STRAIGHT**2 + turn * turn + yaw * yaw) * 2.0 * LASTS_S / seconds
        self.variance += GROW**2 * seconds
        gain = self.variance / (self.variance + noise)
        self.angle = max(-MAX_TRIM, min(MAX_TRIM, self.angle + gain * (sideways - self.angle)))
        self.variance *= 1.0 - gain
