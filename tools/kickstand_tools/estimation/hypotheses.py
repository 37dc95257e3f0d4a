"""Hypotheses about how the parameters change during a ride (their random walk), and their posterior weights.

On straights, a bike seems to lean if the sensor's mount has yielded, or if wind pushes the bike to the side for
minutes. Each of these causes, and each combination, is a hypothesis. The posterior weight of a hypothesis follows from
its prior probability and from the likelihood of the readings. If the readings do not distinguish two hypotheses, the
result is between both, and the standard deviation of the result grows with their difference.
"""

from dataclasses import dataclass

import numpy as np

from ..signals import Array, Ints
from .solver import RandomWalks, Reduced, minus_two_log_likelihood
from .unknowns import BESIDE, OFFSET, PARAMETERS, ROTATION, Prior

ROLL = ROTATION.stop - 1
BLOCK_S = 10.0  # duration of a block of windows, which is one step of the random walk
# Process noise, 1 sigma
FIRM, YIELDING = np.radians([0.05, 0.11])  # rad: rotation of the mount from block to block
CALM_G, WIND_G, STORM_G = 0.00052, 0.01047, 0.03142  # force to the side that lasts for PUSHED_S
PUSHED_S = 120.0
# Change of the other parameters from block to block, as a share of their prior's standard deviation: a sensor warms up
DRIFT = np.full(PARAMETERS, 1e-4)
DRIFT[OFFSET] = 0.15, 0.05, 0.05
# g: additional change of OFFSET, for a sensor that warms up after its six positions, by 0.03 g in minutes
DRIFT_G = 0.0015
# Minus twice the logarithm of the prior probability. A light lasting wind is common, but its readings look like those
# of a yielding mount. Mistaking a yielding mount for wind costs more than the reverse, so the prior of wind is low.
YIELDS, WINDY, STORMY = 1.0, 8.0, 5.0
WEIGHT = 0.25  # exponent of the likelihood: readings are not independent, because errors outside the model last
LEAST_SHARE = 0.02  # a hypothesis with less posterior weight is left out


@dataclass
class Hypotheses:
    """G hypotheses.

    Process noise per block of the mount's rotation: turning (G, rad) about left and up, rolling (G, rad) about forward.
    pushed (G, g): standard deviation of the lasting force to the side. minus_two_log_prior (G): minus twice the
    logarithm of the prior probability. weight (G): posterior weights, whose sum is 1.
    """

    turning: Array
    rolling: Array
    pushed: Array
    minus_two_log_prior: Array
    weight: Array

    def select(self, index: Ints, weight: Array) -> "Hypotheses":
        """The hypotheses with these indices (k), with the posterior weights `weight` (k)."""
        return Hypotheses(
            self.turning[index], self.rolling[index], self.pushed[index], self.minus_two_log_prior[index], weight
        )

    def first(self) -> "Hypotheses":
        """Only the first hypothesis, with weight 1."""
        return self.select(np.zeros(1, dtype=np.intp), np.ones(1))

    def weighted(self, blocks: Reduced, prior: Prior, parameters: Array, unbalance: float) -> "Hypotheses":
        """Compute the posterior weights, and drop hypotheses of negligible weight.

        blocks: the windows' normal equations. parameters (B, PARAMETERS): the values at which the equations were
        linearised. unbalance: see Noise; a value over 1 reduces the weight of the likelihood.
        """
        minus_two_log = minus_two_log_likelihood(blocks, self.random_walks(prior, parameters))
        minus_two_log = minus_two_log * WEIGHT / max(1.0, unbalance) ** 2 + self.minus_two_log_prior
        weight = np.exp(-0.5 * (minus_two_log - np.min(minus_two_log)))
        kept = np.flatnonzero(weight > LEAST_SHARE * np.sum(weight))
        return self.select(kept, weight[kept] / np.sum(weight[kept]))

    def random_walks(self, prior: Prior, parameters: Array) -> RandomWalks:
        """The random walks of the estimated parameters, for the solver: the prior of each hypothesis, the variances of
        the change from block to block, and the current differences between blocks. parameters: see weighted()."""
        unknown = prior.unknown
        sigma = np.tile(prior.sigma, (len(self.weight), 1))
        sigma[:, BESIDE] = np.hypot(sigma[:, BESIDE], self.pushed)
        information = np.stack([prior.information(one) for one in sigma])
        pull = information @ (parameters[0] - prior.mean)[unknown]
        variance = (DRIFT * sigma) ** 2
        variance[:, OFFSET] += DRIFT_G**2
        variance[:, ROTATION] = self.turning[:, None] ** 2
        variance[:, ROLL] = self.rolling**2
        variance[:, BESIDE] = self.pushed**2 * 2.0 * BLOCK_S / PUSHED_S
        steps = np.repeat(variance[:, None, unknown], len(parameters) - 1, axis=1)
        return RandomWalks(
            np.concatenate((information, pull[..., None]), axis=2), steps, np.diff(parameters[:, unknown], axis=0)
        )


def _all_hypotheses() -> Hypotheses:
    mounts = (FIRM, FIRM, 0.0), (FIRM, YIELDING, YIELDS), (YIELDING, YIELDING, YIELDS)
    pushes = (CALM_G, 0.0), (WIND_G, WINDY), (STORM_G, STORMY)
    rows = [
        (turning, rolling, pushed, yields + windy, 1.0 / 9.0)
        for turning, rolling, yields in mounts
        for pushed, windy in pushes
    ]
    return Hypotheses(*np.array(rows).T)


ALL = _all_hypotheses()
