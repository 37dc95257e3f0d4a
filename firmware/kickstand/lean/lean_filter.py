"""Lean while riding: an extended Kalman filter on what one gyro and one accelerometer say of a motorcycle.

States: lean t, pitch q (of road and suspension together), speed v, gyro bias (3), the yaw error of the
alignment y, which a kickstand pose with one degree of pitch makes as large as five, and five errors of scale and
cross-axis sensitivity of the gyro, of which the sheet allows 3 and 2 %: in a long turn they pass for bias, in a
quick roll for lean. With the vertical u = (cos q sin t, cos q cos t, sin q) in the vehicle's axes (left, up,
forward), rates w, force f:

    kinematics, exact on any road:  dt/dt = w_z - tan q (w_x sin t + w_y cos t)
                                    dq/dt = w_y sin t - w_x cos t
    wheels that roll, not slide:    dv/dt = f_z - g sin q + v w_y y
                                    f_x = g u_x + v w_y + dv/dt y - h dw_z/dt
                                    f_y = g u_y - v w_x
    roads are level on average:     0 = q + y sin t

The equations of f_x and f_y are Nicolae's (22)-(23) with s = v w. In a held turn they are parallel in t and
v: there the ratio of the two rates tells the lean, through the last line, and v tells it just after entering.

Where a state is multiplied by a measured rate (v w_y), that rate's noise would be squared, and v and lean would come
out too small (errors in variables): there the filter takes the rate at which a bike in balance at this lean and speed
turns, as long as the measured one is near it.

Force and speed are in g and g seconds, angles in radians. The state follows every sample. Covariance and
corrections follow five times a second, a piece a sample, because the whole would take longer than a sample
lasts.
"""

from math import atan2, cos, degrees, pi, radians, sin, sqrt

from .kalman import Covariance
from .rest import MAX_BIAS_RADPS, RestDetector
from .upright_trim import UprightTrim

_G = 9.80665
# XY: what the gyro's left axis reads of a rate about up, and so on. Not YY: with the speed unknown it says nothing.
T, Q, V, BX, BY, BZ, Y, XX, XY, ZX, ZY, ZZ = range(12)
N = 12
_KEPT = (BX, BY, BZ, Y, XX, XY, ZX, ZY, ZZ)  # of the sensor, not of the ride
WINDOW_US = 200_000
START_US = 50_000  # the first
MAX_PITCH = 1.2  # rad: a motorcycle never, a sensor in the hand may; at 90 degrees lean has no meaning
MAX_SPEED = 150.0 / _G

# Uncertainties at the start: one sigma
START_LEAN = radians(1.5)  # where the force looks like that of a standing bike
START_STAND = radians(0.5)
START_STILL_G, START_STILL_RADPS = 0.05, 0.02
START_LEAN_MOVING = radians(30.0)
START_PITCH = radians(5.0)
START_SPEED = 15.0 / _G
START_BIAS = radians(1.0)  # the poses measured it; it has drifted since
START_YAW_ERROR = radians(5.0)
START_SCALE = 0.010  # most parts; the sheet allows 0.03
START_CROSS_AXIS = 0.010  # the sheet allows 0.02

# Growth of uncertainty per square root of a second
GROW_ANGLE = radians(0.2)  # gyro scale and vibration
GROW_SPEED = 0.35 / _G
GROW_BIAS = radians(0.01)  # warming up: 0.6 deg/s in five minutes

# Measurements, as independent every WINDOW_US: what is wrong with them lasts longer, so they count for less
SIGMA_LEFT = 0.04
SIGMA_UP = 0.4
SHAKEN_SHARE = 0.1  # of the variance within a window, for that of its mean: shaking is not all quick
ROLL_HEIGHT_M = 0.4  # h: of the sensor above the axis the bike rolls about; by how much it may be wrong:
SIGMA_ROLL_HEIGHT_M = 0.4
SIGMA_SLOPE = radians(1.6)
SLOPE_S = 3.0  # how long a slope lasts: fitted, real ones last longer
STRAIGHT_LEAN, STRAIGHT_RATE = radians(8.0), radians(2.5)  # below both, the road is taken for straight:
SIGMA_STRAIGHT = radians(0.8)  # a balanced bike that does not turn is upright; wind and camber lean it more
STRAIGHT_S = 3.0
USUAL_SPEED = 15.0 / _G
SIGMA_SPEED = 20.0 / _G
SPEED_S = 60.0
SIGMA_REST_RATE = radians(0.05)
SIGMA_REST_FORCE = 0.02
SIGMA_REST_SPEED = 0.02 / _G
SIGMA_GIVEN_SPEED = 1.0 / _G  # of a receiver or a wheel, if there is one
GIVEN_SPEED_LATE_S = 1.0

