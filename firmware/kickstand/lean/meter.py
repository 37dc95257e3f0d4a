"""Computes lean and g from each reading of the chip, on the board and in a replay."""

from math import degrees, radians

from ..calibration.parameters import Transform
from ..units import GAP_US, LOST_US, const
from .bike_model import formula_lean_deg
from .consistency import MILD
from .lean_filter import DELAY_S, LeanFilter
from .measurements import SIGMA_SHARE, gyro_variances

_SMOOTH_US = const(300_000)  # time constant of smooth_force
# Largest variance of a lean that is shown. The standard deviation is 1.4 degrees: SIGMA_SHARE times 3 degrees.
MAX_VARIANCE = (SIGMA_SHARE * radians(3.0)) ** 2
DOUBTED_VARIANCE = (SIGMA_SHARE * radians(2.0)) ** 2  # after repeated misfits, a lean of larger variance is not shown
TRIM_MAX_VARIANCE = radians(0.5) ** 2  # a trim of larger variance is not kept
# Smaller changes of the trim and of the gyro's errors are not saved, because saving wears the flash
_TRIM_STEP_DEG = const(0.3)
_GYRO_STEP = const(0.005)
FALLEN_DEG = 65.0  # smallest lean of a fallen bike
_FALLEN_S = const(0.75)  # the bike has fallen if it has lain for four windows of the filter, about a second
# Half of the time for which a lean must last to count as a maximum. The jerk of a pothole is shorter than the whole
# time
HELD_US = 75_000
# Pitch of a wheelie. No road is so steep, and the filter's equations do not hold in a wheelie.
_WHEELIE_DEG = const(20.0)


