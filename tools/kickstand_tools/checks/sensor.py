"""Finds faults of the sensor: dead axes, and sensors at the end of their range.

* Noise changes the readings of a working axis within a second. An axis is dead if it stays the same to the last digit
  while other axes of its sensor change. The readings are left out.
* If a rate above SATURATED_DPS stays the same, the gyro is at the end of its range, so the true rate is unknown. The
  readings are left out.
* Vibration may clip the accelerometer. The force between the shocks is nearly right, so the readings are used, with a
  remark.
"""

import numpy as np
from kickstand.units import AXES

from ..common.messages import Message, Remedy
from ..signals import Array, Bools, Ints, cell_numbers

DEAD_S = 1.0  # length of the stretches in which an axis is judged
LEAST_SAMPLES = 10  # least number of samples in a stretch that is judged
# An axis is judged only if the other axes change by OTHER_G or OTHER_DPS, and by OTHER_STEPS of their last digits.
# Smaller changes do not prove noise, because a phone's rounding may hide it.
OTHER_G, OTHER_DPS, OTHER_STEPS = 0.01, 0.3, 20.0
# An axis has noise if its readings turn from rising to falling, or back, at least at this share of the samples. With
# white noise they turn at two thirds of the samples. Without noise they turn at a smaller share than NOISY.
NOISY = 0.15
# If all axes of a sensor are constant, the sensor is judged only in a part of the log that is longer than this.
DEAD_ALL_S = 20.0
# An axis is dead only if it is without noise for at least this time. Rounding alone may hide the noise for one second.
DEAD_FROM_S = 2.0
SATURATED_DPS, SATURATED_S, SATURATED_SAMPLES = 100.0, 0.1, 5
# An accelerometer is clipped if CLIPPED_SAMPLES have the same largest reading, over CLIPPED_G. This reading
# must be over CLIPPED_STEPS steps of the last digit.
CLIPPED_G, CLIPPED_SAMPLES, CLIPPED_STEPS = 1.1, 10, 200.0
NAMES = tuple(f"{sensor} {axis}" for sensor in ("accelerometer", "gyro") for axis in AXES)

_SENSORS = slice(0, 3), slice(3, 6)
_MOTION = [0, 1, 2, 4, 5, 6]  # columns of forces and rates, in the chip's order, without the temperature
_LEAST = np.repeat([OTHER_G, OTHER_DPS], 3)


class AxisDead(Message):
    """An axis repeats its reading while other axes of the same sensor change.

    name: sensor and axis, such as "gyro x".
    seconds: how long the axis was dead, in all.
    begin_s: time in the log at which this began.
    """

    name: str
    seconds: float
    begin_s: float

    code = "axis-dead"
    text = (
        "{name} is dead: from {begin_s:.1f} s on it does not change for {seconds:.0f} s while others do; these "
        "readings are left out, and the lean is not known there"
    )
    todo = Remedy("check the sensor and its solder joints, or replace it")


class GyroSaturated(Message):
    """The gyro was at the end of its range.

    times: how often this happened.
    seconds: how long this lasted, in all.
    begin_s: time in the log at which this first happened.
    """

    axis: str
    times: int
    seconds: float
    begin_s: float

    code = "gyro-saturated"
    text = (
        "gyro {axis} is at the end of its range {times} times, {seconds:.1f} s in all, first at {begin_s:.1f} s: these "
        "readings are left out"
    )
    todo = Remedy("fix the sensor firmly, or set a larger GYRO_RANGE_DPS")


class AccelClipped(Message):
    """Vibration clipped the accelerometer.

    end_g: the end of its range.
    samples: number of clipped samples.
    begin_s: time in the log of the first clipped sample.
    """

    axis: str
    end_g: float
    samples: int
    begin_s: float

    code = "accel-clipped"
    text = (
        "accelerometer {axis} is at the end of its range ({end_g:.1f} g) in {samples} samples, first at {begin_s:.1f} "
        "s: its mean is wrong there"
    )
    todo = Remedy("mount the sensor more softly, or set a larger ACCEL_RANGE_G")


