"""Finds frozen readings in a log: the same reading repeated for half a second or longer.

The cause is a sensor that hangs, or a phone that repeats its last reading. Noise changes the readings of a working
sensor from sample to sample, even at rest. If all six axes stay the same to the last digit for half a second, they were
not measured.

In a log with few digits, rounding may hide the noise of a vehicle at rest. In such a log, equal readings are compared
with the readings before and after them. The equal readings are kept if the values on one side are about the same. They
are left out if the values jump on both sides.
"""

import numpy as np

from ..common.messages import Message
from ..signals import Array, Bools, Ints
from .log import Log

FROZEN_S, FROZEN_SAMPLES = 0.5, 10  # shortest duration and least number of equal readings that count as frozen
COARSE_G, COARSE_DPS = 0.002, 0.05  # if readings are rounded to steps this large, rounding may hide the sensor's noise
BESIDE_S = 0.5  # equal readings are compared with the readings of this time before and after them
# Largest difference between equal readings at a standstill and the mean of the readings beside them
NEAR_G, NEAR_DPS = 0.02, 0.5

_MOTION = [0, 1, 2, 4, 5, 6]  # columns in the chip's order, without the temperature


class FrozenReadings(Message):
    """The readings froze.

    stretches: number of stretches with frozen readings.
    seconds: their total duration.
    begin_s, end_s: times of the first stretch.
    """

    stretches: int
    seconds: float
    begin_s: float
    end_s: float

    code = "frozen-readings"

    def sentence(self) -> str:
        """See Message."""
        line = f"the readings froze from {self.begin_s:.1f} to {self.end_s:.1f} s"
        if self.stretches > 1:
            line += f" and {self.stretches - 1} times more, {self.seconds:.1f} s in all"
        return line + ": they are left out, and the lean filter restarts after each"


class FrozenFinder:
    """Finds frozen readings. Call mark() with one block after another."""

    def __init__(self) -> None:
        self._last = np.zeros((0, 6))  # last reading of the previous block
        self._last_s = 0.0
        self._since_s = 0.0  # time of the last change of the reading
        self._since_samples = 1  # number of equal readings since then
        self._was_frozen = False
        self._step = np.full(6, np.inf)  # smallest change seen on each axis, used as the size of its last digit
        self._stretches: list[tuple[float, float]] = []

    def mark(self, time_us: Ints, readings: Array) -> Bools:
        """Return True for each frozen reading, shape (n). The first of several equal readings counts as measured.

        readings: as in a Block, shape (n, 7).
        """
        n = len(time_us)
        values, time_s = np.vstack((self._last, readings[:, _MOTION])), time_us.astype(float) * 1e-6
        time_s = np.concatenate(([self._last_s], time_s)) if len(self._last) else time_s
        change = np.abs(np.diff(values, axis=0))
        self._step = np.minimum(self._step, np.min(np.where(change > 1e-9, change, np.inf), axis=0, initial=np.inf))
        same = np.concatenate(([False], ~np.any(change > 0.0, axis=1)))
        frozen = np.zeros(len(same), dtype=bool)
        begins = np.flatnonzero(~same)  # index of the first reading of each run of equal readings
        ends = np.append(begins[1:], len(same))
        long = ends > begins + 1
        for begin, end in zip(begins[long].tolist(), ends[long].tolist()):
            goes_on = begin == 0 and len(self._last) > 0
            since_s = self._since_s if goes_on else float(time_s[begin])
            samples = end - begin + (self._since_samples - 1 if goes_on else 0)
            if time_s[end - 1] - since_s < FROZEN_S or samples < FROZEN_SAMPLES:
                continue
            if (goes_on and self._was_frozen) or self._doubtful(values, time_s, begin, end):
                frozen[begin + 1 : end] = True
                self._add(float(time_s[begin]), float(time_s[end - 1]))
        last = int(begins[-1])
        if not (last == 0 and len(self._last)):
            self._since_s, self._since_samples = float(time_s[last]), 1
        self._since_samples += len(same) - 1 - last
        self._was_frozen = bool(frozen[-1])
        self._last, self._last_s = values[-1:], float(time_s[-1])
        return frozen[-n:]

    def notices(self) -> list[Message]:
        """The notices about the blocks so far."""
        if not self._stretches:
            return []
        first, last = self._stretches[0]
        seconds = sum(end - begin for begin, end in self._stretches)
        return [FrozenReadings(len(self._stretches), seconds, first, last)]

    def _doubtful(self, values: Array, time_s: Array, begin: int, end: int) -> bool:
        """Return True if the equal readings from begin to end are frozen. Return False if they may be a standstill
        whose noise is hidden by rounding."""
        if not np.any(np.isfinite(self._step)):
            return False  # without any change so far, the size of the last digit is unknown
        if np.any(self._step[:3] < COARSE_G) or np.any(self._step[3:] < COARSE_DPS):
            return True
        near = 0.5 * np.where(np.isfinite(self._step), self._step, 0.0) + np.repeat([NEAR_G, NEAR_DPS], 3)
        before = (time_s[:begin] > time_s[begin] - BESIDE_S).nonzero()[0]
        after = end + (time_s[end:] < time_s[end - 1] + BESIDE_S).nonzero()[0]
        means = [np.mean(values[rows], axis=0) for rows in (before, after) if len(rows)]
        return not any(np.all(np.abs(mean - values[begin]) <= near) for mean in means)

    def _add(self, begin_s: float, end_s: float) -> None:
        if self._stretches and self._stretches[-1][1] == begin_s:  # this stretch began in the previous block
            begin_s = self._stretches.pop()[0]
        self._stretches.append((begin_s, end_s))


def without_frozen(log: Log) -> Log:
    """The log without frozen readings, which become gaps. Returns the same log if it has no frozen readings."""
    kept = ~FrozenFinder().mark(log.time_us, log.readings)
    return log if np.all(kept) else log.part(kept)
