"""Detects standstill by how little readings change: for zero-velocity updates and for the gyro's bias."""

import numpy as np
from numpy.typing import NDArray

from . import Array
from .averages import moving_spread

STANDING_MPS = 0.3  # a lower speed is standing: a receiver's is never quite 0
STANDS = 4.0  # factor on the limits of the changes at such a speed


def motionless(
    rate: Array, force: Array, n: int, most_rate: float, most_force: float, speed_mps: Array | None = None
) -> NDArray[np.bool_]:
    """(m) True where, over the n of m samples around each, no component of rate (m, 3) and of force (m, 3) has a
    standard deviation over most_rate and most_force, in their units.

    Samples: means over a fifth of a second, in which an idling engine averages out. speed_mps (m): NaN where there is
    none. A constant rate passes, as bias or as a steady bend: check its mean in addition.
    """
    speed = np.full(len(rate), np.nan) if speed_mps is None else speed_mps
    allowed = np.where(speed < STANDING_MPS, STANDS, 1.0)
    calm = np.max(moving_spread(rate, n), axis=1) < allowed * most_rate
    calm &= np.max(moving_spread(force, n), axis=1) < allowed * most_force
    return calm & ~(speed >= STANDING_MPS)
