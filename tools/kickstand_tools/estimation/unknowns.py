"""Defines the unknowns of the estimation: states and parameters.

The states describe the motion at the edges of the windows. The parameters are errors of sensor and bike, and have a
prior. The parameters are constant within a block of windows, and follow a random walk from block to block (see
hypotheses.py).
"""

from dataclasses import dataclass

import numpy as np

from ..signals import Array, Ints

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
BESIDE = 27  # lasting level force to the side, due to wind, in g; see hypotheses.py
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
