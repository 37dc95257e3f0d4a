"""The motion for which the readings of a stretch of a ride fit together best: Gauss-Newton steps over model.py."""

from dataclasses import dataclass

import numpy as np

from ..logs.axes.leaning import WINDOW_S
from ..logs.table import Array
from . import model as m
from .first_guess import first_guess, in_hand, standing
from .model import Model
from .solver import Chain, Eliminated, back, eliminate, solve_chain, variances
from .windows import Windows, padded

BLOCK = 200  # windows of a block, at least; see solver.py
ROUNDS, PLAIN_ROUNDS = 8, 2  # at most; the first ones without regard to outliers
CONVERGED = np.radians(0.03)
MAX_LEAN = 0.5  # rad: of one step. The equations are linear no further.
MAX_PITCH = 1.2  # rad: as in the firmware
# Standard deviations of the first state of all
START = np.array([1.0, 0.3, 1.0, 1.0, 20.0, 0.03, 0.03, 0.03])


@dataclass
class Adjusted:
    """The motion at the edges of n windows, and the sensor's errors in each of them.

    states, sigma (n + 1, STATES): see model.py, and standard deviations. parameters (n, PARAMETERS).
    """

    states: Array
    sigma: Array
    parameters: Array


def adjust(windows: Windows, six_done: bool) -> Adjusted:
    """six_done: the accelerometer was calibrated by six positions. Raises LinAlgError where nothing can be found."""
    count = max(1, len(windows) // BLOCK)
    fit = _Fit(padded(windows, -(-len(windows) // count)), count, six_done)
    for k in range(ROUNDS):
        if fit.step(robust=k >= PLAIN_ROUNDS) < CONVERGED and k > PLAIN_ROUNDS:
            break
    n = len(windows)
    return Adjusted(fit.states[: n + 1], fit.sigma()[: n + 1], np.repeat(fit.parameters, fit.length, axis=0)[:n])


class _Fit:
    def __init__(self, windows: Windows, blocks: int, six_done: bool) -> None:
        self._windows, self._blocks, self.length = windows, blocks, len(windows) // blocks
        self._still = standing(windows)
        self._in_hand, self._not_riding = in_hand(windows)
        lean, speed = first_guess(windows, self._still)
        self.states = np.zeros((len(windows) + 1, m.STATES))
        self.states[:, m.LEAN], self.states[:, m.FORWARD] = _at_edges(lean), _at_edges(speed)
        self.parameters = np.tile(m.USUAL, (blocks, 1))
        self._unrest = np.ones(len(windows))
        self._known = m.SIGMA.copy() if six_done else m.sigma_without_six()
        self._rolling = np.gradient(windows.rate[:, 2]) / WINDOW_S if len(windows) > 1 else np.zeros(1)

    def step(self, robust: bool) -> float:
        """Returns the largest change of lean, rad."""
        reduced, chain = self._solve(robust)
        change = _in_a_row(back(reduced, chain))
        most = float(np.max(np.abs(change[:, m.LEAN])))
        if not np.isfinite(most):
            raise np.linalg.LinAlgError
        share = min(1.0, MAX_LEAN / max(most, 1e-9))
        self.states += share * change
        self.states[:, m.PITCH] = np.clip(self.states[:, m.PITCH], -MAX_PITCH, MAX_PITCH)
        self.parameters = self.parameters + share * chain.parameters
        return most

    def sigma(self) -> Array:
        """(n + 1, STATES) standard deviations."""
        model, slopes = self._linearised(robust=True)
        self._unrest = model.unrest_of(slopes[:, :, -1])
        return np.sqrt(np.maximum(_in_a_row(variances(*self._solve(robust=True))), 0.0))

    def _linearised(self, robust: bool) -> tuple[Model, Array]:
        middle = 0.5 * (self.states[1:] + self.states[:-1])
        leaned, speed = middle[:, m.LEAN], middle[:, m.FORWARD]
        held = self._in_hand, self._not_riding
        model = Model(self._windows, self._still, *held, self._rolling, leaned, speed, self._unrest)
        return model, model.linearised(self.states, np.repeat(self.parameters, self.length, axis=0), robust)

    def _solve(self, robust: bool) -> tuple[Eliminated, Chain]:
        _, slopes = self._linearised(robust)
        p = self.parameters
        reduced = eliminate(
            slopes.reshape(self._blocks, self.length, *slopes.shape[1:]).transpose(1, 0, 2, 3), m.STATES
        )
        _hold_start(reduced.left, self.states[0])
        prior = np.column_stack((np.diag(1.0 / self._known**2), (p[0] - m.USUAL) / self._known**2))
        return reduced, solve_chain(
            reduced.left, m.STATES, prior, (m.DRIFT * self._known) ** 2, np.diff(p, axis=0)
        )


def _hold_start(left: Array, state: Array) -> None:
    """What is known of the first state of all: little. The lean and the speed are not drawn towards anything."""
    rows = np.arange(m.STATES, 2 * m.STATES)
    left[0, rows, rows] += 1.0 / START**2
    drawn = [m.PITCH, m.LEFT, m.UP, 5, 6, 7]
    left[0, rows[drawn], -1] += state[drawn] / START[drawn] ** 2


def _in_a_row(blocks: Array) -> Array:
    """(K + 1, B, s) with shared ends -> (B K + 1, s)."""
    s = blocks.shape[2]
    return np.concatenate((blocks[:-1].transpose(1, 0, 2).reshape(-1, s), blocks[-1:, -1]))


def _at_edges(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))
