"""Joins the sensors of a recording on the accelerometer's clock. Each sensor may have its own clock and rate."""

from dataclasses import replace
from typing import Any

import numpy as np
from kickstand.units import LOST_US

from ..common.messages import InputError
from ..logs.csv_text import MOST_DPS, MOST_G, TRACK
from ..logs.even_times import even_times
from ..logs.log import Log
from ..signals import Array, Bools, Ints
from .recording import AppRecording, ReceiverTrack, RecordedSensor

MOST_MPS = 200.0  # largest speed, and largest latitude or longitude in degrees
GAP_NS = LOST_US * 1000  # no interpolation between samples that are further apart
FASTER = 1.5  # a gyro with over FASTER times the accelerometer's rate is averaged over each accelerometer sample
MANY = 0.02  # a larger share of readings over MOST_G or MOST_DPS means another unit, not damaged cells
SHUFFLED_NS = 500_000_000  # samples in the wrong order are sorted if they are less late than this
# samples are sorted only if at most the share MOST_LATE is late by over LATE_STEPS median steps
LATE_STEPS, MOST_LATE = 4.0, 0.02
MOST_HZ = 10_000.0  # a sensor with a higher rate is refused; the fastest have 8,000 Hz


def join(recording: AppRecording, name: str) -> tuple[Log, int]:
    """Join the sensors on the accelerometer's clock. name: the recording's name in messages.

    Returns:
        log: times count from the first sample.
        damaged: number of damaged rows that are left out.

    Raises InputError if the sensors have no time in common.
    """
    accel = in_order(recording.accel, name)
    gyro = in_order(recording.gyro, name)
    rates = on_clock(gyro, accel.time_ns, step_ns(accel))
    valid = np.all(np.isfinite(rates), axis=1)
    impossible = np.any(np.abs(accel.values) > MOST_G, axis=1) | np.any(np.abs(np.nan_to_num(rates)) > MOST_DPS, axis=1)
    if np.count_nonzero(impossible) > MANY * len(impossible):
        raise InputError(f"{name}: its readings are past any sensor's, {_most(accel.values, rates)}: check their units")
    valid &= ~impossible
    lost = int(np.count_nonzero(impossible)) + len(recording.accel.time_ns) - len(accel.time_ns)
    # The larger number is used, not the sum, because the same rows may contain both sensors
    lost += max(recording.accel.damaged, recording.gyro.damaged)
    if np.count_nonzero(valid) < 2:
        raise InputError(f"{name}: accelerometer and gyro have no time in common: were they recorded together?")
    temp_c = recording.temp_c
    if temp_c is None or len(temp_c) != len(valid):
        temp_c = np.full(len(valid), np.nan)
    time_ns = accel.time_ns[valid]
    since_s = (time_ns - accel.time_ns[0]) * 1e-9
    track = _on_rows(recording.track, time_ns, recording.utc_ns)
    log = Log(since_s, accel.values[valid], rates[valid], temperature_c=temp_c[valid], name=name, **track)
    return log, lost


def in_order(sensor: RecordedSensor, name: str) -> RecordedSensor:
    """Return the sensor with increasing times. Rounded times are spread evenly. Raises InputError if that is
    impossible."""
    if len(sensor.time_ns) < 2:
        raise InputError(f"{name}: {sensor.name} has {len(sensor.time_ns)} samples: was it recorded?")
    time_ns, values = sensor.time_ns, sensor.values
    if np.mean(np.diff(time_ns) < 0) > 1.0 - MOST_LATE:  # newest first
        time_ns, values = time_ns[::-1], values[::-1]
    valid = ~_damaged(time_ns)
    time_ns, values = time_ns[valid], values[valid]
    late = np.maximum.accumulate(time_ns) - time_ns
    steps = np.diff(time_ns)
    usual_ns = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    if np.count_nonzero(late > LATE_STEPS * usual_ns) > MOST_LATE * len(late):
        times = int(np.count_nonzero(steps < 0))
        row = int(np.argmax(steps < 0)) + 2
        raise InputError(
            f"{name}: the time of {sensor.name} goes back {times} times, first in its row {row}: is it the time "
            "since the recording's beginning?"
        )
    if np.any(late) and np.max(late) < SHUFFLED_NS:
        order = np.argsort(time_ns, kind="stable")
        time_ns, values = time_ns[order], values[order]
    since_s = (time_ns - time_ns[0]) * 1e-9
    even_ns = np.rint(even_times(since_s, f"{name}, {sensor.name}") * 1e9).astype(np.int64) + time_ns[0]
    hz = 1e9 / float(np.median(np.diff(even_ns)))
    if hz > MOST_HZ:
        raise InputError(
            f"{name}: {sensor.name} has {hz:.0f} samples per second, and no sensor has over {MOST_HZ:.0f}: are "
            "these values times, and is their unit right?"
        )
    return replace(sensor, time_ns=even_ns, values=values)


