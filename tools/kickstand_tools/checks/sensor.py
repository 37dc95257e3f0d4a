"""Finds faults of the sensor: dead axes, and sensors at the end of their range.

Noise changes every reading of a working axis within a second. An axis is dead if it stays the same to the last digit
while other axes of its sensor change. A rate that stays the same above SATURATED_DPS means that the gyro is at the end
of its range, so the true rate is unknown. The lean must not be computed from either. If vibration clips the
accelerometer, the force between the shocks is nearly right, so these readings are used, with a remark.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import AXES

from ..common.messages import Message, Remedy
from ..signals import Array, Bools, Ints, cell_numbers

DEAD_S = 1.0  # an axis is judged in each stretch of this length
LEAST_SAMPLES = 10  # least number of samples in such a stretch
# The other axes must change by this much, and by OTHER_STEPS of their last digits: rounding hides the noise of a phone
OTHER_G, OTHER_DPS, OTHER_STEPS = 0.01, 0.3, 20.0
# Least share of samples at which the readings change direction: noise gives two thirds, a log without noise less
NOISY = 0.15
# If no axis of a sensor ever changes, the sensor is judged over a part of the log of this length
DEAD_ALL_S = 20.0
DEAD_FROM_S = 2.0  # shorter stretches are kept, because rounding may hide the noise for a second
SATURATED_DPS, SATURATED_S, SATURATED_SAMPLES = 100.0, 0.1, 5
# An accelerometer is clipped if its largest reading, over CLIPPED_G, is repeated to the last digit
CLIPPED_G, CLIPPED_SAMPLES, CLIPPED_STEPS = 1.1, 10, 200.0
NAMES = tuple(f"{sensor} {axis}" for sensor in ("accelerometer", "gyro") for axis in AXES)

_SENSORS = slice(0, 3), slice(3, 6)
_MOTION = [0, 1, 2, 4, 5, 6]  # columns in the chip's order, without the temperature
_LEAST = np.repeat([OTHER_G, OTHER_DPS], 3)


@dataclass(frozen=True)
class AxisDead(Message):
    """An axis stays the same while others change. name: "gyro x"."""

    name: str
    seconds: float
    begin_s: float

    code = "axis-dead"
    text = (
        "{name} is dead: from {begin_s:.1f} s on it does not change for {seconds:.0f} s while others do; these "
        "readings are left out, and the lean is not known there"
    )
    todo = Remedy("check the sensor and its solder joints, or replace it")


@dataclass(frozen=True)
class GyroSaturated(Message):
    """The gyro was at the end of its range. begin_s: when this first happened."""

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


@dataclass(frozen=True)
class AccelClipped(Message):
    """Vibration clipped the accelerometer. end_g: the end of its range. begin_s: time of the first such sample."""

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
    """Finds faulty readings. mark() takes a log part by part."""

    def __init__(self) -> None:
        self._step = np.full(6, np.inf)  # smallest change seen on each axis: the last digit
        self._dead_s = np.zeros(6)
        self._run_s = np.zeros(6)  # for each axis, how long it has been dead at the end of the last stretch
        self._begin_s = np.full(6, np.nan)
        self._saturated: list[list[float]] = [[], [], []]  # begin of the first case, number of cases, seconds
        # for each axis and sign: largest reading in g, number of samples with it, time of the first
        self._ends: list[tuple[float, int, float]] = [(0.0, 0, 0.0)] * 6
        self._alive = np.zeros(2, dtype=bool)  # True once noise was seen: accelerometer, gyro

    def mark(self, time_us: Ints, readings: Array) -> Bools:
        """(n) True where readings (n, 7), as in a Block, are faulty. The memory must hold a whole part."""
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
        if time_s[-1] - time_s[0] > DEAD_ALL_S:
            constant = np.array([np.all(change[:, sensor] == 0.0) for sensor in _SENSORS])
        else:
            constant = np.zeros(2, dtype=bool)
        before = 0  # begin of the previous stretch: the first second of a dead axis is faulty too
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
        """The notices about the log so far."""
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
        """(6) True for the dead axes of a stretch in which the readings change by `spread` (6). noisy (6): True for
        axes with noise. constant (2): True for a sensor that does not change in a long part of the log."""
        step = np.where(np.isfinite(self._step), self._step, 0.0)
        moves = noisy & (spread >= np.maximum(_LEAST, OTHER_STEPS * step))
        still = spread <= 0.0
        others = [bool(np.any(moves[sensor])) for sensor in reversed(_SENSORS)]
        for k, sensor in enumerate(_SENSORS):
            if np.all(still[sensor]):
                # In simulated logs a gyro may have no noise, so it does not change on straights
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
        """Count the samples with the axis' largest and smallest readings so far."""
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
        """True if the axis is clipped, and not merely a log with few digits that repeats its largest reading."""
        return end[1] >= CLIPPED_SAMPLES and end[0] > CLIPPED_STEPS * self._step[axis]
