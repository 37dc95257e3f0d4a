"""Checks that the angular rates of a log fit its accelerations.

If the sensor turns, gravity turns in the sensor's axes. In a correct log, the axis that points up reads +1 g at rest,
and axes and rates are right-handed. The direction u of gravity then turns in the sensor's axes by du/dt = -rate x u.

This equation shows left-handed axes, a gyro of the opposite sign, and axes exchanged or reversed in only one of the
sensors. Left-handed axes in both sensors look like a gyro of the opposite sign, because a rate is an axial vector. A
log in which all accelerations have the opposite sign is the mirror image of another ride, so the motion cannot show
this mistake.

The force in a ride is hardly ever gravity alone: in a balanced bend it keeps its direction along the bike. Therefore
each window is judged as a whole (see turning.py). The hypotheses are the 48 signed permutations of the gyro's axes,
called exchanges in this module. The best exchange is reported if it explains the forces clearly better than the log's
own axes.
"""

import itertools

import numpy as np
from kickstand.units import AXES

from ..common.messages import Message, WrongAxes
from ..signals import Array, Bools, Ints, stretches
from .bends import KNOWN_DPS, LeftHanded, calm_bias, calm_rates
from .cells import CELL_S, LogCells
from .turning import Turning

WINDOW_S, SHORT_WINDOW_S = 20.0, 10.0  # short windows are used if the log has no long window without a gap
MOST_WINDOWS = 16  # number of windows that are judged: the windows with the largest rates
CALM_DPS = 2.0  # value of calm_rate for calm_rates(), in deg/s
TRIED = 6  # number of exchanges whose velocity and bias are fitted; chosen by their residual before the fit

# An exchange must reduce the mean square of the residual force (g2) by this factor. In correct logs, simulated and
# recorded, the factor is at most 1.1 for every exchange. If the gyro has the opposite sign, the factor is 1.7 to 470.
CLEARLY = 2.0
# The factor LIKELY is enough if the mean reduction in the windows is over SIGMAS standard errors.
LIKELY, SIGMAS = 1.25, 3.0
# With at most FEW_WINDOWS windows, the factor must be FEW_CLEARLY, and the gyro's bias must be near 0, as in a phone.
FEW_WINDOWS, FEW_CLEARLY = 3, 5.0
# Least reduction of the mean square, for any factor. In a parked vehicle, drift reduces it by under 0.0002.
LEAST_G2 = 0.001
# Factors on the residual of an exchange. If several exchanges fit about equally well, the likeliest mistake is chosen.
# All axes reversed (or none) are more likely than some axes reversed, and these are more likely than exchanged axes.
PENALTY = 1.0, 1.3, 1.6


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


def handedness(cells: LogCells) -> Message | None:
    """Return a notice that says what is wrong with the axes.

    Returns None if the axes seem right, or if the log is not enough to judge them.
    """
    turning = liveliest(cells)
    found = None if turning is None else better_exchange(turning)
    if found is None:
        return None
    exchange = EXCHANGES[found]
    reversed_all = np.array_equal(exchange, -np.eye(3))
    return LeftHanded() if reversed_all else RatesMisfit(*map(tuple, exchange.astype(int).tolist()))


def better_exchange(turning: Turning) -> int | None:
    """Return the index in EXCHANGES of an exchange that fits clearly better than the identity; None without one."""
    near = np.argsort(turning.rough(EXCHANGES))[:TRIED]
    # Always fit the identity, and all axes reversed, which is the likeliest mistake.
    places = sorted({0, 1, *(int(k) for k in near)})
    left = dict(zip(places, turning.unexplained(EXCHANGES[places])))
    best = min(left, key=lambda k: float(np.mean(left[k])) * _penalty(EXCHANGES[k]))
    least = min(left.values(), key=np.mean)
    gain = left[0] - least
    times, more = float(np.mean(left[0])) / max(float(np.mean(least)), 1e-12), float(np.mean(gain))
    if more < LEAST_G2 or best == 0:
        return None
    if len(gain) <= FEW_WINDOWS:
        return best if times > FEW_CLEARLY and turning.unbiased else None
    agree = more > SIGMAS * float(np.std(gain)) / np.sqrt(len(gain))
    return best if times > CLEARLY or (times > LIKELY and agree) else None


def liveliest(cells: LogCells) -> Turning | None:
    """Return the windows of the log with the largest rates; None without a window, or if the gyro's bias is unknown."""
    places = _windows(cells.known, WINDOW_S)
    places = places if len(places) else _windows(cells.known, SHORT_WINDOW_S)
    bias = _bias(cells)
    if not len(places) or bias is None:
        return None
    turned = np.sum((cells.rate[places] - bias) ** 2, axis=(1, 2))
    places = places[np.sort(np.argsort(-turned)[:MOST_WINDOWS])]
    time_s, mps = cells.speeds.T
    changes = len(mps) > 1 and np.ptp(mps) > 1.0
    speed = np.column_stack(((time_s - cells.first_s) / CELL_S - 0.5, mps)) if changes else None
    return Turning(cells.force[places], cells.rate[places], bias, speed, places)


def _windows(known: Bools, seconds: float) -> Ints:
    """Find the windows of this many seconds without an unknown cell.

    Returns the indices of the cells of each window, shape (windows, cells).
    """
    length = round(seconds / CELL_S)
    starts = [k for begin, end in stretches(known) for k in range(begin, end - length + 1, length)]
    return np.array(starts, dtype=int).reshape(-1, 1) + np.arange(length)


def _bias(cells: LogCells) -> Array | None:
    """Return the gyro's bias, shape (3), in deg/s; None if it is unknown.

    The bias is the median of the gyro's readings in the calmest seconds, in which the bike mostly rides straight. If
    their rates differ too much, the bias is 0, because a phone subtracts its bias. If the log's mean rate is too large
    for a bias of 0, the bias is unknown.
    """
    seconds = _windows(cells.known, 1.0)
    if not len(seconds):
        return None
    rates = cells.rate[seconds]
    bias = calm_bias(calm_rates(cells.force[seconds], rates, CALM_DPS))
    if bias is not None:
        return bias
    return np.zeros(3) if np.max(np.abs(np.mean(rates, axis=(0, 1)))) < KNOWN_DPS else None


def _penalty(exchange: Array) -> float:
    if np.array_equal(np.abs(exchange), np.eye(3)):
        return PENALTY[0] if np.trace(exchange) in (3.0, -3.0) else PENALTY[1]
    return PENALTY[2]
