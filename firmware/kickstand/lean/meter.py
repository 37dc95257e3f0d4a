"""From a reading of the chip to lean and g: the way of a sample, on the board and in replay."""

from math import degrees, radians

from ..calibration.transform import Transform
from .formula import formula_lean_deg
from .lean_filter import LeanFilter

SMOOTH_US = 300_000  # time constant of the g shown
GAP_US = 500_000  # without readings for so long, the past says nothing about the present
MAX_VARIANCE = radians(3.0) ** 2  # a lean less certain than this is not shown
TRIM_SURE = radians(0.5)
TRIM_STEP_DEG = 0.3  # less is not worth wearing the flash
FALLEN_DEG = 65.0
WHEELIE_DEG = 20.0  # no road is as steep, and with a wheel in the air nothing holds that the filter knows
FALLEN_US = 1_000_000


class LeanMeter:
    """Lean and acceleration of the vehicle. leans: False for a car, whose lean stays 0.

    After update() or update_sum(): force (left, up, forward in g), rate (about them in rad/s), lean_deg (the
    filter's, > 0 right), smooth_force (g, for display; of an aligned one forward alone), fallen, and the maxima since
    reset_maxima().
    doubt: None, or for what reason the lean is not to be trusted, set by whoever knows.
    """

    def __init__(self, calibration, leans=True):
        self._leans = leans
        # lists: on a board reading an array's element takes heap, reading a list's does not
        self.force = [0.0] * 3
        self.rate = [0.0] * 3
        self.smooth_force = [0.0] * 3
        self._reading, self._n = (0,) * 7, 1
        self.reset_maxima()
        self.calibration = self.doubt = None
        self.use(calibration)

    def use(self, calibration):
        """Take another calibration, its scale set, and forget what the one before led to."""
        if calibration is not self.calibration:
            self.doubt = None
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
        if not self._leans:
            return True
        if self.doubt:
            return False
        return self.filter.variance <= MAX_VARIANCE and abs(self.filter.pitch_deg) < WHEELIE_DEG

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

    def measure_speed(self, speed_mps):
        """The vehicle's speed where something measures it: it helps the lean, and is never required."""
        if speed_mps >= 0.0:
            self.filter.measure_speed(speed_mps)

    @property
    def reading(self):
        """The last: 7 numbers in the chip's order."""
        return [value / self._n for value in self._reading]

    def update(self, reading, dt_us):
        """reading: 7 numbers in the chip's order; dt_us: integer microseconds since the one before (0 for the
        first)."""
        self._reading, self._n = reading, 1
        self._transform.apply(reading, self.force, self.rate)
        self._follow(dt_us)

    def update_sum(self, sums, n, dt_us):
        """The same for the sum of n samples, array('i', 7): on the board of those that came in during one turn of the
        loop, because floats cost too much to do it for each."""
        self._reading, self._n = sums, n
        self._transform.apply_sum(sums, n, self.force, self.rate)
        self._follow(dt_us)

    def _follow(self, dt_us):
        """What force and rate lead to."""
        if dt_us > GAP_US:
            self.restart()
        if self._fresh:
            dt_us = 0  # there is no reading before, on the board and in a replay alike
        self._smooth(1.0 if self._fresh else dt_us / (SMOOTH_US + dt_us))
        self._fresh = False
        self.lean_deg = lean = self.filter.update(self.force, self.rate, dt_us) if self._leans else 0.0
        if -FALLEN_DEG < lean < FALLEN_DEG:
            self._flat_us = 0
            self.fallen = False
            self._hold_maxima(lean, self.smooth_force[2])
        else:
            self._flat_us += dt_us
            self.fallen = self._flat_us >= FALLEN_US

    def _smooth(self, gain):
        force, smooth = self.force, self.smooth_force
        smooth[2] += gain * (force[2] - smooth[2])
        if not (self.calibration.aligned and self._leans):  # then the other two are shown as well
            smooth[0] += gain * (force[0] - smooth[0])
            smooth[1] += gain * (force[1] - smooth[1])

    def _hold_maxima(self, lean, forward):
        if (
            -self.max_left_deg <= lean <= self.max_right_deg
            and -self.max_brake_g <= forward <= self.max_accel_g
        ):
            return
        if not self.trusted:
            return
        self.max_left_deg = max(self.max_left_deg, -lean)
        self.max_right_deg = max(self.max_right_deg, lean)
        self.max_accel_g = max(self.max_accel_g, forward)
        self.max_brake_g = max(self.max_brake_g, -forward)
