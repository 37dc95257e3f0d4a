"""Samples averaged over cells of time, block by block: vibration averages out, and what remains is small."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import Array


def cell_numbers(time_s: Array, cell_s: float) -> NDArray[np.int64]:
    """(n) the number of the cell that each time lies in. A time on the edge of two cells, within rounding, is in the
    later one."""
    return np.floor(time_s / cell_s + 1e-6).astype(np.int64)


def runs(values: NDArray[np.generic]) -> NDArray[np.intp]:
    """(m) the first index of each run of equal values among n > 0 values."""
    return np.flatnonzero(np.append(True, values[1:] != values[:-1]))


def stretches(true: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(m, 2) the first index, and that after the last, of each run of True among n values."""
    return np.flatnonzero(np.diff(np.concatenate(([False], true, [False])))).reshape(-1, 2)


@dataclass
class EvenCells:
    """n successive cells, some without samples. first: number of the first cell. count (n): samples in each. means
    (n, k), latest (n, j): see Cells.add(); NaN where there is no value."""

    first: int
    count: Array
    means: Array
    latest: Array

    def merged(self, by: int) -> "EvenCells":
        """Cells that are `by` times as long and begin at multiples of `by`. Their `latest` is the first value in
        each."""
        before = self.first % by
        after = -(before + len(self.count)) % by

        def grouped(values: Array, fill: float) -> Array:
            width = ((before, after), *[(0, 0)] * (values.ndim - 1))
            return np.pad(values, width, constant_values=fill).reshape(-1, by, *values.shape[1:])

        count = grouped(self.count, 0.0)
        total = np.sum(count, axis=1)
        sums = np.sum(np.nan_to_num(grouped(self.means, 0.0)) * count[:, :, None], axis=1)
        means = np.divide(sums, total[:, None], out=np.full_like(sums, np.nan), where=total[:, None] > 0.0)
        latest = grouped(self.latest, np.nan)
        place = np.argmax(~np.isnan(latest), axis=1)[:, None]
        return EvenCells(self.first // by, total, means, np.take_along_axis(latest, place, axis=1)[:, 0])


class Cells:
    """Averages samples over cells of time. add() takes them in the order of time, block by block.

    cell_s: length of a cell, s. most: number of cells with samples that are kept, the last ones; 0: all.
    """

    def __init__(self, cell_s: float, most: int = 0) -> None:
        self.cell_s, self._most = cell_s, most
        self._parts: list[Array] = []  # (m, 2 + k + j): number of the cell, count of samples, sums, latest values
        self._means = 0

    def add(self, time_s: Array, means: Array, latest: Array) -> None:
        """Take n samples. means (n, k): values that are averaged. latest (n, j): values of which each cell keeps the
        last that is not NaN."""
        if not len(time_s):
            return
        number = cell_numbers(time_s, self.cell_s)
        starts = runs(number)
        self._means, after = means.shape[1], 2 + means.shape[1]
        new = np.full((len(starts), after + latest.shape[1]), np.nan)
        new[:, 0] = number[starts]
        new[:, 1] = np.diff(np.append(starts, len(number)))
        new[:, 2:after] = np.add.reduceat(means, starts, axis=0)
        for column, values in enumerate(latest.T, after):
            there = np.flatnonzero(~np.isnan(values))
            new[np.searchsorted(starts, there, side="right") - 1, column] = values[there]
        if self._parts and self._parts[-1][-1, 0] == new[0, 0]:  # the block before ended within this cell
            begun = self._parts[-1][-1]
            new[0, 1:after] += begun[1:after]
            new[0, after:] = np.where(np.isnan(new[0, after:]), begun[after:], new[0, after:])
            self._parts[-1] = self._parts[-1][:-1]
        self._parts.append(new)
        if self._most:
            self._parts = [np.vstack(self._parts)[-self._most :]]

    def evenly(self, longest: int) -> EvenCells | None:
        """The cells from the first to the last one with samples; None if there are none, or more than `longest`."""
        table = np.vstack(self._parts) if self._parts else np.zeros((0, 2))
        place = (table[:, 0] - table[:1, 0]).astype(np.int64)
        if not len(place) or place[-1] >= longest:
            return None
        even = np.full((place[-1] + 1, table.shape[1] - 1), np.nan)
        even[:, 0] = 0.0
        even[place] = table[:, 1:]
        means = even[:, 1 : 1 + self._means]
        means /= np.maximum(even[:, :1], 1.0)
        return EvenCells(int(table[0, 0]), even[:, 0], means, even[:, 1 + self._means :])
