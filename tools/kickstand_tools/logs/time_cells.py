"""Samples summed over cells of time, block by block."""

import numpy as np

from .table import Array

COLUMNS = 9  # number of the cell; sums of force (3) and rate (3); count; last speed, NaN for none


def no_cells() -> Array:
    """(0, COLUMNS)."""
    return np.zeros((0, COLUMNS))


def with_block(cells: Array, cell_s: float, time_s: Array, force: Array, rate: Array, speed_mps: Array) -> Array:
    """cells (m, COLUMNS), each cell_s long, and after them those of a block of n > 0 samples that follows.

    time_s (n), force (n, 3), rate (n, 3), speed_mps (n, NaN for none).
    """
    number = np.floor(time_s / cell_s + 1e-6)
    starts = np.flatnonzero(np.diff(number, prepend=-1.0))
    new = np.full((len(starts), COLUMNS), np.nan)
    new[:, 0] = number[starts]
    new[:, 1:7] = np.add.reduceat(np.hstack((force, rate)), starts)
    new[:, 7] = np.diff(np.append(starts, len(number)))
    there = np.flatnonzero(~np.isnan(speed_mps))
    new[np.searchsorted(starts, there, side="right") - 1, 8] = speed_mps[there]
    if len(cells) and cells[-1, 0] == new[0, 0]:  # the block before ended within this cell
        new[0, 1:8] += cells[-1, 1:8]
        new[0, 8] = cells[-1, 8] if np.isnan(new[0, 8]) else new[0, 8]
        cells = cells[:-1]
    return np.vstack((cells, new))
