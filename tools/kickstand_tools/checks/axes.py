"""Checks that the axes of a log are right: handedness, exchanged or reversed axes, and the sign of the accelerations.

Handedness. The rates of a window are integrated to a rotation C, from the sensor's axes at each instant to its axes at
the beginning of the window. There, the specific force f (in g) is a constant vector `up` plus the acceleration, which
follows from the velocity V in the sensor's rotating axes:

    C f = up + C (dV/dt + rate x V) / g

The term rate x V matters: in a long bend the force keeps its direction along the bike, although the bike turns. V is a
speed along one constant direction, plus a little across it for a phone in a hand. Least squares estimate `up` (1 g
long), V, the direction and the gyro's bias. The hypotheses are the 48 signed permutations of the gyro's axes:
left-handed axes in both sensors look like a gyro of the opposite sign, because a rate is an axial vector. A log is
accused only if another permutation explains the forces clearly better than its own axes. The permutation is named only
if no third one explains them nearly as well: a long bend does not tell the permutations apart.

Sign of the accelerations. If only the accelerations have the opposite sign, the log is an exact mirror image of the
ride, with left and right exchanged. The track can show this: the gyro's rate about up and the rate at which the course
changes must have the same sign.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from kickstand.units import AXES, STANDARD_GRAVITY

from ..common.messages import AT_REST, Message, Remedy, WrongAxes, kind
from ..logs.log import BIN_S, Log, LogBins, log_bins
from ..signals import Array, Bools, Ints, best_lag, cross_matrix, distance_m, intervals, rotation_matrix
from .leaning import bends

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

# Handedness

# Numbers of permutations that are fitted with their bias, besides none and all axes reversed
TRIED, TRIED_IF_WRONG = 4, 12

# Another permutation must reduce the mean square of the residual force (g2) by this factor, or by FEW_CLEARLY in at
# most FEW_WINDOWS windows. In correct logs the factor was at most 1.6 in windows of simulated and recorded rides.
CLEARLY, FEW_WINDOWS, FEW_CLEARLY = 2.0, 3, 3.0
# Least reduction of the mean square, for any factor. In a parked vehicle, drift reduces it by under 0.0002. In few
# windows of one long bend, some permutation explains even the vibration.
LEAST_G2, FEW_LEAST_G2 = 0.001, 0.003
# A permutation is named if the residual of each other one is larger by this factor, or by FEW_NAMED in few windows.
# Before, the residuals are multiplied by PENALTY: all axes reversed (or none) are the likeliest mistake, then some axes
# reversed or two exchanged.
NAMED, FEW_NAMED = 1.3, 1.8
PENALTY = 1.0, 1.15, 1.3

# Sign of the accelerations

SLOWEST_MPS = 3.0  # least speed at which positions show the course
TURNING_DPS = 4.0  # a second counts if the course changes faster than this
MOST_TURNING_DPS = 90.0  # if the course changes faster than this, the positions have jumped
ENOUGH_TURNS = 8  # fewer usable seconds give no result
# Least correlation of course and gyro, of either sign, and by how many standard errors it must differ from 0. The
# errors of the positions turn the course too: in few seconds with small turns, they correlate with the gyro by chance.
COURSE_CORRELATION, COURSE_SIGMAS = 0.6, 5.0
COURSE_LAGS_S = np.arange(0.0, 2.1, 0.25)  # delays of the positions that are tried
LONGEST_S = 2.5  # longest time between two positions


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
        self._force, self._rate, self._cell_s = force, rate, bin_s

    def rough(self, permutations: Array, bias: Array) -> Array:
        """Return the mean square of the unexplained force for each of k permutations and a given bias, shape (k).

        permutations: signed permutations, shape (k, 3, 3). The rate is permutation @ (reading - bias).
        """
        squares = np.empty(len(permutations))
        for sign in 1.0, -1.0:
            model = _Model(sign, self._rate, bias, self._cell_s)
            for k in np.flatnonzero(np.linalg.det(permutations) * sign > 0.0):
                fit = model.fit(_permuted(self._force, sign, permutations[k]))
                squares[k] = np.mean(fit.residual + _WEIGHT * (np.linalg.norm(fit.up, axis=1) - 1.0) ** 2 / model.means)
        return squares

    def fit(self, permutation: Array, bias: Array) -> TurningFit:
        """Fit velocity, direction and bias for one permutation. bias: the first guess."""
        sign = float(np.sign(np.linalg.det(permutation)))
        force = _permuted(self._force, sign, permutation)
        model = _Model(sign, self._rate, bias, self._cell_s)
        fit, share = model.along_fit(force), 1.0
        for _ in range(STEPS):
            change = share * np.clip(model.bias_change(force, fit), -MOST_DPS, MOST_DPS)
            trial = _Model(sign, self._rate, model.bias + change, self._cell_s)
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
        self.bias, self._sign, self._cell_s = bias, sign, bin_s
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

    def fit(self, force: Array, earlier: "_Fit | None" = None) -> _Fit:
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
            direction = np.linalg.eigh(velocity.T @ velocity)[1][:, -1]
            along_up = earlier.up / np.maximum(np.linalg.norm(earlier.up, axis=1), 1e-9)[:, None]
            # One more equation per window: along_up @ up = 1
            row, long = np.einsum("wi,wij->wj", along_up, self._mean), np.sum(along_up * mean, axis=1) - 1.0
            inverse = self._inverse(direction, row)
            gradient += _WEIGHT * row * long[:, None]
            squares += _WEIGHT * long**2
        coefficients = np.einsum("wij,wj->wi", inverse, gradient)
        squares -= np.sum(coefficients * gradient, axis=1)
        up = mean - np.einsum("wij,wj->wi", self._mean, coefficients)
        cost = float(np.sum(squares) + (FORCE_G / BIAS_DPS) ** 2 * (self.bias @ self.bias))
        return _Fit(along_up, coefficients, inverse, up, squares / self.means, cost)

    def along_fit(self, force: Array) -> _Fit:
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
        angle = np.cumsum(self._turn, axis=1) * self._cell_s
        by = cross_matrix(force) @ angle - self._turn @ cross_matrix(speed / STANDARD_GRAVITY)
        by = self._means(self._sign * np.radians(1.0) * by)
        row = np.einsum("wi,wij->wj", fit.along_up, self._mean)
        up, by_up = np.mean(residual, axis=1), np.mean(by, axis=1)
        long = np.sum(fit.along_up * up, axis=1) - 1.0
        long_by = np.einsum("wi,wij->wj", fit.along_up, by_up)
        residual = (residual - up[:, None]).reshape(len(residual), -1)
        by = (by - by_up[:, None]).reshape(len(residual), -1, 3)
        mixed = self._along.swapaxes(1, 2) @ by + _WEIGHT * row[:, :, None] * long_by[:, None]
        square = np.sum(by.swapaxes(1, 2) @ by - mixed.swapaxes(1, 2) @ fit.inverse @ mixed, axis=0)
        square += _WEIGHT * long_by.T @ long_by
        vector = -np.einsum("wni,wn->i", by, residual) - _WEIGHT * long @ long_by
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
    # Before each pass, after[:, k] is the rotation over the last `reach` bins up to bin k. A pass doubles `reach`
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


LeftHanded = kind(
    "left-handed",
    text="the rates turn the force the wrong way, so the lean is wrong",
    todo=Remedy(
        "are the axes left-handed (reverse one in both sensors) or the gyro of the opposite sign (reverse all its "
        f"rates)? The wrong one of the two exchanges left and right: try a lean to a known side. {AT_REST.capitalize()}"
    ),
    base=WrongAxes,
)


def _misfit_words(message) -> str:
    """The check cannot see the sign of all accelerations. So one reversed axis of the accelerometer looks like the
    other two axes reversed in the gyro. Two exchanged axes look the same in either sensor."""
    permutation = message.about_x, message.about_y, message.about_z
    # On the diagonal, an axis has 1 if it is right, -1 if it is reversed, and 0 if it is another one
    right = [axis for k, axis in enumerate(AXES) if permutation[k][k] == 1]
    wrong = [axis for k, axis in enumerate(AXES) if permutation[k][k] != 1]
    moved = [axis for k, axis in enumerate(AXES) if permutation[k][k] == 0]
    signs = [sum(row) for row in permutation]
    what, alternative = "are in another order or of another sign", ""
    if len(right) == 2:
        what = f"are reversed about {wrong[0]}"
    elif not moved:
        what, alternative = f"are reversed about {wrong[0]} and {wrong[1]}", f"along {right[0]} are reversed"
    elif len(moved) == 2 and signs == [1, 1, 1]:
        what = f"about {moved[0]} and {moved[1]} are exchanged"
    elif len(moved) == 2 and signs == [-1, -1, -1]:
        alternative = f"along {moved[0]} and {moved[1]} are exchanged"
    sources = [AXES[[abs(x) for x in row].index(1)] for row in permutation]
    columns = ", ".join(("-" if sign < 0 else "") + f"g{axis}" for sign, axis in zip(signs, sources))
    return (
        "the rates do not belong to the accelerations, so the lean is wrong: "
        + (f"either the accelerations {alternative}, or " if alternative else "")
        + f"the rates {what}, and instead of gx, gy, gz right would be {columns}"
    )


# The fields are the rows of a signed permutation, 3 numbers each. This matrix times the rates of the log gives the true
# rates about x, y and z.
RatesMisfit = kind("rates-misfit", "about_x about_y about_z", _misfit_words, base=WrongAxes)
AxesMisfit = kind(
    "axes-misfit",
    text="the rates do not belong to the accelerations, so the lean is wrong: axes are exchanged or reversed in one of "
    "the sensors, or left-handed in both, and this ride does not show which",
    todo=Remedy("half a minute in which a hand turns the sensor about each of its axes shows it"),
    base=WrongAxes,
)
Mirrored = kind(
    "mirrored",
    text="the sensor turns against the track, so left and right are exchanged",
    todo=Remedy(f"were all accelerations turned? {AT_REST.capitalize()}"),
    base=WrongAxes,
)


def wrong_axes(bins: LogBins) -> Message | None:
    """Return a notice if the axes, their signs or the unit of the rates seem wrong.

    Returns None if they seem right, or if the log is not enough to judge, as the checks that it calls.
    """
    mirrored = Mirrored() if course_agrees(bins) is False else None
    return handedness(bins) or bends(bins) or mirrored


def _permutations() -> Array:
    """Return the signed permutations, shape (48, 3, 3): first the identity, second all axes reversed."""
    axes = [np.eye(3)[list(order)] for order in itertools.permutations(range(3))]
    signed = [rows * np.array(signs)[:, None] for rows in axes for signs in itertools.product((1.0, -1.0), repeat=3)]
    return np.array(sorted(signed, key=lambda rows: -abs(np.trace(rows)) - 0.5 * (np.trace(rows) == 3.0)))


PERMUTATIONS = _permutations()  # true rate = permutation @ reading of the gyro


def handedness(bins: LogBins) -> Message | None:
    """Return a notice that says what is wrong with the axes; None as wrong_axes()."""
    liveliest_windows = liveliest(bins.force, bins.rate, bins.valid, BIN_S)
    fits = None if liveliest_windows is None else fit_permutations(*liveliest_windows)
    if fits is None or not is_wrong(fits):
        return None
    best = likeliest(fits)
    if best is None:
        return AxesMisfit()
    reversed_all = np.array_equal(PERMUTATIONS[best], -np.eye(3))
    return LeftHanded() if reversed_all else RatesMisfit(*map(tuple, PERMUTATIONS[best].astype(int).tolist()))


def fit_permutations(turning: Turning, guesses: list[Array]) -> dict[int, TurningFit]:
    """Fit the log's own axes, all axes reversed, and the permutations that explain the forces best.

    If the log's own axes seem wrong, they are fitted again from more guesses, because the fit may have ended at the
    rate of a long bend instead of the bias. If they still seem wrong, more permutations are fitted, to name it.

    guesses: guesses of the gyro's bias, which is the same for each permutation, in deg/s.
    Returns the fits by their index in PERMUTATIONS.
    """
    fits: dict[int, TurningFit] = {}

    def fit(k: int, bias: Array) -> None:
        new = turning.fit(PERMUTATIONS[k], bias)
        fits[k] = min(fits.get(k, new), new, key=lambda each: each.cost)

    def fit_best(biases: list[Array], tried: int) -> None:
        rough = np.column_stack([turning.rough(PERMUTATIONS, bias) for bias in biases])
        for k in {0, 1, *fits, *np.argsort(np.min(rough, axis=1))[:tried].tolist()}:
            fit(k, biases[int(np.argmin(rough[k]))])

    def best() -> Array:
        return min(fits.values(), key=lambda each: each.cost).bias

    fit_best(guesses, TRIED)
    fit_best([best()], TRIED)
    if is_wrong(fits):
        for bias in [*guesses, *FAR_DPS]:
            fit(0, bias)
    if is_wrong(fits):
        fit_best([best(), *guesses, *FAR_DPS], TRIED_IF_WRONG)
        fit_best([best()], TRIED)
    return fits


def is_wrong(fits: dict[int, TurningFit]) -> bool:
    """True if another permutation explains the forces clearly better than the log's own axes."""
    own, least = float(np.mean(fits[0].residual)), min(float(np.mean(fit.residual)) for fit in fits.values())
    few = len(fits[0].residual) <= FEW_WINDOWS
    clearly, least_g2 = (FEW_CLEARLY, FEW_LEAST_G2) if few else (CLEARLY, LEAST_G2)
    return own > clearly * least and own - least > least_g2


