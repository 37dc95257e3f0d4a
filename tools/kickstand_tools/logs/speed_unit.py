"""Is a log's speed in m/s? Its changes are laid beside the force that made them.

From one second to the next a speed changes by what pushed the vehicle. Which way the sensor sits does not matter:
along is where force and change of speed go together best, for one of some lags, as satellites tell a speed late. Turns,
slopes and a rider who moves about add to the force alone: they make the speed seem to change less than it does, never
more.
"""

from pathlib import Path

import numpy as np
from kickstand.drive_alignment.speed_check import speed_unit_problem
from numpy.typing import NDArray

from ..errors import InputError
from ..refusals import sentence

MOST = 1.5  # times as much as it should: knots are 1.94, and what was right was never over 1.1
PUSH_G = 0.15  # beyond the slopes of ordinary roads
ENOUGH = 10  # seconds of such pushes: two or three brakings
SIGMAS = 5.0  # that force and speed go together by more than chance
LAGS_S = np.arange(0.0, 2.1, 0.25)
SHORTEST_S, LONGEST_S = 0.5, 2.2  # between two speeds
MISSING_S = 0.2  # between samples: what was felt there is not known
WINDOW = 3600  # of such intervals that are kept
_G = 9.80665

Array = NDArray[np.float64]


class SpeedUnit:
    """add() a log's samples block by block."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._time = np.zeros(0)
        self._felt = np.zeros((0, 4))  # integrals up to each time: force (g s, three), and time with samples (s)
        self._speeds = np.zeros((0, 2))  # one a second, (s, m/s): those whose change is not in _rows yet
        self._rows = np.zeros((len(LAGS_S), 0, 4))  # change of speed, then force (three) some lag before; g

    def add(self, time_s: Array, force: Array, speed_mps: Array) -> None:
        """force: (n, 3, g); speed_mps: NaN for none. Raises InputError once it is sure that they are no m/s."""
        self._feel(time_s, force)
        there = ~np.isnan(speed_mps)
        speeds = np.vstack((self._speeds, np.column_stack((time_s[there], speed_mps[there]))))
        speeds = speeds[np.flatnonzero(np.diff(np.floor(speeds[:, 0]), prepend=-1.0))]
        self._speeds = speeds[-1:]
        if len(speeds) > 1:
            self._rows = np.concatenate((self._rows, self._changes(speeds)), axis=1)[:, -WINDOW:]
            self._judge()

    def _feel(self, time_s: Array, force: Array) -> None:
        """Carry the integrals on; what no speed will ask for any more is dropped."""
        kept = self._time > time_s[0] - LONGEST_S - LAGS_S[-1] - 1.0
        before, sums = self._time[kept], self._felt[kept]
        last = self._time[-1:] if len(self._time) else time_s[:1]
        step = np.diff(time_s, prepend=last)
        step = np.where(step > MISSING_S, 0.0, step)[:, None]
        steps = np.hstack((force * step, step))
        self._felt = np.vstack((sums, np.cumsum(steps, axis=0) + (self._felt[-1] if len(self._felt) else 0.0)))
        self._time = np.concatenate((before, time_s))

    def _changes(self, speeds: Array) -> Array:
        """(lags, n, 4) as _rows, where the speeds are neighbours and no samples are missing."""
        time, mps = speeds.T
        seconds = np.diff(time)
        good = (seconds > SHORTEST_S) & (seconds < LONGEST_S)
        rows = []
        for lag in LAGS_S:
            felt = np.diff([np.interp(time - lag, self._time, column) for column in self._felt.T]).T
            good &= felt[:, 3] > 0.9 * seconds
            rows.append(np.column_stack((np.diff(mps) / (_G * seconds), felt[:, :3] / seconds[:, None])))
        return np.array(rows)[:, good]

    def _judge(self) -> None:
        """Raise InputError if most of the strong pushes change the speed too much."""
        count = self._rows.shape[1]
        if count < SIGMAS * SIGMAS:
            return
        best, change, push = max((_along(rows) for rows in self._rows), key=lambda fit: fit[0])
        strong = np.abs(push) > PUSH_G
        if best * np.sqrt(count) < SIGMAS or np.count_nonzero(strong) < ENOUGH:
            return
        if np.median(change[strong] / push[strong]) > MOST:
            slope = float(change @ push / (change @ change))  # as the board's own regression has it
            raise InputError(f"{self._path}: {sentence(speed_unit_problem(slope))}")


def _along(rows: Array) -> tuple[float, Array, Array]:
    """Correlation of change of speed and force, and both (g, without their means), the force along its direction."""
    change, *force = (rows - np.mean(rows, axis=0)).T
    direction = np.array(force) @ change
    push = direction @ force / max(float(np.linalg.norm(direction)), 1e-12)
    size = float(np.sqrt((change @ change) * (push @ push)))
    return (float(change @ push) / size if size > 0.0 else 0.0), change, push