class LeanMeter:
    """Computes lean and acceleration of the vehicle.

    Args:
        leans: False for a car, whose lean stays 0.
        delay_s: delay of the gyro's low-pass.

    Attributes after update_sum():
        force              left, up, forward, in g
        rate               about these axes, in rad/s
        lean_deg           from the filter, > 0 to the right
        smooth_force       g, for the display. Left and up are NaN for an aligned motorcycle.
        fallen             True if the bike has fallen
        max_..._deg, _g    the maxima since reset_maxima()
        suppressed_reason  the reason from distrust() why the lean is not shown, or None
        transform          the Transform of the calibration in use
    """

    def __init__(self, calibration, leans=True, delay_s=DELAY_S):
        self._leans = leans
        self._delay_s = delay_s
        # Lists, because on a board each read of an array's element takes heap
        self.force = [0.0] * 3
        self.rate = [0.0] * 3
        self.smooth_force = [0.0] * 3
        # The last sums and the number of their samples, in a list because of the properties, see app.py
        self._last = [(0,) * 7, 1]
        self.reset_maxima()
        self.calibration = self.suppressed_reason = None
        self.use(calibration)

    def use(self, calibration, posed=False):
        """Use a calibration whose scale is set, and restart the filter. Another calibration clears suppressed_reason.

        posed: True if the poses of the alignment have just ended. At that moment the bike is still, and the gyro's bias
            was just measured."""
        # First all that may need too much memory, so that the earlier calibration stays in use as a whole
        transform, kept = Transform(calibration), [0.0] * 9
        tilted = calibration.aligned and not (calibration.six_done or calibration.by_drive)
        measured = gyro_variances(calibration.gyro_sigma, calibration.vehicle_from_sensor, tilted)
        self.filter = LeanFilter(self._delay_s, radians(calibration.trim_deg), posed, measured, calibration.six_done)
        self.transform = transform
        self._kept = kept  # the part of the gyro's errors that keep_trim() has removed
        if calibration is not self.calibration:
            self.suppressed_reason = None
        self.calibration = calibration
        # if True, the pages also show the forces to the left and up
        self._smooth_all = not (calibration.aligned and self._leans)
        self.smooth_force[0] = self.smooth_force[1] = 0.0 if self._smooth_all else float("nan")
        self.restart()

    def restart(self):
        """Restart filter and smoothing after missing readings. Keep the maxima and the sensor's errors."""
        self.filter.start()
        self._fresh = True
        self.fallen = False
        self.lean_deg = 0.0

    def reset_maxima(self):
        """Set the maxima of lean, acceleration and braking to 0."""
        self.max_left_deg = self.max_right_deg = 0.0
        self.max_accel_g = self.max_brake_g = 0.0
        self._hold_again()

    def distrust(self, reason):
        """Set suppressed_reason: hide the lean until distrust(None) or use() of another calibration."""
        self.suppressed_reason = reason

    @property
    def at_rest(self):
        """True while the vehicle stands still, by the sensor alone."""
        return self.filter.at_rest

    @property
    def speed_mps(self):
        """Estimated speed, from the sensor and the speeds that measure_speed() took."""
        return self.filter.speed_mps

    @property
    def odd(self):
        """The code of repeated misfits, or None: see Consistency."""
        return self.filter.consistency.odd

    @property
    def trim_deg(self):
        """The trim estimated so far, > 0 to the right. keep_trim() copies it to the calibration."""
        return degrees(self.filter.trim.angle)

    @property
    def trusted(self):
        """True while lean_deg is certain enough to show."""
        if not self._leans:
            return True
        if self.suppressed_reason:
            return False
        lean = self.filter
        fits, doubts = lean.consistency, lean.consistency.doubts
        if fits.doubt or fits.unsure or abs(lean.pitch_deg) >= _WHEELIE_DEG:
            return False
        return 0.0 <= lean.variance <= (MAX_VARIANCE if doubts <= MILD else DOUBTED_VARIANCE)

    def shown_deg(self, late=False, fault=None):
        """Return the lean that may be shown in degrees, or None. For a car the lean is 0 while its readings may be
        shown.

        Args:
            late: True if the readings are too old for the display.
            fault: the sensor's fault, or None.
        """
        hidden = late or fault is not None or self.fallen or not (self.calibration.aligned and self.trusted)
        return None if hidden or abs(self.lean_deg) >= FALLEN_DEG else self.lean_deg

    def keep_trim(self):
        """Copy the trim to the calibration, and the gyro's errors that the filter has found to its gyro_matrix.

        Both are kept if the bike is at rest, nothing is doubted, the trim is certain, and trim or errors have changed.
        The conversion of readings does not change until the next use(), because a recorded ride has one calibration.

        Returns True if both were copied.
        """
        lean, calibration = self.filter, self.calibration
        if not self.at_rest or lean.consistency.doubts or lean.trim.variance > TRIM_MAX_VARIANCE:
            return False
        angle, (errors, sigma) = self.trim_deg, lean.gyro_errors()
        new = [error - kept for error, kept in zip(errors, self._kept)]
        if abs(angle - calibration.trim_deg) < _TRIM_STEP_DEG and max(new) < _GYRO_STEP > -min(new):
            return False
        if not calibration.correct_gyro(new, sigma):
            return False
        calibration.trim_deg, self._kept = angle, errors
        return True

    @property
    def lean_formula_deg(self):
        """Nicolae's lean from only the last reading."""
        return formula_lean_deg(self.force, self.rate[1])

    def measure_speed(self, speed_mps):
        """Use a measured speed for the lean. Optional. A negative value means no speed."""
        if speed_mps >= 0.0:
            self.filter.measure_speed(speed_mps)

    @property
    def reading(self):
        """The last reading, or the mean of the last sum: 7 numbers in the chip's order."""
        sums, n = self._last
        return [value / n for value in sums]

    def update_sum(self, sums, n, dt_us):
        """Take the mean of the samples of one pass of the main loop.

        The mean is used, because float computations for each sample would take too long.

        Args:
            sums: sums of the samples' counts in the chip's order, array('i', 7).
            n: number of samples.
            dt_us: microseconds since the previous samples, an integer; 0 for the first samples.
        """
        self._last[0] = sums
        self._last[1] = n
        self.transform.apply_sum(sums, n, self.force, self.rate)
        self._follow(dt_us)

    def _follow(self, dt_us):
        """Update filter, smoothed force, fallen and maxima with the new force and rate. dt_us: time since the previous
        force and rate."""
        if dt_us > LOST_US:
            if dt_us > GAP_US:
                self.restart()
            else:
                self.filter.inflate_covariance(dt_us * 1e-6)
        if self._fresh:
            self._fresh = False
            # Without a previous sample ignore dt_us, because the board and a replay must compute the same lean
            dt_us, gain = 0, 1.0
        else:
            gain = dt_us / (_SMOOTH_US + dt_us)
        force, smooth = self.force, self.smooth_force
        smooth[2] += gain * (force[2] - smooth[2])
        if self._smooth_all:
            smooth[0] += gain * (force[0] - smooth[0])
            smooth[1] += gain * (force[1] - smooth[1])
        self.lean_deg = lean = self.filter.update(force, self.rate, dt_us) if self._leans else 0.0
        if abs(lean) >= FALLEN_DEG:
            self.fallen = self.filter.lying_s > _FALLEN_S
            return
        if self.fallen:
            self.fallen = False
        if not (
            -self.max_left_deg <= lean <= self.max_right_deg and -self.max_brake_g <= smooth[2] <= self.max_accel_g
        ):
            if self._over_us < 0:
                self._over_us += dt_us
            else:
                self._hold_maxima(lean, smooth[2], dt_us)
        elif self._over_us:
            self._hold_again()

    def _hold_again(self):
        """Restart the timing of a lean above its maximum, because the lean is within its maxima or not trusted."""
        # _over_us: time for which the lean has exceeded a maximum. After each HELD_US it starts again from 0. It is
        # negative after a lean that is not trusted, because trust, which takes 0.2 ms to judge, is not judged again for
        # some time. _least: smallest lean since _over_us was 0. _least_before: smallest lean in the previous HELD_US,
        # or 0 if the lean was within its maxima then.
        self._over_us = 0
        self._least = 180.0
        self._least_before = 0.0

    def _hold_maxima(self, lean, forward, dt_us):
        if not self.trusted:
            self._hold_again()
            self._over_us = -HELD_US
            return
        self.max_accel_g = max(self.max_accel_g, forward)
        self.max_brake_g = max(self.max_brake_g, -forward)
        self._over_us += dt_us
        self._least = min(self._least, abs(lean))
        if self._over_us >= HELD_US:
            held = min(self._least_before, self._least)
            if lean > 0.0:
                self.max_right_deg = max(self.max_right_deg, held)
            else:
                self.max_left_deg = max(self.max_left_deg, held)
            self._least_before, self._least, self._over_us = self._least, 180.0, 0
