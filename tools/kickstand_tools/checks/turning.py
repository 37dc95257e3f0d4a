"""Measures how well the rates of a log explain its forces, window by window.

The rates of a window are integrated to a rotation C. C rotates from the sensor's axes at each instant to the sensor's
axes at the beginning of the window. In the axes at the beginning, the specific force f (in g) is a constant vector `up`
plus the acceleration. The acceleration follows from the velocity V, which is given in the sensor's rotating axes:

    C f = up + C (dV/dt + rate x V) / g

V is the log's speed times a constant direction. Without a speed, V is a velocity that changes slowly. The method of
least squares estimates `up`, V and the gyro's bias, with a prior for V and the bias. The residual shows how well the
rates fit the forces.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array, Ints, cross_matrix, rotation_matrix
from .cells import CELL_S

KNOT_S = 5.0  # time between the knots of an unknown velocity
EVENED = 10  # number of cells over which the rotated forces are averaged, to remove vibration
FORCE_G = 0.1  # standard deviation of the noise of these means
# Standard deviations of the prior. VELOCITY_MPS is for an unknown velocity. DIRECTION is for each component of the
# constant direction. BIAS_DPS is for the correction of the gyro's bias.
VELOCITY_MPS, DIRECTION, BIAS_DPS = 20.0, 1.0, 3.0
BIAS_STEPS, MOST_DPS = 2, 5.0  # number of steps that correct the bias, and largest change in one step
LATE_S = (0.0, 0.5, 1.0, 1.5)  # delays of the speed that are tried, because a satellite receiver's speed is late


class Turning:
    """Fits rates to forces in w windows of n cells of CELL_S.

    force: shape (w, n, 3), in g.
    rate: shape (w, n, 3), in deg/s.
    bias: a first guess of the gyro's bias, shape (3), in deg/s.
    speed: index of the cell, and speed in m/s, shape (m, 2); None if unknown.
    places: indices of the windows' cells, shape (w, n).
    """

    def __init__(self, force: Array, rate: Array, bias: Array, speed: Array | None, places: Ints) -> None:
        self._force, self._rate, self._bias = force, rate, bias
        # The velocity is a sum of k functions of time. Each entry of this list, one per delay of the speed, holds these
        # functions and their derivatives, both of shape (k, w, n).
        self._velocities = [_knots(*places.shape)]
        self._usual = VELOCITY_MPS
        if speed is not None:
            self._velocities = [_given(speed, places, late_s) for late_s in LATE_S]
            self._usual = DIRECTION

    @property
    def unbiased(self) -> bool:
        """True if the first guess of the gyro's bias is about 0."""
        return bool(np.max(np.abs(self._bias)) < BIAS_DPS)

    def rough(self, exchanges: Array) -> Array:
        """Compute the residual of each of k exchanges without fitting the velocity.

        exchanges: shape (k, 3, 3). The rate is exchange @ reading.
        Returns the mean square of the force that the integrated rates do not explain, shape (k), in g2.
        """
        sizes = np.mean(np.sum(self._force**2, axis=2))
        left = np.empty(len(exchanges))
        for sign in 1.0, -1.0:
            turn = _turn(self._signed(sign, self._bias))
            both = np.einsum("wnij,wnk->wijk", turn, self._force) / turn.shape[1]
            right = np.linalg.det(exchanges) * sign > 0.0
            # Rotating the gyro's readings has the same effect as rotating the forces by the inverse rotation.
            up = np.einsum("wijk,qkj->qwi", both, sign * exchanges[right])
            left[right] = sizes - np.mean(np.sum(up**2, axis=2), axis=1)
        return left

    def unexplained(self, exchanges: Array) -> Array:
        """Compute the residual of each of k exchanges in each window.

        exchanges: shape (k, 3, 3). The rate is exchange @ reading.
        Returns the mean square of the force that the rates do not explain, shape (k, w), in g2.
        """
        left = np.empty((len(exchanges), len(self._force)))
        for sign in 1.0, -1.0:
            # All exchanges of one sign start with the same rates. Each corrects the bias by itself
            first = self._models(sign, self._bias, self._velocities)
            for k in np.flatnonzero(np.linalg.det(exchanges) * sign > 0.0):
                # permute the force instead of the rates. Only the sign of the permutation is applied to the rates
                left[k] = self._unexplained(sign, self._force @ (sign * exchanges[k]), first)
        return left

    def _unexplained(self, sign: float, force: Array, first: list["_Model"]) -> Array:
        """Choose the delay of the speed, then correct the gyro's bias. Returns the residual, shape (w), in g2.

        first: a model for each delay of the speed, with the first guess of the bias.
        """
        model, bias = min(first, key=lambda each: np.mean(each.fit(force).left)), self._bias
        for _ in range(BIAS_STEPS):
            bias = bias + model.bias_change(sign, model.fit(force))
            (model,) = self._models(sign, bias, [model.velocity])
        return model.fit(force).left

    def _signed(self, sign: float, bias: Array) -> Array:
        """Return the rates minus a bias, shape (w, n, 3), in rad/s."""
        return sign * np.radians(self._rate - bias)

    def _models(self, sign: float, bias: Array, velocities: list[tuple[Array, Array]]) -> list["_Model"]:
        """Return a model for each velocity. The rotations are integrated once for all of them."""
        rate = self._signed(sign, bias)
        turn = _turn(rate)
        moving = turn @ cross_matrix(rate)
        return [_Model(turn, moving, velocity, FORCE_G / self._usual) for velocity in velocities]


