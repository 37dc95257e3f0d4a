"""Finds the yaw of a ride from the sensor alone. This needs no calibration, and the sensor may be mounted at any angle.

Up is the mean direction of the force in bends, because a motorcycle leans until the force points along its own up. The
rate about up is the yaw rate times the cosine of the lean.
"""

from dataclasses import dataclass

import numpy as np

from ..common.errors import InputError
from ..common.messages import Message
from ..logs.reader import Source, read_blocks
from ..logs.source import Progress, name_of
from ..signals import Array, Bools, Cells

STEP_S = 0.05
_MOST_DPS = 20.0  # a cell with a higher rate gets no more weight when up is computed
_LONGEST_S = 100 * 3600.0  # longest ride; memory limits it


@dataclass
class CellMotion:
    """A ride in n cells of STEP_S from its first sample.

    force_g: mean force of each cell along the sensor's axes, shape (n, 3).
    rate_dps: mean rate of each cell about the sensor's axes, minus the gyro's bias, shape (n, 3).
    there: False in a cell without samples or with frozen readings, shape (n). Its force and rate are 0.
    speed, positions: True if the log has them.
    """

    force_g: Array
    rate_dps: Array
    there: Bools
    speed: bool
    positions: bool

    @property
    def t_s(self) -> Array:
        """The middle of each cell, in s since the first sample, shape (n)."""
        return np.arange(0.5, len(self.there)) * STEP_S

    @property
    def seconds(self) -> float:
        """Duration of the ride."""
        return len(self.there) * STEP_S

    @property
    def up(self) -> Array:
        """Return the bike's up in the sensor's axes, shape (3). The direction is exact to a few degrees only, because
        it includes the accelerometer's bias."""
        turning = np.minimum(np.linalg.norm(self.rate_dps, axis=1), _MOST_DPS)
        up: Array = turning @ self.force_g
        return up / max(float(np.linalg.norm(up)), 1e-9)


def motion(ride: Source, progress: Progress | None = None, notices: list[Message] | None = None) -> CellMotion:
    """The CellMotion of a log (see read_log). progress, notices: see read_blocks(). Raises InputError."""
    table, speed, positions = Cells(STEP_S), False, False
    for block in read_blocks(ride, 2, progress, notices, lines=False):
        speed |= bool(np.any(np.isfinite(block.speed_mps)))
        positions |= bool(np.any(np.isfinite(block.lat_deg)))
        good = block.measured
        if len(good.time_us):
            if good.t_s[-1] > _LONGEST_S:
                raise InputError(f"{name_of(ride)} is longer than {_LONGEST_S / 3600:.0f} hours: cut it first")
            table.add(good.t_s, good.readings[:, [0, 1, 2, 4, 5, 6]], np.zeros((len(good.t_s), 0)))
    cells = table.evenly(round(_LONGEST_S / STEP_S) + 1)
    if cells is None:
        raise InputError(f"{name_of(ride)}: all readings are frozen: check the sensor")
    missing = np.zeros((cells.first, 6))  # stays 0 if the readings are frozen from the beginning
    means = np.vstack((missing, cells.means - np.append(np.zeros(3), np.nanmedian(cells.means[:, 3:], axis=0))))
    there = np.append(missing[:, 0], cells.count) > 0
    means[~there] = 0.0
    return CellMotion(means[:, :3], means[:, 3:], there, speed, positions)
