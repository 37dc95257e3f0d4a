"""When a vehicle stands still."""

import numpy as np
from numpy.typing import NDArray

from .channels import Array, Channels
from .signals import smoothed
from .thin import spacing_s

STOPPED_MPS = 0.3  # a speed that counts as standing; satellites never quite say 0
STALE_S = 3.0  # a speed says no more after that

# Without a speed, what stands shakes for so long by no more than a share of what it does on the move
QUIET_S = 1.0
QUIET_SHARE = 0.15  # in pitch and yaw
QUIET_UP_SHARE = 0.5  # up and down, with the engine's
RIDING_PERCENTILE = 90.0  # which even a test with long pauses moves for
ENGINE_S = 0.1  # an idling engine is quicker
STILL_DPS, STILL_G = 1.0, 0.01  # turns no faster, and is as steep at the end as at the beginning


def standing(ride: Channels) -> NDArray[np.bool_]:
    """True where the bike stands still: by the log's own speed, or where there is none by how little it shakes."""
    still = _quiet(ride)
    there = np.flatnonzero(~np.isnan(ride.speed_mps))
    if len(there):
        place = np.searchsorted(there, np.arange(len(still)), side="right") - 1
        latest = there[np.maximum(place, 0)]
        known = (place >= 0) & (ride.t_s - ride.t_s[latest] < STALE_S)
        still = np.where(known, ride.speed_mps[latest] < STOPPED_MPS, still)
    return still


def _quiet(ride: Channels) -> NDArray[np.bool_]:
    still = np.zeros(len(ride.t_s), dtype=bool)
    second = max(4, round(QUIET_S / spacing_s(ride)))
    if len(still) < 2 * second:
        return still
    quiet = np.ones(len(still) - second + 1, dtype=bool)
    for rate in ride.pitch_rate_dps, ride.yaw_rate_dps:
        mean, spread = _window(smoothed(rate, ride.t_s, ENGINE_S), second)
        quiet &= (np.abs(mean) < STILL_DPS) & (spread < QUIET_SHARE * np.percentile(spread, RIDING_PERCENTILE))
    _, spread = _window(ride.up_g, second)
    quiet &= spread < QUIET_UP_SHARE * np.percentile(spread, RIDING_PERCENTILE)
    half = second // 2
    forward, _ = _window(ride.forward_g, half)
    quiet &= np.abs(forward[second - half :] - forward[: len(quiet)]) < STILL_G
    for shift in range(second):  # every sample of a quiet window
        still[shift : shift + len(quiet)] |= quiet
    return still


def _window(values: Array, n: int) -> tuple[Array, Array]:
    """Mean and standard deviation of each n values in a row."""
    middle = float(np.mean(values))  # taken off, or the squares of a large one would hide the spread
    values = values - middle
    first, second = (np.cumsum(np.concatenate(([0.0], x))) for x in (values, values * values))
    mean = (first[n:] - first[:-n]) / n
    return mean + middle, np.sqrt(np.maximum(0.0, (second[n:] - second[:-n]) / n - mean * mean))
