"""The estimator of lean: an extended Kalman filter on the equations of bike_model.py, with the parameters of
measurements.py.

predict     with each sample: integrate lean, pitch and speed, and sum the innovations, measured minus expected force
linearise   five times per second: compute the model's partial derivatives at the means of the window
update      propagate the covariance over the window, and apply each measurement of the window
inject      add the corrections to the state

The steps from linearise to inject take longer than one sample. These steps are a generator, spread over the samples of
the next window. Each sample runs the generator to its next yield. Forces are in g, speeds in m/s, angles in rad.
"""

from math import atan2, degrees, pi, sin, sqrt

from ..units import STANDARD_GRAVITY, const
from . import measurements
from .bike_model import (
    BIAS_LEFT,
    CROSS_FORWARD_LEFT,
    LEAN,
    PITCH,
    SCALE_LEFT,
    SPEED,
    STATES,
    YAW_ERROR,
    Dive,
    Linearisation,
    possible_pitch,
    predict,
)
from .consistency import Consistency
from .kalman import Covariance, UprightTrim

_WINDOW_US = const(200_000)
_FIRST_WINDOW_US = const(50_000)
WORK_STEPS = 21  # number of steps of the work on a window; a test checks this number
_SLOW_STEP_US = const(12_000)  # time between two samples above which all steps are done at once
DELAY_S = 0.0048  # delay of the MPU6050's gyro at DLPF 3
# m/s: estimated speed above which the filter restarts. A board that lies on its nose seems to accelerate, but
# standstill is detected long before the estimated speed reaches this limit.
_MAX_SPEED = const(250.0)


