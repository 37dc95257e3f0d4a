"""Runs all checks on one table of cells, and collects the remarks."""

import numpy as np

from ..calibration.file import CalibrationFile
from ..common.errors import RefusedInput
from ..common.messages import AT_REST, Message, Remedy, WrongAxes
from ..logs.cells import MOST_DPS, MOST_G
from ..logs.log import Block, Log
from . import mount
from .bends import bends
from .cells import CellTable, LogCells
from .course import course_agrees
from .handedness import handedness
from .units import speed_unit

_LIMITS = np.array(3 * [MOST_G] + [np.inf] + 3 * [MOST_DPS])  # limits of readings; a log made in Python may exceed them
_AGAIN_S = 20.0  # the unit of the speed is checked again each time this much of the log was read


class Mirrored(WrongAxes):
    """The track shows that left and right are exchanged."""

    code = "mirrored"
    text = "the sensor turns against the track, so left and right are exchanged"
    todo = Remedy(f"were all accelerations turned? {AT_REST.capitalize()}")


class Checks:
    """Checks a log. Call add() for each part of it, then remarks().

    name: the log's name, for messages.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._table = CellTable()
        self._judged_s = 0.0

    def add(self, part: Block | Log) -> None:
        """Add a part of the log without frozen readings.

        Raises RefusedInput as soon as the speed is certainly not in m/s.
        """
        there = ~np.any(np.abs(part.readings) > _LIMITS, axis=1)
        part = part if np.all(there) else part.part(there)  # a single huge reading would outweigh a whole ride
        readings = part.readings
        self._table.add(part.t_s, readings[:, :3], readings[:, 4:], part.speed_mps, part.lat_deg, part.lon_deg)
        if len(part.t_s) and part.t_s[-1] > self._judged_s + _AGAIN_S:
            self._judged_s = float(part.t_s[-1])
            self._judge_speed(self._table.cells())

    def remarks(self, axes: bool = True, calibration: CalibrationFile | None = None) -> list[Message]:
        """Return at most one remark about the log's axes, and at most one remark that the log contradicts the
        calibration.

        axes: False to skip the checks of the axes.
        calibration: None to skip the check of the calibration.
        Raises RefusedInput if the speed is not in m/s.
        """
        cells = self._table.cells()
        if cells is None:
            return []
        self._judge_speed(cells)
        found: list[Message | None] = []
        if axes:
            mirrored = Mirrored() if course_agrees(cells) is False else None
            found.append(handedness(cells) or bends(cells) or mirrored)
        if calibration is not None:
            found.append(mount.contradiction(cells, calibration))
        return [notice for notice in found if notice]

    def _judge_speed(self, cells: LogCells | None) -> None:
        wrong = cells and speed_unit(cells)
        if wrong:
            raise RefusedInput(wrong, self._name)


def remarks(log: Log, calibration: CalibrationFile | None = None, axes: bool = True) -> list[Message]:
    """Return Checks.remarks() for a log in memory. Raises RefusedInput.

    >>> import numpy as np
    >>> from kickstand_tools.api import simulate_ride
    >>> from kickstand_tools.logs.log import Log
    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.gyro_dps = -log.gyro_dps
    >>> [notice.code for notice in remarks(log)]
    ['left-handed']
    """
    checks = Checks(log.name)
    checks.add(log)
    return checks.remarks(axes, calibration)
