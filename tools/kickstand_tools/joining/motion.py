"""Finds the yaw of a ride from the sensor alone. This needs no calibration, and the sensor may be mounted at any angle.

Up is the mean direction of the force in bends, because a motorcycle leans until the force points along its own up. The
rate about up is the yaw rate times the cosine of the lean.
"""

from dataclasses import dataclass

import numpy as np

from ..checks.log import CheckedLog
from ..common.errors import InputError
from ..signals import Array, Bools, binned

STEP_S = 0.05
_MOST_DPS = 20.0  # a bin with a higher rate gets no more weight when up is computed
_LONGEST_S = 100 * 3600.0  # longest ride; memory limits it


@dataclass
class BinMotion:
    """A ride in n bins of STEP_S from its first sample.

    force_g: mean force of each bin along the sensor's axes, shape (n, 3).
    rate_dps: mean rate of each bin about the sensor's axes, minus the gyro's bias, shape (n, 3).
    valid: False in a bin without samples or with frozen readings, shape (n). Its force and rate are 0.
    has_speed, has_positions: True if the log has them.
    """

    force_g: Array
    rate_dps: Array
    valid: Bools
    has_speed: bool
    has_positions: bool

    @property
    def t_s(self) -> Array:
        """The middle of each bin, in s since the first sample, shape (n)."""
        return np.arange(0.5, len(self.valid)) * STEP_S

    @property
    def seconds(self) -> float:
        """Duration of the ride."""
        return len(self.valid) * STEP_S

    @property
    def up(self) -> Array:
        """Return the bike's up in the sensor's axes, shape (3). The direction is exact to a few degrees only, because
        it includes the accelerometer's bias."""
        turning = np.minimum(np.linalg.norm(self.rate_dps, axis=1), _MOST_DPS)
        up: Array = turning @ self.force_g
        return up / max(float(np.linalg.norm(up)), 1e-9)


def motion(ride: CheckedLog) -> BinMotion:
    """The BinMotion of a checked log. Raises InputError if all readings are frozen, or for a ride that is too long."""
    log, measured = ride.log, ride.measured
    if log.t_s[-1] > _LONGEST_S:
        raise InputError(f"{log.name} is longer than {_LONGEST_S / 3600:.0f} hours: cut it first")
    part = log if np.all(measured) else log.part(measured)
    longest = round(_LONGEST_S / STEP_S) + 1
    bins = binned(part.t_s, STEP_S, [*part.accel_g.T, *part.gyro_dps.T], [], longest, longest)
    if bins is None:
        raise InputError(f"{log.name}: all readings are frozen: check the sensor")
    missing = np.zeros((bins.first, 6))  # stays 0 if the readings are frozen from the beginning
    means = np.vstack((missing, bins.means - np.append(np.zeros(3), np.nanmedian(bins.means[:, 3:], axis=0))))
    valid = np.append(missing[:, 0], bins.count) > 0
    means[~valid] = 0.0
    has_speed, has_positions = (bool(np.any(np.isfinite(values))) for values in (log.speed_mps, log.lat_deg))
    return BinMotion(means[:, :3], means[:, 3:], valid, has_speed, has_positions)
