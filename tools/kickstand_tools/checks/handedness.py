"""Checks that the angular rates of a log fit its accelerations.

If the sensor turns, gravity turns in the sensor's axes. In a correct log, the axis that points up reads +1 g at rest,
and axes and rates are right-handed. The direction u of gravity then turns in the sensor's axes by du/dt = -rate x u.

This equation shows left-handed axes, a gyro of the opposite sign, and axes exchanged or reversed in only one of the
sensors. Left-handed axes in both sensors look like a gyro of the opposite sign, because a rate is an axial vector. A
log in which all accelerations have the opposite sign is the mirror image of another ride, so the motion cannot show
this mistake.

The force in a ride is hardly ever gravity alone: in a balanced bend it keeps its direction along the bike. Therefore
each window is judged as a whole, with the force that the bend needs (see turning.py). The hypotheses are the 48 signed
permutations of the gyro's axes, called exchanges in this module. A log is accused only if another exchange explains the
forces clearly better than the log's own axes. The exchange is named only if no third one explains them nearly as well:
a long bend, or a ride with few bends, does not tell the exchanges apart.
"""

import itertools

import numpy as np
from kickstand.units import AXES

from ..common.messages import Message, Remedy, WrongAxes
from ..signals import Array
from .bends import LeftHanded
from .cells import CELL_S, LogCells
from .turning import FAR_DPS, Turning, TurningFit, liveliest

# Numbers of exchanges that are fitted with their bias, besides none and all axes reversed
TRIED, TRIED_IF_WRONG = 4, 12

# Another exchange must reduce the mean square of the residual force (g2) by this factor, or by FEW_CLEARLY in at most
# FEW_WINDOWS windows. In correct logs the factor was at most 1.6 in windows of simulated and recorded rides.
CLEARLY, FEW_WINDOWS, FEW_CLEARLY = 2.0, 3, 3.0
# Least reduction of the mean square, for any factor. In a parked vehicle, drift reduces it by under 0.0002. In few
# windows of one long bend, some exchange explains even the vibration.
LEAST_G2, FEW_LEAST_G2 = 0.001, 0.003
# An exchange is named if the residual of each other one is larger by this factor, or by FEW_NAMED in few windows.
# Before, the residuals are multiplied by PENALTY: all axes reversed (or none) are the likeliest mistake, then some axes
# reversed or two exchanged.
NAMED, FEW_NAMED = 1.3, 1.8
PENALTY = 1.0, 1.15, 1.3


def _exchanges() -> Array:
    """Return the signed permutations, shape (48, 3, 3): first the identity, second all axes reversed."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            found.append(np.eye(3)[list(order)] * np.array(signs)[:, None])
    return np.array(sorted(found, key=lambda exchange: -abs(np.trace(exchange)) - 0.5 * (np.trace(exchange) == 3.0)))


EXCHANGES = _exchanges()  # true rate = exchange @ reading of the gyro


class RatesMisfit(WrongAxes):
    """The gyro's axes are not those of the accelerometer.

    The fields are the rows of a signed permutation, 3 numbers each. This matrix times the rates of the log gives the
    true rates about x, y and z.
    """

    about_x: tuple[int, ...]
    about_y: tuple[int, ...]
    about_z: tuple[int, ...]

    code = "rates-misfit"

    def sentence(self) -> str:
        """See Message.

        The check cannot see the sign of all accelerations. So one reversed axis of the accelerometer looks like the
        other two axes reversed in the gyro. Two exchanged axes look the same in either sensor.
        """
        exchange = self.about_x, self.about_y, self.about_z
        kept = [axis for k, axis in enumerate(AXES) if exchange[k][k] == 1]
        off = [axis for k, axis in enumerate(AXES) if exchange[k][k] != 1]
        moved = [axis for k, axis in enumerate(AXES) if exchange[k][k] == 0]
        signs = [sum(row) for row in exchange]
        what, or_else = "are in another order or of another sign", ""
        if len(kept) == 2:
            what = f"are reversed about {off[0]}"
        elif not moved:
            what, or_else = f"are reversed about {off[0]} and {off[1]}", f"along {kept[0]} are reversed"
        elif len(moved) == 2 and signs == [1, 1, 1]:
            what = f"about {moved[0]} and {moved[1]} are exchanged"
        elif len(moved) == 2 and signs == [-1, -1, -1]:
            or_else = f"along {moved[0]} and {moved[1]} are exchanged"
        from_axis = [AXES[[abs(x) for x in row].index(1)] for row in exchange]
        right = ", ".join(("-" if sign < 0 else "") + f"g{axis}" for sign, axis in zip(signs, from_axis))
        return (
            "the rates do not belong to the accelerations, so the lean is wrong: "
            + (f"either the accelerations {or_else}, or " if or_else else "")
            + f"the rates {what}, and instead of gx, gy, gz right would be {right}"
        )


class AxesMisfit(WrongAxes):
    """The gyro's axes are not those of the accelerometer, and the log does not show which exchange puts them right."""

    code = "axes-misfit"
    text = (
        "the rates do not belong to the accelerations, so the lean is wrong: axes are exchanged or reversed in one of "
        "the sensors, or left-handed in both, and this ride does not show which"
    )
    todo = Remedy("half a minute in which a hand turns the sensor about each of its axes shows it")


