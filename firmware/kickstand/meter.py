"""From one reading of the chip to lean and g: calibration, alignment, lean. The way of a sample, on the board
and in replay."""

from .lean import formula_lean_deg
from .lean_filter import LeanFilter
from .rotation import rotate, vector

SMOOTH_US = 300_000  # time constant of the g shown
GAP_US = 500_000  # without readings for so long, the past says nothing about the present
MAX_SIGMA_DEG = 6.0  # a lean less certain than this is not shown
FALLEN_DEG = 65.0
FALLEN_US = 1_000_000


class LeanMeter:
    """Lean and acceleration of the vehicle.

    After update(): force (left, up, forward in g), rate (about left, up, forward in deg/s), lean_deg (the
    filter's, > 0 right), lean_formula_deg (Nicolae's, sample by sample), smooth_force (g, for display),
    sensor_force and sensor_rate (calibrated, in the sensor's axes), fallen, and the maxima since
    reset_maxima().
    """

    def __init__(self, calibration):
        self.calibration = calibration
        self.force = vector()
        self.rate = vector()
        self.sensor_force = vector()
        self.sensor_rate = vector()
        self.smooth_force = vector()
        self.filter = LeanFilter()
        self.restart()
        self.reset_maxima()

    def restart(self):
        """Forget the past: after a new calibration, or after readings were missing."""
        self.filter.restart()
        self._fresh = True
        self._flat_us = 0
        self.fallen = False
        self.lean_deg = 0.0
        self.lean_formula_deg = 0.0

    def reset_maxima(self):
        """Start the held maxima again."""
        self.max_left_deg = 0.0
        self.max_right_deg = 0.0
        self.max_accel_g = 0.0
        self.max_brake_g = 0.0

    @property
    def trusted(self):
        """True while lean_deg is certain enough to be shown."""
        return self.filter.sigma_deg <= MAX_SIGMA_DEG

    def update(self, reading, dt_us):
        """reading: 7 numbers in the chip's order; dt_us: integer microseconds since the one before (0 for
        the first)."""
        if dt_us > GAP_US:
            self.restart()
        force = self.force
        self.calibration.apply(reading, self.sensor_force, self.sensor_rate)
        rotate(force, self.calibration.vehicle_from_sensor, self.sensor_force)
        rotate(self.rate, self.calibration.vehicle_from_sensor, self.sensor_rate)
        gain = 1.0 if self._fresh else dt_us / (SMOOTH_US + dt_us)
        self._fresh = False
        smooth = self.smooth_force
        for i in range(3):
            smooth[i] += gain * (force[i] - smooth[i])
        self.lean_formula_deg = formula_lean_deg(force, self.rate[1])
        self.lean_deg = self.filter.update(force, self.rate, dt_us)
        self._flat_us = self._flat_us + dt_us if abs(self.lean_deg) > FALLEN_DEG else 0
        self.fallen = self._flat_us >= FALLEN_US
        if self.trusted and not self.fallen:
            self._hold_maxima()

    def _hold_maxima(self):
        lean, forward = self.lean_deg, self.smooth_force[2]
        self.max_right_deg = max(self.max_right_deg, lean)
        self.max_left_deg = max(self.max_left_deg, -lean)
        self.max_accel_g = max(self.max_accel_g, forward)
        self.max_brake_g = max(self.max_brake_g, -forward)
