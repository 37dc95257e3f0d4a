"""The content of an app's files: tables, and the sensors in them, each on its own clock, in a log's units and signs.

join() brings the sensors on the accelerometer's clock.
"""

import csv
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from kickstand.units import LOST_US

from ..common.messages import InputError, Message
from ..logs.csv_text import MOST_DPS, MOST_G, TRACK, Cells, cells_of, columns_of_text, numbers_of, separator_of
from ..logs.even_times import even_times
from ..logs.log import Log
from ..signals import Array, Bools, Ints
from .files import RecordingFile
from .units import ACCELERATIONS, NO_TIME, RATES, REPEATED, SPEEDS, Nanoseconds, factor, times_ns

LONG = 6  # a common beginning of several names is not repeated if it has at least this many characters
SECOND_NS = 10**9
_ABSURD = 1e6  # in g or deg/s; a larger value is a damaged cell


@dataclass
class Sheet:
    """A table as columns."""

    name: str  # the file's name in messages
    columns: list[str]  # the columns' names in the file. A name may occur twice.
    cells: list[Cells]  # the cells of each column
    left_out: int = 0  # number of damaged rows
    head: str = ""  # the lines above the rows
    unread: str = ""  # columns of a sensor that hold no numbers, in words

    def place(self, *names: str) -> int | None:
        """The number of the column with the first of these names that exists, compared by plain(); None without one."""
        wanted = [plain(name) for name in names]
        names_here = [plain(column) for column in self.columns]
        return next((names_here.index(name) for name in wanted if name in names_here), None)

    def axes(self, *names: str | tuple[str, ...]) -> tuple[list[int], list[str]]:
        """Return place() of each name, and the names of missing columns. A tuple has alternatives for one column; if
        all are missing, the first is returned."""
        groups = [name if isinstance(name, tuple) else (name,) for name in names]
        places_of = {alternatives[0]: self.place(*alternatives) for alternatives in groups}
        places = [place for place in places_of.values() if place is not None]
        return places, [name for name, place in places_of.items() if place is None]

    def times(self, place: int, unit: str = "s") -> Nanoseconds:
        """Return a column as times, shape (n). unit: of numbers, "" to find it from them. Raises InputError."""
        return times_ns(self.cells[place], unit, self.name)

    def named(self, places: list[int]) -> str:
        """The names of the file and of some columns, for messages, without units and repeated beginnings."""
        names = [re.sub(r"[(\[].*?[)\]]", "", self.columns[place]).strip(" ,;") for place in places]
        same = len(os.path.commonprefix(names)) if len(names) > 2 else 0  # noqa: RUF071 - letters, no path
        if same > LONG:
            names[1:] = ["…" + name[same:] for name in names[1:]]
        return f"{self.name}: {', '.join(names)}"

    def numbers(self, place: int | None) -> Array:
        """Return a column as numbers, shape (n), NaN for a cell without a number. All are NaN if place is None."""
        if place is None:
            return np.full(len(self.cells[0]), np.nan)
        return numbers_of(self.cells[place]).astype(float)

    def table(self, places: list[int]) -> Array:
        """Return several columns as numbers, shape (n, columns). Numbers whose sums would overflow are NaN."""
        values = np.column_stack([self.numbers(place) for place in places])
        return np.where(np.abs(values) < 1e12, values, np.nan)


def plain(name: str) -> str:
    """Reduce a column's name for comparison: lower-case letters and digits, without its unit in brackets."""
    return re.sub(r"[\W_]", "", re.sub(r"[(\[].*?[)\]]", "", name).lower())


def increases(numbers: Cells) -> bool:
    """True if a column can be a time, because it increases and hardly ever decreases."""
    good = numbers[np.isfinite(numbers.astype(float))].astype(float)
    steps = np.diff(good)
    return len(steps) > 2 and bool(np.mean(steps < 0.0) < 0.02 and np.mean(steps > 0.0) > 0.01 and good[-1] > good[0])


def unit_in(name: str) -> str:
    """The unit in brackets in a column's name, or ""."""
    match = re.search(r"[(\[]([^)\]]*)[)\]]\s*$", name)
    return match[1].strip() if match else ""


