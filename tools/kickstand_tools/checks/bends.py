"""Are the angular rates of a log in deg/s, and of the right sign? The bends of a motorcycle ride show it.

Leaned, a turning bike also turns about its own left, by its yaw rate times the sine of its lean. All of these come from
the rates. Where they are in rad/s, which is 57 times too small, the product is 57 x 57 times too small, but the rate
about left only 57 times. Where all rates are of the opposite sign, or all axes left-handed, the product keeps its sign
and the rate about left has the opposite one. A car does not lean and a parked vehicle does not turn: they are never
judged.
"""

import numpy as np
from kickstand.errors import Notice

from ..signals import Array
from ..signals.leaning import LIKENESS, WINDOW_S, leaning_of, leans, speed_in_radians, unrest
from .cells import CELL_S, LogCells

KEPT_S, RIDING_S = 1800.0, 15.0  # the last half hour is judged; less riding shows nothing
MOVES_S, MOVES = 1.6, 0.1  # within so long a ride changes the rates by over so much of their liveliest changes
AGAINST, SURE = -0.5, 5.0  # share and sigmas of rates that are of the opposite sign; it is -1.6 to -1.0 then
CALMEST, LEAST, CALM_G = 0.2, 3, 0.02  # of the seconds, and at least so many; force changes so little in them


def bends(cells: LogCells) -> Notice | None:
    """That the rates look like rad/s or of the opposite sign; None if not, or if the log does not show it."""
    force, rate, _ = cells.means(round(WINDOW_S / CELL_S))
    there = np.flatnonzero(~np.isnan(force[:, 0]))[-round(KEPT_S / WINDOW_S) :]
    force, rate = force[there], np.radians(rate[there])
    if len(rate) * WINDOW_S < RIDING_S:
        return None
    changes = unrest(rate, MOVES_S)
    moves = MOVES * np.percentile(changes, 95)  # whatever the unit is
    if np.count_nonzero(changes > moves) * WINDOW_S < RIDING_S:
        return None
    whole = len(rate) // 5 * 5  # seconds
    calm = calm_rates(force[:whole].reshape(-1, 5, 3), rate[:whole].reshape(-1, 5, 3), moves)
    rate -= np.median(calm, axis=0)
    found = leaning_of(rate, force, changes > moves)
    speed = speed_in_radians(found)
    if speed is not None:
        return Notice("rates-in-radians", speed)
    against = found.share < AGAINST and found.sigmas > SURE and found.likeness > LIKENESS
    return Notice("left-handed") if against and leans(found) else None


def calm_rates(force: Array, rate: Array, calm_rate: float) -> Array:
    """(k, 3) mean rates of the calmest of m seconds, which are straight as a rule: about the gyro's bias. force, rate
    (m, cells, 3). calm_rate: what counts in the rates' changes as much as CALM_G in the force's."""
    changes = np.sum(np.std(force, axis=1), axis=1) / CALM_G + np.sum(np.std(rate, axis=1), axis=1) / calm_rate
    return np.mean(rate, axis=1)[np.argsort(changes)[: max(LEAST, round(CALMEST * len(changes)))]]