def _damaged(time_ns: Ints) -> Bools:
    """Find single wrong times, shape (n): the times before and after it fit each other, but not this time."""
    wrong = np.zeros(len(time_ns), dtype=bool)
    if len(time_ns) > 2:
        previous, now, following = time_ns[:-2], time_ns[1:-1], time_ns[2:]
        limit = SHUFFLED_NS
        fits = (following >= previous) & (following - previous < 2 * limit)
        wrong[1:-1] = fits & ((now < previous - limit) | (now > following + limit))
        wrong[0] = time_ns[0] > time_ns[1] + limit and time_ns[2] >= time_ns[1]
        wrong[-1] = time_ns[-1] < time_ns[-2] - limit and time_ns[-2] >= time_ns[-3]
    return wrong


def on_clock(sensor: RecordedSensor, clock_ns: Ints, period_ns: float) -> Array:
    """A sensor's values at the n times of another clock, shape (n, 3). NaN outside the sensor's own times and in gaps.

    Values are interpolated along straight lines. If the sensor is faster than the clock, they are averaged over
    period_ns.
    """
    slow = step_ns(sensor) * FASTER < period_ns
    readings = _averaged(sensor, period_ns) if slow else sensor.values
    sensor_s, clock_s = (np.asarray(ns - sensor.time_ns[0], dtype=float) for ns in (sensor.time_ns, clock_ns))
    values = np.column_stack([_between(clock_s, sensor_s, column) for column in readings.T])
    sensor_ns = sensor.time_ns
    following = np.searchsorted(sensor_ns, clock_ns, side="left")
    next_ns = sensor_ns[np.minimum(following, len(sensor_ns) - 1)]
    exact = next_ns == clock_ns
    apart = next_ns - sensor_ns[np.maximum(following - 1, 0)]
    values[~exact & (apart > GAP_NS)] = np.nan
    return values


def _between(times: Array, since: Array, values: Array) -> Array:
    """Interpolate values, shape (n), linearly at other times. NaN are ignored. The result is NaN before the first and
    after the last value."""
    valid = ~np.isnan(values)
    if not np.any(valid):
        return np.full(len(times), np.nan)
    return np.interp(times, since[valid], values[valid], left=np.nan, right=np.nan)


def _averaged(sensor: RecordedSensor, over_ns: float) -> Array:
    """Return a sensor's values, each averaged over the time over_ns around it, shape (n, 3)."""
    half = round(over_ns / 2.0)
    begin, end = (np.searchsorted(sensor.time_ns, sensor.time_ns + side, side="right") for side in (-half, half))
    sums = np.cumsum(np.vstack((np.zeros(3), np.nan_to_num(sensor.values))), axis=0)
    counts = np.cumsum(np.vstack((np.zeros(3), ~np.isnan(sensor.values))), axis=0)
    sums_over, count = sums[end] - sums[begin], counts[end] - counts[begin]
    return np.where(count > 0.0, sums_over / np.maximum(count, 1.0), np.nan)


def _most(accel_g: Array, rates_dps: Array) -> str:
    return f"up to {np.max(np.abs(accel_g)):.3g} g and {np.max(np.abs(np.nan_to_num(rates_dps))):.3g} deg/s"


def step_ns(sensor: RecordedSensor) -> float:
    """The median time between two samples."""
    return float(np.median(np.diff(sensor.time_ns)))


def _on_rows(track: ReceiverTrack | None, time_ns: Ints, utc_ns: int | None) -> dict[str, Any]:
    """Speed, latitude, longitude and UTC, each of shape (n). A value of the track is in the row nearest in time."""
    columns = {name: np.full(len(time_ns), np.nan) for name in TRACK}
    if utc_ns is not None:
        columns["utc_s"][0] = (time_ns[0] + utc_ns) * 1e-9
    if track is None or not len(track.time_ns):
        return columns
    following = np.clip(np.searchsorted(time_ns, track.time_ns), 1, len(time_ns) - 1)
    row = following - (track.time_ns - time_ns[following - 1] < time_ns[following] - track.time_ns)
    near = np.abs(time_ns[row] - track.time_ns) <= GAP_NS
    for name in ("speed_mps", "lat_deg", "lon_deg"):
        values = getattr(track, name)
        good = near & np.isfinite(values) & (np.abs(values) < MOST_MPS)
        columns[name][row[good]] = values[good]
    if utc_ns is not None:
        columns["utc_s"][row[near]] = (time_ns[row[near]] + utc_ns) * 1e-9
    return columns