def cells_in(line: str, separator: str = "") -> list[str]:
    """The cells of a line, without blanks around them. An empty list if the line is blank or not CSV.

    separator: " " for any blanks, "" to find it in the line.
    """
    if separator == " " or not line.strip():
        return line.split()
    try:
        return [cell.strip() for cell in cells_of(line, separator or separator_of(line))]
    except csv.Error:
        return []


def first_names(file: RecordingFile) -> list[str]:
    """The cells of a file's first line that is not blank."""
    return cells_in(next(iter(file.first_lines(1)), ""))


def names_line(file: RecordingFile, fits: Callable[[list[str]], bool], most: int = 60) -> int | None:
    """The number of the first line whose cells fit, among the first `most` lines; None without such a line."""
    lines = file.text.split("\n", most)[:most]  # including blank lines, because line numbers count them
    return next((k for k, line in enumerate(lines) if fits(cells_in(line))), None)


def read_sheet(file: RecordingFile, header: int = 0, skipped: int = 0) -> Sheet:
    """Read the table below the line of names `header` and `skipped` further lines. Raises InputError without one."""
    lines = file.text.split("\n", header + skipped + 1)
    if len(lines) < header + skipped + 2 or not lines[-1].strip():
        raise InputError(f"{file.name}: no rows under the names of the columns: was anything recorded?")
    columns = cells_in(lines[header])
    while columns and not columns[-1]:
        columns.pop()  # empty names at the end come from lines that end in a separator
    text, separator = lines[-1], separator_of(lines[header])
    return Sheet(file.name, columns, *columns_of_text(text, separator, max(len(columns), 1)))


@dataclass
class Taken:
    """The source of a quantity: the file and the columns, their unit, and the change of sign."""

    quantity: str
    source: str
    unit: str
    rate_hz: float = 0.0  # samples per second, 0 if unknown
    sign: str = ""
    why: str = ""  # the reason for this choice, "" if the app's format defines it


def rate_hz(time_ns: Nanoseconds) -> float:
    """Samples per second, without the gaps; 0 if there are too few samples."""
    steps = np.diff(time_ns[time_ns > REPEATED])
    if not np.any(steps > 0):
        return 0.0
    usual = (steps >= 0) & (steps < 5.0 * np.median(steps[steps > 0]))
    return SECOND_NS * int(np.count_nonzero(usual)) / float(np.sum(steps[usual]))


@dataclass
class RecordedSensor:
    """n samples of an accelerometer or a gyro."""

    name: str  # name in messages
    time_ns: Nanoseconds  # times of the recorder's clock, shape (n)
    # Shape (n, 3). Accelerations are in g, +1 along the axis that points up at rest. Rates are in deg/s, right-handed.
    values: Array
    # Number of rows that are left out because they have too many cells, or a time or value that cannot be read. A row
    # without values does not count, because it belongs to another sensor.
    damaged: int = 0
    taken: list[Taken] = field(default_factory=list)

    def __post_init__(self) -> None:
        without = (self.time_ns == REPEATED) | np.all(np.isnan(self.values), axis=1)
        good = (self.time_ns > REPEATED) & np.all(np.abs(self.values) < _ABSURD, axis=1)  # False for NaN
        self.damaged += int(np.count_nonzero(~good & ~without))
        self.time_ns, self.values = self.time_ns[good], self.values[good]


def sensor_of(
    sheet: Sheet,
    time_ns: Nanoseconds,
    places: list[int],
    quantity: str,
    unit: str,
    sign: str,
    turn: float | Array = 1.0,
) -> RecordedSensor:
    """Make a sensor of three columns of a sheet. Raises InputError for an unknown unit.

    quantity: "accelerometer" or "gyro".
    sign: the columns' sign, in words.
    turn: -1 if a log has the opposite sign; one number, or one per axis.
    """
    scale = turn * factor(unit, ACCELERATIONS if quantity == "accelerometer" else RATES, sheet.name)
    taken = Taken(quantity, sheet.named(places), unit, rate_hz(time_ns), sign)
    return RecordedSensor(quantity, time_ns, sheet.table(places) * scale, sheet.left_out, [taken])


