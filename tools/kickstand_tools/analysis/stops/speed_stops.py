"""Does the log's speed alone fall to a stop? Then one that the force does not tell is no sign that there was none."""

import numpy as np

from ..channels import Channels
from .brake_test import MIN_MFDD_MPS2, MIN_SPEED_MPS
from .standstill import STOPPED_MPS

LONGEST_S = 15.0
SURELY = 1.5  # times what a stop has to have at least


def stops_by_speed(ride: Channels) -> bool:
    """One at least, from over 10 km/h and surely hard enough to be among the brake tests."""
    there = ~np.isnan(ride.speed_mps)
    time, speed = ride.t_s[there], ride.speed_mps[there]
    for end in np.flatnonzero((speed[1:] < STOPPED_MPS) & (speed[:-1] >= STOPPED_MPS)) + 1:
        before = slice(int(np.searchsorted(time, time[end] - LONGEST_S)), end)
        fall = speed[before] / (time[end] - time[before])
        if np.any((speed[before] > MIN_SPEED_MPS) & (fall > SURELY * MIN_MFDD_MPS2)):
            return True
    return False
