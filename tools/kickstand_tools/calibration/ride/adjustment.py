"""The alignment for which the readings of the whole ride fit together best: Gauss-Newton steps over model.py."""

from dataclasses import dataclass

import numpy as np
from kickstand.errors import Refusal
from kickstand.units import STANDARD_GRAVITY

from ...logs.source import Progress
from ...logs.table import Array
from . import model as m
from .first_guess import FirstGuess
from .model import Model
from .phone import SIGMA_DEG
from .rotations import rotation_between, turned
from .solver import back, eliminate, jacobian
from .windows import Windows

_ROUNDS = 20
_CONVERGED, _UNSETTLED = np.radians(0.02), np.radians(0.5)
_MAX_TURN, _MAX_LEAN = 0.3, 0.5  # rad: of one step. The equations are linear no further.


@dataclass
class Adjustment:
    """matrix (3, 3): vehicle from sensor. bias (3): of the gyro in the sensor's axes, rad/s. parameters, sigma: see
    model.py, and their standard errors. halves (3, rad): by how much the second half of the ride turns the vehicle's
    axes against the first. states (n + 1, 6): see model.py.
    """

    matrix: Array
    bias: Array
    parameters: Array
    sigma: Array
    halves: Array
    states: Array


def adjust(windows: Windows, guess: FirstGuess, expected: Array | None, progress: Progress | None = None) -> Adjustment:
    """expected: the matrix as the user says it, None if unknown. Raises Refusal if no alignment fits."""
    fit = _Fit(windows, guess, expected)
    size = np.inf
    for done in range(_ROUNDS):
        size = fit.step()
        if progress:
            progress(done + 1, _ROUNDS + 1)
        if size < _CONVERGED:
            break
    if not size < _UNSETTLED:
        raise Refusal("ride-contradicts")
    found = fit.result()
    if progress:
        progress(_ROUNDS + 1, _ROUNDS + 1)
    return found


class _Fit:
    def __init__(self, windows: Windows, guess: FirstGuess, expected: Array | None) -> None:
        self._windows, self._guess, self._expected = windows, guess, expected
        self._matrix = guess.matrix
        self._parameters = m.USUAL.copy()
        self._states = np.zeros((len(windows) + 1, m.STATE_COUNT))
        self._states[:, m.LEAN], self._states[:, m.SPEED] = guess.lean, guess.speed / STANDARD_GRAVITY

    def step(self) -> float:
        """Returns the angle in rad by which the matrix was turned; infinity if that was more than one step may."""
        slopes, residual = self._linearised()
        prior, pull = self._prior()
        try:
            normal, gains = eliminate(slopes, residual, m.STATE_COUNT)
            change = -np.linalg.solve(normal[:, :-1] + prior, normal[:, -1] + pull)
        except np.linalg.LinAlgError as error:
            raise Refusal("ride-contradicts") from error
        states = back(gains, m.STATE_COUNT, change)
        if not (np.all(np.isfinite(states)) and np.all(np.isfinite(change))):
            raise Refusal("ride-contradicts")
        angle = float(np.linalg.norm(change[m.ROTATION]))
        leaned = float(np.abs(states[:, m.LEAN]).max())
        share = min(1.0, _MAX_TURN / max(angle, 1e-9), _MAX_LEAN / max(leaned, 1e-9))
        self._states += share * states
        self._parameters += share * change
        self._matrix = turned(self._matrix, self._parameters[m.ROTATION])
        self._parameters[m.ROTATION] = 0.0
        return angle if share == 1.0 else np.inf

    def result(self) -> Adjustment:
        slopes, residual = self._linearised()
        prior, pull = self._prior()
        half = len(residual) // 2
        try:
            first, second = (
                eliminate(slopes[part], residual[part], m.STATE_COUNT)[0]
                for part in (slice(None, half), slice(half, None))
            )
            turns = [-np.linalg.solve(each[:, :-1] + prior, each[:, -1] + pull)[m.ROTATION] for each in (first, second)]
            covariance = np.linalg.inv(first[:, :-1] + second[:, :-1] + prior)
        except np.linalg.LinAlgError as error:
            raise Refusal("ride-contradicts") from error
        bias = self._guess.bias + np.median(self._states[:, m.BIAS], axis=0) @ self._matrix
        return Adjustment(
            self._matrix,
            bias,
            self._parameters,
            np.sqrt(np.maximum(np.diag(covariance), 0.0)),
            turns[1] - turns[0],
            self._states,
        )

    def _linearised(self) -> tuple[Array, Array]:
        """Jacobian and residuals, weighted."""
        model = Model.of(self._windows, self._matrix, self._guess.bias, self._states)
        residual = model.residuals(self._states, self._parameters)
        weights = model.weights(residual)
        slopes = jacobian(model.residuals, self._states, self._parameters, m.STATE_STEPS, m.PARAMETER_STEPS)
        slopes *= weights[:, :, None]
        return slopes, residual * weights

    def _prior(self) -> tuple[Array, Array]:
        """Information (m, m) and gradient (m) of what is known before the ride."""
        information = 1.0 / m.SIGMA**2
        pull = information * (self._parameters - m.USUAL)
        if self._expected is not None:
            off = rotation_between(self._matrix, self._expected)
            information[m.ROTATION] += 1.0 / np.radians(SIGMA_DEG) ** 2
            pull[m.ROTATION] += off / np.radians(SIGMA_DEG) ** 2
        return np.diag(information), pull
