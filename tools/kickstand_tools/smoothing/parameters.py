"""The states, and what the errors of the sensor and the bike have in common for a ride; readings without these errors.

The states are those of both ends of each window. Parameters hold for a block of windows and drift from one to the next.
"""

import numpy as np

from ..logs.table import Array

# lean and pitch (rad), velocity of the sensor to the left, up and forward (m/s), bias of the gyro (rad/s)
LEAN, PITCH, LEFT, UP, FORWARD, BIAS = 0, 1, 2, 3, 4, slice(5, 8)
STATES = 8

ROTATION = slice(0, 3)  # rad: error of the alignment about left, up, forward
GYRO = slice(3, 12)  # of 1: scale and cross-axis errors of the gyro, 3 x 3
OFFSET = slice(12, 15)  # g: of the accelerometer
SCALE = 15  # of 1: of the accelerometer along up
HEIGHT, AHEAD = 16, 17  # m: of the sensor above the roll axis, and in front of the rear wheel
TYRES = 18  # g: force to the side over sin(lean), because tyres touch the road beside their middle
BESIDE = 19  # g: level force to the side that lasts, by wind; see beliefs.py
DELAY = 20  # s: of the log's speed
DIVE = 21  # rad per m/s^2: of the nose in braking
CAMBER = 22  # g: force to the side on straights, where a cambered road meets the tyres beside their middle
OF_BIKE = slice(16, 23)  # those from HEIGHT on: not the sensor's
OFFSET_PER_C, BIAS_PER_C = slice(23, 26), slice(26, 29)  # g and rad/s per C, see Windows.warm
PARAMETERS = 29

# What is known of them before the ride, and 1 sigma of that. Scale errors of 3 % and cross-axis sensitivity of 2 % are
# the limits of the data sheet PS-MPU-6000A, 6.1 and 6.2.
USUAL, SIGMA = np.zeros(PARAMETERS), np.empty(PARAMETERS)
SIGMA[ROTATION], SIGMA[GYRO] = np.radians([1.5, 5.0, 2.0]), 0.012
SIGMA[OFFSET], SIGMA[SCALE] = (0.001, 0.003, 0.003), 0.004
SIGMA[OFFSET_PER_C], SIGMA[BIAS_PER_C] = 0.0003, np.radians(0.06)  # of an ordinary sensor; the sheet allows thrice that
WITHOUT_SIX_G, WITHOUT_SIX_SCALE = 0.04, 0.015  # the same where the six positions were not done
for _place, _usual, _sigma in (
    (HEIGHT, 0.5, 0.3),
    (AHEAD, 0.6, 0.5),
    (TYRES, 0.07, 0.06),
    (BESIDE, 0.0, 0.001),
    (CAMBER, 0.0, 0.0055),  # of usual tyres, 0.12, on a road that falls to the side by 2.6 degrees
    (DELAY, 0.4, 0.4),
    (DIVE, np.radians(0.2), np.radians(0.2)),
):
    USUAL[_place], SIGMA[_place] = _usual, _sigma
# Share of sigma by which they change from block to block: a sensor warms up. A mount that yields: see beliefs.py.
DRIFT = np.full(PARAMETERS, 1e-4)
DRIFT[OFFSET] = 0.15, 0.05, 0.05


def sigma(six_done: bool) -> Array:
    """SIGMA for an accelerometer that was calibrated by six positions, or was not."""
    found = SIGMA.copy()
    if not six_done:
        found[OFFSET], found[SCALE] = WITHOUT_SIX_G, WITHOUT_SIX_SCALE
    return found


def known(sigma: Array) -> Array:
    """(m, m): the information about the parameters before the ride, for their standard deviations (m).

    The pose that the alignment took for upright was measured with the accelerometer's offset: not the rotation is known
    from it, but the lean and pitch that the sensor has in this pose, which are the sum of both.
    """
    found = np.diag(1.0 / sigma**2)
    for angle, offset, sign in ((ROTATION.start, OFFSET.stop - 1, 1.0), (ROTATION.stop - 1, OFFSET.start, -1.0)):
        found[offset, offset] += found[angle, angle]
        found[angle, offset] = found[offset, angle] = sign * found[angle, angle]
    return found


def corrected_rates(rate: Array, states: Array, p: Array, warm: Array) -> tuple[Array, Array, Array]:
    """Rates about left, up, forward (rad/s) without the gyro's errors. rate (n, 3), states (n, STATES), p (n,
    PARAMETERS), warm (n): of Windows."""
    x, y, z = rate.T
    a, b, c = p[:, ROTATION].T
    g, bias = p[:, GYRO].T, states[:, BIAS].T + p[:, BIAS_PER_C].T * warm
    return (
        x + b * z - c * y + g[0] * x + g[1] * y + g[2] * z - bias[0],
        y + c * x - a * z + g[3] * x + g[4] * y + g[5] * z - bias[1],
        z + a * y - b * x + g[6] * x + g[7] * y + g[8] * z - bias[2],
    )


def corrected_force(force: Array, p: Array, warm: Array) -> tuple[Array, Array, Array]:
    """Forces to the left, up and forward (g) without the accelerometer's errors. force (n, 3), p (n, PARAMETERS), warm
    (n): of Windows."""
    x, y, z = force.T
    a, b, c = p[:, ROTATION].T
    off = p[:, OFFSET].T + p[:, OFFSET_PER_C].T * warm
    return (
        x + b * z - c * y + off[0],
        (1.0 + p[:, SCALE]) * y + c * x - a * z + off[1],
        z + a * y - b * x + off[2],
    )
