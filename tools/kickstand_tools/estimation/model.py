"""The model of a ride: unknowns with their priors, hypotheses about mount and wind, equations and their Jacobian.

The states are the lean t, the pitch q, three velocities of the sensor, l to the left, u up and v forward, and the
gyro's bias. The velocities are in level axes that yaw with the bike at the yaw rate p. Rates w and forces f are the
measured values (w_m, f_m) without the sensor's errors. R is the rotation by ROTATION, to second order. The acceleration
a is the force in level axes, minus 1 g upwards.

    w = R w_m + GYRO w_m - bias        f = R f_m + ACCEL f_m + offset
    p = (w_x sin t + w_y cos t) / cos q        t' = w_z - p sin q        q' = w_y sin t - w_x cos t
    l' = a_l - p v        v' = a_f + p l        u' = a_u

The firmware's kickstand.lean.bike_model has the same equations, and assumes no motion sideways or up. Here, this is a
measurement of the velocity, with noise, because the acceleration differs from 0 at every bump, but the velocity only
briefly. The wheels' velocity is the sensor's velocity minus the rates times the sensor's position (rigid body). The
measurements are differences that should be 0:

    SLIDING         the wheels' velocity sideways, because wheels do not slide
    CLIMBING        the wheels' velocity up minus the part due to the chassis' pitch. The chassis points along the road,
                    except for dive in braking, (8) there. Dive does not move a wheel.
    SLOPING         the wheels' velocity up, because roads are level on average
    BALANCED        the force to the side minus TYRES, CAMBER and BESIDE: a moving bike is balanced
    ANY_SPEED       the speed minus USUAL_MPS
    MEASURED_SPEED  the speed minus the log's delayed speed
    RESTING         the velocity of a standing bike (zero-velocity update)
    RESTING_RATE    the rates of a standing bike
    BACKWARD        a speed under 0

The parameters are errors of sensor and bike. They are constant within a block of windows, and follow a random walk from
block to block. On straights, a bike seems to lean if the sensor's mount has yielded, or if wind pushes it to the side
for minutes. A hypothesis combines a mount with a strength of the wind. If the readings do not distinguish two
hypotheses, the result is between their results, and its standard deviation grows with the difference.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array, Ints
from .solver import RandomWalks, Reduced, minus_two_log_likelihood
from .windows import Windows

# The states are lean and pitch (rad), the sensor's velocity left, up and forward (m/s), and the gyro's bias (rad/s).
LEAN, PITCH, LEFT, UP, FORWARD, BIAS = 0, 1, 2, 3, 4, slice(5, 8)
STATES = 8

ROTATION = slice(0, 3)  # misalignment of the sensor about left, up, forward, in rad
GYRO = slice(3, 12)  # scale and cross-axis errors of the gyro, a 3 x 3 matrix of ratios
ACCEL = slice(12, 21)  # scale and cross-axis errors of the accelerometer, a 3 x 3 matrix of ratios
OFFSET = slice(21, 24)  # bias of the accelerometer, in g
HEIGHT, AHEAD = 24, 25  # the sensor's height above the roll axis, and its distance in front of the rear wheel, in m
# Force to the side, divided by sin(lean) and by the force up. A leaning bike's tyres touch the road beside their
# middle.
TYRES = 26
BESIDE = 27  # lasting level force to the side, due to wind, in g; see Hypotheses
DELAY = 28  # delay of the log's speed, in s
DIVE = 29  # pitch of the nose in braking, in rad per g; called share in (8) of the firmware's kickstand.lean.bike_model
# Force to the side on straights, in g. A cambered road touches the tyres beside their middle.
CAMBER = 30
# Temperature coefficients of the accelerometer's bias (g per C) and of the gyro's bias (rad/s per C): see Windows.warm
OFFSET_PER_C, BIAS_PER_C = slice(31, 34), slice(34, 37)
PARAMETERS = 37
UP_SCALE = ACCEL.start + 4  # scale error of the accelerometer along up
SENSOR = slice(GYRO.start, OFFSET.stop)

# Mean and standard deviation of the prior. The data sheet PS-MPU-6000A, 6.1 and 6.2, limits scale errors to 3 % and
# cross-axis sensitivity to 2 %.
MEAN, SIGMA = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
SIGMA[ROTATION], SIGMA[GYRO] = np.radians([1.5, 5.0, 2.0]), 0.012
SIGMA[OFFSET], SIGMA[UP_SCALE] = (0.001, 0.003, 0.003), 0.004
# Usual values. The data sheet allows three times these values.
SIGMA[OFFSET_PER_C], SIGMA[BIAS_PER_C] = 0.0003, np.radians(0.06)
# Change of the gyro's errors with temperature since the six positions, as a ratio, as in the firmware
GYRO_DRIFT = 0.002
# Standard deviations of OFFSET and UP_SCALE without the six positions
WITHOUT_SIX_G, WITHOUT_SIX_SCALE = 0.04, 0.015
MEAN[HEIGHT], SIGMA[HEIGHT] = 0.5, 0.3
MEAN[AHEAD], SIGMA[AHEAD] = 0.6, 0.5
MEAN[TYRES], SIGMA[TYRES] = 0.07, 0.06
SIGMA[BESIDE] = 0.001
SIGMA[CAMBER] = 0.0035  # for usual tyres, with TYRES of 0.12, on a road that falls to the side by 3 %
MEAN[DELAY], SIGMA[DELAY] = 0.4, 0.4
MEAN[DIVE], SIGMA[DIVE] = 0.026, 0.035  # bikes dive by 0 to 6 degrees per g; with anti-dive forks even less than 0

ROLL = ROTATION.stop - 1
BLOCK_S = 10.0  # duration of a block of windows; the random walk makes one step per block
# Standard deviations of the process noise
FIRM, YIELDING = np.radians([0.05, 0.11])  # rotation of the mount from block to block, in rad
CALM_G, WIND_G, STORM_G = 0.00052, 0.01047, 0.03142  # force to the side, which lasts for PUSHED_S
PUSHED_S = 120.0
# The other parameters change from block to block too, because a sensor warms up. Each change is a share of the standard
# deviation of the parameter's prior.
DRIFT = np.full(PARAMETERS, 1e-4)
DRIFT[OFFSET] = 0.15, 0.05, 0.05
# Additional change of OFFSET per block, in g. After its six positions, a sensor may warm up and change by 0.03 g within
# minutes.
DRIFT_G = 0.0015
# Minus twice the logarithm of the prior probability. A light lasting wind is common, but its readings look like those
# of a yielding mount. Mistaking a yielding mount for wind costs more than the reverse, so the prior of wind is low.
YIELDS, WINDY, STORMY = 1.0, 8.0, 5.0
WEIGHT = 0.25  # exponent of the likelihood; it is under 1 because neighbouring readings share errors
LEAST_SHARE = 0.02  # least posterior weight of a hypothesis that is kept

# Rows of the measurements, after the rows of the process model
SLIDING, CLIMBING, SLOPING, BALANCED, ANY_SPEED, MEASURED_SPEED = range(STATES, STATES + 6)
RESTING, RESTING_RATE, BACKWARD = slice(14, 17), slice(17, 20), 20
ROWS = 21
USUAL_MPS = 15.0  # mean of the speed's prior
STRAIGHT = 0.1  # in rad: at smaller leans a road is cambered, at larger leans it is banked
STEP = 1e-6  # step of the finite differences, in the units of the unknowns


@dataclass
class Prior:
    """The prior of the parameters."""

    mean: Array  # shape (PARAMETERS)
    sigma: Array  # standard deviations, shape (PARAMETERS). A parameter whose standard deviation is 0 is not estimated.
    posed: bool  # True if the alignment comes from an upright pose

    @classmethod
    def of_pose(cls, six_done: bool, gyro_sigma: Array | None = None) -> "Prior":
        """Return the prior for a sensor that was aligned by poses, and perhaps calibrated by six positions.

        gyro_sigma: standard errors of the gyro's scale and axes after the six positions, along left, up and forward,
            shape (3, 3). None or zeros if the gyro was not measured.
        """
        sigma = SIGMA.copy()
        if gyro_sigma is not None and np.any(gyro_sigma):
            sigma[GYRO] = np.minimum(np.hypot(gyro_sigma, GYRO_DRIFT).ravel(), sigma[GYRO])
        if not six_done:
            sigma[OFFSET], sigma[UP_SCALE] = WITHOUT_SIX_G, WITHOUT_SIX_SCALE
        return cls(MEAN, sigma, True)

    @property
    def unknown(self) -> Ints:
        """The indices of the m parameters that are estimated."""
        return np.flatnonzero(self.sigma)

    def information(self, sigma: Array) -> Array:
        """Return the information matrix (inverse covariance) of the prior, shape (m, m).

        The upright pose was measured with a biased accelerometer. Therefore the prior is about the sum of misalignment
        and bias, which is the lean and pitch that the sensor reads in the pose.
        """
        matrix = np.diag(np.divide(1.0, sigma**2, out=np.zeros(PARAMETERS), where=sigma > 0.0))
        if self.posed:
            ties = (ROTATION.start, OFFSET.stop - 1, 1.0), (ROTATION.stop - 1, OFFSET.start, -1.0)
            for angle, offset, sign in ties:
                matrix[offset, offset] += matrix[angle, angle]
                matrix[angle, offset] = matrix[offset, angle] = sign * matrix[angle, angle]
        return matrix[np.ix_(self.unknown, self.unknown)]


@dataclass
class Hypotheses:
    """G hypotheses. Each field has the shape (G)."""

    turning: Array  # process noise per block of the mount's rotation about left and up, in rad
    rolling: Array  # process noise per block of the mount's rotation about forward, in rad
    pushed: Array  # standard deviation of the lasting force to the side, in g
    minus_two_log_prior: Array  # minus twice the logarithm of the prior probability
    weight: Array  # posterior weights, whose sum is 1

    def select(self, index: Ints, weight: Array) -> "Hypotheses":
        return Hypotheses(
            self.turning[index], self.rolling[index], self.pushed[index], self.minus_two_log_prior[index], weight
        )

    def first(self) -> "Hypotheses":
        return self.select(np.zeros(1, dtype=np.intp), np.ones(1))

    def weighted(self, blocks: Reduced, prior: Prior, parameters: Array, unbalance: float) -> "Hypotheses":
        """Compute the posterior weights, and drop hypotheses of negligible weight.

        parameters: the values at which the equations were linearised, shape (B, PARAMETERS).
        unbalance: see Noise. A value over 1 reduces the weight of the likelihood.
        """
        minus_two_log = minus_two_log_likelihood(blocks, self.random_walks(prior, parameters))
        minus_two_log = minus_two_log * WEIGHT / max(1.0, unbalance) ** 2 + self.minus_two_log_prior
        weight = np.exp(-0.5 * (minus_two_log - np.min(minus_two_log)))
        likely = np.flatnonzero(weight > LEAST_SHARE * np.sum(weight))
        return self.select(likely, weight[likely] / np.sum(weight[likely]))

    def random_walks(self, prior: Prior, parameters: Array) -> RandomWalks:
        """Return the random walks of the estimated parameters, for the solver. parameters: see weighted()."""
        unknown = prior.unknown
        sigma = np.tile(prior.sigma, (len(self.weight), 1))
        sigma[:, BESIDE] = np.hypot(sigma[:, BESIDE], self.pushed)
        information = np.stack([prior.information(deviations) for deviations in sigma])
        pull = information @ (parameters[0] - prior.mean)[unknown]
        variance = (DRIFT * sigma) ** 2
        variance[:, OFFSET] += DRIFT_G**2
        variance[:, ROTATION] = self.turning[:, None] ** 2
        variance[:, ROLL] = self.rolling**2
        variance[:, BESIDE] = self.pushed**2 * 2.0 * BLOCK_S / PUSHED_S
        steps = np.repeat(variance[:, None, unknown], len(parameters) - 1, axis=1)
        equations = np.concatenate((information, pull[..., None]), axis=2)
        return RandomWalks(equations, steps, np.diff(parameters[:, unknown], axis=0))


_MOUNTS = (FIRM, FIRM, 0.0), (FIRM, YIELDING, YIELDS), (YIELDING, YIELDING, YIELDS)
_PUSHES = (CALM_G, 0.0), (WIND_G, WINDY), (STORM_G, STORMY)
ALL = Hypotheses(
    *np.array([(*turns, push, yields + windy, 1.0 / 9.0) for *turns, yields in _MOUNTS for push, windy in _PUSHES]).T
)


def process_and_measurements(windows: Windows, x: Array) -> Array:
    """Evaluate both models in n windows, shape (ROWS, n): the states' rates of change, then the measurements.

    x: states in the middle of each window, then parameters, shape (STATES + PARAMETERS, n).
    """
    return _models(windows, x, _readings(windows, x))


def _readings(windows: Windows, x: Array) -> Array:
    """Return rates and forces without the sensor's errors, shape (6, n)."""
    p = x[STATES:]
    force = _corrected(windows.force.T, p, ACCEL) + p[OFFSET] + p[OFFSET_PER_C] * windows.warm
    return np.concatenate((corrected_rates(windows.rate.T, x, windows.warm), force))


