"""Converts a ride to the vehicle's axes for plot, report and export, and averages it to a lower sample rate.

The lean of each sample is the firmware's lean or the smoothed lean. numpy computes everything that does not depend on
earlier samples. A test compares these values with the firmware's values.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields

import numpy as np
from kickstand.lean.meter import FALLEN_DEG

from ..calibration.file import CalibrationFile
from ..logs.log import ROOM_TEMP_C, Log, Table
from ..replay.replay import formula_lean_deg
from ..signals import Array, Bools

_LAST = ("lat_deg", "lon_deg", "utc_s")
GAP_S = 5.0  # longest time between two positions over which positions are interpolated


@dataclass(eq=False)
class Channels(Table):
    """A ride of n samples in the vehicle's axes left, up, forward. A missing value is NaN.

    t_s: seconds since the log's first sample.
    lean_deg: lean, positive to the right.
    lean_formula_deg: lean by Nicolae's formulas (25)-(26) alone.
    left_g, up_g, forward_g: specific force.
    lateral_g: acceleration to the left in the plane of the road, by formula (23).
    pitch_rate_dps: positive if the nose goes up.
    yaw_rate_dps: positive in a left turn.
    roll_rate_dps: positive to the right.
    speed_mps, temp_c: speed and temperature in the log.
    shown_g: forward force in g, smoothed as on the display.
    lean_sigma_deg: standard deviation of the lean.
    resting: 1 if the meter or the smoothing has detected a standstill, otherwise 0.
    rolling: 1 if the speed that they estimate is surely not 0, otherwise 0.
    sure: 1 if the meter trusts its lean, otherwise 0.
    doubtful: 1 if smooth() doubts the lean, otherwise 0. It is 0 if the lean is not smoothed.
    lat_deg, lon_deg: degrees north and east. NaN in a sample without a new position.
    utc_s: Universal Time in s since 1970. NaN in a sample without a new time.
    """

    t_s: Array
    lean_deg: Array
    lean_formula_deg: Array
    left_g: Array
    up_g: Array
    forward_g: Array
    lateral_g: Array
    pitch_rate_dps: Array
    yaw_rate_dps: Array
    roll_rate_dps: Array
    speed_mps: Array
    temp_c: Array
    shown_g: Array
    lean_sigma_deg: Array
    resting: Array
    rolling: Array
    sure: Array
    doubtful: Array
    lat_deg: Array
    lon_deg: Array
    utc_s: Array

    @property
    def trusted(self) -> Bools:
        """True where the display shows the lean and updates its maxima, shape (n).

        A smoothed lean is trusted if its standard deviation is small, and the lean is under FALLEN_DEG.
        """
        return (self.sure > 0.0) & ~(np.abs(self.lean_deg) >= FALLEN_DEG)

    @property
    def force_g(self) -> Array:
        """Specific force along left, up, forward, shape (n, 3), in g."""
        return np.column_stack((self.left_g, self.up_g, self.forward_g))

    @property
    def rate_dps(self) -> Array:
        """Rates about left, up, forward, shape (n, 3), in deg/s."""
        return np.column_stack((-self.pitch_rate_dps, self.yaw_rate_dps, self.roll_rate_dps))


def channels(log: Log, calibration: CalibrationFile, lean: dict[str, Array], car: bool = False) -> Channels:
    """Convert samples to the vehicle's axes.

    The forces are computed by Nicolae's formulas (18)-(20) and the matrix vehicle_from_sensor. Then (25)-(26) give
    lean_formula_deg, and (23) gives lateral_g. A car has no lean, and its lateral acceleration is the force to the
    left.

    lean: lean_deg, lean_sigma_deg, shown_g, resting, rolling, sure and doubtful. For a car, only shown_g, resting and
        sure are used.
    """
    none = np.zeros(len(log.t_s))
    if car:
        lean = lean | {"lean_deg": none + np.nan, "lean_sigma_deg": none, "rolling": none, "doubtful": none}
    force, rate = calibration.in_vehicle(log.readings)
    left, up, forward = force.T
    angle = np.radians(np.nan_to_num(lean["lean_deg"]))
    temperature = log.temperature_c
    if log.has_temperature:
        temperature = np.nan_to_num(temperature, nan=ROOM_TEMP_C)
    return Channels(
        t_s=log.t_s,
        lean_formula_deg=none + np.nan if car else formula_lean_deg(left, up, rate[:, 1]),
        left_g=left,
        up_g=up,
        forward_g=forward,
        lateral_g=left * np.cos(angle) - up * np.sin(angle),
        pitch_rate_dps=-rate[:, 0],
        yaw_rate_dps=rate[:, 1],
        roll_rate_dps=rate[:, 2],
        speed_mps=log.speed_mps,
        temp_c=temperature,
        lat_deg=log.lat_deg,
        lon_deg=log.lon_deg,
        utc_s=log.utc_s,
        **lean,
    )


def joined(parts: Iterable[Channels]) -> Channels:
    """Join the parts of a ride.

    A column without any value uses no memory, and is read-only.
    """
    columns: list[list[Array]] = [[] for _ in fields(Channels)]
    for part in parts:
        for column, field in zip(columns, fields(Channels)):
            column.append(getattr(part, field.name))
    return Channels(*map(_concatenated, columns))


def _concatenated(parts: list[Array]) -> Array:
    """Join the parts of a column. Clear the list, so that the parts of each column are freed before the next one."""
    column = np.concatenate([np.zeros(0), *parts], dtype=float)
    parts.clear()
    return np.broadcast_to(np.nan, len(column)) if np.all(np.isnan(column)) else column


def thinned(course: Channels, step_s: float) -> Channels:
    """Average a whole ride over steps of step_s. A ride with at most one sample per step is returned unchanged."""
    if np.all(np.diff(_stretches(course.t_s, step_s)) > 0.0):
        return course
    return joined(downsampled([course], step_s))


def spacing_s(course: Channels) -> float:
    """Return the median time between samples, in s."""
    return float(np.median(np.diff(course.t_s))) if len(course.t_s) > 1 else 1.0


def downsampled(blocks: Iterable[Channels], step_s: float, rounded: bool = False) -> Iterator[Channels]:
    """Yield the means over each stretch of step_s that has samples. The means ignore NaN.

    For positions and their time, the last value of a stretch is used, because longitudes on both sides of 180 degrees
    have no mean. A ride with at most one sample per stretch is not changed. A stretch may extend over several blocks.

    rounded: a stretch contains the times that round to the same multiple of step_s.
    """
    remainder: Channels | None = None
    for block in blocks:
        block = block if remainder is None else joined([remainder, block])
        step = _stretches(block.t_s, step_s, rounded)
        last = int(np.searchsorted(step, step[-1]))  # the last stretch may continue in the next block
        remainder = block.part(slice(last, None))
        if last:
            yield _means(block.part(slice(0, last)), step[:last])
    if remainder is not None:
        yield _means(remainder, np.zeros(len(remainder.t_s)))


def rounded_to(t_s: Array, step_s: float) -> Array:
    """Round times to multiples of step_s. Two stretches of downsampled(..., rounded=True) never get the same time."""
    return _stretches(t_s, step_s, True) * step_s


def _stretches(t_s: Array, step_s: float, rounded: bool = False) -> Array:
    """Return the number of each sample's stretch."""
    return np.floor(t_s / step_s + 0.5 * rounded + 1e-6)