@dataclass
class _Fit:
    """The result of the least squares in each of w windows. The velocity has k coefficients.

    turned: the force, rotated to the axes at the beginning of the window, shape (w, n, 3).
    moved: the averaged force, shape (w, m, 3).
    found: the coefficients, shape (w, k).
    left: mean square of the residual, shape (w).
    """

    turned: Array
    moved: Array
    found: Array
    left: Array


class _Model:
    """How the force in w windows depends on the k coefficients of the velocity, for given rates.

    turn: the rotation C, integrated from the rate, shape (w, n, 3, 3).
    moving: C times the cross matrix of the rate, shape (w, n, 3, 3).
    velocity: functions of time and their derivatives, see Turning.
    prior: standard deviation of the noise divided by that of the prior of a coefficient.
    """

    def __init__(self, turn: Array, moving: Array, velocity: tuple[Array, Array], prior: float) -> None:
        self.velocity = velocity
        self._turn = turn
        values, changes = (part[..., None, None] for part in velocity)
        parts = moving * values + turn * changes  # shape (k, w, n, 3, 3)
        # Derivatives of the averaged force by the coefficients, shape (w, m, 3, k)
        self._along = _evened(np.concatenate(list(parts), axis=-1) / STANDARD_GRAVITY)
        square = np.einsum("wnij,wnik->wjk", self._along, self._along)
        self._inverse = np.linalg.inv(square + prior**2 * np.eye(square.shape[-1]))

    def fit(self, force: Array) -> _Fit:
        """Fit the coefficients. force: along the exchanged axes, shape (w, n, 3), in g."""
        turned = np.einsum("wnij,wnj->wni", self._turn, force)
        moved = _evened(turned)
        seen = np.einsum("wnij,wni->wj", self._along, moved)
        found = np.einsum("wij,wj->wi", self._inverse, seen)
        left = (np.sum(moved**2, axis=(1, 2)) - np.sum(found * seen, axis=1)) / moved.shape[1]
        return _Fit(turned, moved, found, left)

    def bias_change(self, sign: float, fit: _Fit) -> Array:
        """Return the correction of the bias by one step of linear least squares, shape (3), in deg/s.

        A change of the bias rotates the force by the integral of this change from the middle of the window.
        """
        angle = np.cumsum(self._turn, axis=1) * CELL_S
        angle -= angle[:, angle.shape[1] // 2, None]
        by_bias = _evened(-sign * np.radians(1.0) * cross_matrix(fit.turned) @ angle)
        mixed = np.einsum("wnij,wnik->wjk", self._along, by_bias)
        # Eliminate the velocities of the windows from the normal equations (Schur complement).
        square = np.einsum("wnij,wnik->jk", by_bias, by_bias)
        square -= np.einsum("wji,wjl->il", mixed, self._inverse @ mixed)
        vector = np.einsum("wnij,wni->j", by_bias, fit.moved) - np.einsum("wji,wj->i", mixed, fit.found)
        change = np.linalg.solve(square + (FORCE_G / BIAS_DPS) ** 2 * np.eye(3), vector)
        return np.clip(change, -MOST_DPS, MOST_DPS)


def _turn(rate: Array) -> Array:
    """Integrate rates to rotations.

    rate: shape (w, n, 3), in rad/s.
    Returns the rotation from the axes in the middle of each cell to the axes at the beginning of the window, shape
    (w, n, 3, 3).
    """
    half = rotation_matrix(rate * (CELL_S / 2.0))
    after = half @ half  # the rotation over each cell
    reach = 1
    # Before each pass, after[:, k] is the rotation over the last `reach` cells up to cell k. A pass doubles `reach`
    while reach < rate.shape[1]:
        after[:, reach:] = after[:, :-reach] @ after[:, reach:]
        reach *= 2
    return np.concatenate((half[:, :1], after[:, :-1] @ half[:, 1:]), axis=1)


def _evened(values: Array) -> Array:
    """Average values over EVENED cells, and subtract each window's mean to remove the constant vector `up`.

    values: shape (w, n, ...).
    """
    means = np.mean(values.reshape(len(values), -1, EVENED, *values.shape[2:]), axis=2)
    return means - np.mean(means, axis=1, keepdims=True)


def _knots(windows: int, cells: int) -> tuple[Array, Array]:
    """Return the functions of an unknown velocity, one per knot, and their derivatives.

    Each function is 1 at its own knot and 0 at the other knots. Between knots each function is linear.
    """
    time = (np.arange(cells) + 0.5) * CELL_S
    count = round(cells * CELL_S / KNOT_S) + 1
    knots = np.arange(count) * KNOT_S
    values = np.array([np.interp(time, knots, unit) for unit in np.eye(count)])
    step = np.minimum((time / KNOT_S).astype(int), count - 2)
    changes = (np.eye(count)[step + 1] - np.eye(count)[step]).T / KNOT_S
    return np.repeat(values[:, None], windows, axis=1), np.repeat(changes[:, None], windows, axis=1)


def _given(speed: Array, places: Ints, late_s: float) -> tuple[Array, Array]:
    """Return the function of a known speed, delayed by late_s, and its derivative."""
    second = round(1.0 / CELL_S)
    cells = np.arange(-second, places.max() + 1 + second)
    values = np.interp(cells + late_s / CELL_S, *speed.T)
    changes = (values[second:] - values[:-second]) / (second * CELL_S)  # mean change during the second around each cell
    return values[places + second][None], changes[places + second // 2][None]