def handedness(cells: LogCells) -> Message | None:
    """Return a notice that says what is wrong with the axes.

    Returns None if the axes seem right, or if the log is not enough to judge them.
    """
    found = liveliest(cells.force, cells.rate, cells.known, CELL_S)
    fits = None if found is None else fit_exchanges(*found)
    if fits is None or not is_wrong(fits):
        return None
    best = likeliest(fits)
    if best is None:
        return AxesMisfit()
    reversed_all = np.array_equal(EXCHANGES[best], -np.eye(3))
    return LeftHanded() if reversed_all else RatesMisfit(*map(tuple, EXCHANGES[best].astype(int).tolist()))


def fit_exchanges(turning: Turning, guesses: list[Array]) -> dict[int, TurningFit]:
    """Fit the log's own axes, all axes reversed, and the exchanges that explain the forces best.

    If the log's own axes seem wrong, they are fitted again from more guesses, because the fit may have ended at the
    rate of a long bend instead of the bias. If they still seem wrong, more exchanges are fitted, to name the right one.

    guesses: guesses of the gyro's bias, each of shape (3), in deg/s. The bias is the same for each exchange, so the
        bias of the best fit is tried for all.
    Returns the fits by their index in EXCHANGES.
    """
    fits: dict[int, TurningFit] = {}

    def fit(k: int, bias: Array) -> None:
        found = turning.fit(EXCHANGES[k], bias)
        fits[k] = min(fits.get(k, found), found, key=lambda each: each.cost)

    def fit_best(biases: list[Array], tried: int) -> None:
        rough = np.column_stack([turning.rough(EXCHANGES, bias) for bias in biases])
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
    """True if another exchange explains the forces clearly better than the log's own axes."""
    own, least = float(np.mean(fits[0].left)), min(float(np.mean(fit.left)) for fit in fits.values())
    few = len(fits[0].left) <= FEW_WINDOWS
    clearly, least_g2 = (FEW_CLEARLY, FEW_LEAST_G2) if few else (CLEARLY, LEAST_G2)
    return own > clearly * least and own - least > least_g2


def likeliest(fits: dict[int, TurningFit]) -> int | None:
    """Return the index in EXCHANGES of the exchange that is right; None if several may be right."""
    scores = {k: float(np.mean(fit.left)) * _penalty(EXCHANGES[k]) for k, fit in fits.items()}
    best, second = sorted(scores, key=lambda k: scores[k])[:2]
    named = NAMED if len(fits[0].left) > FEW_WINDOWS else FEW_NAMED
    return best if scores[second] > named * scores[best] else None


def _penalty(exchange: Array) -> float:
    if np.array_equal(np.abs(exchange), np.eye(3)):
        return PENALTY[0] if abs(np.trace(exchange)) == 3.0 else PENALTY[1]
    return PENALTY[1] if np.array_equal(exchange, exchange.T) and np.min(exchange) == 0.0 else PENALTY[2]
