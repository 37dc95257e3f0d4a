"""The content of an app's files. A Sheet is a table as columns of numbers; its separator, decimal mark and names are
found. An AppRecording has the sensors, each on its own clock, in a log's units and signs."""

import csv
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..common.messages import InputError, Message
from ..logs.csv_text import Cells, cells_of, columns_of_text, numbers_of, separator_of
from ..signals import Array
from .files import RecordingFile
from .units import ACCELERATIONS, NO_TIME, RATES, REPEATED, SPEEDS, Nanoseconds, factor, times_ns

LONG = 6  # a common beginning of several names is not repeated if it has at least this many characters
SECOND_NS = 10**9
_ABSURD = 1e6  # in g or deg/s; a larger value is a damaged cell


@dataclass
class Sheet:
    """A table as columns.

    name: the file's name in messages.
    columns: the columns' names in the file. A name may occur twice.
    cells: the cells of each column.
    left_out: number of damaged rows.
    head: the lines above the rows.
    unread: columns of a sensor that hold no numbers, in words.
    """

    name: str
    columns: list[str]
    cells: list[Cells]
    left_out: int = 0
    head: str = ""
    unread: str = ""

    def place(self, *names: str) -> int | None:
        """Find the first of these names that a column has, compared by plain(). Return the column's number, or None."""
        wanted = [plain(name) for name in names]
        names_here = [plain(column) for column in self.columns]
        return next((names_here.index(name) for name in wanted if name in names_here), None)

    def axes(self, *names: str | tuple[str, ...]) -> tuple[list[int], list[str]]:
        """Return place() of each name, and the names of missing columns.

        A name may be a tuple of alternatives. Then the first name that exists counts. If all alternatives are missing,
        the first is returned as missing."""
        groups = [name if isinstance(name, tuple) else (name,) for name in names]
        places_of = {alternatives[0]: self.place(*alternatives) for alternatives in groups}
        places = [place for place in places_of.values() if place is not None]
        return places, [name for name, place in places_of.items() if place is None]

    def times(self, place: int, unit: str = "s") -> Nanoseconds:
        """Return a column as times, shape (n). Raises InputError.

        unit: the unit of numbers, or "" to find it from the numbers."""
        return times_ns(self.cells[place], unit, self.name)

    def named(self, places: list[int]) -> str:
        """The names of the file and of some columns, for messages. Units are left out, and a common beginning is not
        repeated."""
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


def names_in(line: str) -> list[str]:
    """The cells of a line of names. An empty list if the line is blank or not CSV."""
    try:
        return [] if not line.strip() else [cell.strip() for cell in cells_of(line, separator_of(line))]
    except csv.Error:
        return []


def first_names(file: RecordingFile) -> list[str]:
    """The cells of a file's first line that is not blank."""
    return names_in(next(iter(file.first_lines(1)), ""))


def names_line(file: RecordingFile, fits: Callable[[list[str]], bool], most: int = 60) -> int | None:
    """The number of the first line whose cells fit, among the first `most` lines. None without such a line."""
    lines = file.text.split("\n", most)[:most]  # including blank lines, because line numbers count them
    return next((k for k, line in enumerate(lines) if fits(names_in(line))), None)


def read_sheet(file: RecordingFile, header: int = 0, skipped: int = 0) -> Sheet:
    """Read the table of a file. header: number of the line of names. skipped: lines after it that are not data. Raises
    InputError if there is no table.
    """
    lines = file.text.split("\n", header + skipped + 1)
    if len(lines) < header + skipped + 2 or not lines[-1].strip():
        raise InputError(f"{file.name}: no rows under the names of the columns: was anything recorded?")
    columns = names_in(lines[header])
    while columns and not columns[-1]:
        columns.pop()  # empty names at the end come from lines that end in a separator
    text, separator = lines[-1], separator_of(lines[header])
    return Sheet(file.name, columns, *columns_of_text(text, separator, max(len(columns), 1)))


@dataclass
class Taken:
    """The source of a quantity: the file and the columns, their unit, and the change of sign.

    rate_hz: samples per second, 0 if unknown. why: the reason for this choice, "" if the app's format defines it.
    """

    quantity: str
    source: str
    unit: str
    rate_hz: float = 0.0
    sign: str = ""
    why: str = ""


def rate_hz(time_ns: Nanoseconds) -> float:
    """Samples per second, without the gaps; 0 if there are too few samples."""
    steps = np.diff(time_ns[time_ns > REPEATED])
    if not np.any(steps > 0):
        return 0.0
    usual = (steps >= 0) & (steps < 5.0 * np.median(steps[steps > 0]))
    return SECOND_NS * int(np.count_nonzero(usual)) / float(np.sum(steps[usual]))


@dataclass
class RecordedSensor:
    """n samples of an accelerometer or a gyro.

    name: name in messages.
    time_ns: times of the recorder's clock, shape (n).
    values: shape (n, 3). Accelerations are in g, +1 along the axis that points up at rest. Rates are in deg/s,
        right-handed.
    damaged: number of rows that are left out because they have too many cells, or a time or value that cannot be read.
        A row without values does not count, because it belongs to another sensor.
    taken: the source.
    """

    name: str
    time_ns: Nanoseconds
    values: Array
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
    """Make a sensor of three columns of a sheet. quantity: "accelerometer" or "gyro". sign: the columns' sign, in
    words. turn: -1 if a log has the opposite sign; one number, or one per axis. Raises InputError for an unknown
    unit."""
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
    """The m values of a satellite receiver on the recorder's clock: speed in m/s, position in degrees north and east. A
    missing value is NaN."""

    time_ns: Nanoseconds
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    taken: list[Taken] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Drop rows that repeat the previous values, and speeds below 0, which phones use for an unknown speed."""
        self.speed_mps = np.where(self.speed_mps >= 0.0, self.speed_mps, np.nan)
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
    """Speed and position from the columns of a sheet with these numbers. None without either.

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
    """The sensors of one recording.

    app: the app's name.
    utc_ns: UTC in ns since 1970, minus the recorder's clock. None if unknown.
    vehicle_axes: True if x already points left, y up and z forward on the vehicle, provided that the logger was mounted
        as its maker requires.
    sign_known: True if the app's maker or its files show that up reads +1 g at rest. False if this is only likely.
    """

    app: str
    accel: RecordedSensor
    gyro: RecordedSensor
    track: ReceiverTrack | None = None
    temp_c: Array | None = None
    notices: list[Message] = field(default_factory=list)
    utc_ns: int | None = None
    vehicle_axes: bool = False
    sign_known: bool = True

    @property
    def taken(self) -> list[Taken]:
        """The sources of all quantities."""
        return [*self.accel.taken, *self.gyro.taken, *(self.track.taken if self.track else [])]


Find = Callable[[list[RecordingFile]], list[list[RecordingFile]]]


@dataclass(frozen=True)
class App:
    """An app or a logger whose exports are known.

    find: returns one list of files per recording of this app among some files.
    read: called with the files of one recording, and with the recording's name in messages. Raises InputError.
    asks_speed: True if the files do not name the unit of the speed. Then `read` also takes the unit of the user, or "".
    """

    name: str
    find: Find
    read: Callable[..., AppRecording]
    asks_speed: bool = False


def each_file(is_recording: Callable[[RecordingFile], bool]) -> Find:
    """Return App.find for an app that writes each recording to one file."""
    return lambda files: [[file] for file in files if is_recording(file)]
