"""Is forward really forward? Where a log has a speed, its changes are those that the force along the vehicle makes.

A kickstand on the other side than `calibrate two` was told turns forward and left round, and so do poses that were
swapped. No ride tells it by the force alone: braking is then speeding up.
"""

import numpy as np
from numpy.typing import NDArray

ENOUGH, ENOUGH_MPS = 20, 0.5  # changes of speed from second to second, and their rms
LATE_S = (0, 1, 2)  # a speed of satellites is late
CLEARLY = -0.6  # correlation: a right one has over 0.8, hills of 12 % included
WINDOW = 3600  # seconds that are kept
SWAPPED_DEG = 4.0  # by which up is off: hardly an upright pose is, the kickstand's is

Array = NDArray[np.float64]


class ForwardSign:
    """add() a ride's samples block by block. exchanged: forward and backward are, as far as the speed tells."""

    def __init__(self) -> None:
        self._seconds = np.zeros((0, 4))  # which; sum and number of its forces (g); its first speed (m/s)

    def add(self, time_s: Array, forward_g: Array, speed_mps: Array) -> None:
        """n samples each; speed NaN where there is no new one."""
        if not len(time_s):
            return
        second = np.floor(time_s)
        starts = np.flatnonzero(np.diff(second, prepend=-1.0))
        counts = np.diff(np.append(starts, len(time_s))).astype(float)
        speed = np.full(len(starts), np.nan)
        there = np.flatnonzero(~np.isnan(speed_mps))[::-1]
        speed[np.searchsorted(starts, there, side="right") - 1] = speed_mps[there]  # the first is written last
        new = np.column_stack((second[starts], np.add.reduceat(forward_g, starts), counts, speed))
        if len(self._seconds) and self._seconds[-1, 0] == new[0, 0]:  # the block before ended within a second
            last, self._seconds = self._seconds[-1], self._seconds[:-1]
            new[0, 1:3] += last[1:3]
            new[0, 3] = new[0, 3] if np.isnan(last[3]) else last[3]
        self._seconds = np.vstack((self._seconds, new))[-WINDOW:]

    @property
    def correlation(self) -> float | None:
        """Of speeding up as felt and as the speed has it, -1 to 1; None if the ride does not tell."""
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
        """Forward is backward, clearly."""
        correlation = self.correlation
        return correlation is not None and correlation < CLEARLY


def exchanged_line(car: bool, side: str, roll_deg: float | None = None) -> str:
    """What to say and do. side: that the poses were calibrated for, "" if not known; roll_deg: by which up is off."""
    line = "forward and backward are exchanged: "
    if car:
        return line + "calibrate drive again?"
    if roll_deg is not None and abs(roll_deg) > SWAPPED_DEG:
        return line + "were the poses swapped?"
    other = {"left": "--side right", "right": "--side left"}.get(side, "with the other --side")
    return line + f"calibrate two {other}?" + ("" if roll_deg is not None else " Or were the poses swapped?")


def _correlation(felt: Array, changes: Array) -> float | None:
    both = ~np.isnan(felt) & ~np.isnan(changes)
    felt, changes = felt[both], changes[both]
    if len(changes) < ENOUGH or np.std(changes) < ENOUGH_MPS or not np.std(felt) > 0.0:
        return None
    return float(np.corrcoef(felt, changes)[0, 1])
