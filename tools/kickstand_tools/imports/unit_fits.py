"""Finds units from what the vehicle does: of a gyro's rates from the turns of gravity, of a speed from the positions.

The rates are fitted by least squares. At rest and in a hand, the direction up of gravity turns in the sensor's axes
by d(up)/dt = up x rate. So over a window of WINDOW_S, the change of up has two parts: the integral of up x reading,
times the unit's factor, and the effect of a constant bias. In a vehicle the force is not only gravity. Then the rates
explain the turns of the force less well, and the factor is too small or not found. All 48 signed permutations of the
gyro's axes are tried: exchanged axes are another mistake, which is checked later.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..checks.axes import PERMUTATIONS
from ..common.messages import Message, Remedy, kind
from ..signals import Array, distance_m, integral, window_means
from .recording import SECOND_NS, Sheet
from .units import SPEEDS, Nanoseconds, factor

CELL_S = 0.05  # readings are averaged over cells of this length
MOST_CELLS = 12_000  # ten minutes are enough to find a unit
WINDOW_S = 0.4
LEAST_TURN = 0.03  # a unit is found only if gravity's turn in the windows has this rms, in rad
STRAIGHT = 0.25  # the force in a cell counts as gravity if its length is this close to the median
EXPLAINED = 0.5  # the rates must explain at least this share of the variance of gravity's turns
# with this share, units that differ by a factor of 2 can be distinguished, as the ranges of raw counts do
CLEARLY = 0.9
FEWEST = 8  # least number of windows
# Gravity keeps its direction over TURNED_S if the mean of its unit vectors is at least KEPT_DIRECTION long. Then the
# mean rate across gravity must not amount to a turn of over MOST_TURNED degrees in this time. The data sheet's largest
# bias, 20 deg/s per axis, amounts to less.
TURNED_S, KEPT_DIRECTION, MOST_TURNED = 2.0, 0.97, 120.0
_NEAR = 1.25  # largest factor between the speed and the speed from positions; units differ by 1.6 or more
_FAR = 4.0  # positions whose speed differs by this factor are wrong: of degrees and minutes, or radians

ImportSpeedUnit = kind(
    "import-speed-unit",
    "column",
    "{column} has no unit, and the positions do not show it, so the speed is left out",
    Remedy("add --units speed=km/h, mph or m/s", "write it in brackets behind that name, as in Speed (km/h)"),
)
ImportPositions = kind(
    "import-positions",
    "columns why",
    "the positions in {columns} are left out: {why}",
    Remedy("name them with --columns lat=...,lon=... if they are right", "export them in degrees"),
)


@dataclass
class RateFit:
    """The result of fit_rates()."""

    factor: float = 0.0  # rad/s in one unit of the readings
    explained: float = 0.0  # explained share of the turns' variance
    turn: float = 0.0  # root mean square of gravity's turn in a window, in rad

    @property
    def decides(self) -> bool:
        """True if the factor is exact enough to choose between very different units."""
        return self.explained >= EXPLAINED and self.turn >= LEAST_TURN and self.factor > 0.0

    def unit_among(self, units: Mapping[str, float]) -> str:
        """The unit that the fit shows, among units with these factors to deg/s; "" if it shows none."""
        if not self.decides:
            return ""
        off = {name: np.log(np.degrees(self.factor) / size) for name, size in units.items()}
        best = min(off, key=lambda name: abs(off[name]))
        gaps = [abs(np.log(units[best] / size)) for name, size in units.items() if name != best]
        near = min(gaps) / 2.0 if gaps else 1.0
        certain = self.explained > CLEARLY or near > 1.5
        return best if abs(off[best]) < min(near, 1.2) and certain else ""


def fit_rates(seconds: Array, force: Array, rates: Array) -> RateFit:
    """Fit rates to forces, both in any unit and of shape (n, 3). Each sensor may have its own rows, NaN elsewhere."""
    cells = _in_cells(seconds, force, rates)
    windows = None if cells is None else _windows(*cells)
    if windows is None:
        return RateFit()
    change, middle, rate = windows
    turn = float(np.sqrt(np.mean(np.sum(change**2, axis=1))))
    best = RateFit(turn=turn)
    if turn < 1e-6:
        return best
    # for each pair of axes i, j: the integral of up x (reading of axis j, used as axis i), (windows, 3, 3, 3)
    turned = np.einsum("ila,wnl,wnj->waij", _LEVI_CIVITA, middle, rate) * CELL_S
    # the turn by a bias of 1 about each axis
    by_bias = (np.einsum("ila,wnl->wai", _LEVI_CIVITA, middle) * CELL_S).reshape(-1, 3)
    inverse = np.linalg.pinv(by_bias.T @ by_bias + 1e-9 * np.eye(3)) @ by_bias.T

    def without_bias(turns: Array) -> Array:
        """Remove the part that a constant bias explains."""
        return turns - by_bias @ (inverse @ turns)

    residual = without_bias(change.ravel())
    for permutation in PERMUTATIONS:
        column = without_bias(np.einsum("waij,ij->wa", turned, permutation).ravel())
        size = float(column @ column)
        if size <= 0.0:
            continue
        factor = float(column @ residual) / size
        explained = 1.0 - float(np.sum((residual - factor * column) ** 2)) / max(float(np.sum(residual**2)), 1e-12)
        if factor > 0.0 and explained > best.explained:
            best = RateFit(factor, explained, turn)
    return best


def _windows(force: Array, rates: Array) -> tuple[Array, Array, Array] | None:
    """The w windows of n cells in which the force is nearly gravity; None if there are few.

    Returns the change of the direction of gravity in each window, shape (w, 3), and in the middle between two cells
    the direction and the rate, shape (w, n, 3).
    """
    length = np.linalg.norm(force, axis=1)
    good = np.abs(length - np.median(length)) < STRAIGHT * np.median(length)
    up = force / np.maximum(length, 1e-9)[:, None]
    span = round(WINDOW_S / CELL_S)
    begins = np.arange(0, len(up) - span, span // 2)
    begins = begins[np.array([np.all(good[begin : begin + span + 1]) for begin in begins], dtype=bool)]
    if len(begins) < FEWEST:
        return None
    within = begins[:, None] + np.arange(span)
    rate = 0.5 * (rates[within] + rates[within + 1])
    rate = rate - np.mean(rate, axis=(0, 1)) if _is_steady(up) else rate
    return up[begins + span] - up[begins], 0.5 * (up[within] + up[within + 1]), rate


def turns_too_far(seconds: Array, force: Array, rates: Array) -> bool:
    """True if rates in deg/s would turn gravity round and round although its direction is constant."""
    cells = _in_cells(seconds, force, rates)
    if cells is None:
        return False
    force, rates = cells
    up = force / np.maximum(np.linalg.norm(force, axis=1), 1e-9)[:, None]
    span = round(TURNED_S / CELL_S)
    direction, rate = (window_means(values, span)[::span] for values in (up, rates))
    along = np.sum(rate * direction, axis=1) / np.maximum(np.sum(direction**2, axis=1), 1e-9)
    across = rate - along[:, None] * direction
    steady = np.linalg.norm(direction, axis=1) > KEPT_DIRECTION
    turns = np.linalg.norm(across, axis=1) * TURNED_S > MOST_TURNED
    return bool(np.count_nonzero(steady & turns) > 0.5 * len(turns))


def _is_steady(up: Array) -> bool:
    """True if gravity keeps its direction. The mean of the rates is then their bias."""
    return float(np.max(np.std(up, axis=0))) < 0.02


def _in_cells(seconds: Array, force: Array, rates: Array) -> tuple[Array, Array] | None:
    """The means of force and rates in cells of CELL_S, each of shape (m, 3); None if the stretch is too short."""
    timed = np.isfinite(seconds)
    seconds, force, rates = seconds[timed], force[timed], rates[timed]
    if len(seconds) < 4:
        return None
    begin, end = float(np.percentile(seconds, 1.0)), float(np.percentile(seconds, 99.0))
    count = int(min((end - begin) / CELL_S, MOST_CELLS))
    if count < 2 * WINDOW_S / CELL_S:
        return None
    edges = begin + CELL_S * np.arange(count + 1)
    within = (seconds >= begin) & (seconds <= edges[-1])
    seconds, force, rates = seconds[within], force[within], rates[within]
    means = []
    for values in (force, rates):
        valid = np.all(np.isfinite(values), axis=1)
        order = np.argsort(seconds[valid], kind="stable")
        times, rows = seconds[valid][order], values[valid][order]
        if len(times) < 4:
            return None
        sums = np.column_stack([np.interp(edges, times, integral(times, column)) for column in rows.T])
        means.append(np.diff(sums, axis=0) / CELL_S)
    return means[0], means[1]


# e[i, l, a] is component a of the cross product of the unit vectors of axis l (of gravity) and axis i (of the rate)
_LEVI_CIVITA = np.cross(np.eye(3)[None, :, :], np.eye(3)[:, None, :])


# The unit of a speed


def doubt_of_positions(time_ns: Nanoseconds, speed_mps: Array, lat: Array, lon: Array) -> str:
    """Return why positions are wrong, or "".

    They must move as fast as the speed, NaN if unknown, says. If latitude and longitude are exchanged, the ratio of
    both speeds changes with the direction.
    """
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

    speed, lat, lon: numbers of columns. per_degree: factors from lat and lon to degrees.
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


def speed_of(
    sheet: Sheet,
    time_ns: Nanoseconds,
    speed: int | None,
    stated: str,
    lat: int | None,
    lon: int | None,
    per_degree: tuple[float, float] = (1.0, 1.0),
) -> tuple[int | None, str, list[Message]]:
    """Return the number of the speed's column, its unit, and notices.

    stated: the unit in the column's name or of the user. If it is no unit of speed, see unit_by_positions(). If they do
    not show it either, the speed is left out: the number is None.
    """
    if speed is None:
        return None, "m/s", []
    speed_unit = stated if stated in SPEEDS else unit_by_positions(sheet, time_ns, speed, lat, lon, per_degree)
    if not speed_unit:
        return None, "m/s", [ImportSpeedUnit(sheet.columns[speed])]
    return speed, speed_unit, []


def _course_mps(time_ns: Nanoseconds, lat: Array, lon: Array) -> Array:
    """The mean speed from the positions over about a second before each row, shape (n), NaN if unknown."""
    steps = np.diff(time_ns)
    rows = max(1, round(SECOND_NS / max(float(np.median(steps)), 1.0))) if len(steps) else 1
    apart_s = np.full(len(time_ns), np.nan)
    apart_s[rows:] = (time_ns[rows:] - time_ns[:-rows]) / SECOND_NS
    east, north = distance_m(np.roll(lat, rows), np.roll(lon, rows), lat, lon)
    return np.where((apart_s > 0.5) & (apart_s < 2.0), np.hypot(east, north) / np.maximum(apart_s, 0.5), np.nan)
