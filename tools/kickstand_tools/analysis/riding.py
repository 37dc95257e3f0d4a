"""How long a vehicle was on the move."""

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array
from .channels import Channels
from .downsample import spacing_s
from .signals import smoothed

# A vehicle that has gone anywhere has turned, sped up or braked by this much for a second. An engine that idles at
# standstill shakes as much as a road, but its mean over a second hardly changes.
OVER_S = 1.0
TURNS_DPS, PUSHES_G = 3.0, 0.05
MOVES_MPS = 1.0


def riding_s(ride: Channels, standing: NDArray[np.bool_]) -> float:
    """Seconds. ride: with evenly spaced samples (see downsampled()); standing (n): True where it stands still."""
    if not _has_moved(ride):
        return 0.0
    return float(np.count_nonzero(~standing)) * spacing_s(ride)


def _has_moved(ride: Channels) -> bool:
    if np.any(~np.isnan(ride.speed_mps)):
        return bool(np.nanmax(ride.speed_mps) > MOVES_MPS)
    if ride.t_s[-1] - ride.t_s[0] < OVER_S:
        return False
    return _changes(ride.yaw_rate_dps, ride.t_s) > TURNS_DPS or _changes(ride.forward_g, ride.t_s) > PUSHES_G


def _changes(values: Array, t_s: Array) -> float:
    """By how much the mean over OVER_S differs from the usual one: a gyro's bias, or the slope of the ground."""
    slow = smoothed(values, t_s, OVER_S)
    return float(np.max(np.abs(slow - np.median(slow))))
