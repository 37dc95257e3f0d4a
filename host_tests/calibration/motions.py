"""Rotations, directions and readings for the tests of calibrations."""

import numpy as np
from kickstand_tools.logs.log import Log

SIDES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
SLANTED = np.array([0.6, 0.0, 0.8])
# An accelerometer with the errors that the data sheet allows: force = SLOPE * reading + OFFSET_G
OFFSET_G, SLOPE = np.array([0.01, -0.02, 0.03]), np.array([1.02, 0.99, 1.01])


def random_rotation(chance):
    """Return a uniformly distributed rotation matrix, rounded to float32."""
    q, r = np.linalg.qr(chance.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return (q * np.linalg.det(q)).astype(np.float32).astype(float)


def tipped(direction, angle_deg, chance):
    """Return the direction rotated by an angle about a random axis perpendicular to it."""
    across = np.cross(direction, chance.normal(size=3))
    across /= np.linalg.norm(across)
    return np.asarray(direction) * np.cos(np.radians(angle_deg)) + across * np.sin(np.radians(angle_deg))


def leaned(angle_deg):
    """Return the specific force (left, up, forward) of a bike at rest that leans to the right by this angle."""
    return np.array([np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg)), 0.0])


def read_at(force):
    """Return the reading of the accelerometer for a force in g."""
    return (np.asarray(force, float) - OFFSET_G) / SLOPE


def still(force, count=400, bias_dps=(0.0, 0.0, 0.0), noise=0.002):
    """Return readings (n, 7) of a sensor at rest. noise: standard deviation of the readings, in g and in deg/s."""
    readings = np.tile([*read_at(force), 20.0, *bias_dps], (count, 1))
    readings[:, [0, 1, 2, 4, 5, 6]] += np.random.default_rng(1).normal(0.0, noise, (count, 6))
    return readings


def still_log(force, name="", **how):
    """Return the log of still()."""
    log = Log.from_readings(still(force, **how), 100.0)
    log.name = name
    return log
