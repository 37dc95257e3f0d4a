"""Robust nonlinear least squares for the states and parameters of a stretch of a ride, by Gauss-Newton steps.

There are two kinds of residuals: the measurements, and the errors of the process model. An error of the process model
is the change of the states from window to window minus the predicted change. Each residual is divided by its standard
deviation. Outliers of both kinds are down-weighted (Cauchy).
"""

from dataclasses import replace

import numpy as np

from ..signals import Array, Bools, Ints, intervals, rotation_matrix
from . import model as of
from .model import Hypotheses, Prior, jacobian, process_and_measurements
from .noise import BRIEF_S, LONG_S, Noise
from .solver import RandomWalks, Reduced, covariances, posterior_covariance, reduce_windows, solve
from .windows import Windows, lean_and_speed, standing

BLOCK = 50  # number of windows per block; see solver.py
PART = 12  # number of blocks whose derivatives are computed at once
ROUNDS, PLAIN_ROUNDS = 20, 2  # largest number of steps; the first PLAIN_ROUNDS steps do not down-weight outliers
# The largest change of an angle in a step, in rad. If it is under NEAR, the hypotheses are weighted. If it is under
# CONVERGED, the steps end.
NEAR, CONVERGED = np.radians([3.0, 0.02])
WEIGHING_ROUNDS = 2  # number of steps that recompute the weights of the hypotheses
# The unbalance of a ride on roads with camber. A changing camber unbalances the bike, so a ride with a smaller
# unbalance was on roads with less camber.
CAMBERED = 0.5
MAX_LEAN = 0.5  # largest change of an angle in one step, in rad; the equations are not linear over a larger change
MAX_PITCH = 1.2  # largest pitch, in rad, as in the firmware
START = np.array([1.0, 0.3, 1.0, 1.0, 20.0, 0.03, 0.03, 0.03])  # standard deviations of the first state's prior
# A steady ride on a straight may look like a standstill for up to BRIEF windows. Then a residual within AROUND windows
# is over CONTRADICTED standard deviations. At real standstills, all these residuals are under 2 standard deviations.
BRIEF, AROUND, CONTRADICTED = 15, 25, 4.0
CONTRADICTING = [of.PITCH, of.LEFT, of.UP, of.FORWARD, of.SLIDING, *range(of.RESTING.start, of.RESTING_RATE.stop)]
DRAWN = [of.PITCH, of.LEFT, of.UP, *range(of.STATES)[of.BIAS]]  # components of the first state whose prior has mean 0