class LeanFilter:
    """Estimates lean from force and rate in the vehicle's axes, in fixed memory.

    Args:
        delay_s: delay of the gyro's low-pass. The lean is extrapolated by delay_s.
        trim: in rad, see UprightTrim.
        posed: see LeanMeter.use().
        gyro_variances: see gyro_variances().
        six_done: True if the six positions have measured the accelerometer.
    """

    def __init__(self, delay_s=DELAY_S, trim=0.0, posed=False, gyro_variances=None, six_done=False):
        self.trim = UprightTrim(trim)
        self._delay_s = delay_s
        self._posed = posed
        self._gyro_variances = gyro_variances
        self._p = None
        # Relative error of the force's magnitude, caused by the accelerometer's bias and scale error. This error is
        # measured at rest, where the magnitude should be 1 g.
        self._force_error = 0.0
        self.dive = Dive()
        self.consistency = Consistency(six_done)
        self._failed = False  # True if a misfit has just begun
        # The sensor's errors (the states from BIAS_LEFT on) at two earlier times while everything fitted
        self._good = self._next_good = [0.0] * (STATES - BIAS_LEFT)
        self._good_s = 0.0
        self._kept_speed = None  # (speed, variance) for the next start of the filter
        self._gap = False  # True if the next start of the filter follows missing readings
        self.lying_s = 0.0  # time for which the bike has lain on its side, by force and rates alone
        self.restart()

    def restart(self):
        """Reset lean and pitch after missing readings. Keep the sensor's errors, the bike's dive, and the speed of a
        bike that still moves."""
        x = [0.0] * STATES
        self._failed = False
        self.dive.restart()
        self._kept = []  # (state, variance) of the sensor's errors
        if self._p is not None:
            self._gap = True
            self._kept_speed = self._x[SPEED], self._p.rows[SPEED][SPEED] + measurements.SIGMA_GAP_SPEED**2
            for i in range(BIAS_LEFT, STATES):
                x[i] = self._x[i]
                self._kept.append((i, self._p.rows[i][i]))
        self._x = x
        self._p = None
        self._upright = self.trim.angle  # value of the state LEAN while the bike is upright
        self._rest = measurements.RestDetector(not self._kept)
        # _speed: the latest measured speed, until a window uses it. _last_speed: the measured speed that a window used
        # last. _speed_s: seconds since the use of _last_speed. _straight_s: seconds since straight_or_prior_speed() was
        # used.
        self._speed = self._last_speed = None
        self._speed_s = self._straight_s = 0.0
        self._moving_s = 0.0  # remaining time for which the last measured speed proves that the bike moves
        self._work = None  # the generator of _process() until it is finished
        self._steps = 1  # steps of _work that each sample runs
        self._sums = [0.0] * 9  # see predict()
        self._count = self._window_us = 0
        self._astray_s = 0.0  # time for which the lean has been impossible
        self._axis = 0  # the axis of the gyro whose bias the next window at rest measures
        self._roll_rate = self._last_roll_rate = 0.0

    def inflate_covariance(self, seconds):
        """Increase the variances of lean, pitch and speed, because readings were lost for this many seconds."""
        p = self._p
        if p is None:
            return
        for _ in self._work or ():  # finish the work on the covariance first
            pass
        self._work = None
        p.add_noise(LEAN, (measurements.SIGMA_LOST_RATE * seconds) ** 2)
        p.add_noise(PITCH, (measurements.SIGMA_LOST_RATE * seconds) ** 2 / 16)
        p.add_noise(SPEED, (measurements.SIGMA_LOST_FORCE * STANDARD_GRAVITY * seconds) ** 2)

    def _remember(self, seconds):
        """Store the sensor's errors of some time ago, while everything fits."""
        self._good_s += seconds
        if self.consistency.doubt:
            self._good_s = 0.0
        elif self._good_s >= measurements.REMEMBER_S:
            self._good_s = 0.0
            self._good, self._next_good = self._next_good, self._x[BIAS_LEFT:STATES]

    def _doubt(self):
        """Restart because the readings do not fit.

        The first two times, use the sensor's earlier errors, because the fault may be over. Later, use no prior
        knowledge, because a bias may have jumped."""
        good = self.consistency.doubts <= 2
        speed, variance, rest = self._x[SPEED], self._p.rows[SPEED][SPEED], self._rest
        moving_s = self._moving_s
        self._forget()
        self._rest, self._moving_s = rest, moving_s
        if not good:
            self._good = self._next_good = [0.0] * (STATES - BIAS_LEFT)
            return
        self._kept_speed = speed, variance + measurements.SIGMA_GOOD_SPEED**2
        self._kept = []
        for i in range(BIAS_LEFT, STATES):
            self._x[i] = self._good[i - BIAS_LEFT]
            sigma = measurements.GOOD_SHARE * measurements.SIGMA_START[i]
            variance = (measurements.SIGMA_GOOD_BIAS if i < YAW_ERROR else sigma) ** 2
            if i >= SCALE_LEFT and self._gyro_variances:
                variance = min(variance, self._gyro_variances[i - SCALE_LEFT])
            self._kept.append((i, variance))

    def _forget(self):
        """Restart with nothing kept."""
        self._p, self._force_error, self.dive = None, 0.0, Dive()
        self.restart()
        self._kept = [(i, measurements.SIGMA_DOUBT_BIAS**2) for i in range(BIAS_LEFT, YAW_ERROR)]

    @property
    def speed_mps(self):
        """Estimated speed."""
        return self._x[SPEED]

    def gyro_errors(self):
        """Return the gyro's errors that were found while riding.

        Returns:
            errors: the reading of axis i per rate about axis j, in the vehicle's axes; 9 values, row by row.
            sigma: standard error of each value.
        """
        square = sum([self._p.rows[i][i] for i in range(SCALE_LEFT, STATES)]) / (STATES - SCALE_LEFT)
        x = self._x
        return x[SCALE_LEFT:CROSS_FORWARD_LEFT] + [0.0] * 4 + x[CROSS_FORWARD_LEFT:STATES], sqrt(square)

    @property
    def pitch_deg(self):
        """Estimated pitch of road and suspension, nose up > 0."""
        return degrees(self._x[PITCH])

    def measure_speed(self, speed_mps):
        """Take a measured speed for the next window. Optional."""
        self._speed = speed_mps
        self._moving_s = measurements.MOVING_S if speed_mps > measurements.MOVING_SPEED else 0.0

    @property
    def variance(self):
        """Variance of the lean's error, rad^2; pi^2 (unknown) before the end of the first window."""
        if self._p is None:
            return pi * pi
        return measurements.SIGMA_SHARE**2 * (self._p.rows[LEAN][LEAN] + self.trim.variance)

    @property
    def at_rest(self):
        """True while the bike stands still."""
        return self._rest.resting

    @property
    def rolling(self):
        """True if the estimated speed is certain enough to exclude a standstill."""
        if self._p is None or self._x[SPEED] <= measurements.ROLLING_SPEED:
            return False
        return self._x[SPEED] > measurements.ROLLING_SIGMAS * sqrt(self._p.rows[SPEED][SPEED])

    def update(self, force, rate, dt_us):
        """Take one sample. Return the lean in degrees.

        Args:
            force: 3 values in g.
            rate: 3 values in rad/s.
            dt_us: microseconds since the previous sample.
        """
        x, sums = self._x, self._sums
        self._roll_rate = predict(x, force, rate, dt_us * 1e-6, sums)
        self._count += 1
        self._window_us += dt_us
        if self._work is not None:
            for _ in range(self._steps):
                if next(self._work, True):  # next() returns None at a yield and True at the end
                    self._work = None
                    break
        elif self._window_us >= (_WINDOW_US if self._p is not None else _FIRST_WINDOW_US):
            self._end_window()
        if self._p is None:
            return degrees(atan2(sums[5], sums[6]))
        return degrees(x[LEAN] + self._delay_s * self._roll_rate - self._upright)

    def _end_window(self):
        """Start the work on the window that ends, unless it is the first window, the bike comes to rest or the filter
        must restart. The work on the previous window is finished."""
        n = self._count
        means = [total / n for total in self._sums]
        seconds = self._window_us * 1e-6
        for i in range(9):
            self._sums[i] = 0.0
        self._steps = WORK_STEPS if self._window_us > n * _SLOW_STEP_US else 1
        self._count = self._window_us = 0
        x = self._x
        if self._p is None:
            self._start(means)
            return
        if not (abs(x[LEAN]) < 2 * pi and x[SPEED] < _MAX_SPEED):  # also true for NaN
            self.consistency.gap()
            self._forget()  # forget the sensor's errors too, because they may be NaN
            return
        if self._lies(means):
            self.lying_s += seconds
        else:
            self.lying_s = 0.0
        if self._impossible(means, seconds):
            self.consistency.fail("odd-up")
            self._failed = True
        if self._failed:
            self._failed = False
            self._doubt()
            return
        roll_acceleration = (self._roll_rate - self._last_roll_rate) / seconds
        self._last_roll_rate = self._roll_rate
        rested = self._rest.resting
        pushed = abs(means[7] - sin(x[PITCH])) > measurements.MAX_REST_PUSH
        bias = x[BIAS_LEFT : BIAS_LEFT + 3]
        moving = self._moving_s > 0.0
        self._moving_s -= seconds
        self._rest.update(means[2:5], means[5:8], bias, seconds, self.rolling or pushed, moving)
        if self._rest.resting and not rested:
            self._stand(means)
            return  # no update, because this window's innovations belong to the state before _stand()
        self._work = self._process(means, seconds, roll_acceleration)

    def _lies(self, means):
        """True if the force is gravity on a bike that lies on its side and does not turn. On a bike in balance the
        force points to the bike's up axis, even if the estimated lean is wrong."""
        force = sqrt(means[5] * means[5] + means[6] * means[6] + means[7] * means[7])
        if abs(means[5]) < measurements.LYING_SIDE * force or abs(force - 1.0) > measurements.LYING_FORCE:
            return False
        return max(max(means[2:5]), -min(means[2:5])) < measurements.LYING_RATE

    def _impossible(self, means, seconds):
        """True if the lean has been impossible for a bike, and the force does not confirm it. The force does confirm
        the lean of a fallen bike or of a sensor in the hand."""
        lean = self._x[LEAN]
        apart = abs(lean - atan2(means[5], means[6]))
        if abs(lean) > measurements.IMPOSSIBLE_LEAN and pi / 4 < apart < 7 * pi / 4:
            self._astray_s += seconds
        else:
            self._astray_s = 0.0
        return self._astray_s >= measurements.IMPOSSIBLE_S

    def _start(self, means):
        """Set the first state and its covariance from the means of the first window."""
        wx, wy, wz, fx, fy, fz = means[2:8]
        # A long bend is as calm as a standstill and has no force to the side. Only the yaw rate shows the difference.
        turning = max(abs(wx), abs(wy), abs(wz)) > measurements.START_MAX_RATE
        moving = turning or abs(sqrt(fx * fx + fy * fy + fz * fz) - 1.0) > measurements.START_MAX_FORCE
        variances = [sigma * sigma for sigma in measurements.SIGMA_START]
        # _posed is used once, because only the first start comes right after the poses
        posed, self._posed = self._posed, False
        if posed:
            variances[BIAS_LEFT : BIAS_LEFT + 3] = [measurements.SIGMA_FRESH_BIAS**2] * 3
        if self._gyro_variances:
            variances[SCALE_LEFT:STATES] = self._gyro_variances
        gap, self._gap = self._gap, False
        if moving:
            variances[LEAN] = measurements.SIGMA_START_LEAN_MOVING**2
            if gap:
                self.consistency.gap()  # in a bend the covariance is too small just after a restart
        self._p = Covariance(variances)
        for i, variance in self._kept:
            self._p.set_variance(i, variance)
        x = self._x
        x[LEAN] = atan2(fx, fy)
        x[PITCH] = 0.0
        x[SPEED] = measurements.PRIOR_SPEED if moving else 0.0  # without a movement the ride begins at rest
        if self._kept_speed and (moving or not gap):
            x[SPEED], variance = self._kept_speed
            self._p.set_variance(SPEED, variance)
        self._kept_speed = None
        if posed and not moving:
            self._stand(means)

    def _stand(self, means):
        """At the beginning of rest, set lean and pitch by the force, which is now vertical, and the speed to 0. Keep a
        bias of the gyro unless it is far off, for example after the sensor was moved about by hand."""
        fx, fy, fz = means[5:8]
        x, p = self._x, self._p
        rates = [abs(means[2 + i] + x[BIAS_LEFT + i]) for i in range(3)]
        if max(rates) > measurements.MAX_BIAS_RADPS:
            # Either the bias has changed much since the calibration, or the bike is in a long, smooth bend
            self.consistency.gap(False)
        x[LEAN] = atan2(fx, fy)
        x[PITCH] = possible_pitch(atan2(fz, sqrt(fx * fx + fy * fy)))
        x[SPEED] = 0.0
        self._upright = self.trim.angle
        p.set_variance(LEAN, measurements.SIGMA_STAND**2)
        p.set_variance(PITCH, measurements.SIGMA_STAND**2)
        p.set_variance(SPEED, measurements.SIGMA_REST_SPEED**2)
        for i in range(3):
            if abs(means[2 + i]) > measurements.MAX_BIAS_RADPS:
                x[BIAS_LEFT + i] += means[2 + i]
                p.set_variance(BIAS_LEFT + i, measurements.SIGMA_START[BIAS_LEFT] ** 2)

    def _process(self, means, seconds, roll_acceleration):
        """Linearise, update and inject for one window, as a generator of short steps."""
        p = self._p
        model = Linearisation(self._x, means[2:5], means[7], p.rows[LEAN][LEAN])
        yield
        noise = measurements.NOISE_ANGLE**2 * seconds
        yield from p.propagate_row(LEAN, model.lean_row, seconds, noise)
        yield from p.propagate_row(PITCH, model.pitch_row, seconds, noise)
        yield from p.propagate_row(SPEED, model.speed_row, seconds, measurements.NOISE_SPEED**2 * seconds)
        for i in range(BIAS_LEFT, BIAS_LEFT + 3):
            p.add_noise(i, measurements.NOISE_BIAS**2 * seconds)
        if self._rest.resting:
            self.consistency.rest(seconds)
            size = sqrt(means[5] * means[5] + means[6] * means[6] + means[7] * means[7])
            self._force_error += measurements.REST_FORCE_SHARE * (size - 1.0 - self._force_error)
            self._axis = (self._axis + 1) % 3
            for measurement in measurements.at_rest(model, means, self._x[SPEED], self._axis):
                yield from p.update(*measurement)
        else:
            yield from self._update_ride(model, means, seconds, roll_acceleration)
        self._inject(model)

    def _update_ride(self, model, means, seconds, roll_acceleration):
        """Apply the window's forces, the level road, and the measured speed. Without a new measured speed apply
        straight_or_prior_speed(). Update the trim if speed and lean are certain enough. A generator."""
        p, x = self._p, self._x
        push = means[7] - model.sin_pitch
        dive = self.dive.update(push, model.pitch_rate, model.speed, seconds)
        left, up = measurements.forces(model, means, roll_acceleration, self._force_error, dive)
        yield from p.update(*left)
        misfit = p.misfit
        yield from p.update(*up)
        sideways = (means[5] - means[7] * x[YAW_ERROR]) / max(means[6], 0.5)
        unbalanced = None
        if x[SPEED] > measurements.BALANCE_SPEED and p.rows[SPEED][SPEED] < measurements.SIGMA_BALANCE_SPEED**2:
            unbalanced = self.trim.unexplained(sideways, x[LEAN])
        # A larger force forward means that the sensor is not on a bike
        if abs(means[7]) < measurements.MOST_FORWARD * abs(means[6]):
            up_misfit = p.misfit
            if abs(x[PITCH]) > 2 * measurements.STEEP:
                # The equations do not hold in a wheelie, so only the duration of the pitch is judged
                misfit = up_misfit = 0.0
            lean = x[LEAN] - self._upright
            pitch, turning = x[PITCH], model.yaw_rate
            self.consistency.add_rates(means[2], means[3], means[4], seconds)
            self._failed = self.consistency.add(misfit, up_misfit, unbalanced, pitch, push, lean, turning, seconds)
        self._remember(seconds)
        yield from p.update(*measurements.level_road(model, x, seconds))
        lean, speed, measured = x[LEAN] - self._upright, x[SPEED], self._speed
        self._speed_s += seconds
        self._straight_s = min(self._straight_s, seconds) + seconds
        if measured is not None and (self._last_speed is None or self._speed_s > measurements.MEASURED_SPEED_EVERY_S):
            # With these values measured_speed() does not raise the noise of the first speed
            acceleration, since = 0.0, 2 * measurements.SPEED_SCALE_S
            if self._last_speed is not None:
                # The acceleration is computed from measured speeds only, because an error of the pitch biases `push`
                acceleration, since = (measured - self._last_speed) / self._speed_s, self._speed_s
            self._speed, self._last_speed, self._speed_s = None, measured, 0.0
            yield from p.update(*measurements.measured_speed(measured, speed, acceleration, since))
        else:
            yield from p.update(*measurements.straight_or_prior_speed(lean, speed, model.yaw_rate, self._straight_s))
            self._straight_s = 0.0
        certain = p.rows[SPEED][SPEED] < measurements.SIGMA_TRIM_SPEED**2
        certain = certain and p.rows[LEAN][LEAN] < measurements.SIGMA_TRIM_LEAN**2
        if certain and model.speed > measurements.STRAIGHT_MIN_SPEED:
            self.trim.update(sideways, x[LEAN], model.yaw_rate, seconds)

    def _inject(self, model):
        """Add the corrections to the state. Adapt the next window's sums of innovations, because they were computed
        with the old state."""
        p, x, sums = self._p, self._x, self._sums
        for j, h in model.left_row:
            sums[0] -= self._count * h * p.correction[j]
        for j, h in model.up_row:
            sums[1] -= self._count * h * p.correction[j]
        for i in range(STATES):
            x[i] += p.take_correction(i)
        x[SPEED] = max(0.0, x[SPEED])
        x[PITCH] = possible_pitch(x[PITCH])
        # At rest the force shows the lean, so no correction for the yaw error is needed. The yaw error is meaningless
        # for a sensor in the hand.
        if not self._rest.resting:
            self._upright = self.trim.angle + model.lean_by_pitch(x)
        if x[LEAN] > pi:
            x[LEAN] -= 2 * pi
        elif x[LEAN] < -pi:
            x[LEAN] += 2 * pi
