"""The calmest seconds of a log: what the gyro reads there is about its bias, since they are straight as a rule."""

import numpy as np

from ..table import Array

CALMEST, LEAST = 0.2, 3  # of the seconds, and at least so many
CALM_G = 0.02  # force changes so little there


def calm_rates(force: Array, rate: Array, calm_rate: float) -> Array:
    """(k, 3) mean rates of the calmest of m seconds. force, rate (m, cells, 3). calm_rate: what counts in the rates'
    changes as much as CALM_G in the force's."""
    changes = np.sum(np.std(force, axis=1), axis=1) / CALM_G + np.sum(np.std(rate, axis=1), axis=1) / calm_rate
    return np.mean(rate, axis=1)[np.argsort(changes)[: max(LEAST, round(CALMEST * len(changes)))]]