def _models(windows: Windows, x: Array, readings: Array) -> Array:
    """Evaluate both models, see process_and_measurements(). readings: without errors, shape (6, n)."""
    t, q, left, up, forward = x[: BIAS.start]
    p, (wx, wy, wz, fx, fy, fz) = x[STATES:], readings
    st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
    yaw = (wx * st + wy * ct) / cq
    upright = fx * st + fy * ct  # upward force in axes that pitch but do not lean with the bike
    ahead = (fz * cq - upright * sq) * STANDARD_GRAVITY
    rows = np.zeros((ROWS, len(t)))
    rows[LEAN] = wz - yaw * sq
    rows[PITCH] = wy * st - wx * ct
    rows[LEFT] = (fx * ct - fy * st) * STANDARD_GRAVITY - yaw * forward
    rows[UP] = (upright * cq + fz * sq - 1.0) * STANDARD_GRAVITY
    rows[FORWARD] = ahead + yaw * left
    height, distance = p[HEIGHT], p[AHEAD]
    turn_x, turn_y, turn_z = wy * distance - wz * height, -wx * distance, wx * height  # rates x place
    raised = turn_x * st + turn_y * ct
    wheel_up = up - (raised * cq + turn_z * sq)
    wheel = forward - (turn_z * cq - raised * sq)
    rows[SLIDING] = left - (turn_x * ct - turn_y * st)
    rows[CLIMBING] = wheel_up - wheel * (q - p[DIVE] * ahead / STANDARD_GRAVITY)
    rows[SLOPING] = wheel_up
    rows[BALANCED] = fx - p[TYRES] * st * fy - p[BESIDE] * ct - p[CAMBER] / (1.0 + (t / STRAIGHT) ** 4)
    rows[ANY_SPEED] = wheel - USUAL_MPS
    rows[MEASURED_SPEED] = wheel - p[DELAY] * ahead - np.nan_to_num(windows.speed)
    rows[RESTING] = left, up, forward
    rows[RESTING_RATE] = wx, wy, wz
    rows[BACKWARD] = np.minimum(wheel, 0.0)
    return rows


