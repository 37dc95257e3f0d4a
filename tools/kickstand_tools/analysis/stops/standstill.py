"""Detects standstills, for the stops of a ride.

The limits are relative to the shaking of the ride. They find all of the standing time in simulated rides; the fixed
limits of signals.motionless, in deg/s and g, find 54 to 92 %. Only where an idling engine shakes as much as the road,
relative limits find less (17 to 41 % instead of 91 %).
"""

import numpy as np

from ...signals import STANDING_MPS, Array, Bools, smoothed, stretches, window_means, window_spreads
from ..channels import Channels, spacing_s

STALE_S = 3.0  # an older speed is not used

# Without a speed, a vehicle stands still if it shakes over QUIET_S by less than a share of its shaking when moving
QUIET_S = 1.0
QUIET_SHARE = 0.15  # this share, for pitch and yaw
QUIET_UP_SHARE = 0.2  # this share, for up and down: a fork at a stop shakes less, smooth roads and idling engines more
RIDING_PERCENTILE = 90.0  # this percentile of the shaking is from moving, even in a ride with long pauses
ENGINE_S, BEND_S = 0.1, 0.5  # shaking by the road is slower than an engine's, and faster than bends and the fork's dive
STILL_DPS, STILL_G = 1.0, 0.01  # limits at standstill: rate, change of the forward force from beginning to end
MAX_OFF_G = 0.05  # largest difference from the force at rest; even smooth braking and gentle bends exceed this
UNCALIBRATED_G = 0.12  # largest difference from 1 g if the ride has no rest and the sensor is not calibrated


def standing(ride: Channels) -> Bools:
    """(n) True where the vehicle stands still. Uses the log's speed or, without a speed, the shaking."""
    still = _quiet(ride)
    if not np.any(still):
        still = _rests_of_filter(ride)
    there = ~np.isnan(ride.speed_mps)
    latest = np.maximum.accumulate(np.where(there, np.arange(len(there)), 0))
    known = there[latest] & (ride.t_s - ride.t_s[latest] < STALE_S)
    return np.where(known, ride.speed_mps[latest] < STANDING_MPS, still)


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
    """The rests found by the lean filter, for a road that is too smooth to detect standstills by shaking. Each rest is
    extended back to the time when the forward force reached its value at rest."""
    still = ride.resting > 0.5
    forward = smoothed(ride.forward_g, ride.t_s, ENGINE_S)
    for start, _ in stretches(still):
        weight = np.median(forward[start : start + 10])
        off = np.flatnonzero(np.abs(forward[:start] - weight) > 2 * STILL_G)
        still[(int(off[-1]) + 1 if len(off) else 0) : start] = True
    return still


def _shaking_by_road(values: Array, time: Array) -> Array:
    """The values without the engine's shaking (faster), and without bends and braking (slower): the road's shaking."""
    slow = smoothed(values, time, ENGINE_S)
    return slow - smoothed(slow, time, BEND_S)


def _is_calm(values: Array, n: int, share: float) -> Bools:
    """True where the standard deviation of n successive samples is under this share of the deviation while moving."""
    spread = window_spreads(values, n)
    return spread < share * np.percentile(spread, RIDING_PERCENTILE)


def _has_force_at_rest(ride: Channels, n: int) -> Bools:
    """True where the force over n successive samples equals the force at rest, within the sensor's calibration
    errors."""
    size = np.sqrt(sum(window_means(axis, n) ** 2 for axis in (ride.left_g, ride.up_g, ride.forward_g)))
    rests = size[window_means(ride.resting, n) > 0.99]
    weight = float(np.median(rests)) if len(rests) else 1.0
    return np.abs(size - weight) < (MAX_OFF_G if len(rests) else UNCALIBRATED_G)
