"""Fits the rates of a log to its forces, to find the gyro's bias, and how well the rates explain the forces.

The rates of a window are integrated to a rotation C, from the sensor's axes at each instant to its axes at the
beginning of the window. There, the specific force f (in g) is a constant vector `up` plus the acceleration, which
follows from the velocity V in the sensor's rotating axes:

    C f = up + C (dV/dt + rate x V) / g

The term rate x V matters: in a long bend the force keeps its direction along the bike, although the bike turns. V is a
speed along one constant direction, plus a little across it for a phone in a hand. Least squares estimate `up` (1 g
long), V, the direction and the gyro's bias.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array, Bools, Ints, cross_matrix, intervals, rotation_matrix

WINDOW_S, SHORT_WINDOW_S = 20.0, 10.0  # short windows are used if the log has no long window without a gap
MOST_WINDOWS = 10  # number of windows that are fitted: the windows with the largest rates

FAR_DPS = 10.0 * np.array(list(itertools.product((1.0, -1.0), repeat=3)))  # guesses of a large bias
MERGED_S = 0.2  # bins are merged to this length
KNOT_S = 2.5  # time between the knots of the velocity
EVENED_S = 1.0  # time over which the rotated forces are averaged, to remove vibration
FORCE_G = 0.1  # standard deviation of the noise of these means
# Standard deviations of the prior: of the velocity along the vehicle's direction and across it, and of the gyro's bias.
ALONG_MPS, ACROSS_MPS, BIAS_DPS = 30.0, 2.0, 10.0
UP_G = 0.07  # standard deviation of the length of `up`, because of the accelerometer's errors
STEPS = 5  # most steps that correct the bias
MOST_DPS = 8.0  # largest change of the bias in one step
SETTLED = 0.02  # the bias is found if a step reduces the cost by a smaller share
SMALLER, LEAST_STEP = 0.3, 0.1  # a step that increases the cost is tried again, smaller

_WEIGHT = (FORCE_G / UP_G) ** 2


@dataclass
class TurningFit:
    """The result of the least squares in w windows for one permutation of the gyro's axes."""

    residual: Array  # mean square of the force that the rates do not explain in each window, shape (w), in g2
    bias: Array  # the gyro's bias, along the axes of its readings, shape (3), in deg/s
    cost: float  # the sum of the squares, with the prior


def liveliest(force: Array, rate: Array, valid: Bools, bin_s: float) -> tuple["Turning", list[Array]] | None:
    """Return the windows of a log with the largest rates, and guesses of the gyro's bias; None without a window.

    A phone has no bias. In other logs, the median rate is a guess: most of a ride is nearly straight.

    force: mean force of each bin of bin_s seconds, shape (n, 3), in g.
    rate: mean rate of each bin, shape (n, 3), in deg/s.
    valid: False for the bins in gaps, shape (n).
    """
    rows = windows(valid, round(WINDOW_S / bin_s))
    rows = rows if len(rows) else windows(valid, round(SHORT_WINDOW_S / bin_s))
    if not len(rows):
        return None
    usual = np.median(rate[valid], axis=0)
    turned = np.sum((rate[rows] - usual) ** 2, axis=(1, 2))
    rows = rows[np.sort(np.argsort(-turned)[:MOST_WINDOWS])]
    shape = len(rows), -1, round(MERGED_S / bin_s), 3
    force, rate = (np.mean(values[rows].reshape(shape), axis=2) for values in (force, rate))
    return Turning(force, rate, MERGED_S), [np.zeros(3), usual]


def bias_dps(force: Array, rate: Array, valid: Bools, bin_s: float) -> Array | None:
    """Find the gyro's bias in a log without a standstill, in deg/s; None if the log is too short. See liveliest()."""
    lively = liveliest(force, rate, valid, bin_s)
    if lively is None:
        return None
    turning, guesses = lively
    return min((turning.fit(np.eye(3), guess) for guess in [*guesses, *FAR_DPS]), key=lambda fit: fit.cost).bias


def windows(valid: Bools, length: int) -> Ints:
    """Return the indices of the bins of the windows without an unknown bin, shape (windows, length)."""
    starts = [k for begin, end in intervals(valid) for k in range(begin, end - length + 1, length)]
    return np.array(starts, dtype=int).reshape(-1, 1) + np.arange(length)


