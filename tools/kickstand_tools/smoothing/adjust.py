"""The motion for which the readings of a stretch of a ride fit together best: Gauss-Newton steps over model.py."""

from dataclasses import dataclass

import numpy as np

from ..logs.axes.leaning import WINDOW_S
from ..logs.table import Array
from . import parameters as of
from .first_guess import first_guess, in_hand, standing
from .model import linearised, motion_and_measurements
from .noise import BALANCED, Circumstances
from .parameters import BIAS, FORWARD, LEAN, LEFT, PITCH, STATES, UP
from .solver import Beliefs, Chain, Eliminated, back, eliminate, mixed, solve_chain, unlikelihood, variances
from .windows import Windows, padded

BLOCK = 50  # windows of a block, at least; see solver.py
ROUNDS, PLAIN_ROUNDS = 8, 2  # at most; the first ones without regard to outliers
CONVERGED = np.radians(0.03)
MAX_LEAN = 0.5  # rad: of one step. The equations are linear no further.
MAX_PITCH = 1.2  # rad: as in the firmware
START = np.array([1.0, 0.3, 1.0, 1.0, 20.0, 0.03, 0.03, 0.03])  # 1 sigma of the first state of all
DRAWN = [PITCH, LEFT, UP, *range(STATES)[BIAS]]  # of it, what is drawn towards 0

