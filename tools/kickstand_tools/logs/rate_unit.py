"""Are the angular rates of a log in deg/s? The bends of a motorcycle ride tell.

In a bend a motorcycle leans: the specific force grows and keeps its direction in the sensor's axes. Braking turns that
direction. The lean that belongs to the force and the rate of turning together give the speed, v = g tan(lean) / rate.
Rates in rad/s are 57 times too small, and the speed becomes one that no vehicle has. A car does not lean and a parked
vehicle does not turn: they are never judged.
"""

import numpy as np
from kickstand.errors import Notice
from kickstand.units import STANDARD_GRAVITY

from .table import Array

LEANED = 1.15  # times the usual force: a lean of 30 degrees
ALONG = 0.97  # share of the force along its usual direction: within 14 degrees of it
ENOUGH = 10  # seconds in bends
SAMPLES = 10  # at least in a second, so that vibration averages out
FASTEST_MPS = 200.0  # recorded rides have a median of up to 20 m/s in deg/s, of over 330 m/s in rad/s
WINDOW = 3600  # seconds that are kept


class RateUnit:
    """add() takes a log's samples block by block. notice: that the rates look like rad/s, None if they do not."""

    def __init__(self) -> None:
        self._means = np.zeros((0, 6))  # over a second, of force (3, g) and rates (3, deg/s)
        self.notice: Notice | None = None

    def add(self, time_s: Array, force: Array, rate: Array) -> None:
        """force: (n, 3, g); rate: (n, 3, deg/s); in the sensor's axes."""
        starts = np.flatnonzero(np.diff(np.floor(time_s), prepend=-1.0))
        counts = np.diff(np.append(starts, len(time_s)))
        means = np.add.reduceat(np.hstack((force, rate)), starts) / counts[:, None]
        self._means = np.vstack((self._means, means[counts >= SAMPLES]))[-WINDOW:]
        speed = self._leaned_speed() if len(self._means) else 0.0
        if speed > FASTEST_MPS:
            self.notice = Notice("rates-in-radians", speed)

    def _leaned_speed(self) -> float:
        """The median speed in the bends, m/s; 0 where there are too few to tell."""
        force, rate = self._means[:, :3], np.radians(self._means[:, 3:])
        usual = np.median(force, axis=0)
        # in balance the force has the direction of the bike's own up
        along = force @ usual / max(float(np.linalg.norm(usual)), 1e-9)
        grown = along / max(float(np.median(along)), 1e-9)
        leaned = (grown > LEANED) & (along > ALONG * np.linalg.norm(force, axis=1))
        if np.count_nonzero(leaned) < ENOUGH:
            return 0.0
        tangent = np.sqrt(grown[leaned] ** 2 - 1.0)
        return float(np.median(STANDARD_GRAVITY * tangent / np.maximum(np.linalg.norm(rate[leaned], axis=1), 1e-6)))
