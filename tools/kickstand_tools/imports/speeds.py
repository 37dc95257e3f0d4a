"""Finds the unit of a speed from the positions in the same recording."""

import numpy as np

from ..common.messages import Message, Remedy
from ..signals import Array, distance_m
from .recording import SECOND_NS, Sheet
from .units import SPEEDS, Nanoseconds, factor

_NEAR = 1.25  # largest factor between the speed and the speed from positions; units differ by 1.6 or more
_FAR = 4.0  # positions whose speed differs by this factor are wrong: of degrees and minutes, or radians


class ImportSpeedUnit(Message):
    """The speed is left out because its unit is unknown."""

    column: str

    code = "import-speed-unit"
    text = "{column} has no unit, and the positions do not show it, so the speed is left out"
    todo = Remedy("add --units speed=km/h, mph or m/s", "write it in brackets behind that name, as in Speed (km/h)")


class ImportPositions(Message):
    """The positions are left out, because they are no degrees, or latitude and longitude are exchanged."""

    columns: str
    why: str

    code = "import-positions"
    text = "the positions in {columns} are left out: {why}"
    todo = Remedy("name them with --columns lat=...,lon=... if they are right", "export them in degrees")


def doubt_of_positions(time_ns: Nanoseconds, speed_mps: Array, lat: Array, lon: Array) -> str:
    """Return why positions are wrong, or "".

    They must move as fast as the speed says. If latitude and longitude are exchanged, the ratio of both speeds changes
    with the direction. speed_mps: NaN if unknown."""
    if np.any(np.abs(lat) > 90.0) or np.any(np.abs(lon) > 180.0):
        return "they are no degrees"

    def ratios(north: Array, east: Array) -> Array:
        course_mps = _course_mps(time_ns, north, east)
        return course_mps[(course_mps > 0.0) & (speed_mps > 3.0)] / speed_mps[(course_mps > 0.0) & (speed_mps > 3.0)]

    def spread(ratio: Array) -> float:
        return float(np.median(np.abs(np.log(ratio / np.median(ratio))))) if len(ratio) > 20 else np.nan

    own, exchanged = ratios(lat, lon), ratios(lon, lat)
    if np.all(np.abs(lon[np.isfinite(lon)]) <= 90.0) and spread(exchanged) < 0.5 * spread(own) > 0.025:
        return "latitude and longitude are exchanged"
    factor_off = float(np.median(own)) if len(own) > 20 else 1.0
    return "" if 1.0 / _FAR < factor_off < _FAR else "they do not move as fast as the speed says: are they degrees?"


def unit_by_positions(
    sheet: Sheet,
    time_ns: Nanoseconds,
    speed: int,
    lat: int | None,
    lon: int | None,
    per_degree: tuple[float, float] = (1.0, 1.0),
) -> str:
    """Return the unit in which the speeds fit the changes of position, or "" if several units or none fit.

    speed, lat, lon: numbers of columns. per_degree: factors from the columns to degrees of latitude and longitude.
    """
    if lat is None or lon is None:
        return ""
    course_mps = _course_mps(time_ns, sheet.numbers(lat) * per_degree[0], sheet.numbers(lon) * per_degree[1])
    speeds = sheet.numbers(speed)
    fast = np.isfinite(course_mps) & np.isfinite(speeds) & (course_mps > 3.0)
    if np.count_nonzero(fast) < 20:
        return ""
    ratio = float(np.median(speeds[fast] / course_mps[fast]))
    near = {name: max(ratio * factor(name, SPEEDS, ""), 1.0 / (ratio * SPEEDS[name])) for name in SPEEDS if ratio > 0.0}
    best = min(near, key=lambda name: near[name]) if near else ""
    return best if best and near[best] < _NEAR else ""


def _course_mps(time_ns: Nanoseconds, lat: Array, lon: Array) -> Array:
    """Return the mean speed from the positions over about a second before each row, shape (n). NaN if unknown."""
    steps = np.diff(time_ns)
    rows = max(1, round(SECOND_NS / max(float(np.median(steps)), 1.0))) if len(steps) else 1
    apart_s = np.full(len(time_ns), np.nan)
    apart_s[rows:] = (time_ns[rows:] - time_ns[:-rows]) / SECOND_NS
    east, north = distance_m(np.roll(lat, rows), np.roll(lon, rows), lat, lon)
    return np.where((apart_s > 0.5) & (apart_s < 2.0), np.hypot(east, north) / np.maximum(apart_s, 0.5), np.nan)
