"""From one reading of the chip to lean and g: calibration, alignment, lean. The way of a sample, on the
board and in replay."""

from .lean import SmoothedLean, formula_lean_deg
from .rotation import rotate, vector

SETTLE_US = 150_000  # before lean is shown and maxima count


class LeanMeter:
    """Lean and acceleration of the vehicle.

    After update(): force (left, up, forward in g), rate (about left, up, forward in deg/s), lean_deg (shown,
    > 0 right), lean_formula_deg (Nicolae's, sample by sample), smooth_force (g, for display), sensor_force
    and sensor_rate (calibrated, in the sensor's axes), and the maxima since reset_maxima().
    """

    def __init__(self, calibration):
        self.calibration = calibration
        self.force = vector()
        self.rate = vector()
        self.sensor_force = vector()
        self.sensor_rate = vector()
        self.restart()
        self.reset_maxima()

    def restart(self):
        """Forget the past: after a new calibration, or after readings were missing."""
        self._smoothed = SmoothedLean()
        self.smooth_force = self._smoothed.force
        self._age_us = 0
        self.lean_deg = 0.0
        self.lean_formula_deg = 0.0

    def reset_maxima(self):
        """Start the held maxima again."""
        self.max_left_deg = 0.0
        self.max_right_deg = 0.0
        self.max_accel_g = 0.0
        self.max_brake_g = 0.0

    @property
    def settled(self):
        """True once lean_deg has enough readings behind it to be shown."""
        return self._age_us >= SETTLE_US

    def update(self, reading, dt_us):
        """reading: 7 numbers in the chip's order; dt_us: integer microseconds since the one before (0 for
        the first)."""
        force, rate = self.sensor_force, self.sensor_rate
        self.calibration.apply(reading, force, rate)
        matrix = self.calibration.vehicle_from_sensor
        rotate(self.force, matrix, force)
        rotate(self.rate, matrix, rate)
        self.lean_formula_deg = formula_lean_deg(self.force, self.rate[1])
        self.lean_deg = self._smoothed.update(self.force, self.rate, dt_us)
        if self._age_us < SETTLE_US:
            self._age_us += dt_us
        else:
            self._hold_maxima()

    def _hold_maxima(self):
        lean, forward = self.lean_deg, self.smooth_force[2]
        self.max_right_deg = max(self.max_right_deg, lean)
        self.max_left_deg = max(self.max_left_deg, -lean)
        self.max_accel_g = max(self.max_accel_g, forward)
        self.max_brake_g = max(self.max_brake_g, -forward)
