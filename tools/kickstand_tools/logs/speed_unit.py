"""Is the speed of a log in m/s? Its changes are compared with the specific force that caused them.

From one second to the next a speed changes by the acceleration along the vehicle. How the sensor is mounted does not
matter: the direction along the vehicle is the one in which force and change of speed correlate best. Several lags are
tried, because a satellite receiver tells the speed late. Turns, slopes and a rider who moves about add to the force
alone: they can make the speed seem to change too little, never too much.
"""

import numpy as np
from kickstand.drive_alignment.speed_check import speed_unit_problem
from kickstand.units import STANDARD_GRAVITY

from ..refusals import RefusedInput
from .table import Array

MOST = 1.5  # times the change that the force explains: knots give 1.94, recorded speeds in m/s never over 1.1
PUSH_G = 0.15  # a stronger force is no slope of an ordinary road
ENOUGH = 10  # seconds of such forces: two or three braking events
SIGMAS = 5.0  # by which the correlation of force and change of speed has to be more than chance
LAGS_S = np.arange(0.0, 2.1, 0.25)
SHORTEST_S, LONGEST_S = 0.5, 2.2  # between two speeds
MISSING_S = 0.2  # a longer gap between samples: the force in it is unknown
WINDOW = 3600  # intervals between speeds that are kept


class SpeedUnit:
    """add() takes a log's samples block by block. log: its name for messages."""

    def __init__(self, log: str) -> None:
        self._log = log
        self._time = np.zeros(0)
        self._felt = np.zeros((0, 4))  # integrals up to each time: force (g s, three), and time with samples (s)
        self._speeds = np.zeros((0, 2))  # the last one (s, m/s): its change to the next is not in _rows yet
        self._rows = np.zeros((len(LAGS_S), 0, 4))  # by lag: change of speed, mean force (3) so much earlier; g

    def add(self, time_s: Array, force: Array, speed_mps: Array) -> None:
        """force: (n, 3, g); speed_mps: (n), NaN for none. Raises RefusedInput once it is sure that they are not m/s."""
        self._feel(time_s, force)
        there = ~np.isnan(speed_mps)
        speeds = np.vstack((self._speeds, np.column_stack((time_s[there], speed_mps[there]))))
        speeds = speeds[np.flatnonzero(np.diff(np.floor(speeds[:, 0]), prepend=-1.0))]
        self._speeds = speeds[-1:]
        if len(speeds) > 1:
            self._rows = np.concatenate((self._rows, self._changes(speeds)), axis=1)[:, -WINDOW:]
            self._judge()

    def _feel(self, time_s: Array, force: Array) -> None:
        """Continue the integrals of the force. Values too old for the next speed are dropped."""
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
            rows.append(np.column_stack((np.diff(mps) / (STANDARD_GRAVITY * seconds), felt[:, :3] / seconds[:, None])))
        return np.array(rows)[:, good]

    def _judge(self) -> None:
        """Raise RefusedInput if the speed changes too much at most of the strong forces."""
        count = self._rows.shape[1]
        if count < SIGMAS * SIGMAS:
            return
        best, change, push = max((_along(rows) for rows in self._rows), key=lambda fit: fit[0])
        strong = np.abs(push) > PUSH_G
        if best * np.sqrt(count) < SIGMAS or np.count_nonzero(strong) < ENOUGH:
            return
        if np.median(change[strong] / push[strong]) > MOST:
            slope = float(change @ push / (change @ change))  # as the board's own regression has it
            raise RefusedInput(speed_unit_problem(slope), self._log)


def _along(rows: Array) -> tuple[float, Array, Array]:
    """Correlation of change of speed and force, then both without their means (g), the force along the direction in
    which it correlates best."""
    change, *force = (rows - np.mean(rows, axis=0)).T
    direction = np.array(force) @ change
    push = direction @ force / max(float(np.linalg.norm(direction)), 1e-12)
    size = float(np.sqrt((change @ change) * (push @ push)))
    return (float(change @ push) / size if size > 0.0 else 0.0), change, push
