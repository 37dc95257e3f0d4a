"""Checks in the bends of a motorcycle ride that the angular rates of a log are in deg/s.

In a bend, the rate of a leaning bike about its own left axis is the yaw rate times the sine of the lean. The log's
rates give the rate about left, the yaw rate and the lean. Rates in rad/s are 57 times too small. The product is then
57 x 57 times too small, but the rate about left only 57 times.

Logs of a parked vehicle are never judged. Logs of a car are never judged either, because a car does not lean.
"""

import numpy as np

from ..common.messages import AT_REST, Message, Remedy, WrongAxes
from ..signals import Array
from ..signals.leaning import WINDOW_S, leaning_of, speed_in_radians, unrest
from .cells import CELL_S, LogCells

KEPT_S, RIDING_S = 1800.0, 15.0  # the last KEPT_S are judged if they have RIDING_S of riding
# The bike is riding if the standard deviation of its rates over MOVES_S is over MOVES times its 95th percentile.
MOVES_S, MOVES = 1.6, 0.1
# The calmest seconds are the share CALMEST of all seconds, but at least LEAST seconds. In calm_rates(), the standard
# deviation CALM_G of the force counts as much as the standard deviation calm_rate of the rates.
CALMEST, LEAST, CALM_G = 0.2, 3, 0.02
# The gyro's bias is known if the share AGREE of the calmest seconds is within KNOWN_DPS. Otherwise the FEW calmest
# seconds are tried. In a ride that is mostly one long, steady bend, these few seconds are a standstill.
AGREE, FEW, KNOWN_DPS = 0.8, 5, 3.0


class RatesInRadians(WrongAxes):
    """The rates seem to be in rad/s.

    speed_mps: the impossible speed in bends that these rates would mean in deg/s.
    """

    speed_mps: float

    code = "rates-in-radians"
    text = "in bends the rates are those of {speed_mps:.0f} m/s"
    todo = Remedy("are they in rad/s? deg/s are needed")


class LeftHanded(WrongAxes):
    """The rates have the opposite sign, or the axes are left-handed."""

    code = "left-handed"
    text = "the rates turn the force the wrong way, so the lean is wrong"
    todo = Remedy(
        "are the axes left-handed (reverse one in both sensors) or the gyro of the opposite sign (reverse all its "
        f"rates)? The wrong one of the two exchanges left and right: try a lean to a known side. {AT_REST.capitalize()}"
    )


def bends(cells: LogCells) -> Message | None:
    """Return a notice if the rates seem to be in rad/s.

    Returns None if the rates seem right, or if the log is not enough to judge them.
    """
    force, rate, _ = cells.means(round(WINDOW_S / CELL_S))
    there = np.flatnonzero(~np.isnan(force[:, 0]))[-round(KEPT_S / WINDOW_S) :]
    force, rate = force[there], np.radians(rate[there])
    if len(rate) * WINDOW_S < RIDING_S:
        return None
    changes = unrest(rate, MOVES_S)
    moves = MOVES * np.percentile(changes, 95)  # the limit is relative, because the unit of the rates is unknown
    if np.count_nonzero(changes > moves) * WINDOW_S < RIDING_S:
        return None
    whole = len(rate) // 5 * 5  # in whole seconds
    calm = calm_rates(force[:whole].reshape(-1, 5, 3), rate[:whole].reshape(-1, 5, 3), moves)
    bias = calm_bias(np.degrees(calm))
    if bias is None:
        return None
    rate -= np.radians(bias)
    speed = speed_in_radians(leaning_of(rate, force, changes > moves))
    return None if speed is None else RatesInRadians(speed)


def calm_bias(calm: Array) -> Array | None:
    """Return the gyro's bias, shape (3), in deg/s; None if the rates differ too much.

    calm: the result of calm_rates(), in deg/s.
    """
    for some in (calm, calm[:FEW]):
        bias = np.median(some, axis=0)
        if np.mean(np.linalg.norm(some - bias, axis=1) < KNOWN_DPS) > AGREE:
            return bias
    return None


def calm_rates(force: Array, rate: Array, calm_rate: float) -> Array:
    """Return the mean rates in the k calmest of m seconds, the calmest second first.

    force, rate: shape (m, cells, 3).
    calm_rate: the standard deviation of the rates that counts as much as a standard deviation CALM_G of the force.
    Returns an array of shape (k, 3).
    """
    changes = np.sum(np.std(force, axis=1), axis=1) / CALM_G + np.sum(np.std(rate, axis=1), axis=1) / calm_rate
    return np.mean(rate, axis=1)[np.argsort(changes)[: max(LEAST, round(CALMEST * len(changes)))]]
