"""Are the angular rates of a log in deg/s, and of the right sign? The bends of a motorcycle ride tell.

Leaned, a turning bike also turns about its own left, by its yaw rate times the sine of its lean. All of these come from
the rates. Where they are in rad/s, which is 57 times too small, the product is 57 x 57 times too small, but the rate
about left only 57 times. Where all rates are of the opposite sign, or all axes left-handed, the product keeps its sign
and the rate about left has the opposite one. A car does not lean and a parked vehicle does not turn: they are never
judged.
"""

import numpy as np
from kickstand.errors import Notice

from ...signals.leaning import WINDOW_S, Leaning, leaning_of, unrest
from ..table import Array
from ..time_cells import no_cells, with_block
from .calm import calm_rates

KEPT_S, RIDING_S = 1800.0, 15.0  # half an hour is judged; less riding tells nothing
MOVES_S, MOVES = 1.6, 0.1  # within so long a ride changes the rates by over so much of their liveliest changes
# Simulated rides and recordings in deg/s have a share of 1.0 to 1.6 and in rad/s of 57 to 92, of over 5 sigmas; cars
# have a likeness under 0.6.
SHARE, SIGMAS, LIKENESS = 15.0, 4.5, 0.65
AGAINST, SURE = -0.5, 5.0  # share and sigmas of rates that are of the opposite sign; it is -1.6 to -1.0 then
LEAST_LEAN = np.radians(2.0 / 57.3)  # rms: less is nearly straight


class Bends:
    """add() takes a log's samples block by block; notice() judges them."""

    def __init__(self) -> None:
        self._cells = no_cells()

    def add(self, time_s: Array, force: Array, rate: Array, speed_mps: Array) -> None:
        """force: (n, 3, g); rate: (n, 3, deg/s), in the sensor's axes; speed_mps: (n), NaN for none."""
        added = with_block(self._cells, WINDOW_S, time_s, force, rate, speed_mps)
        self._cells = added[-round(KEPT_S / WINDOW_S) :]

    def notice(self) -> Notice | None:
        """That the rates look like rad/s or of the opposite sign; None if not, or if the log does not tell."""
        force, rate = self._cells[:, 1:4] / self._cells[:, 7:8], np.radians(self._cells[:, 4:7] / self._cells[:, 7:8])
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
        return Notice("left-handed") if against and _leans(found) else None


def speed_in_radians(found: Leaning) -> float | None:
    """The speed of the bends, m/s, if the rates, which are 57 times too small, are deg/s; None where they may be."""
    wrong = found.share > SHARE and found.sigmas > SIGMAS and found.likeness > LIKENESS
    return float(np.degrees(found.speed)) if wrong and _leans(found) else None


def _leans(found: Leaning) -> bool:
    return float(np.sqrt(np.mean(found.rolled**2))) > LEAST_LEAN
