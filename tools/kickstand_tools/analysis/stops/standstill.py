"""Detects standstills, for the stops of a ride.

It does not use signals.motionless. Limits relative to the ride's own shaking detect all of the standing time of
simulated rides on the road; limits in deg/s and g detect 54 to 92 %. Only if an idling engine shakes like the road,
relative limits detect less (17 to 41 % against 91 %).
"""

import numpy as np

from ...signals import STANDING_MPS, Array, Bools, smoothed, stretches, window_means, window_spreads
from ..channels import Channels, spacing_s

STALE_S = 3.0  # an older speed is not used

# Without a speed: a vehicle stands still while, over QUIET_S, it shakes by less than a share of its shaking when moving
QUIET_S = 1.0
QUIET_SHARE = 0.15  # that share for pitch and yaw
QUIET_UP_SHARE = 0.2  # that share for up and down: smooth roads and an idling engine leave more than a standing fork
RIDING_PERCENTILE = 90.0  # this percentile of the shaking is from moving, even in a ride with long pauses
ENGINE_S, BEND_S = 0.1, 0.5  # the road shakes slower than an idling engine, faster than bends and the fork's dive
STILL_DPS, STILL_G = 1.0, 0.01  # limits at standstill: rate, change of the forward force from beginning to end
MAX_OFF_G = 0.05  # largest difference of the force from that at rest; in smooth braking and bends it is larger
UNCALIBRATED_G = 0.12  # largest difference from 1 g, for a ride without rest and a sensor without six positions


def standing(ride: Channels) -> Bools:
    """(n) True where the vehicle stands still: from the log's speed, or without one from its small shaking."""
    still = _quiet(ride)
    if not np.any(still):
        still = _rested(ride)
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
        quiet &= (np.abs(window_means(slow, second)) < STILL_DPS) & _calm(slow, second, QUIET_SHARE)
        quiet &= _calm(_road(rate, ride.t_s), second, QUIET_SHARE)
    quiet &= _calm(_road(ride.up_g, ride.t_s), second, QUIET_UP_SHARE)
    half = second // 2
    forward = window_means(ride.forward_g, half)
    quiet &= np.abs(forward[second - half :] - forward[: len(quiet)]) < STILL_G
    quiet &= _weight(ride, second) & (window_means(ride.rolling, second) < 0.5)
    for shift in range(second):  # mark every sample of a quiet window
        still[shift : shift + len(quiet)] |= quiet
    return still


def _rested(ride: Channels) -> Bools:
    """The rests that the lean filter found, for a road that is too smooth for the test of shaking. Each is extended
    back to where the forward force reached that of the rest."""
    still = ride.resting > 0.5
    forward = smoothed(ride.forward_g, ride.t_s, ENGINE_S)
    for start, _ in stretches(still):
        weight = np.median(forward[start : start + 10])
        off = np.flatnonzero(np.abs(forward[:start] - weight) > 2 * STILL_G)
        still[(int(off[-1]) + 1 if len(off) else 0) : start] = True
    return still


def _road(values: Array, time: Array) -> Array:
    """The shaking caused by the road: values without the engine's shaking, and without bends and braking, which are
    larger."""
    slow = smoothed(values, time, ENGINE_S)
    return slow - smoothed(slow, time, BEND_S)


def _calm(values: Array, n: int, share: float) -> Bools:
    """True where the standard deviation of n successive samples is under this share of the one while moving."""
    spread = window_spreads(values, n)
    return spread < share * np.percentile(spread, RIDING_PERCENTILE)


def _weight(ride: Channels, n: int) -> Bools:
    """True where the force over n successive samples equals that at rest, within the sensor's calibration errors."""
    size = np.sqrt(sum(window_means(axis, n) ** 2 for axis in (ride.left_g, ride.up_g, ride.forward_g)))
    rests = size[window_means(ride.resting, n) > 0.99]
    weight = float(np.median(rests)) if len(rests) else 1.0
    return np.abs(size - weight) < (MAX_OFF_G if len(rests) else UNCALIBRATED_G)
