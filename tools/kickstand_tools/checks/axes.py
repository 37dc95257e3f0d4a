"""Checks that the axes of a log are right: handedness, exchanged or reversed axes, and the sign of the accelerations.

Handedness. turning.py fits the rates to the forces. The hypotheses are the 48 signed permutations of the gyro's axes:
left-handed axes in both sensors look like a gyro of the opposite sign, because a rate is an axial vector. A log is
accused only if another permutation explains the forces clearly better than its own axes. The permutation is named only
if no third one explains them nearly as well: a long bend does not tell the permutations apart.

Sign of the accelerations. If only the accelerations have the opposite sign, the log is an exact mirror image of the
ride, with left and right exchanged. The track can show this: the gyro's rate about up and the rate at which the course
changes must have the same sign.
"""

import itertools

import numpy as np
from kickstand.units import AXES

from ..common.messages import AT_REST, Message, Remedy, WrongAxes, kind
from ..logs.log import BIN_S, Log, LogBins, log_bins
from ..signals import Array, best_lag, distance_m
from .leaning import bends
from .turning import FAR_DPS, Turning, TurningFit, liveliest

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
    permutation = np.array((message.about_x, message.about_y, message.about_z))
    # On the diagonal, an axis has 1 if it is right, -1 if it is reversed, and 0 if it is another one
    diagonal = dict(zip(AXES, np.diag(permutation).tolist()))
    right = [axis for axis, sign in diagonal.items() if sign == 1]
    wrong = [axis for axis, sign in diagonal.items() if sign != 1]
    moved = [axis for axis, sign in diagonal.items() if sign == 0]
    signs = np.sum(permutation, axis=1).tolist()
    what, alternative = "are in another order or of another sign", ""
    if len(right) == 2:
        what = f"are reversed about {wrong[0]}"
    elif not moved:
        what, alternative = f"are reversed about {wrong[0]} and {wrong[1]}", f"along {right[0]} are reversed"
    elif len(moved) == 2 and signs == [1, 1, 1]:
        what = f"about {moved[0]} and {moved[1]} are exchanged"
    elif len(moved) == 2 and signs == [-1, -1, -1]:
        alternative = f"along {moved[0]} and {moved[1]} are exchanged"
    sources = [AXES[k] for k in np.argmax(np.abs(permutation), axis=1)]
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
    # The course must vary, because a gyro's bias does not vary with it
    if len(course_dps) < ENOUGH_TURNS or np.std(course_dps) < TURNING_DPS:
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
