"""Do the angular rates of a log belong to its accelerations? What turns the sensor turns the direction of gravity.

At rest the axis that points up reads +1 g; the axes are right-handed, and so are the rates about them. Then gravity's
direction u turns in the sensor's axes as du/dt = -rate x u. Left-handed axes, a gyro of the opposite sign, and axes
exchanged or reversed in one sensor alone break that. Left-handed axes in both sensors look like a gyro of the opposite
sign, because a rate is an axial vector. Accelerations of the opposite sign are the mirror image of another ride: no
motion tells them.

A ride's force is hardly gravity's alone: in a balanced bend it keeps its direction along the bike. Therefore each
window is judged as a whole (see turning.py), and of the 48 ways in which the gyro's axes can be exchanged and reversed
the one is looked for that explains the forces best.
"""

import itertools

import numpy as np
from kickstand.errors import Notice
from kickstand.units import AXES
from numpy.typing import NDArray

from ..table import Array
from ..time_cells import no_cells, with_block
from .calm import calm_rates
from .turning import CELL_S, Turning

WINDOW_S, SHORT_WINDOW_S = 20.0, 10.0  # the second one where the log has none of the first
MOST_WINDOWS = 16  # judged: those in which the sensor turns most
KEPT = 36_000  # cells: an hour
GAP_CELLS = 3  # without a sample, or with the same reading in each: nothing is known there
CALM_DPS = 2.0  # rates change so little in calm seconds
KNOWN_DPS = 3.0  # a bias that is wrong by less is found while fitting
TRIED = 6  # of the 48 ways are looked at closely

# By how much a way has to explain the forces better than the log as it is: the mean square (g2) of what is unexplained.
# Right logs, simulated and recorded, stay under 1.1 times; a gyro of the opposite sign gives 1.7 to 470.
CLEARLY, LIKELY, SIGMAS = 2.0, 1.25, 3.0  # so many times; or so many, if the windows agree by so many sigmas
FEW_WINDOWS, FEW_CLEARLY = 3, 5.0  # with so few windows, so many times, and a bias near 0, as a phone's is
LEAST_G2 = 0.001  # at least: a parked vehicle's drift is under 0.0002
UNLIKELY = 1.0, 1.3, 1.6  # of ways that explain about as well: all reversed, some reversed, others; times what is left


def _ways() -> Array:
    """(48, 3, 3) signed permutations: first none changed, then all reversed."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            found.append(np.eye(3)[list(order)] * np.array(signs)[:, None])
    return np.array(sorted(found, key=lambda way: -abs(np.trace(way)) - 0.5 * (np.trace(way) == 3.0)))


WAYS = _ways()  # rate = way @ reading of the gyro; the first one: as it is


class Handedness:
    """add() takes a log's samples block by block; notice() judges them."""

    def __init__(self) -> None:
        self._cells = no_cells()

    def add(self, time_s: Array, force: Array, rate: Array, speed_mps: Array) -> None:
        """force: (n, 3, g); rate: (n, 3, deg/s), in the sensor's axes; speed_mps: (n), NaN for none."""
        self._cells = with_block(self._cells, CELL_S, time_s, force, rate, speed_mps)[-KEPT:]

    def notice(self) -> Notice | None:
        """What is wrong with the axes; None if nothing is, or if the log does not tell."""
        found = self._best()
        return None if found is None else _told(WAYS[found])

    def _best(self) -> int | None:
        """The place in WAYS of one that is clearly better than the first, None if there is none."""
        turning = self._turning()
        if turning is None:
            return None
        near = np.argsort(turning.rough(WAYS))[:TRIED]
        # always the way it is, and the likeliest mistake
        places = {0, 1, *(int(k) for k in near)}
        left = {k: turning.unexplained(WAYS[k]) for k in places}
        best = min(left, key=lambda k: float(np.mean(left[k])) * _unlikely(WAYS[k]))
        least = min(left.values(), key=np.mean)
        gain = left[0] - least
        times, more = float(np.mean(left[0])) / max(float(np.mean(least)), 1e-12), float(np.mean(gain))
        if more < LEAST_G2 or best == 0:
            return None
        if len(gain) <= FEW_WINDOWS:
            return best if times > FEW_CLEARLY and turning.unbiased else None
        agree = more > SIGMAS * float(np.std(gain)) / np.sqrt(len(gain))
        return best if times > CLEARLY or (times > LIKELY and agree) else None

    def _turning(self) -> Turning | None:
        """The windows in which the log turns most; None if there is none, or if the gyro's bias is not known."""
        force, rate, known, speed = self._evenly()
        places = _whole(known, round(WINDOW_S / CELL_S))
        if not len(places):
            places = _whole(known, round(SHORT_WINDOW_S / CELL_S))
        bias = _bias(force, rate, known)
        if not len(places) or bias is None:
            return None
        turned = np.sum((rate[places] - bias) ** 2, axis=(1, 2))
        places = places[np.sort(np.argsort(-turned)[:MOST_WINDOWS])]
        return Turning(force[places], rate[places], bias, speed, places)

    def _evenly(self) -> tuple[Array, Array, NDArray[np.bool_], Array | None]:
        """Force, rate (n, 3 each), whether they are known and, where there is a speed that changes, its values (m, 2:
        cell and m/s), from the first cell to the last."""
        at = (self._cells[:, 0] - self._cells[:1, 0]).astype(int)
        if not len(at) or at[-1] > 100 * KEPT:
            return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool), None
        mean = self._cells[:, 1:7] / self._cells[:, 7:8]
        cells = np.arange(at[-1] + 1)
        even = np.column_stack([np.interp(cells, at, column) for column in mean.T])
        there = np.zeros(len(cells), dtype=bool)
        there[at] = np.any(np.diff(mean, axis=0, prepend=np.nan) != 0.0, axis=1)
        # a place is unknown in the middle of GAP_CELLS without news
        silent = np.convolve(~there, np.ones(GAP_CELLS), mode="same") >= GAP_CELLS
        told = ~np.isnan(self._cells[:, 8])
        speed = np.column_stack((at[told], self._cells[told, 8]))
        return even[:, :3], even[:, 3:], ~silent, speed if len(speed) > 1 and np.ptp(speed[:, 1]) > 1.0 else None


