"""Are a log's rates in deg/s? On a bike the bends tell.

In a bend the bike leans, and the force grows and keeps its direction, which it does not do in braking. A force that
has grown and a rate of turning make a speed, v = g tan(lean) / rate, and in rad/s the rates are so small that it is one
that no vehicle has. A car, which does not lean, and what is parked never come to be judged.
"""

import numpy as np
from numpy.typing import NDArray

LEANED = 1.15  # times the usual force: 30 degrees
ALONG = 0.97  # of the force is where it usually is: within 14 degrees
ENOUGH = 10  # seconds of that
SAMPLES = 10  # in a second, for its vibration to even out
FASTEST_MPS = 200.0  # of rides up to 20 were had in deg/s, over 330 in rad/s, in the middle
WINDOW = 3600  # seconds that are kept
_G = 9.80665

Array = NDArray[np.float64]


class RateUnit:
    """add() a log's samples block by block. remark: what there is to be said of them, or ""."""

    def __init__(self) -> None:
        self._means = np.zeros((0, 6))  # of force (g) and rates (deg/s), three each, over a second
        self.remark = ""

    def add(self, time_s: Array, force: Array, rate: Array) -> None:
        """force: (n, 3, g); rate: (n, 3, deg/s); in the sensor's axes."""
        starts = np.flatnonzero(np.diff(np.floor(time_s), prepend=-1.0))
        counts = np.diff(np.append(starts, len(time_s)))
        means = np.add.reduceat(np.hstack((force, rate)), starts) / counts[:, None]
        self._means = np.vstack((self._means, means[counts >= SAMPLES]))[-WINDOW:]
        speed = self._leaned_speed() if len(self._means) else 0.0
        if speed > FASTEST_MPS:
            self.remark = f"in bends the rates are those of {speed:.0f} m/s: are they in rad/s? deg/s are needed"

    def _leaned_speed(self) -> float:
        """In the middle, in m/s; 0 where it is not enough to tell."""
        force, rate = self._means[:, :3], np.radians(self._means[:, 3:])
        usual = np.median(force, axis=0)
        along = force @ usual / max(float(np.linalg.norm(usual)), 1e-9)  # a bike in balance has its own up there
        grown = along / max(float(np.median(along)), 1e-9)
        leaned = (grown > LEANED) & (along > ALONG * np.linalg.norm(force, axis=1))
        if np.count_nonzero(leaned) < ENOUGH:
            return 0.0
        tangent = np.sqrt(grown[leaned] ** 2 - 1.0)
        return float(np.median(_G * tangent / np.maximum(np.linalg.norm(rate[leaned], axis=1), 1e-6)))
