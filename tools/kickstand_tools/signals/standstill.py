"""When a vehicle stands still, by how little its readings change: for zero-velocity updates, for the gyro's bias."""

import numpy as np
from numpy.typing import NDArray

from . import Array
from .averages import moving_spread

STANDING_MPS = 0.3  # a slower speed is standing: satellites never quite say 0
STANDS = 4.0  # such a speed allows so many times the changes


def motionless(
    rate: Array, force: Array, n: int, most_rate: float, most_force: float, speed_mps: Array | None = None
) -> NDArray[np.bool_]:
    """(m) True where, over the n of m samples around each, no component of rate (m, 3) and of force (m, 3) has a
    standard deviation over most_rate and most_force, in their units.

    Of means over a fifth of a second, in which an idling engine averages out. speed_mps (m): NaN where there is none.
    A rate that stays the same is a bias or a steady turn: judge its mean beside this.
    """
    speed = np.full(len(rate), np.nan) if speed_mps is None else speed_mps
    allowed = np.where(speed < STANDING_MPS, STANDS, 1.0)
    calm = np.max(moving_spread(rate, n), axis=1) < allowed * most_rate
    calm &= np.max(moving_spread(force, n), axis=1) < allowed * most_force
    return calm & ~(speed >= STANDING_MPS)
