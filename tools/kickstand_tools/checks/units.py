"""Refuses logs whose first samples show that they are in other units than g and seconds."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..signals import Array

LEAST_G = 0.3  # least median force: a ride's is over 0.9, one without gravity has less


def check_units(name: str, time_us: NDArray[np.int64], accel_g: Array) -> None:
    """Raise InputError for accelerations without gravity or in m/s2, and for times in ms. time_us (n), accel_g (n, 3):
    of the first samples of the log."""
    usual_g = np.median(np.linalg.norm(accel_g, axis=1))
    if usual_g < LEAST_G:
        raise InputError(
            f"{name}: accelerations are usually {usual_g:.2f} g, not 1 g: was gravity taken off? It has to be in them"
        )
    if 5.0 < usual_g < 20.0:
        raise InputError(f"{name}: accelerations look like m/s2: divide them by 9.80665, their unit is g")
    if len(time_us) > 1 and (time_us[-1] - time_us[0]) / (len(time_us) - 1) >= 4e6:
        raise InputError(f"{name}: seconds between samples: is t_s in milliseconds?")