SIDE_S = 120.0
SIDE_DRIFT = np.sqrt(2.0 * 10.0 / SIDE_S)
FLOOR=[0.5]; TEMPER=[0.5]; UPRIOR=np.array([0,0,6,4,0,0,4,4,0,0,4,4.])
D=np.radians
SLIP=D(1.5)
CONST=[D(.15)]
WIDE=np.array([[D(.5),D(.5),D(.06),0,0]])
HYP=np.array([[D(py)*.7,D(m)*.7,D(sd),slip,u+us] for py,m,slip,u in ((.04,.04,0,0),(.04,.15,0,1),(.15,.15,0,1),(.04,.04,1,4),(.04,.15,1,4),(.15,.15,1,4)) for sd,us in ((.04,0),(.6,7),(1.8,7))])


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
    count = max(1, len(windows) // BLOCK)
    fit = _Fit(padded(windows, -(-len(windows) // count)), count, six_done)
    for k in range(ROUNDS):
        if fit.step(robust=k >= PLAIN_ROUNDS) < CONVERGED and k > PLAIN_ROUNDS:
            break
    n = len(windows)
    return Adjusted(fit.states[: n + 1], fit.sigma()[: n + 1], fit.each_window()[:n])


class _Fit:
    def __init__(self, windows: Windows, blocks: int, six_done: bool) -> None:
        self._windows, self._blocks, self._length = windows, blocks, len(windows) // blocks
        self._still = standing(windows)
        self._held = in_hand(windows)
        lean, speed = first_guess(windows, self._still)
        self.states = np.zeros((len(windows) + 1, STATES))
        self.states[:, LEAN], self.states[:, FORWARD] = _at_edges(lean), _at_edges(speed)
        self._parameters = np.tile(of.USUAL, (blocks, 1))
        self._roughness = np.ones(len(windows))
        self._unbalance = 1.0
        self._slip = 0
        self._before = of.sigma(six_done)  # 1 sigma of the parameters, before the ride
        self._rolling = np.gradient(windows.rate[:, 2]) / WINDOW_S if len(windows) > 1 else np.zeros(1)

    def each_window(self) -> Array:
        """(n, PARAMETERS)"""
        return np.repeat(self._parameters, self._length, axis=0)

    def step(self, robust: bool) -> float:
        """Returns the largest change of lean, rad. Raises LinAlgError."""
        reduced, chain = self._solved(self._linearised(robust))
        change = _in_a_row(back(reduced, chain))
        most = float(np.max(np.abs(change[:, LEAN])))
        if not np.isfinite(most):
            raise np.linalg.LinAlgError
        if robust:
            self._unbalance = self._how_unbalanced()
            if FLOOR[0] < 1.0:
                self._roughness = np.maximum(FLOOR[0], self._circumstances().roughness_of(self._linearised(robust=True)[:, :, -1]))
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
        self._roughness = self.true_rough=self._circumstances().roughness_of(self._linearised(robust=True)[:, :, -1])
        return np.sqrt(np.maximum(_in_a_row(variances(*self._solved(self._linearised(robust=True), judge=False))), 0.0))

    def _how_unbalanced(self) -> float:
        middle = 0.5 * (self.states[1:] + self.states[:-1])
        _, measured = motion_and_measurements(self._windows, middle, self.each_window())
        return self._circumstances().unbalance_of(measured[:, BALANCED])

    def _circumstances(self) -> Circumstances:
        middle = 0.5 * (self.states[1:] + self.states[:-1])
        lean, speed = middle[:, LEAN], middle[:, FORWARD]
        return Circumstances(
            self._windows, self._still, *self._held, self._rolling, lean, speed, self._roughness, self._unbalance
        )

    def _linearised(self, robust: bool) -> Array:
        return linearised(self._circumstances(), self.states, self.each_window(), robust)

    def _solved(self, slopes: Array, judge: bool = True) -> tuple[Eliminated, Chain]:
        side_by_side = slopes.reshape(self._blocks, self._length, *slopes.shape[1:]).transpose(1, 0, 2, 3)
        reduced = eliminate(side_by_side, STATES)
        first = np.arange(STATES, 2 * STATES)
        reduced.left[0, first, first] += 1.0 / START**2
        reduced.left[0, first[DRAWN], -1] += self.states[0, DRAWN] / START[DRAWN] ** 2
        if judge:
            wide = solve_chain(reduced.left, STATES, self._beliefs(WIDE))
            moved = np.diff(self._parameters + wide.parameters, axis=0)[:, of.ROTATION]
            if len(moved):
                places = np.argsort(np.sum(moved**2, axis=1))[-6:]
                self._slip = places
                worse = unlikelihood(reduced.left, STATES, self._beliefs(np.tile([D(.04),D(.1),D(.06),1,0],(len(places),1))))
                self._slip = int(places[np.argmin(worse)])
            self.unlikely = unlikelihood(reduced.left, STATES, self._beliefs(HYP))+HYP[:,4]
            share = np.exp(-0.5*TEMPER[0] * (self.unlikely - np.min(self.unlikely)))
            self.share = share / np.sum(share)
        told = np.flatnonzero(self.share > 0.02)
        return reduced, mixed(reduced.left, STATES, self._beliefs(HYP[told]), self.share[told] / np.sum(self.share[told]))

    def _beliefs(self, hyp) -> Beliefs:
        p = self._parameters
        py, mount, side, slip, _ = hyp.T
        sigma = np.tile(self._before, (len(mount), 1))
        sigma[:, of.BESIDE] = np.hypot(side,CONST[0])
        known = np.stack([of.known(one) for one in sigma])
        drift = (of.DRIFT * sigma) ** 2
        drift[:, of.ROTATION] = py[:, None] ** 2; drift[:,2]=mount**2
        drift[:, of.BESIDE] = (side * SIDE_DRIFT)**2
        drift = np.repeat(drift[:, None], len(p)-1, axis=1)
        if len(p) > 1: drift[np.arange(len(drift)), self._slip, of.ROTATION.start:of.ROTATION.stop] if 0 else None
        if len(p) > 1:
            g=np.arange(len(drift))[:,None]; sl=np.broadcast_to(self._slip,len(drift))[:,None]
            drift[g, sl, np.arange(3)[None,:]] += (slip[:, None] * SLIP)**2
        pull = known @ (p[0] - of.USUAL)
        return Beliefs(np.concatenate((known, pull[:, :, None]), axis=2), drift, np.diff(p, axis=0))


def _in_a_row(blocks: Array) -> Array:
    """(K + 1, B, s) with shared ends -> (B K + 1, s)."""
    s = blocks.shape[2]
    return np.concatenate((blocks[:-1].transpose(1, 0, 2).reshape(-1, s), blocks[-1:, -1]))


def _at_edges(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))
