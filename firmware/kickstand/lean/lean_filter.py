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
from .consistency import MILD, Consistency, Mean
from .kalman import Covariance, UprightTrim

_WINDOW_US = const(200_000)
_FIRST_WINDOW_US = const(50_000)
WORK_STEPS = 21  # number of steps of the work on a window; a test checks this number
_SLOW_STEP_US = const(12_000)  # time between two samples above which all steps are done at once
DELAY_S = 0.0048  # delay of the MPU6050's gyro at DLPF 3
# m/s: estimated speed above which the filter restarts. A board that lies on its nose seems to accelerate, but
# standstill is detected long before the estimated speed reaches this limit.
_MAX_SPEED = const(250.0)

# What LeanFilter.start() keeps
ALL = 2  # after missing readings: everything but lean and pitch
ERRORS = 1  # the speed, and the sensor's errors from before the fault, because the fault may be over
NONE = 0  # nothing about sensor and bike, because a bias may have jumped


class State:
    """What the filter has estimated since its last start.

    Args:
        upright: value of the state LEAN while the bike is upright.
        variances: variances of the states at the end of the first window.
        gap: True if the start follows missing readings.
        posed: see LeanMeter.use().
    """

    def __init__(self, upright, variances, gap=False, posed=False):
        self.upright, self.variances, self.gap, self.posed = upright, variances, gap, posed
        self.x = [0.0] * STATES
        self.p = None  # the Covariance, None before the end of the first window
        self.kept_mps = None  # the speed before the start, if it is kept
        self.work = None  # the generator of _process() until it is finished
        self.steps = 1  # steps of the work that each sample runs
        self.roll_rate = self.last_roll_rate = 0.0
        self.astray_s = self.tipped_s = 0.0  # time for which the lean, or the force forward, has been impossible
        self.failed = False  # True if a misfit has just begun
        self.axis = 0  # the axis of the gyro whose bias the next window at rest measures
        # measured: the latest measured speed, until a window uses it. used: the measured speed that a window used last.
        # used_s: seconds since then, many before the first. straight_s: since straight_or_prior_speed() was used.
        self.measured, self.used, self.used_s, self.straight_s = None, 0.0, 1e4, 0.0
        self.sums = [0.0] * 9  # of the current window, see predict()
        self.count = self.window_us = 0


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
        self._delay_s = delay_s
        self._gyro_variances = gyro_variances
        self.trim = UprightTrim(trim)
        self.consistency = Consistency(six_done)
        self._rest = measurements.RestDetector()
        self._vibration = Mean(measurements.VIBRATION_S)  # variance of the force to the left within a window, in g^2
        self.lying_s = 0.0  # time for which the bike has lain on its side, by force and rates alone
        # The sensor's errors (the states from BIAS_LEFT on) at two earlier times while everything fitted
        self._good = self._next_good = [0.0] * (STATES - BIAS_LEFT)
        self._good_s = 0.0
        sigma = measurements.SIGMA_FRESH_BIAS if posed else measurements.SIGMA_START[BIAS_LEFT]
        self._renew(State(trim, self._variances(sigma), posed=posed))

    def start(self, keep=ALL):
        """Start again with the next sample, and estimate lean and pitch anew. keep: what is kept of the other states:
        ALL, ERRORS or NONE."""
        old, x, p = self._state, self._state.x, self._state.p
        if p is None:  # nothing was estimated since the last start
            old.sums, old.count, old.window_us = [0.0] * 9, 0, 0
            return
        new = State(self.trim.angle, self._variances(measurements.SIGMA_DOUBT_BIAS), keep == ALL)
        variances = new.variances
        if keep == ALL:
            self.dive.restart()
            self._rest = measurements.RestDetector(False)
            self._state = new
            new.x[BIAS_LEFT:] = x[BIAS_LEFT:]
            for i in range(BIAS_LEFT, STATES):
                variances[i] = p.rows[i][i]
        else:
            self._renew(new)
        if keep == ERRORS:
            new.x[BIAS_LEFT:] = self._good
            for i in range(BIAS_LEFT, STATES):
                sigma = measurements.GOOD_SHARE * measurements.SIGMA_START[i]
                variance = (measurements.SIGMA_GOOD_BIAS if i < YAW_ERROR else sigma) ** 2
                variances[i] = variance if i < SCALE_LEFT else min(variance, variances[i])
        if keep:
            new.kept_mps = x[SPEED]
            sigma = measurements.SIGMA_GAP_SPEED if keep == ALL else measurements.SIGMA_GOOD_SPEED
            variances[SPEED] = p.rows[SPEED][SPEED] + sigma**2

    def _renew(self, state):
        """Begin a state, and forget what was found about bike and accelerometer."""
        self._state = state
        self.dive = Dive()
        # Relative error of the force's magnitude, caused by the accelerometer's bias and scale error. This error is
        # measured at rest, where the magnitude should be 1 g.
        self._force_error = 0.0

    def _variances(self, sigma_bias):
        """Return the variances of the states before the first window."""
        variances = [sigma * sigma for sigma in measurements.SIGMA_START]
        variances[BIAS_LEFT:YAW_ERROR] = [sigma_bias**2] * 3
        if self._gyro_variances:
            variances[SCALE_LEFT:] = self._gyro_variances
        return variances

    def inflate_covariance(self, seconds):
        """Increase the variances of lean, pitch and speed, because readings were lost for this many seconds."""
        p = self._state.p
        if p is None:
            return
        for _ in self._state.work or ():  # finish the work on the covariance first
            pass
        self._state.work = None
        p.add_noise(LEAN, (measurements.SIGMA_LOST_RATE * seconds) ** 2)
        p.add_noise(PITCH, (measurements.SIGMA_LOST_RATE * seconds) ** 2 / 16)
        p.add_noise(SPEED, (measurements.SIGMA_LOST_FORCE * STANDARD_GRAVITY * seconds) ** 2)

    def _remember(self, seconds):
        """Store the sensor's errors of some time ago, while everything fits. The errors from before a misfit are kept
        until it is forgotten or, from the third misfit on, until the lean is shown again."""
        self._good_s += seconds
        if self.consistency.doubt or 0 < self.consistency.doubts < MILD:
            self._good_s = 0.0
        elif self._good_s >= measurements.REMEMBER_S:
            self._good_s = 0.0
            self._good, self._next_good = self._next_good, self._state.x[BIAS_LEFT:]

    @property
    def speed_mps(self):
        """Estimated speed."""
        return self._state.x[SPEED]

    def gyro_errors(self):
        """Return the gyro's errors that were found while riding.

        Returns:
            errors: the reading of axis i per rate about axis j, in the vehicle's axes; 9 values, row by row.
            sigma: standard error of each value.
        """
        x, rows = self._state.x, self._state.p.rows
        square = sum([rows[i][i] for i in range(SCALE_LEFT, STATES)]) / (STATES - SCALE_LEFT)
        return x[SCALE_LEFT:CROSS_FORWARD_LEFT] + [0.0] * 4 + x[CROSS_FORWARD_LEFT:], sqrt(square)

    @property
    def pitch_deg(self):
        """Estimated pitch of road and suspension, nose up > 0."""
        return degrees(self._state.x[PITCH])

    def measure_speed(self, speed_mps):
        """Take a measured speed for the next window. Optional."""
        self._state.measured = speed_mps
        self._rest.moving_s = measurements.MOVING_S if speed_mps > measurements.MOVING_SPEED else 0.0

    @property
    def variance(self):
        """Variance of the lean's error, rad^2; pi^2 (unknown) before the end of the first window."""
        p = self._state.p
        if p is None:
            return pi * pi
        return measurements.SIGMA_SHARE**2 * (p.rows[LEAN][LEAN] + self.trim.variance)

    @property
    def at_rest(self):
        """True while the bike stands still."""
        return self._rest.resting

    @property
    def rolling(self):
        """True if the estimated speed is certain enough to exclude a standstill."""
        speed, p = self._state.x[SPEED], self._state.p
        if p is None or speed <= measurements.ROLLING_SPEED:
            return False
        return speed > measurements.ROLLING_SIGMAS * sqrt(p.rows[SPEED][SPEED])

    def update(self, force, rate, dt_us):
        """Take one sample. Return the lean in degrees.

        Args:
            force: 3 values in g.
            rate: 3 values in rad/s.
            dt_us: microseconds since the previous sample.
        """
        state = self._state
        state.roll_rate = predict(state.x, force, rate, dt_us * 1e-6, state.sums)
        state.count += 1
        state.window_us += dt_us
        if state.work is not None:
            for _ in range(state.steps):
                if next(state.work, True):  # next() returns None at a yield and True at the end
                    state.work = None
                    break
        elif state.window_us >= (_WINDOW_US if state.p is not None else _FIRST_WINDOW_US):
            self._end_window()
            state = self._state
        if state.p is None:
            return degrees(atan2(state.sums[5], state.sums[6]))
        return degrees(state.x[LEAN] + self._delay_s * state.roll_rate - state.upright)

    def _end_window(self):
        """Start the work on the window that ends, unless it is the first window, the bike comes to rest or the filter
        must start again. The work on the previous window is finished."""
        state, x, n = self._state, self._state.x, self._state.count
        means = [total / n for total in state.sums]
        seconds = state.window_us * 1e-6
        for i in range(9):
            state.sums[i] = 0.0
        state.steps = WORK_STEPS if state.window_us > n * _SLOW_STEP_US else 1
        state.count = state.window_us = 0
        if state.p is None:
            self._first_window(means)
            return
        if not (abs(x[LEAN]) < 2 * pi and x[SPEED] < _MAX_SPEED):  # also true for NaN
            self.consistency.gap()
            self.start(NONE)  # forget the sensor's errors too, because they may be NaN
            self._rest = measurements.RestDetector()
            return
        self.lying_s = self.lying_s + seconds if measurements.lies(means) else 0.0
        if self._impossible(means, seconds):
            self.consistency.fail("odd-up")
            state.failed = True
        if state.failed:
            # The first two times the fault may be over. Later a bias may have jumped
            self.start(ERRORS if self.consistency.doubts < MILD else NONE)
            return
        roll_acceleration = (state.roll_rate - state.last_roll_rate) / seconds
        state.last_roll_rate = state.roll_rate
        rested = self._rest.resting
        pushed = abs(means[7] - sin(x[PITCH])) > measurements.MAX_REST_PUSH
        self._vibration.add(means[8] - means[0] * means[0], seconds)
        rolling = self.rolling and not (self._rest.first and self._vibration.value < measurements.QUIET**2)
        self._rest.update(means[2:5], means[5:8], x[BIAS_LEFT:YAW_ERROR], seconds, rolling or pushed)
        if self._rest.resting and not rested:
            self._stand(means)
            return  # no update, because this window's innovations belong to the state before _stand()
        if rested and not self._rest.resting:
            self.trim.held(x[LEAN])
        state.work = self._process(means, seconds, roll_acceleration)

    def _impossible(self, means, seconds):
        """True if the lean has been impossible for a bike, and the force does not confirm it. The force does confirm
        the lean of a fallen bike or of a sensor in the hand."""
        state, lean = self._state, self._state.x[LEAN]
        apart = abs(lean - atan2(means[5], means[6]))
        if abs(lean) > measurements.IMPOSSIBLE_LEAN and pi / 4 < apart < 7 * pi / 4:
            state.astray_s += seconds
        else:
            state.astray_s = 0.0
        return state.astray_s >= measurements.IMPOSSIBLE_S

    def _first_window(self, means):
        """Set the first state and its covariance from the means of the first window."""
        wx, wy, wz, fx, fy, fz = means[2:8]
        state, x, variances = self._state, self._state.x, self._state.variances
        # A long bend is as calm as a standstill and has no force to the side. Only the yaw rate shows the difference.
        turning = max(abs(wx), abs(wy), abs(wz)) > measurements.START_MAX_RATE
        moving = turning or abs(sqrt(fx * fx + fy * fy + fz * fz) - 1.0) > measurements.START_MAX_FORCE
        if moving:
            variances[LEAN] = measurements.SIGMA_START_LEAN_MOVING**2
            if state.gap:
                self.consistency.gap()  # in a bend the covariance is too small just after a restart
        x[LEAN] = atan2(fx, fy)
        x[PITCH] = 0.0
        if state.kept_mps is not None and (moving or not state.gap):
            x[SPEED] = state.kept_mps
        else:
            x[SPEED] = measurements.PRIOR_SPEED if moving else 0.0  # without a movement the ride begins at rest
            variances[SPEED] = measurements.SIGMA_START[SPEED] ** 2
        state.p = Covariance(variances)
        if state.posed and not moving:
            self._stand(means)

    def _stand(self, means):
        """At the beginning of rest, set lean and pitch by the force, which is now vertical, and the speed to 0. Keep a
        bias of the gyro unless it is far off, for example after the sensor was moved about by hand."""
        fx, fy, fz = means[5:8]
        state, x, p = self._state, self._state.x, self._state.p
        # A bias that has fitted a ride of REMEMBER_S is certain
        rates = [abs(means[2 + i] + x[BIAS_LEFT + i] - self._next_good[i]) for i in range(3)]
        if max(rates) > measurements.MAX_BIAS_RADPS:
            # Either the bias has changed much since then, or the bike is in a long, smooth bend
            self.consistency.gap(False)
        x[LEAN] = atan2(fx, fy)
        x[PITCH] = possible_pitch(atan2(fz, sqrt(fx * fx + fy * fy)))
        x[SPEED] = 0.0
        state.upright = self.trim.angle
        p.set_variance(LEAN, measurements.SIGMA_STAND**2)
        p.set_variance(PITCH, measurements.SIGMA_STAND**2)
        p.set_variance(SPEED, measurements.SIGMA_REST_SPEED**2)
        for i in range(3):
            if abs(means[2 + i]) > measurements.MAX_BIAS_RADPS:
                x[BIAS_LEFT + i] += means[2 + i]
                p.set_variance(BIAS_LEFT + i, measurements.SIGMA_START[BIAS_LEFT] ** 2)

    def _process(self, means, seconds, roll_acceleration):
        """Linearise, update and inject for one window, as a generator of short steps."""
        state, p = self._state, self._state.p
        model = Linearisation(state.x, means[2:5], means[7], p.rows[LEAN][LEAN])
        yield
        noise = measurements.NOISE_ANGLE**2 * seconds
        yield from p.propagate_row(LEAN, model.lean_row, seconds, noise)
        yield from p.propagate_row(PITCH, model.pitch_row, seconds, noise)
        yield from p.propagate_row(SPEED, model.speed_row, seconds, measurements.NOISE_SPEED**2 * seconds)
        for i in range(BIAS_LEFT, YAW_ERROR):
            p.add_noise(i, measurements.NOISE_BIAS**2 * seconds)
        if self._rest.resting:
            self.consistency.rest(seconds)
            size = sqrt(means[5] * means[5] + means[6] * means[6] + means[7] * means[7])
            self._force_error += measurements.REST_FORCE_SHARE * (size - 1.0 - self._force_error)
            state.axis = (state.axis + 1) % 3
            for measurement in measurements.at_rest(model, means, state.x[SPEED], state.axis):
                yield from p.update(*measurement)
        else:
            yield from self._update_ride(model, means, seconds, roll_acceleration)
        self._inject(model)

    def _update_ride(self, model, means, seconds, roll_acceleration):
        """Apply the window's forces, the level road, and the measured speed. Without a new measured speed apply
        straight_or_prior_speed(). Update the trim if speed and lean are certain enough. A generator."""
        state, x, p = self._state, self._state.x, self._state.p
        push = means[7] - model.sin_pitch
        dive = self.dive.update(push, model.pitch_rate, model.speed, seconds)
        left, up = measurements.forces(model, means, roll_acceleration, self._force_error, dive)
        yield from p.update(*left)
        misfit = p.misfit
        yield from p.update(*up)
        sideways = (means[5] - means[7] * x[YAW_ERROR]) / max(means[6], 0.5)
        unbalanced = None
        comparable = p.rows[LEAN][LEAN] < measurements.SIGMA_COMPARED**2
        if x[SPEED] > measurements.BALANCE_SPEED and p.rows[SPEED][SPEED] < measurements.SIGMA_BALANCE_SPEED**2:
            unbalanced = side = self.trim.unexplained(sideways, measurements.balanced_lean(x[SPEED], model.yaw_rate))
            speed = state.used
            agree = abs(speed - x[SPEED]) < measurements.AGREED * (speed + x[SPEED])
            if agree and comparable and state.used_s < measurements.MOVING_S:
                # Instead the lean beyond that of a bike in balance at the measured speed, which is such a force too
                lean = measurements.balanced_lean(speed, model.yaw_rate)
                side = self.trim.unexplained(x[LEAN] - lean, lean)
            self.consistency.side.add(side, seconds)
        # A larger force forward means that the sensor is not on a bike, or that the accelerometer has failed
        if abs(means[7]) >= measurements.MOST_FORWARD * means[6]:
            state.tipped_s += seconds
            if state.tipped_s > measurements.TIPPED_S:
                self.consistency.gap()
        else:
            state.tipped_s = 0.0
            up_misfit = p.misfit
            if abs(x[PITCH]) > 2 * measurements.STEEP:
                # The equations do not hold in a wheelie, so only the duration of the pitch is judged
                misfit = up_misfit = 0.0
            lean = x[LEAN] - state.upright
            # The yaw error turns a part of lean and yaw rate into the sensor's pitch and forward force
            push += model.sideways * x[YAW_ERROR]
            pitch, turning = x[PITCH] + x[YAW_ERROR] * model.sin_lean, model.yaw_rate
            check = self.consistency
            check.add_rates(means[2], means[3], means[4], seconds)
            by_left, by_up, by_forward = [x[BIAS_LEFT + i] - self._good[i] for i in range(3)]
            moved = by_left * by_left + (by_up * by_up + by_forward * by_forward) / 3
            expected, measured = -(means[3] + by_up) * model.sin_lean, -(means[2] + by_left) * model.cos_lean
            if comparable:
                check.compare(expected, measured, moved, seconds)
            fast = x[SPEED] > measurements.FAST and self.rolling and not self._rest.first
            state.failed = check.add(misfit, up_misfit, unbalanced, pitch, push, lean, turning, seconds, fast)
        self._remember(seconds)
        yield from p.update(*measurements.level_road(model, x, seconds))
        lean, speed, measured = x[LEAN] - state.upright, x[SPEED], state.measured
        state.used_s += seconds
        state.straight_s = min(state.straight_s, seconds) + seconds
        if measured is not None and state.used_s > measurements.MEASURED_SPEED_EVERY_S:
            # The acceleration is computed from measured speeds only, because an error of the pitch biases `push`
            acceleration, since = (measured - state.used) / state.used_s, state.used_s
            state.measured, state.used, state.used_s = None, measured, 0.0
            yield from p.update(*measurements.measured_speed(measured, speed, acceleration, since))
        else:
            yield from p.update(*measurements.straight_or_prior_speed(lean, speed, model.yaw_rate, state.straight_s))
            state.straight_s = 0.0
        certain = p.rows[SPEED][SPEED] < measurements.SIGMA_TRIM_SPEED**2
        certain = certain and p.rows[LEAN][LEAN] < measurements.SIGMA_TRIM_LEAN**2
        if certain and model.speed > measurements.STRAIGHT_MIN_SPEED:
            self.trim.update(sideways, x[LEAN], model.yaw_rate, seconds)

    def _inject(self, model):
        """Add the corrections to the state. Adapt the next window's sums of innovations, because they were computed
        with the old state."""
        state, x, correction = self._state, self._state.x, self._state.p.correction
        sums, n = state.sums, state.count
        for k, row in enumerate((model.left_row, model.up_row)):
            change = sum([h * correction[j] for j, h in row])
            if k == 0:
                sums[8] += change * (n * change - 2.0 * sums[0])
            sums[k] -= n * change
        for i in range(STATES):
            x[i] += correction[i]
            correction[i] = 0.0
        x[SPEED] = max(0.0, x[SPEED])
        x[PITCH] = possible_pitch(x[PITCH])
        # At rest the force shows the lean, so no correction for the yaw error is needed. The yaw error is meaningless
        # for a sensor in the hand.
        if not self._rest.resting:
            state.upright = self.trim.angle + model.lean_by_pitch(x)
        if x[LEAN] > pi:
            x[LEAN] -= 2 * pi
        elif x[LEAN] < -pi:
            x[LEAN] += 2 * pi