class SensorHealth:
    """Finds faulty readings. Call mark() for each part of a log, then notices()."""

    def __init__(self) -> None:
        self._step = np.full(6, np.inf)  # smallest change seen on each axis, which is one step of its last digit
        self._dead_s = np.zeros(6)
        self._run_s = np.zeros(6)  # time for which each axis has been dead at the end of the last stretch
        self._begin_s = np.full(6, np.nan)
        self._saturated: list[list[float]] = [[], [], []]  # per axis: time of the first case, number of cases, seconds
        # For each axis and sign: largest reading (g), number of samples with this reading, time of the first of them.
        self._ends: list[tuple[float, int, float]] = [(0.0, 0, 0.0)] * 6
        self._alive = np.zeros(2, dtype=bool)  # True once noise was seen on the accelerometer, and on the gyro

    def mark(self, time_us: Ints, readings: Array) -> Bools:
        """Find the faulty readings in the next part of a log.

        time_us: times of the samples, shape (n).
        readings: as in a Block, shape (n, 7).
        Returns True where the readings are faulty, shape (n).
        """
        time_s, values = time_us.astype(float) * 1e-6, readings[:, _MOTION]
        sick = np.zeros(len(time_s), dtype=bool)
        if len(time_s) < LEAST_SAMPLES:
            return sick
        change = np.abs(np.diff(values, axis=0))
        self._step = np.minimum(self._step, np.min(np.where(change > 1e-9, change, np.inf), axis=0, initial=np.inf))
        number = cell_numbers(time_s, DEAD_S)
        begins = np.flatnonzero(np.append(True, np.diff(number) != 0))
        ends = np.append(begins[1:], len(number))
        spread = np.maximum.reduceat(values, begins) - np.minimum.reduceat(values, begins)
        slope = np.diff(values, axis=0, append=values[-1:])
        turns = np.add.reduceat(slope * np.roll(slope, 1, axis=0) < 0.0, begins, dtype=float)
        noisy = turns >= NOISY * (ends - begins)[:, None]
        long = time_s[-1] - time_s[0] > DEAD_ALL_S
        constant = np.array([long and np.all(change[:, sensor] == 0.0) for sensor in _SENSORS], dtype=bool)
        before = 0  # begin of the previous stretch, because the first second of a dead axis is faulty too
        for begin, end, spreads, noise in zip(begins.tolist(), ends.tolist(), spread, noisy):
            if end - begin >= LEAST_SAMPLES:
                dead = self._dead(spreads, noise, constant)
                self._count(dead, float(time_s[begin]), float(time_s[end - 1] - time_s[begin]))
                if np.any(dead & (self._run_s >= DEAD_FROM_S)):
                    sick[before:end] = True
            before = begin
        for axis in range(3):
            self._mark_saturated(axis, time_s, values[:, 3 + axis], sick)
            self._find_clipped(axis, time_s, values[:, axis])
        return sick

    def notices(self) -> list[Message]:
        """Return the notices about the log so far."""
        found: list[Message] = [
            AxisDead(name, float(seconds), float(begin))
            for name, seconds, begin in zip(NAMES, self._dead_s, self._begin_s)
            if seconds >= DEAD_FROM_S
        ]
        found += [GyroSaturated(name, int(at[1]), at[2], at[0]) for name, at in zip(AXES, self._saturated) if at]
        for axis, name in enumerate(AXES):
            ends = [end for end in self._ends[axis :: len(AXES)] if self._is_clipped(axis, end)]
            if ends:
                samples = sum(count for _, count, _ in ends)
                found.append(AccelClipped(name, ends[0][0], samples, min(first for *_, first in ends)))
        return found

    def _dead(self, spread: Array, noisy: Bools, constant: Bools) -> Bools:
        """Find the dead axes in a stretch.

        spread: largest minus smallest reading of each axis, shape (6).
        noisy: True for axes with noise, shape (6).
        constant: True for a sensor whose axes do not change in a long part of the log, shape (2).
        Returns True for dead axes, shape (6).
        """
        step = np.where(np.isfinite(self._step), self._step, 0.0)
        moves = noisy & (spread >= np.maximum(_LEAST, OTHER_STEPS * step))
        still = spread <= 0.0
        others = [bool(np.any(moves[sensor])) for sensor in reversed(_SENSORS)]
        for k, sensor in enumerate(_SENSORS):
            if np.all(still[sensor]):
                # In simulated logs a gyro may have no noise, so its readings do not change on straights.
                still[sensor] &= others[k] and (self._alive[k] or constant[k])
            else:
                still[sensor] &= np.any(moves[sensor])
                self._alive[k] |= np.any(moves[sensor])
        return still

    def _count(self, dead: Bools, begin_s: float, seconds: float) -> None:
        first = dead & np.isnan(self._begin_s)
        self._begin_s[first] = begin_s
        self._run_s = np.where(dead, self._run_s + DEAD_S, 0.0)
        self._begin_s[(self._run_s == 0.0) & (self._dead_s < DEAD_FROM_S)] = np.nan
        self._dead_s = np.where(dead, self._dead_s + seconds, self._dead_s)

    def _mark_saturated(self, axis: int, time_s: Array, rate: Array, sick: Bools) -> None:
        begins = np.flatnonzero(np.append(True, np.diff(rate) != 0.0))
        ends = np.append(begins[1:], len(rate))
        long = (ends - begins >= SATURATED_SAMPLES) & (np.abs(rate[begins]) > SATURATED_DPS)
        for begin, end in zip(begins[long].tolist(), ends[long].tolist()):
            seconds = float(time_s[end - 1] - time_s[begin])
            if seconds < SATURATED_S:
                continue
            sick[begin:end] = True
            at = self._saturated[axis] or [float(time_s[begin]), 0.0, 0.0]
            self._saturated[axis] = [at[0], at[1] + 1.0, at[2] + seconds]

    def _find_clipped(self, axis: int, time_s: Array, force: Array) -> None:
        """Count the samples with the largest and the smallest reading of an axis so far."""
        for at, values in ((axis, force), (axis + len(AXES), -force)):
            end, count, first = self._ends[at]
            most = float(np.max(values))
            if most > end:
                count = 0
            if most >= max(end, CLIPPED_G):
                there = values == most
                first = first if count else float(time_s[np.argmax(there)])
                self._ends[at] = (most, count + int(np.count_nonzero(there)), first)

    def _is_clipped(self, axis: int, end: tuple[float, int, float]) -> bool:
        """True if the axis is clipped. A log with few digits may repeat its largest reading without clipping."""
        return end[1] >= CLIPPED_SAMPLES and end[0] > CLIPPED_STEPS * self._step[axis]
