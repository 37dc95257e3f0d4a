"""Hypotheses about how the parameters change during a ride (their random walk), and their posterior weights.

On straights, a bike seems to lean if the sensor's mount has yielded, or if wind pushes the bike to the side for
minutes. A hypothesis combines a mount with a strength of the wind. Its posterior weight follows from its prior
probability and from the likelihood of the readings. If the readings do not distinguish two hypotheses, the result is
between the results of the two hypotheses. The standard deviation of the result then grows with the difference between
them.
"""

from dataclasses import dataclass

import numpy as np

from ..signals import Array, Ints
from .solver import RandomWalks, Reduced, minus_two_log_likelihood
from .unknowns import BESIDE, OFFSET, PARAMETERS, ROTATION, Prior

ROLL = ROTATION.stop - 1
BLOCK_S = 10.0  # duration of a block of windows; the random walk makes one step per block
# Standard deviations of the process noise
FIRM, YIELDING = np.radians([0.05, 0.11])  # rotation of the mount from block to block, in rad
CALM_G, WIND_G, STORM_G = 0.00052, 0.01047, 0.03142  # force to the side, which lasts for PUSHED_S
PUSHED_S = 120.0
# The other parameters change from block to block too, because a sensor warms up. Each change is a share of the standard
# deviation of the parameter's prior.
DRIFT = np.full(PARAMETERS, 1e-4)
DRIFT[OFFSET] = 0.15, 0.05, 0.05
# Additional change of OFFSET per block, in g. After its six positions, a sensor may warm up and change by 0.03 g within
# minutes.
DRIFT_G = 0.0015
# Minus twice the logarithm of the prior probability. A light lasting wind is common, but its readings look like those
# of a yielding mount. Mistaking a yielding mount for wind costs more than the reverse, so the prior of wind is low.
YIELDS, WINDY, STORMY = 1.0, 8.0, 5.0
WEIGHT = 0.25  # exponent of the likelihood; it is under 1 because neighbouring readings share errors
LEAST_SHARE = 0.02  # least posterior weight of a hypothesis that is kept


@dataclass
class Hypotheses:
    """G hypotheses. Each field has the shape (G).

    turning: process noise per block of the mount's rotation about left and up, in rad.
    rolling: process noise per block of the mount's rotation about forward, in rad.
    pushed: standard deviation of the lasting force to the side, in g.
    minus_two_log_prior: minus twice the logarithm of the prior probability.
    weight: posterior weights, whose sum is 1.
    """

    turning: Array
    rolling: Array
    pushed: Array
    minus_two_log_prior: Array
    weight: Array

    def select(self, index: Ints, weight: Array) -> "Hypotheses":
        """Return k of the hypotheses, with new posterior weights.

        index: indices of the hypotheses, shape (k). weight: their posterior weights, shape (k).
        """
        return Hypotheses(
            self.turning[index], self.rolling[index], self.pushed[index], self.minus_two_log_prior[index], weight
        )

    def first(self) -> "Hypotheses":
        """Return only the first hypothesis, with weight 1."""
        return self.select(np.zeros(1, dtype=np.intp), np.ones(1))

    def weighted(self, blocks: Reduced, prior: Prior, parameters: Array, unbalance: float) -> "Hypotheses":
        """Compute the posterior weights, and drop hypotheses of negligible weight.

        blocks: the normal equations of the windows.
        parameters: the values at which the equations were linearised, shape (B, PARAMETERS).
        unbalance: see Noise. A value over 1 reduces the weight of the likelihood.
        """
        minus_two_log = minus_two_log_likelihood(blocks, self.random_walks(prior, parameters))
        minus_two_log = minus_two_log * WEIGHT / max(1.0, unbalance) ** 2 + self.minus_two_log_prior
        weight = np.exp(-0.5 * (minus_two_log - np.min(minus_two_log)))
        likely = np.flatnonzero(weight > LEAST_SHARE * np.sum(weight))
        return self.select(likely, weight[likely] / np.sum(weight[likely]))

    def random_walks(self, prior: Prior, parameters: Array) -> RandomWalks:
        """Return the random walks of the estimated parameters, for the solver.

        They hold the prior of each hypothesis, the variances of the changes from block to block, and the current
        differences between blocks. parameters: see weighted().
        """
        unknown = prior.unknown
        sigma = np.tile(prior.sigma, (len(self.weight), 1))
        sigma[:, BESIDE] = np.hypot(sigma[:, BESIDE], self.pushed)
        information = np.stack([prior.information(deviations) for deviations in sigma])
        pull = information @ (parameters[0] - prior.mean)[unknown]
        variance = (DRIFT * sigma) ** 2
        variance[:, OFFSET] += DRIFT_G**2
        variance[:, ROTATION] = self.turning[:, None] ** 2
        variance[:, ROLL] = self.rolling**2
        variance[:, BESIDE] = self.pushed**2 * 2.0 * BLOCK_S / PUSHED_S
        steps = np.repeat(variance[:, None, unknown], len(parameters) - 1, axis=1)
        equations = np.concatenate((information, pull[..., None]), axis=2)
        return RandomWalks(equations, steps, np.diff(parameters[:, unknown], axis=0))


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