class Turning:
    """Fits rates (deg/s) to forces (g), both of shape (w, n, 3), in w windows of n bins of bin_s seconds."""

    def __init__(self, force: Array, rate: Array, bin_s: float) -> None:
        self._force, self._rate, self._bin_s = force, rate, bin_s

    def rough(self, permutations: Array, bias: Array) -> Array:
        """Return the mean square of the unexplained force for each of k permutations and a given bias, shape (k).

        permutations: signed permutations, shape (k, 3, 3). The rate is permutation @ (reading - bias).
        """
        squares = np.empty(len(permutations))
        for sign in 1.0, -1.0:
            model = _Model(sign, self._rate, bias, self._bin_s)
            for k in np.flatnonzero(np.linalg.det(permutations) * sign > 0.0):
                fit = model.fit(_permuted(self._force, sign, permutations[k]))
                excess_g = np.linalg.norm(fit.up, axis=1) - 1.0
                squares[k] = np.mean(fit.residual + _WEIGHT * excess_g**2 / model.means)
        return squares

    def fit(self, permutation: Array, bias: Array) -> TurningFit:
        """Fit velocity, direction and bias for one permutation. bias: the first guess."""
        sign = float(np.sign(np.linalg.det(permutation)))
        force = _permuted(self._force, sign, permutation)
        model = _Model(sign, self._rate, bias, self._bin_s)
        fit, share = model.along_fit(force), 1.0
        for _ in range(STEPS):
            change = share * np.clip(model.bias_change(force, fit), -MOST_DPS, MOST_DPS)
            trial = _Model(sign, self._rate, model.bias + change, self._bin_s)
            better = trial.along_fit(force)
            if better.cost < fit.cost:
                settled = better.cost > (1.0 - SETTLED) * fit.cost
                model, fit, share = trial, better, 1.0
                if settled:
                    break
            else:
                share *= SMALLER
                if share < LEAST_STEP:
                    break
        return TurningFit(fit.residual, model.bias, fit.cost)


@dataclass
class _Fit:
    """The least squares in w windows for one bias. The velocity has k coefficients."""

    along_up: Array  # the direction of `up` before this fit, shape (w, 3), or 0 if its length was not used
    velocity: Array  # the coefficients of the velocity, shape (w, k)
    inverse: Array  # the inverse of the normal equations, shape (w, k, k)
    up: Array  # shape (w, 3), in g
    residual: Array  # see TurningFit, as cost
    cost: float


