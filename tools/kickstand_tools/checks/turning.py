"""How well rates explain the forces of a log, window by window.

The rates of a window are integrated to the turn C from the sensor's axes at each instant to those at its beginning.
There the force (specific, in g) is up, a constant vector, and the change of a velocity V, which the sensor's axes turn
round: C f = up + C (dV/dt + rate x V) / g. V is small except along the vehicle: it is what the log's speed says, times
a direction, or where there is none a velocity that changes slowly. up, V and a bias of the gyro are fitted by least
squares, with what is usual for V and the bias as a prior; what is left shows how well the rates belong to the forces.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..signals import Array
from ..signals.rotations import cross_matrix, rotation_matrix
from .cells import CELL_S

KNOT_S = 5.0  # between two knots an unknown velocity changes evenly
EVENED = 10  # cells: in means over so many, once they are turned into the same axes, vibration evens out
FORCE_G = 0.1  # rms of what is left of them
VELOCITY_MPS, DIRECTION, BIAS_DPS = 20.0, 1.0, 3.0  # usual: an unknown velocity, a direction's part, a change of bias
BIAS_STEPS, MOST_DPS = 2, 5.0  # so often the bias is corrected, by at most so much at once
LATE_S = (0.0, 0.5, 1.0, 1.5)  # delays of the speed that are tried: a satellite receiver's is late


class Turning:
    """force (w, n, 3, g), rate (w, n, 3, deg/s): w windows of n cells of CELL_S. bias (3, deg/s): of the gyro, about.

    speed (m, 2): cell and m/s, or None; places (w, n): the windows' cells.
    """

    def __init__(self, force: Array, rate: Array, bias: Array, speed: Array | None, places: NDArray[np.int64]) -> None:
        self._force, self._rate, self._bias = force, rate, bias
        self._velocities = [_knots(*places.shape)]  # each: values and their changes per second, (kinds, w, n)
        self._usual = VELOCITY_MPS
        if speed is not None:
            self._velocities = [_given(speed, places, late_s) for late_s in LATE_S]
            self._usual = DIRECTION

    @property
    def unbiased(self) -> bool:
        """The gyro's bias is about 0."""
        return bool(np.max(np.abs(self._bias)) < BIAS_DPS)

    def rough(self, exchanges: Array) -> Array:
        """exchanges (k, 3, 3): rate = exchange @ reading. (k): mean square, g2, of what the turn alone leaves of the
        force."""
        sizes = np.mean(np.sum(self._force**2, axis=2))
        left = np.empty(len(exchanges))
        for sign in 1.0, -1.0:
            turn = _turn(sign * np.radians(self._rate - self._bias))
            both = np.einsum("wnij,wnk->wijk", turn, self._force) / turn.shape[1]
            right = np.linalg.det(exchanges) * sign > 0.0
            # turning the gyro's axes by a rotation is turning the force's by its inverse
            up = np.einsum("wijk,qkj->qwi", both, sign * exchanges[right])
            left[right] = sizes - np.mean(np.sum(up**2, axis=2), axis=1)
        return left

    def unexplained(self, exchange: Array) -> Array:
        """(w): mean square in each window, g2, of the force that the rates exchange @ reading do not explain."""
        sign = np.linalg.det(exchange)
        force = self._force @ (sign * exchange)  # in axes in which the gyro needs no more than this sign
        bias, velocity = self._bias, self._velocities[0]
        if len(self._velocities) > 1:
            turned = self._turned(force, sign, bias)
            velocity = min(self._velocities, key=lambda each: np.mean(self._fit(*turned, each).left))
        for _ in range(BIAS_STEPS):
            turned = self._turned(force, sign, bias)
            bias = bias + self._bias_change(sign, *turned, self._fit(*turned, velocity))
        return self._fit(*self._turned(force, sign, bias), velocity).left

    def _turned(self, force: Array, sign: float, bias: Array) -> tuple[Array, Array, Array]:
        """(w, n, 3) rate, rad/s; (w, n, 3, 3) its turn; (w, n, 3) the force, turned by it."""
        rate = sign * np.radians(self._rate - bias)
        turn = _turn(rate)
        return rate, turn, np.einsum("wnij,wnj->wni", turn, force)

    def _fit(self, rate: Array, turn: Array, turned: Array, velocity: tuple[Array, Array]) -> "_Fit":
        values, changes = (part[..., None, None] for part in velocity)
        parts = turn @ (cross_matrix(rate) * values + np.eye(3) * changes)  # (kinds, w, n, 3, 3)
        along = _evened(np.concatenate(list(parts), axis=-1) / STANDARD_GRAVITY)
        moved = _evened(turned)
        square = np.einsum("wnij,wnik->wjk", along, along)
        square += (FORCE_G / self._usual) ** 2 * np.eye(square.shape[-1])
        inverse, seen = np.linalg.inv(square), np.einsum("wnij,wni->wj", along, moved)
        found = np.einsum("wij,wj->wi", inverse, seen)
        left = (np.sum(moved**2, axis=(1, 2)) - np.sum(found * seen, axis=1)) / moved.shape[1]
        return _Fit(along, moved, inverse, found, left)

    def _bias_change(self, sign: float, rate: Array, turn: Array, turned: Array, fit: "_Fit") -> Array:
        """(3) deg/s. A change of the bias turns all that was integrated: linear about the middle of the window."""
        angle = np.cumsum(turn, axis=1) * CELL_S
        angle -= angle[:, rate.shape[1] // 2, None]
        by_bias = _evened(-sign * np.radians(1.0) * cross_matrix(turned) @ angle)
        mixed = np.einsum("wnij,wnik->wjk", fit.along, by_bias)
        # the velocities of the windows are eliminated from the normal equations
        square = np.einsum("wnij,wnik->jk", by_bias, by_bias) - np.einsum("wji,wjk,wkl->il", mixed, fit.inverse, mixed)
        vector = np.einsum("wnij,wni->j", by_bias, fit.moved) - np.einsum("wji,wj->i", mixed, fit.found)
        change = np.linalg.solve(square + (FORCE_G / BIAS_DPS) ** 2 * np.eye(3), vector)
        return np.clip(change, -MOST_DPS, MOST_DPS)


@dataclass
class _Fit:
    """Of each window: along (w, m, 3, k), what k parts of the velocity do to the moved force (w, m, 3); found (w, k),
    those parts; inverse (w, k, k) of their normal matrix; left (w), mean square of what is not explained."""

    along: Array
    moved: Array
    inverse: Array
    found: Array
    left: Array


def _turn(rate: Array) -> Array:
    """(w, n, 3, 3): from the axes in the middle of each cell to those at the window's beginning. rate: rad/s."""
    half = rotation_matrix(rate * (CELL_S / 2.0))
    after = half @ half  # then the product of twice as many cells each time
    reach = 1
    while reach < rate.shape[1]:
        after[:, reach:] = after[:, :-reach] @ after[:, reach:]
        reach *= 2
    return np.concatenate((half[:, :1], after[:, :-1] @ half[:, 1:]), axis=1)


def _evened(values: Array) -> Array:
    """(w, n, ...) in means over EVENED cells, without each window's own mean: that takes up, which is constant, out."""
    means = np.mean(values.reshape(len(values), -1, EVENED, *values.shape[2:]), axis=2)
    return means - np.mean(means, axis=1, keepdims=True)


def _knots(windows: int, cells: int) -> tuple[Array, Array]:
    """A velocity that is given at each knot and changes evenly between them."""
    time = (np.arange(cells) + 0.5) * CELL_S
    count = round(cells * CELL_S / KNOT_S) + 1
    knots = np.arange(count) * KNOT_S
    values = np.array([np.interp(time, knots, unit) for unit in np.eye(count)])
    step = np.minimum((time / KNOT_S).astype(int), count - 2)
    changes = (np.eye(count)[step + 1] - np.eye(count)[step]).T / KNOT_S
    return np.repeat(values[:, None], windows, axis=1), np.repeat(changes[:, None], windows, axis=1)


def _given(speed: Array, places: NDArray[np.int64], late_s: float) -> tuple[Array, Array]:
    """A velocity of this speed."""
    second = round(1.0 / CELL_S)
    cells = np.arange(-second, places.max() + 1 + second)
    values = np.interp(cells + late_s / CELL_S, *speed.T)
    changes = (values[second:] - values[:-second]) / (second * CELL_S)  # of the second around it
    return values[places + second][None], changes[places + second // 2][None]
