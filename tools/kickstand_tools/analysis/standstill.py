"""Detects standstills, for the stops of a ride.

The limits are relative to the shaking of the ride. In simulated rides, these limits find all of the standing time. The
fixed limits of signals.motionless, in deg/s and g, find only 54 to 92 % of this time. Relative limits are worse only if
an idling engine shakes as much as the road. Then relative limits find 17 to 41 % of the standing time, and fixed limits
find 91 %.
"""

import numpy as np

from ..signals import STANDING_MPS, Array, Bools, intervals, smoothed, window_means, window_spreads
from .channels import Channels, spacing_s

STALE_S = 3.0  # an older speed is not used

# Without a speed, standstills are found by the shaking. At a standstill, the shaking over QUIET_S is less than a share
# of the shaking while moving.
QUIET_S = 1.0
QUIET_SHARE = 0.15  # the share for the rates of pitch and yaw
# The share for the vertical force. After a stop the fork shakes less than this. Smooth roads and idling engines cause
# more shaking.
QUIET_UP_SHARE = 0.2
RIDING_PERCENTILE = 90.0  # this percentile of the shaking comes from a moving vehicle, even with long pauses
# Limits of the road's shaking. Shaking faster than ENGINE_S is the engine's. Changes slower than BEND_S are bends and
# the dive of the fork
ENGINE_S, BEND_S = 0.1, 0.5
STILL_DPS, STILL_G = 1.0, 0.01  # at a standstill, largest rate, and largest change of the forward force over QUIET_S
MAX_OFF_G = 0.05  # at a standstill, largest difference from the force at rest; even gentle braking and bends exceed it
UNCALIBRATED_G = 0.12  # for a ride without a rest: largest difference from 1 g, also of an uncalibrated sensor


def standing(ride: Channels) -> Bools:
    """Find the standstills by the log's speed or, without a speed, by the shaking.

    Returns True where the vehicle stands still, shape (n).
    """
    still = _quiet(ride)
    if not np.any(still):
        still = _rests_of_filter(ride)
    valid = ~np.isnan(ride.speed_mps)
    latest = np.maximum.accumulate(np.where(valid, np.arange(len(valid)), 0))
    recent = valid[latest] & (ride.t_s - ride.t_s[latest] < STALE_S)
    return np.where(recent, ride.speed_mps[latest] < STANDING_MPS, still)


def _quiet(ride: Channels) -> Bools:
    still = np.zeros(len(ride.t_s), dtype=bool)
    second = max(4, round(QUIET_S / spacing_s(ride)))
    if len(still) < 2 * second:
        return still
    quiet = np.ones(len(still) - second + 1, dtype=bool)
    for rate in ride.pitch_rate_dps, ride.yaw_rate_dps:
        slow = smoothed(rate, ride.t_s, ENGINE_S)
        quiet &= (np.abs(window_means(slow, second)) < STILL_DPS) & _is_calm(slow, second, QUIET_SHARE)
        quiet &= _is_calm(_shaking_by_road(rate, ride.t_s), second, QUIET_SHARE)
    quiet &= _is_calm(_shaking_by_road(ride.up_g, ride.t_s), second, QUIET_UP_SHARE)
    half = second // 2
    forward = window_means(ride.forward_g, half)
    quiet &= np.abs(forward[second - half :] - forward[: len(quiet)]) < STILL_G
    quiet &= _has_force_at_rest(ride, second) & (window_means(ride.rolling, second) < 0.5)
    for shift in range(second):  # mark every sample of a quiet window
        still[shift : shift + len(quiet)] |= quiet
    return still


def _rests_of_filter(ride: Channels) -> Bools:
    """Return the rests that the lean filter finds, for a road that is too smooth to detect standstills by shaking.

    Each rest is extended back to the time when the forward force reached its value at rest.
    """
    still = ride.resting > 0.5
    forward = smoothed(ride.forward_g, ride.t_s, ENGINE_S)
    for start, _ in intervals(still):
        weight = np.median(forward[start : start + 10])
        moving = np.flatnonzero(np.abs(forward[:start] - weight) > 2 * STILL_G)
        still[(int(moving[-1]) + 1 if len(moving) else 0) : start] = True
    return still


def _shaking_by_road(values: Array, time: Array) -> Array:
    """Return only the road's shaking: remove the engine's faster shaking, and slower bends and braking."""
    slow = smoothed(values, time, ENGINE_S)
    return slow - smoothed(slow, time, BEND_S)


def _is_calm(values: Array, n: int, share: float) -> Bools:
    """Return True where the standard deviation of n successive samples is below a share of its value while moving."""
    spread = window_spreads(values, n)
    return spread < share * np.percentile(spread, RIDING_PERCENTILE)


def _has_force_at_rest(ride: Channels, n: int) -> Bools:
    """True where the mean force over n samples is the force at rest, within the errors of the calibration."""
    size = np.sqrt(sum(window_means(axis, n) ** 2 for axis in (ride.left_g, ride.up_g, ride.forward_g)))
    rests = size[window_means(ride.resting, n) > 0.99]
    weight = float(np.median(rests)) if len(rests) else 1.0
    return np.abs(size - weight) < (MAX_OFF_G if len(rests) else UNCALIBRATED_G)