class _Model:
    """How the force in w windows depends on the velocity, for one bias. sign: 1, or -1 to reverse all rates."""

    def __init__(self, sign: float, readings: Array, bias: Array, bin_s: float) -> None:
        self.bias, self._sign, self._bin_s = bias, sign, bin_s
        self._rate = rate = sign * np.radians(readings - bias)
        self._evened = round(EVENED_S / bin_s)
        self.means = rate.shape[1] // self._evened  # number of averaged forces in a window
        self._turn = _turn(rate, bin_s)
        self._functions = values, changes = _knots(rate.shape[1], bin_s)
        moving = self._turn @ cross_matrix(rate)
        # Derivatives of the averaged force by the coefficients, shape (w, m, 3, knots, 3)
        shape = len(rate), -1, self._evened, 3, 3
        each = (len(values), -1, self._evened)
        along = np.einsum("wmcij,kmc->wmikj", moving.reshape(shape), values.reshape(each), optimize=True)
        along += np.einsum("wmcij,kmc->wmikj", self._turn.reshape(shape), changes.reshape(each), optimize=True)
        along = along.reshape(*along.shape[:3], -1) / (self._evened * STANDARD_GRAVITY)
        self._mean = np.mean(along, axis=1)
        self._along = (along - self._mean[:, None]).reshape(len(rate), -1, along.shape[-1])
        self._square = self._along.swapaxes(1, 2) @ self._along
        self._knots = len(values)

    def fit(self, force: Array, earlier: _Fit | None = None) -> _Fit:
        """Fit the velocity. force: along the permuted axes, shape (w, n, 3), in g.

        earlier: an earlier fit, for the direction of the velocity, which is the same in all windows, and of `up`. None
            if unknown: then the velocity has any direction, and `up` any length.
        """
        means = self._means(np.einsum("wnij,wnj->wni", self._turn, force))
        mean = np.mean(means, axis=1)
        moved = (means - mean[:, None]).reshape(len(force), -1)
        gradient = np.einsum("wij,wi->wj", self._along, moved)
        squares = np.sum(moved**2, axis=1)
        along_up, inverse = np.zeros_like(mean), self._any_direction
        if earlier is not None:
            velocity = earlier.velocity.reshape(-1, 3)
            direction = np.linalg.eigh(velocity.T @ velocity).eigenvectors[:, -1]
            along_up = earlier.up / np.maximum(np.linalg.norm(earlier.up, axis=1), 1e-9)[:, None]
            # One more equation per window: along_up @ up = 1
            row, excess_g = np.einsum("wi,wij->wj", along_up, self._mean), np.sum(along_up * mean, axis=1) - 1.0
            inverse = self._inverse(direction, row)
            gradient += _WEIGHT * row * excess_g[:, None]
            squares += _WEIGHT * excess_g**2
        coefficients = np.einsum("wij,wj->wi", inverse, gradient)
        squares -= np.sum(coefficients * gradient, axis=1)
        up = mean - np.einsum("wij,wj->wi", self._mean, coefficients)
        cost = float(np.sum(squares) + (FORCE_G / BIAS_DPS) ** 2 * (self.bias @ self.bias))
        return _Fit(along_up, coefficients, inverse, up, squares / self.means, cost)

    def along_fit(self, force: Array) -> _Fit:
        """Fit the velocity along one direction, which a first fit without this condition finds."""
        return self.fit(force, self.fit(force))

    def bias_change(self, force: Array, fit: _Fit) -> Array:
        """Return the correction of the bias by one step of linear least squares, shape (3), in deg/s.

        The velocity is eliminated from the normal equations (Schur complement).
        """
        coefficients = fit.velocity.reshape(len(force), self._knots, 3)
        speed, change = (np.einsum("kn,wkj->wnj", functions, coefficients) for functions in self._functions)
        force = force - (change + np.einsum("wnij,wnj->wni", cross_matrix(self._rate), speed)) / STANDARD_GRAVITY
        force = np.einsum("wnij,wnj->wni", self._turn, force)
        residual = self._means(force)
        # Derivatives by the bias. A change of the bias rotates the force by the integral of this change. It also
        # changes the force that the bend needs.
        angle = np.cumsum(self._turn, axis=1) * self._bin_s
        by = cross_matrix(force) @ angle - self._turn @ cross_matrix(speed / STANDARD_GRAVITY)
        by = self._means(self._sign * np.radians(1.0) * by)
        row = np.einsum("wi,wij->wj", fit.along_up, self._mean)
        up, by_up = np.mean(residual, axis=1), np.mean(by, axis=1)
        excess_g = np.sum(fit.along_up * up, axis=1) - 1.0
        excess_by = np.einsum("wi,wij->wj", fit.along_up, by_up)
        residual = (residual - up[:, None]).reshape(len(residual), -1)
        by = (by - by_up[:, None]).reshape(len(residual), -1, 3)
        mixed = self._along.swapaxes(1, 2) @ by + _WEIGHT * row[:, :, None] * excess_by[:, None]
        square = np.sum(by.swapaxes(1, 2) @ by - mixed.swapaxes(1, 2) @ fit.inverse @ mixed, axis=0)
        square += _WEIGHT * excess_by.T @ excess_by
        vector = -np.einsum("wni,wn->i", by, residual) - _WEIGHT * excess_g @ excess_by
        prior = (FORCE_G / BIAS_DPS) ** 2
        return np.linalg.solve(square + prior * np.eye(3), vector - prior * self.bias)

    def _means(self, values: Array) -> Array:
        return np.mean(values.reshape(len(values), self.means, self._evened, *values.shape[2:]), axis=2)

    @cached_property
    def _any_direction(self) -> Array:
        return self._inverted(np.eye(3) / ALONG_MPS**2)

    def _inverse(self, direction: Array, row: Array) -> Array:
        along = np.outer(direction, direction)
        prior = along / ALONG_MPS**2 + (np.eye(3) - along) / ACROSS_MPS**2
        return self._inverted(prior, _WEIGHT * row[:, :, None] * row[:, None])

    def _inverted(self, prior: Array, square: Array | float = 0.0) -> Array:
        return np.linalg.inv(self._square + square + FORCE_G**2 * np.kron(np.eye(self._knots), prior))


def _permuted(force: Array, sign: float, permutation: Array) -> Array:
    """Permute the force instead of the rates, so that all permutations of one sign share a model."""
    return force @ (sign * permutation)


def _turn(rate: Array, bin_s: float) -> Array:
    """Integrate rates in rad/s, shape (w, n, 3), to rotations from the middle of each bin to the window's beginning."""
    half = rotation_matrix(rate * (bin_s / 2.0))
    turns = half @ half  # the rotation over each bin
    reach = 1
    # Before each pass, turns[:, k] is the rotation over the last `reach` bins up to bin k. A pass doubles `reach`
    while reach < rate.shape[1]:
        turns[:, reach:] = turns[:, :-reach] @ turns[:, reach:]
        reach *= 2
    return np.concatenate((half[:, :1], turns[:, :-1] @ half[:, 1:]), axis=1)


def _knots(bins: int, bin_s: float) -> tuple[Array, Array]:
    """Return the functions of the velocity and their derivatives, each of shape (knots, bins).

    Each function is 1 at its own knot and 0 at the other knots. Between knots it is linear.
    """
    time = (np.arange(bins) + 0.5) * bin_s
    count = round(bins * bin_s / KNOT_S) + 1
    knots = np.arange(count) * KNOT_S
    values = np.array([np.interp(time, knots, unit) for unit in np.eye(count)])
    step = np.minimum((time / KNOT_S).astype(int), count - 2)
    return values, (np.eye(count)[step + 1] - np.eye(count)[step]).T / KNOT_S
