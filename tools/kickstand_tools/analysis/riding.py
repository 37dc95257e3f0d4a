"""Measures for how long a vehicle was on the move."""

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array
from ..signals.averages import smoothed
from .channels import Channels
from .downsample import spacing_s

# A vehicle that has gone anywhere has turned, sped up or braked by this much for a second. An engine that idles at
# standstill shakes as much as a road, but its mean over a second hardly changes.
OVER_S = 1.0
TURNS_DPS, PUSHES_G = 3.0, 0.05
MOVES_MPS = 1.0


def riding_s(ride: Channels, standing: NDArray[np.bool_], whole: bool = True) -> float:
    """Seconds on the move. ride: with evenly spaced samples (see downsampled()); standing (n): True where it stands
    still. whole: False for a stretch of a ride, in which a vehicle may go straight on, or stay in one bend, from
    beginning to end."""
    if whole and not _has_moved(ride):
        return 0.0
    return float(np.count_nonzero(~standing)) * spacing_s(ride)


def _has_moved(ride: Channels) -> bool:
    if np.any(~np.isnan(ride.speed_mps)):
        return bool(np.nanmax(ride.speed_mps) > MOVES_MPS)
    half = round(0.5 * OVER_S / spacing_s(ride))
    if len(ride.t_s) <= 2 * half:
        return False
    inner = slice(half, len(ride.t_s) - half)  # at its ends a mean is mostly that of the first or the last sample
    turns, pushes = (smoothed(values, ride.t_s, OVER_S)[inner] for values in (ride.yaw_rate_dps, ride.forward_g))
    return _changes(turns) > TURNS_DPS or _changes(pushes) > PUSHES_G


def _changes(means: Array) -> float:
    """The largest difference of means from their median: that is a gyro's bias, or the slope of the ground."""
    return float(np.max(np.abs(means - np.median(means))))