def _means(block: Channels, step: Array) -> Channels:
    starts = np.flatnonzero(np.diff(step, prepend=-np.inf))
    if len(starts) == len(step):
        return block
    columns = []
    for field in fields(block):
        values = getattr(block, field.name)
        valid = ~np.isnan(values)
        if not np.any(valid):
            columns.append(np.broadcast_to(np.nan, len(starts)))
            continue
        if field.name in _LAST:
            last = np.maximum.reduceat(np.where(valid, np.arange(len(step)), -1), starts)
            columns.append(np.where(last >= 0, values[last], np.nan))
            continue
        count = np.add.reduceat(valid, starts, dtype=float)
        total = np.add.reduceat(np.where(valid, values, 0.0), starts)
        columns.append(np.divide(total, count, out=np.full(len(starts), np.nan), where=count > 0))
    return Channels(*columns)


@dataclass
class LogTrack:
    """m positions. Each field has the shape (m).

    t_s: seconds since the log's first sample.
    lat_deg: degrees north.
    lon_deg: degrees east.
    """

    t_s: Array
    lat_deg: Array
    lon_deg: Array

    def at(self, t_s: Array) -> tuple[Array, Array]:
        """Interpolate the positions along straight lines, also across 180 degrees.

        Results are NaN before the first position, after the last position, and in gaps of over GAP_S.

        t_s: times, shape (n).
        Returns latitude and longitude, each of shape (n), in degrees.
        """
        none = np.full(len(t_s), np.nan)
        if not len(self.t_s):
            return none, none
        next_index = np.clip(np.searchsorted(self.t_s, t_s), 1, max(1, len(self.t_s) - 1))
        before_s, after_s = self.t_s[next_index - 1], self.t_s[np.minimum(next_index, len(self.t_s) - 1)]
        valid = (t_s >= self.t_s[0]) & (t_s <= self.t_s[-1])
        valid &= (after_s - before_s <= GAP_S) | (t_s == before_s) | (t_s == after_s)
        lat = np.interp(t_s, self.t_s, self.lat_deg)
        lon = np.interp(t_s, self.t_s, np.unwrap(self.lon_deg, period=360.0))  # also across 180 degrees
        return np.where(valid, lat, np.nan), np.where(valid, (lon + 180.0) % 360.0 - 180.0, np.nan)


def track(part: Channels | Log) -> LogTrack:
    """Return the positions in a ride, in a part of it, or in a log."""
    valid = np.isfinite(part.lat_deg) & np.isfinite(part.lon_deg)
    return LogTrack(part.t_s[valid], part.lat_deg[valid], part.lon_deg[valid])