class Estimate:
    """Estimates the motion at the edges of n windows, and the errors of sensor and bike.

    states: states at the edges, shape (n + 1, STATES).
    parameters: parameters of each of the B blocks of BLOCK windows, shape (B, PARAMETERS).
    matrix: the rotation that was applied to the windows, shape (3, 3). The identity if the prior comes from a pose.
    change: the largest change of an angle in the last step, in rad.
    """

    def __init__(self, windows: Windows, prior: Prior, hypotheses: Hypotheses) -> None:
        """Run the estimation. Raises LinAlgError if the equations have no solution."""
        self._length = min(BLOCK, len(windows))
        self._windows = windows = windows.padded(self._length)
        self._grid = len(windows) // self._length, self._length
        # Several blocks at once, because the derivatives of all blocks would need much memory
        self._parts = [slice(k, k + PART) for k in range(0, self._grid[0], PART)]
        self.prior, self._hypotheses, self.matrix = prior, hypotheses, np.eye(3)
        still = standing(windows)
        self._start(still)
        false = self._false_standstill(still)
        if np.any(false):
            self._start(still & ~false)
        if self._learn_misfit():
            self._converge()
        self._use_own_noise()

    def unknowns(self, number: Ints, states: Array) -> Array:
        """Return k columns of states and parameters, in the order of model.py, shape (STATES + PARAMETERS, k).

        number: index of the window of each row of `states`, shape (k).
        states: shape (k, STATES).
        """
        return np.concatenate((states.T, self.parameters[number // self._length].T))

    def sigma(self) -> Array:
        """Return the standard deviations of the states, shape (n + 1, STATES)."""
        blocks, s = self._reduced(robust=True), of.STATES
        of_blocks = posterior_covariance(*self._solver_arguments(blocks))
        variances = np.empty((*self._grid, 2 * s))  # of the states at the start and at the end of each window
        for rows in self._parts:
            of_windows = covariances(blocks.part(rows), of_blocks[rows])
            variances[rows] = np.diagonal(of_windows[..., : 2 * s], axis1=2, axis2=3)
        # An edge is the start of a window. The last edge is the end of the last window
        edges = np.concatenate((variances[:, :, :s].reshape(-1, s), variances[-1, -1:, s:]))
        return np.sqrt(np.maximum(edges, 0.0))

    def parameter_sigma(self) -> Array:
        """Return the standard deviations of the first block's parameters, shape (PARAMETERS)."""
        of_first = posterior_covariance(*self._solver_arguments(self._reduced(robust=True)))[0]
        sigma = np.zeros(of.PARAMETERS)
        sigma[self.prior.unknown] = np.sqrt(np.maximum(np.diagonal(of_first)[2 * of.STATES :], 0.0))
        return sigma

    def split(self) -> Array:
        """Return the misalignment in the second half of the ride minus that in the first half, shape (3), in rad.

        The misalignment must be estimated, and must be almost equal in all blocks so far, as without a yielding mount:
        the result is the difference of its changes from the present estimate.
        """
        walks = self._likely.random_walks(self.prior, self.parameters)
        middle = len(self.parameters) // 2
        # The step between the two middle blocks, as a slice, because a ride of one block has no step. The columns are
        # indices into prior.unknown, in which ROTATION comes first
        walks.variance[:, middle - 1 : middle, of.ROTATION] = 1.0
        changes = solve(self._reduced(robust=True), walks, self._likely.weight)[1]
        return changes[-1, of.ROTATION] - changes[0, of.ROTATION]

    def _start(self, still: Bools) -> None:
        self._likely = self._hypotheses.first()
        self.noise = Noise(self._windows, still)
        lean, speed = lean_and_speed(self._windows, still)
        self.states = np.zeros((len(self._windows) + 1, of.STATES))
        self.states[:, of.LEAN], self.states[:, of.FORWARD] = _at_edges(lean), _at_edges(speed)
        self.parameters = np.tile(self.prior.mean, (len(self._windows) // self._length, 1))
        self.parameters[:, of.ROTATION] = 0.0  # the windows are rotated already at a second start
        self.change = np.inf
        self._converge()

    def _false_standstill(self, still: Bools) -> Bools:
        """Return True in brief standstills that the motion around them contradicts, shape (n)."""
        contradicted = np.max(np.abs(self._residuals() / self.noise.sigma())[:, CONTRADICTING], axis=1) > CONTRADICTED
        false = np.zeros_like(still)
        for begin, end in intervals(still):
            near = contradicted[max(0, begin - AROUND) : end + AROUND]
            false[begin:end] = end - begin < BRIEF and bool(np.any(near))
        return false

    def _converge(self) -> None:
        weighing_rounds = 0
        for k in range(ROUNDS):
            near = k > PLAIN_ROUNDS and self.change < NEAR
            if near:
                self.noise.estimate_unbalance(self._residuals()[:, of.BALANCED], BRIEF_S)
            self._step(k >= PLAIN_ROUNDS, near and weighing_rounds < WEIGHING_ROUNDS)
            weighing_rounds += near
            if self.change < CONVERGED and weighing_rounds >= WEIGHING_ROUNDS:
                break

    def _learn_misfit(self) -> bool:
        """Return True if some accelerations in the ride are not the bike's."""
        self.noise.estimate_misfit(self._residuals())
        return bool(np.max(self.noise.misfit) > 1.0)

    def _use_own_noise(self) -> None:
        """Set the noise from this ride's residuals, for the covariance only.

        The states need the larger noise of a rough ride, which gives less weight to lasting errors that the model
        lacks.
        """
        residuals = self._residuals()
        self.noise.count_own_misfit()
        self.noise.estimate_roughness(residuals / self.noise.robust(self.noise.sigma(), residuals))
        self.noise.estimate_unbalance(residuals[:, of.BALANCED], LONG_S)
        self.prior.sigma[of.CAMBER] *= min(1.0, self.noise.unbalance / CAMBERED)

    def _step(self, robust: bool, weigh: bool) -> None:
        """Do one Gauss-Newton step. Raises LinAlgError.

        robust: down-weight outliers.
        weigh: first compute the posterior weights of the hypotheses.
        """
        blocks = self._reduced(robust)
        if weigh:
            self._likely = self._hypotheses.weighted(blocks, self.prior, self.parameters, self.noise.unbalance)
        change, parameters = solve(*self._solver_arguments(blocks))
        change = np.concatenate((change[:, :-1].reshape(-1, of.STATES), change[-1, -1:]))
        self.change = float(np.max(np.abs(change[:, of.LEAN])))
        if not self.prior.posed:
            self.change = max(self.change, float(np.max(np.abs(parameters[:, of.ROTATION]))))
        if not np.isfinite(self.change):
            raise np.linalg.LinAlgError
        share = min(1.0, MAX_LEAN / max(self.change, 1e-9))
        self.states += share * change
        self.states[:, of.PITCH] = np.clip(self.states[:, of.PITCH], -MAX_PITCH, MAX_PITCH)
        self.parameters[:, self.prior.unknown] += share * parameters
        if not self.prior.posed:
            self._turn_axes()

    def _turn_axes(self) -> None:
        """Rotate the readings by the estimated rotation, then set it to 0: the model is for small rotations only."""
        rotation = self.parameters[0, of.ROTATION].copy()
        self.parameters[:, of.ROTATION] -= rotation
        self.prior.mean[of.ROTATION] -= rotation
        turn = rotation_matrix(rotation)
        self.matrix, self._windows = turn @ self.matrix, self._windows.turned(turn)

    def _middle(self) -> Array:
        return self.unknowns(np.arange(len(self._windows)), 0.5 * (self.states[1:] + self.states[:-1]))

    def _residuals(self) -> Array:
        """Return the residuals of each window, shape (n, ROWS).

        The changes of the states minus the predicted changes come first, then the measurements.
        """
        x = self._middle()
        self.noise.lean, self.noise.pitch, self.noise.speed = x[of.LEAN], x[of.PITCH], x[of.FORWARD]
        residuals, s = process_and_measurements(self._windows, x).T, of.STATES
        residuals[:, :s] = np.diff(self.states, axis=0) - self._windows.covered[:, None] * residuals[:, :s]
        return residuals

    def _reduced(self, robust: bool) -> Reduced:
        """Linearise the equations at the present estimate, and eliminate all states inside the blocks.

        The prior of the first state is included. robust: down-weight outliers.
        """
        residuals, sigma, x = self._residuals(), self.noise.sigma(), self._middle()
        sigma = self.noise.robust(sigma, residuals) if robust else sigma
        parts = []
        for blocks in self._parts:
            rows = slice(blocks.start * self._length, blocks.stop * self._length)
            derivatives = self._derivatives(rows, x[:, rows], residuals[rows], sigma[rows])
            parts.append(reduce_windows(derivatives.reshape(-1, self._length, *derivatives.shape[1:]), of.STATES))
        reduced, step = Reduced.joined(parts), np.arange(of.STATES)
        reduced.left[0, step, step] += 1.0 / START**2
        reduced.left[0, DRAWN, -1] += self.states[0, DRAWN] / START[DRAWN] ** 2
        return reduced

    def _derivatives(self, rows: slice, x: Array, residuals: Array, sigma: Array) -> Array:
        """Return the derivatives of the residuals of some windows, divided by sigma; see reduce_windows().

        residuals, sigma: residuals of these windows, and their standard deviations, shape (windows, ROWS).
        """
        windows, s, unknown = self._windows, of.STATES, self.prior.unknown
        windows = replace(
            windows, **{name: getattr(windows, name)[rows] for name in ("rate", "force", "speed", "warm")}
        )
        of_middle = jacobian(windows, x, np.concatenate((np.arange(s), s + unknown)))
        of_middle[:, :s] *= -self._windows.covered[rows]
        of_middle /= sigma.T
        derivatives = np.empty((len(sigma), of.ROWS, 2 * s + len(unknown) + 1))
        # The state in the middle of a window is the mean of the states at its edges.
        derivatives[..., :s] = derivatives[..., s : 2 * s] = 0.5 * of_middle[:s].transpose(2, 1, 0)
        step = np.arange(s)
        derivatives[:, step, step] -= 1.0 / sigma[:, :s]
        derivatives[:, step, s + step] += 1.0 / sigma[:, :s]
        derivatives[..., 2 * s : -1], derivatives[..., -1] = of_middle[s:].transpose(2, 1, 0), residuals / sigma
        return derivatives

    def _solver_arguments(self, blocks: Reduced) -> tuple[Reduced, RandomWalks, Array]:
        return blocks, self._likely.random_walks(self.prior, self.parameters), self._likely.weight


def _at_edges(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))
