"""From a reading of the chip to lean and g: the way of a sample, on the board and in replay."""

from math import degrees, radians

from .lean import formula_lean_deg
from .lean_filter import LeanFilter
from .transform import Transform

SMOOTH_US = 300_000  # time constant of the g shown
GAP_US = 500_000  # without readings for so long, the past says nothing about the present
MAX_VARIANCE = radians(5.0) ** 2  # a lean less certain than this is not shown
TRIM_SURE = radians(0.5)
TRIM_STEP_DEG = 0.3  # less is not worth wearing the flash
FALLEN_DEG = 65.0
FALLEN_US = 1_000_000


class LeanMeter:
    """Lean and acceleration of the vehicle.

    After update(): force (left, up, forward in g), rate (about them in rad/s), lean_deg (the filter's, > 0
    right), smooth_force (g, for display), reading (the last), fallen, and the maxima since reset_maxima().
    """

    def __init__(self, calibration):
        # lists: on a board reading an array's element takes heap, reading a list's does not
        self.force = [0.0] * 3
        self.rate = [0.0] * 3
        self.smooth_force = [0.0] * 3
        self.reading = (0,) * 7
        self.reset_maxima()
        self.use(calibration)

    def use(self, calibration):
        """Take another calibration, its scale set, and forget what the one before led to."""
        self.calibration = calibration
        self._transform = Transform(calibration)
        self.filter = LeanFilter()
        self.filter.trim.start(radians(calibration.trim_deg))
        self.restart()

    def restart(self):
        """Forget the past: readings were missing."""
        self.filter.restart()
        self._fresh = True
        self._flat_us = 0
        self.fallen = False
        self.lean_deg = 0.0

    def reset_maxima(self):
        """Start the held maxima again."""
        self.max_left_deg = 0.0
        self.max_right_deg = 0.0
        self.max_accel_g = 0.0
        self.max_brake_g = 0.0

    @property
    def trusted(self):
        """True while lean_deg is certain enough to be shown."""
        return self.filter.variance <= MAX_VARIANCE

    def keep_trim(self):
        """Take the trim found so far into the calibration, if the bike stands and it is another by now: True then."""
        trim = self.filter.trim
        angle = degrees(trim.angle)
        if (
            not self.filter.at_rest
            or trim.variance > TRIM_SURE**2
            or abs(angle - self.calibration.trim_deg) < TRIM_STEP_DEG
        ):
            return False
        self.calibration.trim_deg = angle
        return True

    @property
    def lean_formula_deg(self):
        """Nicolae's lean of this one reading."""
        return formula_lean_deg(self.force, self.rate[1])

    def update(self, reading, dt_us):
        """reading: 7 numbers in the chip's order; dt_us: integer microseconds since the one before (0 for the
        first). On the board the mean of the few samples that came in during one turn of the loop."""
        if dt_us > GAP_US:
            self.restart()
        if self._fresh:
            dt_us = 0  # there is no reading before, on the board and in a replay alike
        self.reading = reading
        force = self.force
        self._transform.apply(reading, force, self.rate)
        gain = 1.0 if self._fresh else dt_us / (SMOOTH_US + dt_us)
        self._fresh = False
        smooth = self.smooth_force
        for i in range(3):
            smooth[i] += gain * (force[i] - smooth[i])
        self.lean_deg = lean = self.filter.update(force, self.rate, dt_us)
        if -FALLEN_DEG < lean < FALLEN_DEG:
            self._flat_us = 0
            self.fallen = False
        else:
            self._flat_us += dt_us
            self.fallen = self._flat_us >= FALLEN_US
        if self.trusted and -FALLEN_DEG < lean < FALLEN_DEG:
            self._hold_maxima(lean, smooth[2])

    def _hold_maxima(self, lean, forward):
        if lean > self.max_right_deg:
            self.max_right_deg = lean
        elif -lean > self.max_left_deg:
            self.max_left_deg = -lean
        if forward > self.max_accel_g:
            self.max_accel_g = forward
        elif -forward > self.max_brake_g:
            self.max_brake_g = -forward
