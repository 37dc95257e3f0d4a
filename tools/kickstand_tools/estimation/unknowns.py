"""Defines the unknowns of the estimation: states and parameters, and hypotheses about the parameters' changes.

The states describe the motion at the edges of the windows. The parameters are errors of sensor and bike, and have a
prior. The parameters are constant within a block of windows, and follow a random walk from block to block.

On straights, a bike seems to lean if the sensor's mount has yielded, or if wind pushes the bike to the side for
minutes. A hypothesis combines a mount with a strength of the wind. Its posterior weight follows from its prior
probability and from the likelihood of the readings. If the readings do not distinguish two hypotheses, the result is
between the results of the two hypotheses. The standard deviation of the result then grows with the difference between
them.
"""

from dataclasses import dataclass

import numpy as np

from ..signals import Array, Ints
from .solver import RandomWalks, Reduced, minus_two_log_likelihood

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


@dataclass
class Prior:
    """The prior of the parameters.

    mean: shape (PARAMETERS).
    sigma: standard deviations, shape (PARAMETERS). A parameter whose standard deviation is 0 is not estimated.
    posed: True if the alignment comes from an upright pose.
    """

    mean: Array
    sigma: Array
    posed: bool

    @classmethod
    def of_pose(cls, six_done: bool, gyro_sigma: Array | None = None) -> "Prior":
        """Return the prior for a sensor that was aligned by poses.

        six_done: True if six positions calibrated the accelerometer.
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
        and bias. This sum is the lean and pitch that the sensor reads in the pose.

        sigma: standard deviations of the prior, shape (PARAMETERS). A hypothesis may have enlarged some of them.
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
    """G hypotheses. Each field has the shape (G).

    turning: process noise per block of the mount's rotation about left and up, in rad.
    rolling: process noise per block of the mount's rotation about forward, in rad.
    pushed: standard deviation of the lasting force to the side, in g.
    minus_two_log_prior: minus twice the logarithm of the prior probability.
    weight: posterior weights, whose sum is 1.
    """

    turning: Array
    rolling: Array
    pushed: Array
    minus_two_log_prior: Array
    weight: Array

    def select(self, index: Ints, weight: Array) -> "Hypotheses":
        """Return k of the hypotheses, with new posterior weights.

        index: indices of the hypotheses, shape (k). weight: their posterior weights, shape (k).
        """
        return Hypotheses(
            self.turning[index], self.rolling[index], self.pushed[index], self.minus_two_log_prior[index], weight
        )

    def first(self) -> "Hypotheses":
        """Return only the first hypothesis, with weight 1."""
        return self.select(np.zeros(1, dtype=np.intp), np.ones(1))

    def weighted(self, blocks: Reduced, prior: Prior, parameters: Array, unbalance: float) -> "Hypotheses":
        """Compute the posterior weights, and drop hypotheses of negligible weight.

        blocks: the normal equations of the windows.
        parameters: the values at which the equations were linearised, shape (B, PARAMETERS).
        unbalance: see Noise. A value over 1 reduces the weight of the likelihood.
        """
        minus_two_log = minus_two_log_likelihood(blocks, self.random_walks(prior, parameters))
        minus_two_log = minus_two_log * WEIGHT / max(1.0, unbalance) ** 2 + self.minus_two_log_prior
        weight = np.exp(-0.5 * (minus_two_log - np.min(minus_two_log)))
        likely = np.flatnonzero(weight > LEAST_SHARE * np.sum(weight))
        return self.select(likely, weight[likely] / np.sum(weight[likely]))

    def random_walks(self, prior: Prior, parameters: Array) -> RandomWalks:
        """Return the random walks of the estimated parameters, for the solver.

        They hold the prior of each hypothesis, the variances of the changes from block to block, and the current
        differences between blocks. parameters: see weighted().
        """
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


def _all_hypotheses() -> Hypotheses:
    mounts = (FIRM, FIRM, 0.0), (FIRM, YIELDING, YIELDS), (YIELDING, YIELDING, YIELDS)
    pushes = (CALM_G, 0.0), (WIND_G, WINDY), (STORM_G, STORMY)
    rows = [
        (turning, rolling, pushed, yields + windy, 1.0 / 9.0)
        for turning, rolling, yields in mounts
        for pushed, windy in pushes
    ]
    return Hypotheses(*np.array(rows).T)


ALL = _all_hypotheses()