def jacobian(windows: Windows, x: Array, unknown: Ints) -> Array:
    """Return the derivatives of process_and_measurements() by some rows of x, shape (len(unknown), ROWS, n).

    Most unknowns are errors of the sensor, which only change the corrected readings. So the derivatives by the readings
    are computed first, as finite differences.

    unknown: indices of these rows of x.
    """
    readings, moved, derivatives = _readings(windows, x), x.copy(), np.empty((len(unknown), ROWS, x.shape[1]))
    base, by_reading = _models(windows, x, readings), np.empty((len(readings), *derivatives.shape[1:]))  # (6, ROWS, n)
    for k, slot in enumerate(by_reading):
        readings[k] += STEP
        slot[:] = (_models(windows, x, readings) - base) / STEP
        readings[k] -= STEP
    errors, turns = _errors(windows), range(STATES + ROTATION.start, STATES + ROTATION.stop)
    for slot, row in zip(derivatives, unknown, strict=True):
        if row in errors:  # an error of one axis changes one reading, with a known derivative
            reading, derivative = errors[row]
            np.multiply(by_reading[reading], derivative, out=slot)
            continue
        moved[row] += STEP
        if row in turns:  # a misalignment changes all six readings
            slot[:] = np.einsum("krn,kn->rn", by_reading, (_readings(windows, moved) - readings) / STEP)
        else:  # any other unknown changes the models themselves
            slot[:] = (_models(windows, moved, readings) - base) / STEP
        moved[row] = x[row]
    return derivatives