def likeliest(fits: dict[int, TurningFit]) -> int | None:
    """Return the index in PERMUTATIONS of the permutation that is right; None if several may be right."""
    scores = {k: float(np.mean(fit.residual)) * _penalty(PERMUTATIONS[k]) for k, fit in fits.items()}
    best, second = sorted(scores, key=lambda k: scores[k])[:2]
    named = NAMED if len(fits[0].residual) > FEW_WINDOWS else FEW_NAMED
    return best if scores[second] > named * scores[best] else None


def _penalty(permutation: Array) -> float:
    all_or_none_reversed, likely, unlikely = PENALTY
    if np.array_equal(np.abs(permutation), np.eye(3)):  # only signs differ
        return all_or_none_reversed if abs(np.trace(permutation)) == 3.0 else likely
    exchanges_two = np.array_equal(permutation, permutation.T) and np.min(permutation) == 0.0
    return likely if exchanges_two else unlikely


def course_agrees(bins: LogBins) -> bool | None:
    """Return True if the rate about up has the sign of the rate at which the course changes, False if the opposite.

    Returns None if the log has too few bends to both sides.
    """
    if len(bins.positions) < ENOUGH_TURNS:
        return None
    time_s, lat, lon = bins.positions.T
    east, north = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
    step_s = np.diff(time_s)
    moving = (np.hypot(east, north) > SLOWEST_MPS * step_s) & (step_s < LONGEST_S)
    middle_s, span_s = time_s[1:-1], (step_s[1:] + step_s[:-1]) / 2.0
    course_dps = np.degrees(np.diff(np.unwrap(np.arctan2(north, east)))) / span_s
    counted = moving[1:] & moving[:-1] & (np.abs(course_dps) > TURNING_DPS) & (np.abs(course_dps) < MOST_TURNING_DPS)
    course_dps, middle_s, span_s = course_dps[counted], middle_s[counted], span_s[counted]
    if (
        len(course_dps) < ENOUGH_TURNS or np.std(course_dps) < TURNING_DPS
    ):  # a gyro's bias does not vary with the course
        return None
    up = np.sum(bins.force * bins.bins.count[:, None], axis=0)

    def earlier(by_s: float) -> tuple[Array, Array]:
        begin, end = (bins.integrals(middle_s - by_s + side * span_s)[:, 3:6] for side in (-0.5, 0.5))
        return course_dps, ((end - begin) @ up / span_s)[:, None]

    best = best_lag(COURSE_LAGS_S, earlier)
    if best is None or best.value < COURSE_CORRELATION:
        return None
    sigmas = best.value * np.sqrt((len(course_dps) - 2) / max(1.0 - best.value**2, 1e-9))
    return bool(best.direction[0] > 0.0) if sigmas > COURSE_SIGMAS else None


def log_agrees(log: Log) -> bool | None:
    bins = log_bins(log)
    return None if bins is None else course_agrees(bins)
