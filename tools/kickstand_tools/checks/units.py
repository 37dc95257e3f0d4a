"""Are a log's values in the units that they should be in? What is easily taken for them shows in its beginning.

Whether the speed is in m/s shows later: its changes are compared with the specific force that caused them. From one
second to the next a speed changes by the acceleration along the vehicle. How the sensor is mounted does not matter: the
direction along the vehicle is the one in which force and change of speed correlate best. Turns, slopes of the road and
a rider who moves about add to the force alone: they can make the speed seem to change too little, never too much.
"""

import numpy as np
from kickstand.drive_alignment.speed_check import speed_unit_problem
from kickstand.errors import Refusal
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..errors import InputError
from ..signals import Array
from ..signals.lag import best_lag
from .cells import LogCells

LEAST_G = 0.3  # median force; less is usual where gravity was taken off, a ride's is over 0.9
MOST = 1.5  # times the change that the force explains: knots give 1.94, recorded speeds in m/s never over 1.1
PUSH_G = 0.15  # a stronger force is no slope of an ordinary road
ENOUGH = 10  # seconds of such forces: two or three braking events
SIGMAS = 5.0  # by which the correlation of force and change of speed has to be more than chance
LAGS_S = np.arange(0.0, 2.1, 0.25)  # by which a satellite receiver's speed may be late
SHORTEST_S, LONGEST_S = 0.5, 2.2  # between two speeds


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


def speed_unit(cells: LogCells) -> Refusal | None:
    """That the speed changes too much at most of the strong forces; None if not, or if the log cannot show it."""
    time_s, mps = cells.speeds.T
    seconds = np.diff(time_s)
    good = (seconds > SHORTEST_S) & (seconds < LONGEST_S)
    for lag_s in LAGS_S:
        good &= np.diff(cells.integrals(time_s - lag_s)[:, 6]) > 0.9 * seconds
    if np.count_nonzero(good) < SIGMAS * SIGMAS:
        return None
    change = np.diff(mps)[good] / (STANDARD_GRAVITY * seconds[good])

    def earlier(by_s: float) -> tuple[Array, Array]:
        return change, np.diff(cells.integrals(time_s - by_s)[:, :3], axis=0)[good] / seconds[good, None]

    best = best_lag(LAGS_S, earlier)
    if best is None or best.value * np.sqrt(len(change)) < SIGMAS:
        return None
    push = earlier(best.lag_s)[1] @ best.direction
    push, change = push - np.mean(push), change - np.mean(change)
    strong = np.abs(push) > PUSH_G
    if np.count_nonzero(strong) < ENOUGH or np.median(change[strong] / push[strong]) <= MOST:
        return None
    return speed_unit_problem(float(change @ push / (change @ change)))  # as the board's own regression has it
