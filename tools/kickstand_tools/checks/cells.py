"""Averages the last hour of a log over cells of a tenth of a second, for all checks."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..signals import Array, Bools, Cells, EvenCells, cell_numbers, runs, stretches

CELL_S = 0.1  # length of a cell: faster changes are vibration
KEPT = 36_000  # number of cells with samples that are kept: an hour
GAP_CELLS = 3  # this many successive cells without samples are unknown; fewer are interpolated


@dataclass
class LogCells:
    """n successive cells of CELL_S. first_s: the time at which the first begins. force (n, 3, g), rate (n, 3, deg/s):
    means, in the sensor's axes; 0 where known (n) is False. speeds (m, 2: s, m/s), places (m, 3: s, degrees): the first
    value of each second that has one."""

    even: EvenCells
    force: Array
    rate: Array
    known: Bools
    speeds: Array
    places: Array

    @property
    def first_s(self) -> float:
        return self.even.first * CELL_S

    def integrals(self, at_s: Array) -> Array:
        """The integrals (k, 7) up to the times at_s (k): force (3, g s), rate (3, degrees), duration of known cells
        (s)."""
        edges_s = self.first_s + np.arange(len(self.known) + 1) * CELL_S
        return np.column_stack([np.interp(at_s, edges_s, sums) for sums in self._sums])

    @cached_property
    def _sums(self) -> Array:
        values = np.column_stack((self.force, self.rate, self.known)) * CELL_S
        sums = np.zeros((7, len(values) + 1))
        np.cumsum(values.T, axis=1, out=sums[:, 1:])
        return sums

    def means(self, over: int) -> tuple[Array, Array, Array]:
        """Mean force (k, 3), mean rate (k, 3) and first speed (k, m/s) of each group of `over` cells; NaN for
        missing values."""
        merged = self.even.merged(over)
        return merged.means[:, :3], merged.means[:, 3:], merged.latest[:, 1]


class CellTable:
    """Collects LogCells. add() takes a log's samples block by block."""

    def __init__(self) -> None:
        self._cells = Cells(CELL_S, KEPT)

    def add(self, time_s: Array, force: Array, rate: Array, speed_mps: Array, *place: Array) -> None:
        """Take n samples. force (n, 3, g), rate (n, 3, deg/s): in the sensor's axes. speed_mps (n) and, if the log
        has positions, latitude and longitude (n, degrees): NaN for no new value."""
        lat, lon = place or np.full((2, len(time_s)), np.nan)
        speed_s, place_s = (np.where(np.isnan(values), np.nan, time_s) for values in (speed_mps, lat))
        latest = np.column_stack((speed_s, speed_mps, place_s, lat, lon))
        self._cells.add(time_s, np.column_stack((force, rate)), latest)

    def cells(self) -> LogCells | None:
        """The cells so far. None without cells, or if gaps make their time too long for a ride."""
        even = self._cells.evenly(10 * KEPT)
        if even is None:
            return None
        there = even.count > 0
        known = there.copy()
        for begin, end in stretches(~there):
            known[begin:end] = end - begin < GAP_CELLS
        at, places = np.arange(len(there)), np.flatnonzero(there)
        filled = np.column_stack([np.interp(at, places, column[places]) for column in even.means.T]) * known[:, None]
        return LogCells(
            even,
            filled[:, :3],
            filled[:, 3:],
            known,
            _once_a_second(even.latest[:, :2]),
            _once_a_second(even.latest[:, 2:]),
        )


def _once_a_second(values: Array) -> Array:
    """The first known row of each second. values: the first column is the time."""
    values = values[np.all(np.isfinite(values), axis=1)]
    return values[runs(cell_numbers(values[:, 0], 1.0))] if len(values) else values