def _errors(windows: Windows) -> dict[int, tuple[int, Array]]:
    """Return the index of the reading, and its derivative, for each row of x that is an error of one axis."""
    warm, errors = windows.warm, {}
    for k in range(3):
        errors[BIAS.start + k] = k, -np.ones(len(warm))
        errors[STATES + BIAS_PER_C.start + k] = k, -warm
        errors[STATES + OFFSET.start + k] = 3 + k, np.ones(len(warm))
        errors[STATES + OFFSET_PER_C.start + k] = 3 + k, warm
        for by in range(3):
            errors[STATES + GYRO.start + 3 * k + by] = k, windows.rate[:, by]
            errors[STATES + ACCEL.start + 3 * k + by] = 3 + k, windows.force[:, by]
    return errors


def corrected_rates(rate: Array, x: Array, warm: Array) -> Array:
    """Remove the gyro's errors from n measured rates, shape (3, n), in rad/s.

    x: states, then parameters, shape (STATES + PARAMETERS, n).
    warm: see Windows, shape (n).
    """
    return _corrected(rate, x[STATES:], GYRO) - x[BIAS] - x[STATES:][BIAS_PER_C] * warm


def _corrected(readings: Array, p: Array, errors: slice) -> Array:
    """Rotate readings (3, n) by ROTATION, and add the matrix `errors` times the readings."""
    x, y, z = readings
    a, b, c = p[ROTATION]
    e = p[errors]
    # Second order is needed. To first order, a rotation also lengthens the readings, like a scale error: by 0.8 % for a
    # yaw of 7 degrees.
    u, v, w = 0.5 * (b * z - c * y), 0.5 * (c * x - a * z), 0.5 * (a * y - b * x)
    return np.array(
        (
            x + 2.0 * u + b * w - c * v + e[0] * x + e[1] * y + e[2] * z,
            y + 2.0 * v + c * u - a * w + e[3] * x + e[4] * y + e[5] * z,
            z + 2.0 * w + a * v - b * u + e[6] * x + e[7] * y + e[8] * z,
        )
    )
