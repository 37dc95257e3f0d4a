"""Replaces random numbers by fixed ones, so that simulations have known results."""

import itertools

import numpy as np


class Fixed(np.random.Generator):
    """Returns fixed numbers from a range or a distribution. Other random numbers are those of seed 1.

    share: 0 for the lower end of a range, 1 for the upper end.
    choices: the results of random(). The last is repeated.
    sigmas: number of standard deviations above the mean, for normal distributions.
    """

    def __init__(self, share=0.0, *choices, sigmas=0.0):
        super().__init__(np.random.PCG64(1))
        self._share, self._sigmas = share, sigmas
        self._choices = itertools.chain(choices, itertools.repeat(choices[-1] if choices else 0.0))

    def uniform(self, low=0.0, high=1.0, size=None):
        value = low + self._share * (high - low)
        return value if size is None else np.full(size, value)

    def random(self, *_, **__):
        return next(self._choices)

    def normal(self, loc=0.0, scale=1.0, size=None):
        value = loc + self._sigmas * scale
        return value if size is None else np.full(size, value)
