"""Averages the last hour of a log over cells of a tenth of a second, for all checks."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..signals import Array, Bools, Cells, EvenCells, cell_numbers, runs, stretches

CELL_S = 0.1  # length of a cell; faster changes are vibration
KEPT = 36_000  # number of cells with samples that are kept: one hour
GAP_CELLS = 3  # number of successive cells without samples that make a gap; fewer cells are interpolated


@dataclass
class LogCells:
    """n successive cells of CELL_S. Vectors are along the sensor's axes.

    even: the cells as averaged.
    force: mean forces, shape (n, 3), in g; 0 where unknown.
    rate: mean rates, shape (n, 3), in deg/s; 0 where unknown.
    known: False in gaps, shape (n).
    speeds: the first speed of each second, shape (m, 2): time in s, speed in m/s.
    places: the first position of each second, shape (m, 3): time in s, latitude and longitude in degrees.
    """

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
        """Integrate from the first cell to each of k times.

        at_s: the times, shape (k), in s.
        Returns seven columns, shape (k, 7): the integral of the force (3, in g s), the integral of the rate (3, in
        degrees), and the duration of known cells (s).
        """
        edges_s = self.first_s + np.arange(len(self.known) + 1) * CELL_S
        return np.column_stack([np.interp(at_s, edges_s, sums) for sums in self._sums])

    @cached_property
    def _sums(self) -> Array:
        values = np.column_stack((self.force, self.rate, self.known)) * CELL_S
        sums = np.zeros((7, len(values) + 1))
        np.cumsum(values.T, axis=1, out=sums[:, 1:])
        return sums

    def means(self, over: int) -> tuple[Array, Array, Array]:
        """Average groups of `over` cells. Missing values are NaN.

        Returns:
            force: mean force of each group, shape (k, 3), in g.
            rate: mean rate of each group, shape (k, 3), in deg/s.
            speed: first speed in each group, shape (k), in m/s.
        """
        merged = self.even.merged(over)
        return merged.means[:, :3], merged.means[:, 3:], merged.latest[:, 1]


class CellTable:
    """Averages the samples of a log to LogCells. Call add() block by block."""

    def __init__(self) -> None:
        self._cells = Cells(CELL_S, KEPT)

    def add(self, time_s: Array, force: Array, rate: Array, speed_mps: Array, *place: Array) -> None:
        """Add n samples.

        time_s: shape (n), in s.
        force: along the sensor's axes, shape (n, 3), in g.
        rate: along the sensor's axes, shape (n, 3), in deg/s.
        speed_mps: shape (n); NaN for no new value.
        place: latitude and longitude, each of shape (n), in degrees; NaN for no new value. Leave both out if the log
            has no positions.
        """
        lat, lon = place or np.full((2, len(time_s)), np.nan)
        speed_s, place_s = (np.where(np.isnan(values), np.nan, time_s) for values in (speed_mps, lat))
        latest = np.column_stack((speed_s, speed_mps, place_s, lat, lon))
        self._cells.add(time_s, np.column_stack((force, rate)), latest)

    def cells(self) -> LogCells | None:
        """Return the cells so far; None without cells, or if gaps make the log too long for a ride."""
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
    """Return the first row of each second without a NaN. The first column of `values` is the time."""
    values = values[np.all(np.isfinite(values), axis=1)]
    return values[runs(cell_numbers(values[:, 0], 1.0))] if len(values) else values
