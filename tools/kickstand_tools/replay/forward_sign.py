"""Is the alignment's forward really forward? Where a log has a speed, its changes have the sign of the force along
the vehicle.

A kickstand on the other side than `calibrate two` was told exchanges forward with backward and left with right, and so
do two poses that were swapped. The force alone does not show it, because braking then looks like speeding up.
"""

import numpy as np
from kickstand.errors import Notice

from ..calibration.file import CalibrationFile
from ..logs.table import Array

ENOUGH, ENOUGH_MPS = 20, 0.5  # at least so many changes of speed from second to second, with at least this rms
LATE_S = (0, 1, 2)  # delays of the speed that are tried: a satellite receiver tells it late
CLEARLY = -0.6  # a correlation below this is a reversed forward; a right one has over 0.8, on slopes of 12 % too
WINDOW = 3600  # seconds that are kept


class ForwardSign:
    """add() takes a ride's samples block by block. exchanged: the speed says that forward and backward are."""

    def __init__(self) -> None:
        self._seconds = np.zeros((0, 4))  # its number; sum and count of its forces (g); its first speed (m/s)

    def add(self, time_s: Array, forward_g: Array, speed_mps: Array) -> None:
        """n samples each; speed NaN where there is no new one."""
        if not len(time_s):
            return
        second = np.floor(time_s)
        starts = np.flatnonzero(np.diff(second, prepend=-1.0))
        counts = np.diff(np.append(starts, len(time_s))).astype(float)
        speed = np.full(len(starts), np.nan)
        there = np.flatnonzero(~np.isnan(speed_mps))[::-1]
        # written backwards: of several speeds in a second the first one stays
        speed[np.searchsorted(starts, there, side="right") - 1] = speed_mps[there]
        new = np.column_stack((second[starts], np.add.reduceat(forward_g, starts), counts, speed))
        if len(self._seconds) and self._seconds[-1, 0] == new[0, 0]:  # the block before ended within this second
            last, self._seconds = self._seconds[-1], self._seconds[:-1]
            new[0, 1:3] += last[1:3]
            new[0, 3] = new[0, 3] if np.isnan(last[3]) else last[3]
        self._seconds = np.vstack((self._seconds, new))[-WINDOW:]

    @property
    def correlation(self) -> float | None:
        """Between the force along the vehicle and the change of speed, -1 to 1; None if the ride does not tell."""
        if len(self._seconds) < ENOUGH:
            return None
        first = int(self._seconds[0, 0])
        place = self._seconds[:, 0].astype(int) - first
        if place[-1] > 100 * WINDOW:
            return None  # not one ride
        felt, speed = np.full((2, place[-1] + 1), np.nan)
        felt[place], speed[place] = self._seconds[:, 1] / self._seconds[:, 2], self._seconds[:, 3]
        changes = np.diff(speed)
        found = [_correlation(felt[: len(changes) - late], changes[late:]) for late in LATE_S]
        known = [value for value in found if value is not None]
        return max(known, key=abs) if known else None

    @property
    def exchanged(self) -> bool:
        """Forward is clearly backward."""
        correlation = self.correlation
        return correlation is not None and correlation < CLEARLY


def exchanged_notice(calibration: CalibrationFile, roll_deg: float | None = None) -> Notice:
    """roll_deg: by how much the ride says that up is off, None if it was not asked."""
    return Notice("forward-exchanged", calibration.vehicle == "car", calibration.kickstand_side, roll_deg)


def _correlation(felt: Array, changes: Array) -> float | None:
    both = ~np.isnan(felt) & ~np.isnan(changes)
    felt, changes = felt[both], changes[both]
    if len(changes) < ENOUGH or np.std(changes) < ENOUGH_MPS or not np.std(felt) > 0.0:
        return None
    return float(np.corrcoef(felt, changes)[0, 1])
