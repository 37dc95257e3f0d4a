"""Is the speed of a log in m/s? Its changes are compared with the specific force that caused them.

From one second to the next a speed changes by the acceleration along the vehicle. How the sensor is mounted does not
matter: the direction along the vehicle is the one in which force and change of speed correlate best. Turns, slopes of
the road and a rider who moves about add to the force alone: they can make the speed seem to change too little, never
too much.
"""

import numpy as np
from kickstand.drive_alignment.speed_check import speed_unit_problem
from kickstand.errors import Refusal
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array
from ..signals.lag import best_lag
from .cells import LogCells

MOST = 1.5  # largest change of speed over the one that the force explains: knots give 1.94, m/s never over 1.1
PUSH_G = 0.15  # strong forces: stronger ones than those by the slopes of ordinary roads
ENOUGH = 10  # least number of seconds with strong forces: two or three braking events
SIGMAS = 5.0  # least correlation of force and change of speed, over its standard deviation by chance
LAGS_S = np.arange(0.0, 2.1, 0.25)  # delays of a satellite receiver's speed that are tried
SHORTEST_S, LONGEST_S = 0.5, 2.2  # times between two speeds that are compared


def speed_unit(cells: LogCells) -> Refusal | None:
    """A refusal if the speed changes too much at most of the strong forces; None if not, or if the log cannot show
    it."""
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
