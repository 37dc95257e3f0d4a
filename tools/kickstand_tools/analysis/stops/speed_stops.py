"""Does the speed in the log alone fall to a stop? Then there was one, even if the force does not show it."""

import numpy as np

from ...signals.standstill import STANDING_MPS
from ..channels import Channels
from .brake_test import MIN_MFDD_MPS2, MIN_SPEED_MPS

LONGEST_S = 15.0
SURELY = 1.5  # times the smallest deceleration of a stop


def stops_by_speed(ride: Channels) -> bool:
    """True if there is one from over 10 km/h, surely hard enough to be a brake test."""
    there = ~np.isnan(ride.speed_mps)
    time, speed = ride.t_s[there], ride.speed_mps[there]
    for end in np.flatnonzero((speed[1:] < STANDING_MPS) & (speed[:-1] >= STANDING_MPS)) + 1:
        before = slice(int(np.searchsorted(time, time[end] - LONGEST_S)), end)
        fall = speed[before] / (time[end] - time[before])
        if np.any((speed[before] > MIN_SPEED_MPS) & (fall > SURELY * MIN_MFDD_MPS2)):
            return True
    return False
