"""How a ride turned, by its sensor alone: no calibration is needed, and the sensor may sit at any angle.

Up is where the force points on average while the bike turns: a motorcycle leans so that the force stays along its own
up. The rate about it is the yaw rate times the cosine of the lean.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.errors import Notice
from numpy.typing import NDArray

from ..errors import InputError
from ..logs.reader import Source, read_blocks
from ..logs.source import Progress, name_of
from ..logs.table import Array
from ..logs.time_cells import no_cells, with_block

STEP_S = 0.05
_MOST_DPS = 20.0  # a cell that turns faster weighs no more for the direction of up
_LONGEST_S = 100 * 3600.0  # what fits into memory


@dataclass
class Motion:
    """A ride in n cells of STEP_S from its first sample.

    force_g, rate_dps (n, 3): means in the sensor's axes, the gyro's bias taken off. there (n): False where the log has
    no sample, or readings that froze; force and rate are 0 there. speed, positions: does the log have any?
    """

    force_g: Array
    rate_dps: Array
    there: NDArray[np.bool_]
    speed: bool
    positions: bool

    @property
    def t_s(self) -> Array:
        """(n) the middle of each cell, s since the first sample."""
        return np.arange(0.5, len(self.there)) * STEP_S

    @property
    def seconds(self) -> float:
        """How long the ride lasts."""
        return len(self.there) * STEP_S

    @property
    def up(self) -> Array:
        """(3) the bike's up in the sensor's axes, to some degrees, as the accelerometer's offset has it."""
        turning = np.minimum(np.linalg.norm(self.rate_dps, axis=1), _MOST_DPS)
        up: Array = turning @ self.force_g
        return up / max(float(np.linalg.norm(up)), 1e-9)


def motion(ride: Source, progress: Progress | None = None, notices: list[Notice] | None = None) -> Motion:
    """Of a log (see read_log). progress, notices: of read_blocks(). Raises InputError."""
    done, last, speed, positions = [], no_cells(), False, False
    for block in read_blocks(ride, 2, progress, notices):
        speed |= bool(np.any(np.isfinite(block.speed_mps)))
        positions |= bool(np.any(np.isfinite(block.lat_deg)))
        good = block.measured
        if len(good.time_us):
            if good.t_s[-1] > _LONGEST_S:
                raise InputError(f"{name_of(ride)} is longer than {_LONGEST_S / 3600:.0f} hours: cut it first")
            readings = good.readings
            cells = with_block(last, STEP_S, good.t_s, readings[:, :3], readings[:, 4:], good.speed_mps)
            done.append(cells[:-1])
            last = cells[-1:]
    table = np.vstack([*done, last])
    if not len(table):
        raise InputError(f"{name_of(ride)}: all readings are frozen: check the sensor")
    place = table[:, 0].astype(int)
    n = int(place[-1]) + 1
    force, rate, there = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n, dtype=bool)
    force[place] = table[:, 1:4] / table[:, 7:8]
    measured = table[:, 4:7] / table[:, 7:8]
    rate[place] = measured - np.median(measured, axis=0)
    there[place] = True
    return Motion(force, rate, there, speed, positions)
