"""What may change in the course of a ride beside the motion, and which of that the readings speak for.

On its straights a bike seems to lean when its mount has yielded, slowly or at one moment, and when something pushes it
to the side for minutes, such as wind. Each of these, alone or together, is a way to see the ride. They count by how
likely the readings are in each way and by how usual it is. Where the readings do not tell two ways apart, the result
lies between both, and its standard deviation is as large as the difference.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array
from . import parameters as of
from .parameters import BESIDE, ROTATION
from .solver import Beliefs, solve_chains, unlikelihood

ROLL = ROTATION.stop - 1
# Standard deviations. The mount's are those of its turning within a block of 10 s.
FIRM, YIELDING, LOOSE = np.radians([0.05, 0.11, 0.35])  # rad
SLIP = np.radians(1.0)  # rad: of its turning about forward at one moment
CALM_G, WIND_G, STORM_G = np.radians([0.04, 0.6, 1.8])  # g: force to the side that lasts for minutes
PUSHED_S = 120.0  # for how long
BLOCK_S = 10.0
# How unusual something is: twice the logarithm of how often a ride is without it. A light wind that lasts is usual, but
# a mount that yields looks the same, and is further from the truth if it is taken for wind.
YIELDS, SLIPS, WINDY, STORMY = 1.0, 6.0, 8.0, 5.0
PLACES = 6  # so many blocks are tried, in which the mount may have slipped
WEIGHT = 0.25  # of the likelihood: errors that no model has last, so that the readings tell less than they seem to
LEAST_SHARE = 0.02  # a way that is less likely does not count


@dataclass
class Ways:
    """G ways to see a ride.

    turning, rolling (G, rad): by which a mount turns within a block about left and up, and about forward. pushed (G):
    g, to the side. slips (G): 1 where the mount slips. unusual (G): see above.
    """

    turning: Array
    rolling: Array
    pushed: Array
    slips: Array
    unusual: Array

    def part(self, which: NDArray[np.intp]) -> "Ways":
        """Those of these numbers."""
        return Ways(*(values[which] for values in vars(self).values()))


def _all_ways() -> Ways:
    mounts = ((FIRM, FIRM, 0.0), (FIRM, YIELDING, YIELDS), (YIELDING, YIELDING, YIELDS))
    pushes = ((CALM_G, 0.0), (WIND_G, WINDY), (STORM_G, STORMY))
    slips = ((0.0, 0.0), (1.0, SLIPS))
    rows = [
        (turning, rolling, pushed, slip, yields + windy + slipped)
        for slip, slipped in slips
        for turning, rolling, yields in mounts
        for pushed, windy in pushes
    ]
    return Ways(*np.array(rows).T)


ALL = _all_ways()
USUAL = ALL.part(np.array([0]))
LOOSE_MOUNT = Ways(*np.array([[LOOSE], [LOOSE], [CALM_G], [0.0], [0.0]]))
SLIPPING = Ways(*np.array([[FIRM], [YIELDING], [CALM_G], [1.0], [SLIPS]]))


@dataclass
class Judged:
    """The ways that count, their shares (G), whose sum is 1, and the number of the block after which a mount slips."""

    ways: Ways
    share: Array
    place: int


UNJUDGED = Judged(USUAL, np.ones(1), 0)


def judged(left: Array, s: int, parameters: Array, before: Array, unbalance: float) -> Judged:
    """left, s: of solver.eliminate(). parameters (B, m): about which the equations are linear. before (m): standard
    deviations of the parameters before the ride. unbalance: of Circumstances; errors that are so much larger than usual
    let the readings tell less."""
    place = _slipped(left, s, parameters, before)
    unlikely = unlikelihood(left, s, beliefs(ALL, place, parameters, before)) * WEIGHT / max(1.0, unbalance) ** 2
    unlikely += ALL.unusual
    share = np.exp(-0.5 * (unlikely - np.min(unlikely)))
    counted = np.flatnonzero(share > LEAST_SHARE * np.sum(share))
    return Judged(ALL.part(counted), share[counted] / np.sum(share[counted]), place)


def _slipped(left: Array, s: int, parameters: Array, before: Array) -> int:
    """Number of the block after which the mount slips, if it does: of those after which it turns most if it is loose,
    the one that the readings speak for."""
    if len(parameters) < 2:
        return 0
    (loose,) = solve_chains(left, s, beliefs(LOOSE_MOUNT, 0, parameters, before))
    turned = np.diff(parameters + loose.parameters, axis=0)[:, ROLL]
    places = np.argsort(np.abs(turned))[-PLACES:]
    tried = SLIPPING.part(np.zeros(len(places), dtype=int))
    return int(places[np.argmin(unlikelihood(left, s, beliefs(tried, places, parameters, before)))])


def beliefs(ways: Ways, place: int | NDArray[np.intp], parameters: Array, before: Array) -> Beliefs:
    """The ways as the solver takes them. place: of Judged, for all ways or for each. See judged()."""
    count, blocks = len(ways.unusual), len(parameters)
    sigma = np.tile(before, (count, 1))
    sigma[:, BESIDE] = np.hypot(sigma[:, BESIDE], ways.pushed)
    known = np.stack([of.known(one) for one in sigma])
    drift = (of.DRIFT * sigma) ** 2
    drift[:, ROTATION] = ways.turning[:, None] ** 2
    drift[:, ROLL] = ways.rolling**2
    drift[:, BESIDE] = ways.pushed**2 * 2.0 * BLOCK_S / PUSHED_S
    drift = np.repeat(drift[:, None], max(0, blocks - 1), axis=1)
    if blocks > 1:
        drift[np.arange(count), place, ROLL] += (ways.slips * SLIP) ** 2
    pull = known @ (parameters[0] - of.USUAL)
    return Beliefs(np.concatenate((known, pull[:, :, None]), axis=2), drift, np.diff(parameters, axis=0))
