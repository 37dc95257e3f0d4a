"""A ride as means over a fifth of a second, in which the vibration of the engine has averaged out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...logs.axes.leaning import WINDOW_S, averaged, unrest
from ...logs.cells import MOST_DPS, MOST_G
from ...logs.log import Log
from ...logs.table import Array

_MOUNTED_S, _MOUNTED_DEG = 10.0, 35.0  # over so long the mean force of a ride keeps within this of the usual one
_LONGEST_S = 1800.0  # more than half an hour of a ride tells no more
_STILL_S, _CALM_S = 1.6, 1.0  # shorter standstills are not told from smooth riding
# A bike at rest, held by its rider with the engine idling, moves less. A speed of zero allows more.
_STILL_RADPS, _STILL_G, _STILL_MPS, _STANDS = np.radians(0.6), 0.03, 0.3, 4.0
_ONE_BIAS_RADPS = np.radians(1.0)  # the rates of standstills differ by less: a steady bend is none


@dataclass
class Windows:
    """n windows. time_s (n): their middles. rate (n, 3, rad/s) and force (n, 3, g): means, in the sensor's axes.
    shaken (n): variance of the force within each window, g^2. speed (n): m/s, NaN where there is none. linked (n):
    False where samples are missing between this window and the next. still (n): True where the bike stands. calm (n):
    True where it stands or rides straight on so smoothly that the gyro reads its bias. unrest (n): standard deviation
    of the rate within a second, rad/s.
    """

    time_s: Array
    rate: Array
    force: Array
    shaken: Array
    speed: Array
    linked: NDArray[np.bool_]
    still: NDArray[np.bool_]
    calm: NDArray[np.bool_]
    unrest: Array

    def __len__(self) -> int:
        return len(self.time_s)


def windows_of(log: Log) -> Windows:
    """The windows of the longest stretch of a log in which the sensor stays mounted as it is, of half an hour at most.

    Those without samples, and with absurd ones, are left out.
    """
    number = np.floor(log.t_s / WINDOW_S + 1e-9).astype(int)
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    count = np.diff(np.append(starts, len(number)))[:, None]

    def means(values: Array) -> Array:
        return np.add.reduceat(values, starts, axis=0) / count

    rate, force = means(np.radians(log.gyro_dps)), means(log.accel_g)
    shaken = np.maximum(np.mean(means(log.accel_g**2) - force**2, axis=1), 0.0)
    there = np.flatnonzero(~np.isnan(log.speed_mps))
    speed = np.full(len(starts), np.nan)
    speed[np.searchsorted(starts, there, side="right") - 1] = log.speed_mps[there]
    kept = np.flatnonzero(_plausible(log, starts))
    kept = kept[_mounted(force[kept])] if len(kept) else kept
    number = number[starts][kept]
    time, rate, force, speed = (number + 0.5) * WINDOW_S, rate[kept], force[kept], speed[kept]
    known = known_speed(time, speed)
    return Windows(
        time,
        rate,
        force,
        shaken[kept],
        speed,
        np.append(np.diff(number) == 1, False)[: len(kept)],
        _still(rate, force, known, _STILL_S),
        _still(rate, force, known, _CALM_S),
        unrest(rate, _CALM_S),
    )


def known_speed(time_s: Array, speed: Array) -> Array:
    """(n) m/s, interpolated between the logged values; NaN everywhere if there are fewer than two."""
    there = ~np.isnan(speed)
    if np.count_nonzero(there) < 2:
        return np.full(len(speed), np.nan)
    return np.interp(time_s, time_s[there], speed[there])


def _plausible(log: Log, starts: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(windows) False where a reading is one that no ride gives."""
    absurd = np.any(np.abs(log.accel_g) > MOST_G, axis=1) | np.any(np.abs(log.gyro_dps) > MOST_DPS, axis=1)
    return ~np.logical_or.reduceat(absurd, starts)


def _mounted(force: Array) -> slice:
    """The longest stretch in which the mean force keeps its direction: before and after, a hand held the sensor."""
    mean = averaged(force, _MOUNTED_S)
    mean /= np.maximum(np.linalg.norm(mean, axis=1), 1e-9)[:, None]
    usual = np.median(mean, axis=0)
    near = mean @ usual > np.cos(np.radians(_MOUNTED_DEG)) * np.linalg.norm(usual)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], near, [False]))))
    if not len(edges):
        return slice(0, 0)
    longest = int(np.argmax(edges[1::2] - edges[::2]))
    begin, end = int(edges[2 * longest]), int(edges[2 * longest + 1])
    margin = round(_MOUNTED_S / WINDOW_S)  # until the mean is of the ride alone
    begin, end = begin + margin * (begin > 0), end - margin * (end < len(force))
    return slice(begin, min(end, begin + round(_LONGEST_S / WINDOW_S)))


def _still(rate: Array, force: Array, speed: Array, over_s: float) -> NDArray[np.bool_]:
    """Nothing changes for over_s, and the rates are those of most such places. speed: m/s, NaN if unknown."""
    allowed = np.where(speed < _STILL_MPS, _STANDS, 1.0)
    calm = (unrest(rate, over_s) < allowed * _STILL_RADPS) & (unrest(force, over_s) < allowed * _STILL_G)
    calm &= ~(speed >= _STILL_MPS)
    if not np.any(calm):
        return calm
    bias = np.median(rate[calm], axis=0)
    return calm & (np.linalg.norm(averaged(rate, over_s) - bias, axis=1) < allowed * _ONE_BIAS_RADPS)
