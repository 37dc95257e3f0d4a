"""Least squares with a chain of states, and parameters that are common to all of it.

Each row of residuals depends on the states at both ends of its window and on the parameters. The normal equations are
solved by eliminating one state after the other, so that work and memory grow with the length and not with its square.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...logs.table import Array

Residuals = Callable[[Array, Array], Array]  # states (n + 1, s), parameters (m) -> (n, r)


def jacobian(residuals: Residuals, states: Array, parameters: Array, sizes: Array, steps: Array) -> Array:
    """Derivatives (n, r, s + s + m) by differences: by the state at a window's begin, at its end, the parameters.

    Every second state is moved at once, because a window has only two. sizes (s), steps (m): of the differences.
    """

    def slope(column: int, first: int | None) -> Array:
        values = []
        for sign in (1.0, -1.0):
            moved, changed = states.copy(), parameters.copy()
            if first is None:
                changed[column] += sign * steps[column]
            else:
                moved[first::2, column] += sign * sizes[column]
            values.append(residuals(moved, changed))
        return (values[0] - values[1]) / (2.0 * (steps if first is None else sizes)[column])

    s = states.shape[1]
    even = (np.arange(len(states) - 1) % 2 == 0)[:, None]
    by_state = [(slope(i, 0), slope(i, 1)) for i in range(s)]
    begin = [np.where(even, zero, one) for zero, one in by_state]
    end = [np.where(even, one, zero) for zero, one in by_state]
    return np.stack([*begin, *end, *(slope(j, None) for j in range(len(parameters)))], axis=2)


def eliminate(slopes: Array, residual: Array, s: int) -> tuple[Array, list[Array]]:
    """What the windows together say about the parameters: (m, m + 1), the normal equations whose last column is the
    gradient; and for back() how each state follows from what comes after it.

    slopes (n, r, 2 s + m): of jacobian(); residual (n, r).
    """
    gains = []
    known = np.zeros((slopes.shape[2] - s, slopes.shape[2] - s + 1))  # of the state at hand and the parameters
    for slope, value in zip(slopes, residual, strict=True):
        normal = slope.T @ np.column_stack((slope, value))
        normal[:s, :s] += known[:s, :s]
        normal[:s, 2 * s :] += known[:s, s:]
        normal[2 * s :, :s] += known[s:, :s]
        normal[2 * s :, 2 * s :] += known[s:, s:]
        gains.append(np.linalg.solve(normal[:s, :s], normal[:s, s:]))
        known = normal[s:, s:] - normal[s:, :s] @ gains[-1]
    gains.append(np.linalg.solve(known[:s, :s], known[:s, s:]))
    return known[s:, s:] - known[s:, :s] @ gains[-1], gains


def back(gains: list[Array], s: int, change: NDArray[np.floating]) -> Array:
    """The changes of all states (n + 1, s) that belong to this change of the parameters."""
    states = np.zeros((len(gains), s))
    states[-1] = -(gains[-1][:, :-1] @ change + gains[-1][:, -1])
    for k in range(len(gains) - 2, -1, -1):
        following = np.concatenate((states[k + 1], change, [1.0]))
        states[k] = -gains[k] @ following
    return states
