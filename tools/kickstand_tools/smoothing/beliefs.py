"""What may change in the course of a ride beside the motion, and which of that the readings speak for.

On its straights a bike seems to lean when its mount has yielded, and when something pushes it to the side for minutes,
such as wind. Each of these, alone or together, is a way to see the ride. They count by how
likely the readings are in each way and by how usual it is. Where the readings do not tell two ways apart, the result
lies between both, and its standard deviation is as large as the difference.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array
from . import parameters as of
from .parameters import BESIDE, ROTATION
from .solver import Beliefs, unlikelihood

ROLL = ROTATION.stop - 1
# Standard deviations. The mount's are those of its turning within a block of 10 s.
FIRM, YIELDING = np.radians([0.05, 0.11])  # rad
CALM_G, WIND_G, STORM_G = np.radians([0.03, 0.6, 1.8])  # g: force to the side that lasts for minutes
PUSHED_S = 120.0  # for how long
BLOCK_S = 10.0
# How unusual something is: twice the logarithm of how often a ride is without it. A light wind that lasts is usual, but
# a mount that yields looks the same, and is further from the truth if it is taken for wind.
YIELDS, WINDY, STORMY = 1.0, 8.0, 5.0
WEIGHT = 0.25  # of the likelihood: errors that no model has last, so that the readings tell less than they seem to
LEAST_SHARE = 0.02  # a way that is less likely does not count


@dataclass
class Ways:
    """G ways to see a ride.

    turning, rolling (G, rad): by which a mount turns within a block about left and up, and about forward. pushed (G):
    g, to the side. unusual (G): see above.
    """

    turning: Array
    rolling: Array
    pushed: Array
    unusual: Array

    def part(self, which: NDArray[np.intp]) -> "Ways":
        """Those of these numbers."""
        return Ways(*(values[which] for values in vars(self).values()))


def _all_ways() -> Ways:
    mounts = ((FIRM, FIRM, 0.0), (FIRM, YIELDING, YIELDS), (YIELDING, YIELDING, YIELDS))
    pushes = ((CALM_G, 0.0), (WIND_G, WINDY), (STORM_G, STORMY))
    rows = [
        (turning, rolling, pushed, yields + windy) for turning, rolling, yields in mounts for pushed, windy in pushes
    ]
    return Ways(*np.array(rows).T)


ALL = _all_ways()
USUAL = ALL.part(np.array([0]))


@dataclass
class Judged:
    """The ways that count, and their shares (G), whose sum is 1."""

    ways: Ways
    share: Array


UNJUDGED = Judged(USUAL, np.ones(1))


def judged(left: Array, s: int, parameters: Array, before: Array, unbalance: float) -> Judged:
    """left, s: of solver.eliminate(). parameters (B, m): about which the equations are linear. before (m): standard
    deviations of the parameters before the ride. unbalance: of Circumstances; errors that are so much larger than usual
    let the readings tell less."""
    unlikely = unlikelihood(left, s, beliefs(ALL, parameters, before)) * WEIGHT / max(1.0, unbalance) ** 2
    unlikely += ALL.unusual
    share = np.exp(-0.5 * (unlikely - np.min(unlikely)))
    counted = np.flatnonzero(share > LEAST_SHARE * np.sum(share))
    return Judged(ALL.part(counted), share[counted] / np.sum(share[counted]))


def beliefs(ways: Ways, parameters: Array, before: Array) -> Beliefs:
    """The ways as the solver takes them. See judged()."""
    count, blocks = len(ways.unusual), len(parameters)
    sigma = np.tile(before, (count, 1))
    sigma[:, BESIDE] = np.hypot(sigma[:, BESIDE], ways.pushed)
    known = np.stack([of.known(one) for one in sigma])
    drift = (of.DRIFT * sigma) ** 2
    drift[:, ROTATION] = ways.turning[:, None] ** 2
    drift[:, ROLL] = ways.rolling**2
    drift[:, BESIDE] = ways.pushed**2 * 2.0 * BLOCK_S / PUSHED_S
    drift = np.repeat(drift[:, None], max(0, blocks - 1), axis=1)
    pull = known @ (parameters[0] - of.USUAL)
    return Beliefs(np.concatenate((known, pull[:, :, None]), axis=2), drift, np.diff(parameters, axis=0))
