"""Replaces random numbers by fixed ones, so that simulations have known results."""

import itertools
from typing import Any

import numpy as np


class Fixed(np.random.Generator):
    """Returns fixed numbers from a range or a distribution. Other random numbers are those of seed 1.

    share: 0 for the lower end of a range, 1 for the upper end.
    choices: the results of random(). The last result is repeated.
    sigmas: number of standard deviations above the mean, for normal distributions.
    """

    def __init__(self, share=0.0, *choices, sigmas=0.0):
        super().__init__(np.random.PCG64(1))
        self._share, self._sigmas = share, sigmas
        self._choices = itertools.chain(choices, itertools.repeat(choices[-1] if choices else 0.0))

    def uniform(self, low: Any = 0.0, high: Any = 1.0, size: Any = None) -> Any:
        value = low + self._share * (high - low)
        return value if size is None else np.full(size, value)

    def random(self, *_: Any, **__: Any) -> Any:
        return next(self._choices)

    def normal(self, loc: Any = 0.0, scale: Any = 1.0, size: Any = None) -> Any:
        value = loc + self._sigmas * scale
        return value if size is None else np.full(size, value)
