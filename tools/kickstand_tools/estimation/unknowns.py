"""The unknowns: states at both edges of each window, and parameters, the errors of sensor and bike, with their prior.

Parameters are constant within a block of windows and follow a random walk from block to block (see hypotheses.py).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array

# lean and pitch (rad), velocity of the sensor to the left, up and forward (m/s), bias of the gyro (rad/s)
LEAN, PITCH, LEFT, UP, FORWARD, BIAS = 0, 1, 2, 3, 4, slice(5, 8)
STATES = 8

ROTATION = slice(0, 3)  # rad: misalignment about left, up, forward
GYRO = slice(3, 12)  # of 1: scale and cross-axis errors of the gyro, 3 x 3
ACCEL = slice(12, 21)  # of 1: the same of the accelerometer
OFFSET = slice(21, 24)  # g: bias of the accelerometer
HEIGHT, AHEAD = 24, 25  # m: of the sensor above the roll axis, and in front of the rear wheel
TYRES = 26  # g: force to the side over sin(lean), because tyres touch the road beside their middle
BESIDE = 27  # g: level force to the side that lasts, by wind; see hypotheses.py
DELAY = 28  # s: of the log's speed
DIVE = 29  # rad per m/s^2: of the nose in braking
CAMBER = 30  # g: force to the side on straights, where a cambered road meets the tyres beside their middle
OFFSET_PER_C, BIAS_PER_C = slice(31, 34), slice(34, 37)  # g and rad/s per C, see Windows.warm
PARAMETERS = 37
UP_SCALE = ACCEL.start + 4  # of the accelerometer along up
SENSOR = slice(GYRO.start, OFFSET.stop)

# Mean and standard deviation of the prior. Scale errors of 3 % and cross-axis sensitivity of 2 % are the limits of the
# data sheet PS-MPU-6000A, 6.1 and 6.2.
MEAN, SIGMA = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
SIGMA[ROTATION], SIGMA[GYRO] = np.radians([1.5, 5.0, 2.0]), 0.012
SIGMA[OFFSET], SIGMA[UP_SCALE] = (0.001, 0.003, 0.003), 0.004
SIGMA[OFFSET_PER_C], SIGMA[BIAS_PER_C] = 0.0003, np.radians(0.06)  # of an ordinary sensor; the sheet allows thrice that
WITHOUT_SIX_G, WITHOUT_SIX_SCALE = 0.04, 0.015  # the same where the six positions were not done
MEAN[HEIGHT], SIGMA[HEIGHT] = 0.5, 0.3
MEAN[AHEAD], SIGMA[AHEAD] = 0.6, 0.5
MEAN[TYRES], SIGMA[TYRES] = 0.07, 0.06
SIGMA[BESIDE] = 0.001
SIGMA[CAMBER] = 0.0055  # of usual tyres, 0.12, on a road that falls to the side by 2.6 degrees
MEAN[DELAY], SIGMA[DELAY] = 0.4, 0.4
MEAN[DIVE], SIGMA[DIVE] = np.radians([0.2, 0.2])


@dataclass
class Prior:
    """Of the parameters (PARAMETERS): mean and standard deviation; a parameter with the standard deviation 0 is no
    unknown. posed: the alignment is that of an upright pose."""

    mean: Array
    sigma: Array
    posed: bool

    @classmethod
    def of_pose(cls, six_done: bool) -> "Prior":
        """Of a sensor that was aligned by poses. six_done: its accelerometer was calibrated by six positions."""
        sigma = SIGMA.copy()
        if not six_done:
            sigma[OFFSET], sigma[UP_SCALE] = WITHOUT_SIX_G, WITHOUT_SIX_SCALE
        return cls(MEAN, sigma, True)

    @property
    def unknown(self) -> NDArray[np.intp]:
        """The indices (m) of the parameters that are unknowns."""
        return np.flatnonzero(self.sigma)

    def information(self, sigma: Array) -> Array:
        """(m, m): for standard deviations (PARAMETERS) that a hypothesis has enlarged.

        The pose that the alignment took for upright was measured with the accelerometer's offset: not the rotation is
        known from it, but the lean and pitch that the sensor has in this pose, which are the sum of both.
        """
        found = np.diag(np.divide(1.0, sigma**2, out=np.zeros(PARAMETERS), where=sigma > 0.0))
        if self.posed:
            for angle, offset, sign in (
                (ROTATION.start, OFFSET.stop - 1, 1.0),
                (ROTATION.stop - 1, OFFSET.start, -1.0),
            ):
                found[offset, offset] += found[angle, angle]
                found[angle, offset] = found[offset, angle] = sign * found[angle, angle]
        return found[np.ix_(self.unknown, self.unknown)]
