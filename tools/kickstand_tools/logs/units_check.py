"""Units that are easily taken for a log's own, told by its beginning."""

import numpy as np

from ..errors import InputError
from .block import Block

LEAST_G = 0.3  # median force; less is usual where gravity was taken off, a ride's is over 0.9


def check_units(name: str, block: Block) -> None:
    """Raise InputError for accelerations without gravity or in m/s2, and for times in ms. block: the log's first."""
    usual_g = np.median(np.linalg.norm(block.readings[:, :3], axis=1))
    if usual_g < LEAST_G:
        raise InputError(
            f"{name}: accelerations are usually {usual_g:.2f} g, not 1 g: was gravity taken off? It has to be in them"
        )
    if 5.0 < usual_g < 20.0:
        raise InputError(f"{name}: accelerations look like m/s2: divide them by 9.80665, their unit is g")
    time_us = block.time_us
    if len(time_us) > 1 and (time_us[-1] - time_us[0]) / (len(time_us) - 1) >= 4e6:
        raise InputError(f"{name}: seconds between samples: is t_s in milliseconds?")
