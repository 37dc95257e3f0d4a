"""Do the angular rates of a log belong to its accelerations? What turns the sensor turns the direction of gravity.

At rest the axis that points up reads +1 g; the axes are right-handed, and so are the rates about them. Then gravity's
direction u turns in the sensor's axes as du/dt = -rate x u. Left-handed axes, a gyro of the opposite sign, and axes
exchanged or reversed in one sensor alone break that. Left-handed axes in both sensors look like a gyro of the opposite
sign, because a rate is an axial vector. Accelerations of the opposite sign are the mirror image of another ride: no
motion shows them.

A ride's force is hardly gravity's alone: in a balanced bend it keeps its direction along the bike. Therefore each
window is judged as a whole (see turning.py), and of the 48 signed permutations of the gyro's axes, the hypotheses, the
one is looked for that explains the forces best.
"""

import itertools

import numpy as np
from kickstand.errors import Notice
from numpy.typing import NDArray

from ..signals import Array
from ..signals.cells import stretches
from .bends import calm_rates
from .cells import CELL_S, LogCells
from .turning import Turning

WINDOW_S, SHORT_WINDOW_S = 20.0, 10.0  # the second one where the log has none of the first
MOST_WINDOWS = 16  # judged: those in which the sensor turns most
CALM_DPS = 2.0  # rates change so little in calm seconds
KNOWN_DPS = 3.0  # a bias that is wrong by less is found while fitting
TRIED = 6  # of the 48 exchanges are looked at closely

# By how much an exchange has to explain the forces better than the log as it is: the mean square (g2) of what is
# unexplained. Right logs, simulated and recorded, stay under 1.1 times; a gyro of the opposite sign gives 1.7 to 470.
CLEARLY, LIKELY, SIGMAS = 2.0, 1.25, 3.0  # so many times; or so many, if the windows agree by so many sigmas
FEW_WINDOWS, FEW_CLEARLY = 3, 5.0  # with so few windows, so many times, and a bias near 0, as a phone's is
LEAST_G2 = 0.001  # at least: a parked vehicle's drift is under 0.0002
# Of exchanges that explain about as well, times what is left: all axes reversed, some reversed, others
PENALTY = 1.0, 1.3, 1.6


def _exchanges() -> Array:
    """(48, 3, 3) signed permutations: first none changed, then all reversed."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            found.append(np.eye(3)[list(order)] * np.array(signs)[:, None])
    return np.array(sorted(found, key=lambda exchange: -abs(np.trace(exchange)) - 0.5 * (np.trace(exchange) == 3.0)))


EXCHANGES = _exchanges()  # rate = exchange @ reading of the gyro; the first one: as it is


def handedness(cells: LogCells) -> Notice | None:
    """What is wrong with the axes; None if nothing is, or if the log does not show it."""
    turning = liveliest(cells)
    found = None if turning is None else better_exchange(turning)
    if found is None:
        return None
    exchange = EXCHANGES[found]
    reversed_all = np.array_equal(exchange, -np.eye(3))
    return Notice("left-handed") if reversed_all else Notice("rates-misfit", *exchange.astype(int).tolist())


def better_exchange(turning: Turning) -> int | None:
    """The place in EXCHANGES of one that is clearly better than the first, None if there is none."""
    near = np.argsort(turning.rough(EXCHANGES))[:TRIED]
    # always as it is, and the likeliest mistake
    places = {0, 1, *(int(k) for k in near)}
    left = {k: turning.unexplained(EXCHANGES[k]) for k in places}
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
    """The windows in which the log turns most; None if there is none, or if the gyro's bias is not known."""
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


def _windows(known: NDArray[np.bool_], seconds: float) -> NDArray[np.int64]:
    """(windows, cells): places of known cells, one after the other."""
    length = round(seconds / CELL_S)
    starts = [k for begin, end in stretches(known) for k in range(begin, end - length + 1, length)]
    return np.array(starts, dtype=int).reshape(-1, 1) + np.arange(length)


def _bias(cells: LogCells) -> Array | None:
    """(3) deg/s: the gyro's mean reading in the calmest seconds, which are straight as a rule. Where these differ, 0 if
    that can be, as of a phone, which knows its bias; else None."""
    seconds = _windows(cells.known, 1.0)
    if not len(seconds):
        return None
    rates = cells.rate[seconds]
    calmest = calm_rates(cells.force[seconds], rates, CALM_DPS)
    bias = np.median(calmest, axis=0)
    if np.median(np.linalg.norm(calmest - bias, axis=1)) < KNOWN_DPS:
        return bias
    return np.zeros(3) if np.max(np.abs(np.mean(rates, axis=(0, 1)))) < KNOWN_DPS else None


def _penalty(exchange: Array) -> float:
    if np.array_equal(np.abs(exchange), np.eye(3)):
        return PENALTY[0] if np.trace(exchange) in (3.0, -3.0) else PENALTY[1]
    return PENALTY[2]