def sensors_of(
    sheet: Sheet,
    time_ns: Nanoseconds,
    places: list[int],
    signs: tuple[str, str],
    units: tuple[str, str] = ("g", "deg/s"),
    turns: tuple[float | Array, float | Array] = (1.0, 1.0),
) -> tuple[RecordedSensor, RecordedSensor]:
    """Make the accelerometer and the gyro of six columns of a sheet: see sensor_of()."""
    accel = sensor_of(sheet, time_ns, places[:3], "accelerometer", units[0], signs[0], turns[0])
    return accel, sensor_of(sheet, time_ns, places[3:], "gyro", units[1], signs[1], turns[1])


@dataclass
class ReceiverTrack:
    """The m values of a satellite receiver on the recorder's clock, NaN if missing. Positions are north and east."""

    time_ns: Nanoseconds
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    taken: list[Taken] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Drop rows that repeat the previous values."""
        self.speed_mps = np.where(self.speed_mps >= 0.0, self.speed_mps, np.nan)  # a phone writes -1 for unknown
        nowhere = (self.lat_deg == 0.0) & (self.lon_deg == 0.0)
        nowhere |= ~((np.abs(self.lat_deg) <= 90.0) & (np.abs(self.lon_deg) <= 180.0))
        self.lat_deg, self.lon_deg = (np.where(nowhere, np.nan, place) for place in (self.lat_deg, self.lon_deg))
        values = np.column_stack((self.speed_mps, self.lat_deg, self.lon_deg))
        filled = (self.time_ns != NO_TIME) & ~np.all(np.isnan(values), axis=1)
        rows = np.flatnonzero(filled)
        same = np.all((values[rows][1:] == values[rows][:-1]) | np.isnan(values[rows][1:]), axis=1)
        same &= np.diff(self.time_ns[rows] // SECOND_NS) == 0  # at a standstill, values are kept once per second
        rows = np.delete(rows, np.flatnonzero(same) + 1)
        self.time_ns, (self.speed_mps, self.lat_deg, self.lon_deg) = self.time_ns[rows], values[rows].T


def track_of(
    sheet: Sheet,
    time_ns: Nanoseconds,
    speed: int | None,
    lat: int | None,
    lon: int | None,
    speed_unit: str = "m/s",
    per_degree: tuple[float, float] = (1.0, 1.0),
) -> ReceiverTrack | None:
    """Speed and position from columns of a sheet; None without either.

    per_degree: factors from the columns to degrees of latitude and longitude.
    """
    if speed is None and (lat is None or lon is None):
        return None
    speed_mps = sheet.numbers(speed) * factor(speed_unit, SPEEDS, "speed")
    track = ReceiverTrack(time_ns, speed_mps, sheet.numbers(lat) * per_degree[0], sheet.numbers(lon) * per_degree[1])
    hz = rate_hz(track.time_ns)
    if speed is not None:
        track.taken.append(Taken("speed", sheet.named([speed]), speed_unit, hz))
    if lat is not None and lon is not None:
        track.taken.append(Taken("position", sheet.named([lat, lon]), "degrees", hz))
    return track


@dataclass
class AppRecording:
    """The sensors of one recording."""

    app: str
    accel: RecordedSensor
    gyro: RecordedSensor
    track: ReceiverTrack | None = None
    temp_c: Array | None = None
    notices: list[Message] = field(default_factory=list)
    utc_ns: int | None = None  # UTC in ns since 1970, minus the recorder's clock. None if unknown.
    # True if x already points left, y up and z forward on the vehicle, provided that the logger was mounted as its
    # maker requires
    vehicle_axes: bool = False
    # True if the app's maker or its files show that up reads +1 g at rest. False if this is only likely.
    sign_known: bool = True

    @property
    def taken(self) -> list[Taken]:
        """The sources of all quantities."""
        return [*self.accel.taken, *self.gyro.taken, *(self.track.taken if self.track else [])]


Find = Callable[[list[RecordingFile]], list[list[RecordingFile]]]


@dataclass(frozen=True)
class App:
    """An app or a logger whose exports are known."""

    name: str
    find: Find  # returns one list of files per recording of this app among some files
    # Called with the files of one recording, and with the recording's name in messages. Raises InputError.
    read: Callable[..., AppRecording]
    # True if the files do not name the unit of the speed. Then `read` also takes the unit of the user, or "".
    asks_speed: bool = False


def each_file(is_recording: Callable[[RecordingFile], bool]) -> Find:
    """Return App.find for an app that writes each recording to one file."""
    return lambda files: [[file] for file in files if is_recording(file)]


# The join of the sensors

MOST_OF_TRACK = 200.0  # largest speed in m/s; degrees of latitude and longitude are smaller too
GAP_NS = LOST_US * 1000  # no interpolation between samples that are further apart
FASTER = 1.5  # a gyro with over FASTER times the accelerometer's rate is averaged over each accelerometer sample
MANY = 0.02  # a larger share of readings over MOST_G or MOST_DPS means another unit, not damaged cells
SHUFFLED_NS = 500_000_000  # samples in the wrong order are sorted if they are less late than this
# samples are sorted only if at most the share MOST_LATE is late by over LATE_STEPS median steps
LATE_STEPS, MOST_LATE = 4.0, 0.02
MOST_HZ = 10_000.0  # a sensor with a higher rate is refused; the fastest have 8,000 Hz


def join(recording: AppRecording, name: str) -> tuple[Log, int]:
    """Join the sensors on the accelerometer's clock. name: the recording's name in messages.

    Returns the log, and the number of damaged rows that are left out. Raises InputError, for example if the sensors
    have no time in common.
    """
    accel = in_order(recording.accel, name)
    gyro = in_order(recording.gyro, name)
    rates = on_clock(gyro, accel.time_ns, step_ns(accel))
    impossible = np.any(np.abs(accel.values) > MOST_G, axis=1) | np.any(np.abs(rates) > MOST_DPS, axis=1)
    impossible_count = int(np.count_nonzero(impossible))
    if impossible_count > MANY * len(impossible):
        raise InputError(f"{name}: its readings are past any sensor's, {_most(accel.values, rates)}: check their units")
    valid = np.all(np.isfinite(rates), axis=1) & ~impossible
    if np.count_nonzero(valid) < 2:
        raise InputError(f"{name}: accelerometer and gyro have no time in common: were they recorded together?")
    wrong_times = len(recording.accel.time_ns) - len(accel.time_ns)
    # The larger number is used, not the sum, because the same rows may contain both sensors
    unreadable = max(recording.accel.damaged, recording.gyro.damaged)
    temp_c = recording.temp_c
    if temp_c is None or len(temp_c) != len(valid):
        temp_c = np.full(len(valid), np.nan)
    time_ns = accel.time_ns[valid]
    since_s = (time_ns - accel.time_ns[0]) * 1e-9
    track = _on_rows(recording.track, time_ns, recording.utc_ns)
    log = Log(since_s, accel.values[valid], rates[valid], temperature_c=temp_c[valid], name=name, **track)
    return log, impossible_count + wrong_times + unreadable


def in_order(sensor: RecordedSensor, name: str) -> RecordedSensor:
    """Return the sensor with even, increasing times. Raises InputError if that is impossible."""
    if len(sensor.time_ns) < 2:
        raise InputError(f"{name}: {sensor.name} has {len(sensor.time_ns)} samples: was it recorded?")
    time_ns, values = _sorted(sensor, name)
    since_s = (time_ns - time_ns[0]) * 1e-9
    even_ns = np.rint(even_times(since_s, f"{name}, {sensor.name}") * 1e9).astype(np.int64) + time_ns[0]
    hz = 1e9 / float(np.median(np.diff(even_ns)))
    if hz > MOST_HZ:
        raise InputError(
            f"{name}: {sensor.name} has {hz:.0f} samples per second, and no sensor has over {MOST_HZ:.0f}: are "
            "these values times, and is their unit right?"
        )
    return replace(sensor, time_ns=even_ns, values=values)


def _sorted(sensor: RecordedSensor, name: str) -> tuple[Nanoseconds, Array]:
    """Times and values in the order of time, without damaged times. Raises InputError if many samples are late."""
    time_ns, values = sensor.time_ns, sensor.values
    if np.mean(np.diff(time_ns) < 0) > 1.0 - MOST_LATE:  # newest first
        time_ns, values = time_ns[::-1], values[::-1]
    valid = ~_damaged(time_ns)
    time_ns, values = time_ns[valid], values[valid]
    late_ns = np.maximum.accumulate(time_ns) - time_ns
    steps = np.diff(time_ns)
    usual_ns = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    if np.count_nonzero(late_ns > LATE_STEPS * usual_ns) > MOST_LATE * len(late_ns):
        goes_back = np.flatnonzero(steps < 0)
        raise InputError(
            f"{name}: the time of {sensor.name} goes back {len(goes_back)} times, first in its row "
            f"{goes_back[0] + 2}: is it the time since the recording's beginning?"
        )
    if np.any(late_ns) and np.max(late_ns) < SHUFFLED_NS:
        order = np.argsort(time_ns, kind="stable")
        time_ns, values = time_ns[order], values[order]
    return time_ns, values


def _damaged(time_ns: Ints) -> Bools:
    """Find single wrong times, shape (n): the times before and after it fit each other, but not this time."""
    wrong = np.zeros(len(time_ns), dtype=bool)
    if len(time_ns) > 2:
        previous, now, following = time_ns[:-2], time_ns[1:-1], time_ns[2:]
        fits = (following >= previous) & (following - previous < 2 * SHUFFLED_NS)
        wrong[1:-1] = fits & ((now < previous - SHUFFLED_NS) | (now > following + SHUFFLED_NS))
        wrong[0] = time_ns[0] > time_ns[1] + SHUFFLED_NS and time_ns[2] >= time_ns[1]
        wrong[-1] = time_ns[-1] < time_ns[-2] - SHUFFLED_NS and time_ns[-2] >= time_ns[-3]
    return wrong


def on_clock(sensor: RecordedSensor, clock_ns: Ints, period_ns: float) -> Array:
    """A sensor's values at the n times of another clock, shape (n, 3), NaN outside its own times and in gaps.

    Values are interpolated linearly. If the sensor is faster than the clock, they are averaged over period_ns.
    """
    is_faster = step_ns(sensor) * FASTER < period_ns
    readings = _averaged(sensor, period_ns) if is_faster else sensor.values
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
    """Interpolate linearly between the values that are not NaN. The result is NaN before and after them."""
    valid = ~np.isnan(values)
    if not np.any(valid):
        return np.full(len(times), np.nan)
    return np.interp(times, since[valid], values[valid], left=np.nan, right=np.nan)


def _averaged(sensor: RecordedSensor, over_ns: float) -> Array:
    """A sensor's values, each averaged over the time over_ns around it, shape (n, 3)."""
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
    """The columns TRACK, each of shape (n), NaN if empty. A value of the track is in the row nearest in time.

    time_ns: increasing times of the log's rows, shape (n). The track has times of its own, shape (m).
    """
    columns = {name: np.full(len(time_ns), np.nan) for name in TRACK}
    if utc_ns is not None:
        columns["utc_s"][0] = (time_ns[0] + utc_ns) * 1e-9  # also a log without a track shows when it began
    if track is None or not len(track.time_ns):
        return columns
    following = np.clip(np.searchsorted(time_ns, track.time_ns), 1, len(time_ns) - 1)
    previous_is_nearer = track.time_ns - time_ns[following - 1] < time_ns[following] - track.time_ns
    row = np.where(previous_is_nearer, following - 1, following)
    near = np.abs(time_ns[row] - track.time_ns) <= GAP_NS
    for name in ("speed_mps", "lat_deg", "lon_deg"):
        values = getattr(track, name)
        good = near & np.isfinite(values) & (np.abs(values) < MOST_OF_TRACK)
        columns[name][row[good]] = values[good]
    if utc_ns is not None:
        columns["utc_s"][row[near]] = (time_ns[row[near]] + utc_ns) * 1e-9
    return columns
