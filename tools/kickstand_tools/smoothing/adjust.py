"""The motion for which the readings of a stretch of a ride fit together best: Gauss-Newton steps over model.py."""

from dataclasses import dataclass

import numpy as np

from ..logs.axes.leaning import WINDOW_S
from ..logs.table import Array
from . import parameters as of
from .beliefs import UNJUDGED, beliefs, judged
from .first_guess import first_guess, in_hand, standing
from .model import Residuals, linearised, residuals
from .noise import BALANCED, BRIEF_S, LONG_S, Circumstances
from .parameters import BIAS, FORWARD, LEAN, LEFT, PITCH, STATES, UP
from .solver import Chain, Eliminated, back, eliminate, mixed, solve_chains, variances
from .windows import Windows, padded

BLOCK = 50  # windows of a block; see solver.py
ROUNDS, PLAIN_ROUNDS = 10, 2  # at most; the first ones without regard to outliers
NEAR, CONVERGED = np.radians([3.0, 0.02])  # changes of lean: from NEAR on residuals tell of the ride's errors
JUDGING_ROUNDS = 2
MAX_LEAN = 0.5  # rad: of one step. The equations are linear no further.
MAX_PITCH = 1.2  # rad: as in the firmware
START = np.array([1.0, 0.3, 1.0, 1.0, 20.0, 0.03, 0.03, 0.03])  # 1 sigma of the first state of all
DRAWN = [PITCH, LEFT, UP, *range(STATES)[BIAS]]  # of it, what is drawn towards 0


@dataclass
class Adjusted:
    """The motion at the edges of n windows, and the sensor's errors in each of them.

    states, sigma (n + 1, STATES): see parameters.py, and their standard deviations. parameters (n, PARAMETERS).
    """

    states: Array
    sigma: Array
    parameters: Array


def adjust(windows: Windows, six_done: bool) -> Adjusted:
    """six_done: the accelerometer was calibrated by six positions. Raises LinAlgError where nothing can be found."""
    length = min(BLOCK, len(windows))
    fit = _Fit(padded(windows, length), length, six_done)
    fit.converge()
    n = len(windows)
    return Adjusted(fit.states[: n + 1], fit.sigma()[: n + 1], fit.each_window()[:n])


class _Fit:
    def __init__(self, windows: Windows, length: int, six_done: bool) -> None:
        self._windows, self._blocks, self._length = windows, len(windows) // length, length
        self._still = standing(windows)
        self._held = in_hand(windows)
        lean, speed = first_guess(windows, self._still)
        self.states = np.zeros((len(windows) + 1, STATES))
        self.states[:, LEAN], self.states[:, FORWARD] = _at_edges(lean), _at_edges(speed)
        self._parameters = np.tile(of.USUAL, (self._blocks, 1))
        self._roughness, self._unbalance, self._judged = np.ones(len(windows)), 1.0, UNJUDGED
        self._before = of.sigma(six_done)  # 1 sigma of the parameters, before the ride
        self._rolling = np.gradient(windows.rate[:, 2]) / WINDOW_S if len(windows) > 1 else np.zeros(1)

    def each_window(self) -> Array:
        """(n, PARAMETERS)"""
        return np.repeat(self._parameters, self._length, axis=0)

    def converge(self) -> None:
        """Raises LinAlgError."""
        change, judged_rounds = np.inf, 0
        for k in range(ROUNDS):
            near = k > PLAIN_ROUNDS and change < NEAR
            if near:
                balance = self._residuals().measured[:, BALANCED]
                self._unbalance = self._circumstances().unbalance_of(balance, BRIEF_S)
            change = self._step(k >= PLAIN_ROUNDS, judge=near and judged_rounds < JUDGING_ROUNDS)
            judged_rounds += near
            if change < CONVERGED and judged_rounds >= JUDGING_ROUNDS:
                break

    def _step(self, robust: bool, judge: bool) -> float:
        """judge: what of beliefs.py counts. Returns the largest change of lean, rad. Raises LinAlgError."""
        reduced = self._reduced(robust)
        if judge:
            self._judged = judged(reduced.left, STATES, self._parameters, self._before, self._unbalance)
        chain = self._solved(reduced)
        change = _in_a_row(back(reduced, chain))
        most = float(np.max(np.abs(change[:, LEAN])))
        if not np.isfinite(most):
            raise np.linalg.LinAlgError
        share = min(1.0, MAX_LEAN / max(most, 1e-9))
        self.states += share * change
        self.states[:, PITCH] = np.clip(self.states[:, PITCH], -MAX_PITCH, MAX_PITCH)
        self._parameters = self._parameters + share * chain.parameters
        return most

    def sigma(self) -> Array:
        """(n + 1, STATES) standard deviations, of errors that are as large as this ride's residuals.

        The states are those by the sigmas of a rough ride, because errors that no model has last for long, and weigh
        less then.
        """
        known, found = self._circumstances(), self._residuals()
        self._roughness = known.roughness_of(found.values)
        self._unbalance = known.unbalance_of(found.measured[:, BALANCED], LONG_S)
        reduced = self._reduced(robust=True)
        return np.sqrt(np.maximum(_in_a_row(variances(reduced, self._solved(reduced))), 0.0))

    def _circumstances(self) -> Circumstances:
        middle = 0.5 * (self.states[1:] + self.states[:-1])
        lean, speed = middle[:, LEAN], middle[:, FORWARD]
        return Circumstances(
            self._windows, self._still, *self._held, self._rolling, lean, speed, self._roughness, self._unbalance
        )

    def _residuals(self) -> Residuals:
        return residuals(self._circumstances(), self.states, self.each_window(), robust=True)

    def _reduced(self, robust: bool) -> Eliminated:
        slopes, ends = linearised(self._circumstances(), self.states, self.each_window(), robust)
        side_by_side = self._blocks, self._length
        reduced = eliminate(slopes.reshape(*side_by_side, *slopes.shape[1:]), ends.reshape(*side_by_side, STATES))
        first = np.arange(STATES, 2 * STATES)
        reduced.left[0, first, first] += 1.0 / START**2
        reduced.left[0, first[DRAWN], -1] += self.states[0, DRAWN] / START[DRAWN] ** 2
        return reduced

    def _solved(self, reduced: Eliminated) -> Chain:
        known = self._judged
        ways = beliefs(known.ways, self._parameters, self._before)
        return mixed(solve_chains(reduced.left, STATES, ways), known.share)


def _in_a_row(blocks: Array) -> Array:
    """(B, K + 1, s) with shared ends -> (B K + 1, s)."""
    return np.concatenate((blocks[:, :-1].reshape(-1, blocks.shape[2]), blocks[-1, -1:]))


def _at_edges(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))
