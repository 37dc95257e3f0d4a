"""The motion for which the readings of a stretch of a ride fit together best: Gauss-Newton steps over model.py."""

from dataclasses import dataclass

import numpy as np

from ..logs.table import Array
from . import model as m
from .first_guess import first_guess, standing
from .model import Model
from .solver import back, eliminate, solve_chain, variances
from .windows import WINDOW_S, Windows

BLOCK = 200  # windows of a block, at least; solver.py
ROUNDS = 6


@dataclass
class Adjusted:
    """states, sigma (n + 1, STATES): at the edges of the windows. parameters (n, PARAMETERS)."""

    states: Array
    sigma: Array
    parameters: Array


def laid_out(windows: Windows, length: int) -> Windows:
    """With windows without readings and without length at the end, to a multiple of `length`."""
    n = len(windows)
    more = -n % length

    def longer(values: Array, fill: float) -> Array:
        return np.concatenate((values, np.full((more, *values.shape[1:]), fill)))

    edges = np.append(windows.edges, np.full(more, windows.edges[-1]))
    gap = np.append(windows.gap, np.ones(more, dtype=bool))
    return Windows(
        edges,
        longer(windows.rate, 0.0),
        longer(windows.force, 0.0),
        longer(windows.shaken, 0.0),
        longer(windows.speed, np.nan),
        gap,
        windows.number,
    )


def adjust(windows: Windows, six_done: bool, rounds: int = ROUNDS, verbose: bool = False) -> Adjusted:
    n = len(windows)
    blocks = max(1, n // BLOCK)
    length = -(-n // blocks)
    w = laid_out(windows, length)
    blocks = len(w) // length
    still = standing(w)
    lean, speed = first_guess(w, still)
    states = np.zeros((len(w) + 1, m.STATES))
    states[:, m.LEAN], states[:, m.FORWARD] = _edges(lean), _edges(speed)
    sigma = m.SIGMA.copy()
    if not six_done:
        sigma[m.OFFSET], sigma[m.SCALE] = m.WITHOUT_SIX_G, m.WITHOUT_SIX_SCALE
    p = np.tile(m.USUAL, (blocks, 1))
    rolling = np.gradient(w.rate[:, 2]) / WINDOW_S
    start = np.array([1.0, 0.3, 1.0, 1.0, 20.0, 0.03, 0.03, 0.03])
    for k in range(rounds + 1):
        middle = 0.5 * (states[1:] + states[:-1])
        balanced = middle[:, m.FORWARD] > m.BALANCED_MPS
        model = Model(w, still, balanced, rolling, middle[:, m.LEAN], middle[:, m.FORWARD])
        ends = np.stack((states[:-1], states[1:]), axis=1)
        slopes = model.linearised(ends, np.repeat(p, length, axis=0), robust=k >= 2)
        slopes = slopes.reshape(blocks, length, m.ROWS, -1).transpose(1, 0, 2, 3)
        prior = np.column_stack((np.diag(1.0 / sigma**2), (p[0] - m.USUAL) / sigma**2))
        reduced = eliminate(slopes, m.STATES)
        _hold(reduced.left, states[0], start)
        chain = solve_chain(reduced.left, m.STATES, prior, (m.DRIFT * sigma) ** 2, np.diff(p, axis=0))
        if k == rounds:
            break
        change = back(reduced, chain)
        flat = np.concatenate((change[:-1].transpose(1, 0, 2).reshape(-1, m.STATES), change[-1:, -1]))
        most = float(np.max(np.abs(flat[:, m.LEAN])))
        share = min(1.0, 0.5 / max(most, 1e-9))
        states += share * flat
        states[:, m.PITCH] = np.clip(states[:, m.PITCH], -1.2, 1.2)
        p = p + share * chain.parameters
        if verbose:
            print(k, f"largest change {np.degrees(most):.3f}", p[0].round(3))
    spread = np.sqrt(np.maximum(variances(reduced, chain), 0.0))
    flat = np.concatenate((spread[:-1].transpose(1, 0, 2).reshape(-1, m.STATES), spread[-1:, -1]))
    return Adjusted(states[: n + 1], flat[: n + 1], np.repeat(p, length, axis=0)[:n])


def _hold(left: Array, state: Array, sigma: Array) -> None:
    """What is known of the first state of all: little."""
    s = m.STATES
    rows = np.arange(s, 2 * s)
    left[0, rows, rows] += 1.0 / sigma**2
    pulled = np.array([0, m.PITCH, m.LEFT, m.UP, 5, 6, 7])
    left[0, s + pulled, -1] += state[pulled] / sigma[pulled] ** 2 * (pulled != 0)


def _edges(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))