def _whole(known: NDArray[np.bool_], length: int) -> NDArray[np.int64]:
    """(windows, length): places of known cells, one after the other."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(int)))
    starts = [k for a, b in edges.reshape(-1, 2) for k in range(a, b - length + 1, length)]
    return np.array(starts, dtype=int).reshape(-1, 1) + np.arange(length)


def _bias(force: Array, rate: Array, known: NDArray[np.bool_]) -> Array | None:
    """(3) deg/s: the gyro's mean reading in the calmest seconds, which are straight as a rule. Where these differ, 0 if
    that can be, as of a phone, which knows its bias; else None."""
    n = round(1.0 / CELL_S)
    count = len(known) // n
    whole = np.all(known[: count * n].reshape(count, n), axis=1)
    if not np.any(whole):
        return None
    forces, rates = (values[: count * n].reshape(count, n, 3)[whole] for values in (force, rate))
    calmest = calm_rates(forces, rates, CALM_DPS)
    bias = np.median(calmest, axis=0)
    if np.median(np.linalg.norm(calmest - bias, axis=1)) < KNOWN_DPS:
        return bias
    return np.zeros(3) if np.max(np.abs(np.mean(rates, axis=(0, 1)))) < KNOWN_DPS else None


def _unlikely(way: Array) -> float:
    if np.array_equal(np.abs(way), np.eye(3)):
        return UNLIKELY[0] if np.trace(way) in (3.0, -3.0) else UNLIKELY[1]
    return UNLIKELY[2]


def _told(way: Array) -> Notice:
    """What is wrong, if the rates about x, y and z are way @ those of the log.

    A reversed axis of the accelerometer is the same as the two others reversed in the gyro, because accelerations of
    the opposite sign are as good as the right ones; likewise with two that are exchanged.
    """
    if np.array_equal(way, -np.eye(3)):
        return Notice("left-handed")
    columns = [("-" if np.min(row) < 0.0 else "") + "g" + AXES[int(np.argmax(np.abs(row)))] for row in way]
    kept = [AXES[k] for k in range(3) if way[k, k] == 1.0]
    off = [AXES[k] for k in range(3) if way[k, k] != 1.0]
    what = "are in another order or of another sign"
    if len(kept) == 2:
        what = f"are reversed about {off[0]}"
    elif np.all(np.diag(way) != 0.0):
        what = f"are reversed about {off[0]} and {off[1]}, or accelerations along {kept[0]}"
    elif len(kept) == 1 and np.all(way >= 0.0):
        what = f"about {off[0]} and {off[1]} are exchanged"
    elif np.all(way <= 0.0) and np.trace(way) != 0.0:
        one, other = (AXES[k] for k in range(3) if way[k, k] == 0.0)
        what = f"fit if the accelerations along {one} and {other} are exchanged"
    return Notice("rates-misfit", what, ", ".join(columns))