MAX_REST_PUSH = 0.08  # g from what its pitch makes: more is braking, even if it is as even as standing on a slope
ROLLING_SPEED, ROLLING_SIGMAS = 3.0 / _G, 3.0  # a speed as sure as this is no standstill
BALANCED_SPEED = 4.0 / _G  # beyond, the yaw rate follows from lean and speed, if
BALANCED_SHARE, BALANCED_RADPS = 0.5, 0.1  # what is measured differs by less than this of it, and this
MIN_COS = 0.3

PIECES = 22  # of the work on a window, spread over the samples of the next one
SLOW_STEP_US = 12_000

TRIM_SPEED = 4.0 / _G
TRIM_SIGMA_SPEED = 8.0 / _G

DELAY_S = 0.005  # lean is shown as it is by now: the chip's low-pass at 44 Hz is 5 ms late


class LeanFilter:
    """Estimates lean from force and rate in the vehicle's axes. Fixed memory."""

    def __init__(self):
        self.trim = UprightTrim()
        self._p = None
        self.restart()

    def restart(self):
        """Forget lean, pitch and speed: readings were missing. What was learned of the sensor stays."""
        kept = _KEPT if self._p is not None else ()
        self._kept = [(i, self._x[i], self._p.rows[i][i]) for i in kept]
        self._p = None
        self._rest = RestDetector(not kept)
        self._x = [0.0] * N
        self._given_speed = None
        for i, value, _ in self._kept:
            self._x[i] = value
        self._work = None
        self._pieces = 1
        self._sums = [0.0] * 9
        self._count = 0
        self._window_us = 0
        self._axis = 0  # of the gyro, whose bias is measured next at rest
        self._roll_rate = 0.0
        self._last_roll_rate = 0.0

    @property
    def speed_mps(self):
        """Estimated speed."""
        return self._x[V] * _G

    @property
    def pitch_deg(self):
        """Estimated pitch of road and suspension, nose up > 0."""
        return degrees(self._x[Q])

    @property
    def gyro_bias_dps(self):
        """Estimated change of the gyro's bias since the calibration: left, up, forward."""
        return [degrees(self._x[i]) for i in (BX, BY, BZ)]

    def measure_speed(self, speed_mps):
        """The vehicle's speed, from whatever knows it; never required."""
        self._given_speed = speed_mps / _G

    @property
    def variance(self):
        """Of the lean, rad^2."""
        return self._p.rows[T][T] + self.trim.variance if self._p else pi * pi

    @property
    def sigma_deg(self):
        """Standard deviation of the lean: a quality figure."""
        return degrees(sqrt(self.variance))

    @property
    def at_rest(self):
        """True while the bike stands still."""
        return self._rest.resting

    @property
    def rolling(self):
        """True where the estimated speed is as sure as it must be to say that the bike does not stand."""
        speed = self._x[V]
        return self._p is not None and speed > ROLLING_SPEED and speed > ROLLING_SIGMAS * sqrt(self._p.rows[V][V])

    def update(self, force, rate, dt_us):
        """One sample: force (3, g), rate (3, rad/s), dt_us since the one before. Returns lean in degrees."""
        fx, fy, fz = force
        wx, wy, wz = rate
        x = self._x
        t, q, v, bx, by, bz, yaw_error, xx, xy, zx, zy, zz = x
        wx -= bx
        wy -= by
        wz -= bz
        wz -= zx * wx + zy * wy + zz * wz
        wx -= xx * wx + xy * wy
        st, ct = sin(t), cos(t)
        sq = sin(q)
        cq = sqrt(1.0 - sq * sq)
        dt = dt_us * 1e-6
        sideways = v * wy
        acceleration = fz - sq + sideways * yaw_error
        x[T] = t + (wz - sq / cq * (wx * st + wy * ct)) * dt
        q += (wy * st - wx * ct) * dt
        if not -MAX_PITCH <= q <= MAX_PITCH:
            q = -MAX_PITCH if q < 0.0 else MAX_PITCH
        x[Q] = q
        speed = v + acceleration * dt
        x[V] = speed if speed > 0.0 else 0.0
        sums = self._sums
        left = fx - cq * st - sideways - acceleration * yaw_error
        sums[0] += left
        sums[8] += left * left
        sums[1] += fy - cq * ct + v * wx
        sums[2] += wx
        sums[3] += wy
        sums[4] += wz
        sums[5] += fx
        sums[6] += fy
        sums[7] += fz
        self._roll_rate = wz
        self._count += 1
        self._window_us += dt_us
        work = self._work
        if work is not None:
            for _ in range(self._pieces):
                if next(work, True):
                    self._work = None
                    break
        elif self._window_us >= (WINDOW_US if self._p is not None else START_US):
            self._end_window()
        if self._p is None:
            return degrees(atan2(sums[5], sums[6]))
        return degrees(x[T] + DELAY_S * wz - self.trim.angle)

    def _end_window(self):
        """The work on the window before is done: begin with this one's means."""
        n = self._count
        means = [total / n for total in self._sums]
        seconds = self._window_us * 1e-6
        for i in range(9):
            self._sums[i] = 0.0
        step_us = self._window_us // n
        # where samples come slowly there is time, and waiting for the rest of the work would cost more
        self._pieces = PIECES if step_us > SLOW_STEP_US else max(1, PIECES * step_us // WINDOW_US)
        self._count = 0
        self._window_us = 0
        x = self._x
        if self._p is not None and not (abs(x[T]) < 2 * pi and x[V] < MAX_SPEED):  # also not-a-number
            self.restart()
            return
        if self._p is None:
            self._start(means)
            return
        roll_acceleration = (self._roll_rate - self._last_roll_rate) / seconds
        self._last_roll_rate = self._roll_rate
        rested = self._rest.resting
        pushed = abs(means[7] - sin(x[Q])) > MAX_REST_PUSH
        self._rest.update(means, (x[BX], x[BY], x[BZ]), seconds, self.rolling or pushed)
        if self._rest.resting and not rested:
            self._stand(means)
        self._work = self._process(means, seconds, roll_acceleration)

    def _start(self, means):
        _, _, wx, wy, wz, fx, fy, fz, _ = means
        # a long turn is as calm as standing, and gives no force to the side: only the yaw rate tells them apart
        turning = max(abs(wx), abs(wy), abs(wz)) > START_STILL_RADPS
        moving = turning or abs(sqrt(fx * fx + fy * fy + fz * fz) - 1.0) > START_STILL_G
        lean = START_LEAN_MOVING if moving else START_LEAN
        sigmas = [lean, START_PITCH, START_SPEED, START_BIAS, START_BIAS, START_BIAS, START_YAW_ERROR]
        sigmas += [START_SCALE, START_CROSS_AXIS, START_CROSS_AXIS, START_CROSS_AXIS, START_SCALE]
        self._p = Covariance([sigma * sigma for sigma in sigmas])
        for i, _, variance in self._kept:
            self._p.rows[i][i] = variance
        x = self._x
        x[T] = atan2(fx, fy)
        x[Q] = 0.0
        x[V] = USUAL_SPEED if moving else 0.0  # most rides begin at rest

    def _stand(self, means):
        """Coming to rest, the force is the vertical, whatever was believed before; the bias is kept, unless it went
        astray, as in the hand."""
        fx, fy, fz = means[5:8]
        x = self._x
        x[T] = atan2(fx, fy)
        x[Q] = atan2(fz, sqrt(fx * fx + fy * fy))
        x[V] = 0.0
        self._p.forget(T, START_STAND * START_STAND)
        self._p.forget(Q, START_STAND * START_STAND)
        self._p.forget(V, SIGMA_REST_SPEED**2)
        for i in range(3):
            if abs(means[2 + i]) > MAX_BIAS_RADPS:
                x[BX + i] += means[2 + i]
                self._p.forget(BX + i, START_BIAS**2)

    def _process(self, means, seconds, roll_acceleration):
        """Covariance and corrections for one window; a generator of short pieces."""
        p, x = self._p, self._x
        left, up, wx, wy, wz, fx, fy, fz, square = means
        st, ct = sin(x[T]), cos(x[T])
        sq = sin(x[Q])
        cq = sqrt(1.0 - sq * sq)
        yaw_rate = wx * st + wy * ct
        speed = x[V]
        acceleration = fz - sq + speed * wy * x[Y]
        turn_x, turn_y = wx, wy
        if speed > BALANCED_SPEED:
            balanced = -cq * st / speed
            if abs(wy - balanced) < BALANCED_SHARE * abs(balanced) + BALANCED_RADPS:
                turn_y = balanced
                turn_x = balanced * st / max(ct, MIN_COS)
        yield
        grow_angle = GROW_ANGLE * GROW_ANGLE * seconds
        turned_x, turned_y = turn_x * seconds, turn_y * seconds
        gyro = ((BZ, -seconds), (ZX, -turned_x), (ZY, -turned_y), (ZZ, -wz * seconds))
        yield from p.carry(T, ((Q, -yaw_rate / (cq * cq) * seconds),) + gyro, grow_angle)
        gyro = ((BX, ct * seconds), (BY, -st * seconds), (XX, ct * turned_x), (XY, ct * turned_y))
        yield from p.carry(Q, ((T, yaw_rate * seconds),) + gyro, grow_angle)
        yield from p.carry(V, ((Q, -cq * seconds), (Y, speed * wy * seconds)), GROW_SPEED * GROW_SPEED * seconds)
        for i in (BX, BY, BZ):
            p.rows[i][i] += GROW_BIAS * GROW_BIAS * seconds
        left_terms = ((T, cq * ct), (Q, -sq * st - cq * x[Y]), (V, turn_y), (BY, -speed), (Y, acceleration))
        gyro = ((BX, speed), (XX, speed * turn_x), (XY, speed * turn_y))
        up_terms = ((T, -cq * st), (Q, -sq * ct), (V, -turn_x)) + gyro
        if self._rest.resting:
            yield from self._measure_rest(left_terms, left + speed * wy, (wx, wy, wz), fz - sq, cq)
        else:
            roll = roll_acceleration / _G
            uncertain = SIGMA_ROLL_HEIGHT_M * roll
            shaken = max(0.0, square - left * left)
            left_variance = SIGMA_LEFT**2 + SHAKEN_SHARE * shaken + uncertain**2
            yield from p.measure(left_terms, left + ROLL_HEIGHT_M * roll * ct, left_variance)
            yield from p.measure(up_terms, up, SIGMA_UP**2 + (uncertain * st) ** 2)
            terms = ((Q, 1.0), (T, x[Y] * ct), (Y, st))
            yield from p.measure(terms, -x[Q] - x[Y] * st, SIGMA_SLOPE**2 * 2 * SLOPE_S / seconds)
            yield from self._measure_ride(yaw_rate, acceleration, seconds)
            if speed > TRIM_SPEED and p.rows[V][V] < TRIM_SIGMA_SPEED**2:
                self.trim.update((fx - acceleration * x[Y]) / max(fy, 0.5), x[T], yaw_rate, seconds)
        self._correct(left_terms, up_terms)

    def _measure_ride(self, yaw_rate, acceleration, seconds):
        """One of: the speed as something else measured it; upright on a straight; an ordinary speed."""
        p, x = self._p, self._x
        upright = x[T] - self.trim.angle
        if self._given_speed is not None:
            late = GIVEN_SPEED_LATE_S * acceleration
            innovation = self._given_speed - x[V]
            self._given_speed = None
            yield from p.measure(((V, 1.0),), innovation, SIGMA_GIVEN_SPEED**2 + late * late)
        elif abs(upright) < STRAIGHT_LEAN and abs(yaw_rate) < STRAIGHT_RATE and x[V] > TRIM_SPEED:
            yield from p.measure(((T, 1.0),), -upright, SIGMA_STRAIGHT**2 * 2 * STRAIGHT_S / seconds)
        else:
            yield from p.measure(((V, 1.0),), USUAL_SPEED - x[V], SIGMA_SPEED**2 * 2 * SPEED_S / seconds)

    def _measure_rest(self, left_terms, left, rates, forward, cq):
        """Standing still: no speed, the rates are bias, the force is the vertical. One axis of the gyro each time."""
        p, x = self._p, self._x
        yield from p.measure(((V, 1.0),), -x[V], SIGMA_REST_SPEED**2)
        self._axis = (self._axis + 1) % 3
        yield from p.measure(((BX + self._axis, 1.0),), rates[self._axis], SIGMA_REST_RATE**2)
        yield from p.measure(left_terms[0:2], left, SIGMA_REST_FORCE**2)
        yield from p.measure(((Q, cq),), forward, SIGMA_REST_FORCE**2)

    def _correct(self, left_terms, up_terms):
        """Put the corrections into the state, and into the innovations already summed up against the old
        one."""
        p, x, sums = self._p, self._x, self._sums
        for j, h in left_terms:
            sums[0] -= self._count * h * p.correction[j]
        for j, h in up_terms:
            sums[1] -= self._count * h * p.correction[j]
        for i in range(N):
            x[i] += p.take_correction(i)
        x[V] = max(0.0, x[V])
        x[Q] = max(-MAX_PITCH, min(MAX_PITCH, x[Q]))
        if x[T] > pi:
            x[T] -= 2 * pi
        elif x[T] < -pi:
            x[T] += 2 * pi
