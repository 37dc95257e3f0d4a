"""A log in memory (Log), a part of it between two times (Stretch), and its means over bins of time (LogBins)."""

from collections.abc import Container, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from kickstand.units import AXES
from numpy.typing import ArrayLike, NDArray

from ..common.installation import extra
from ..common.messages import InputError, Message
from ..signals import Array, Bins, Bools, Ints, bin_numbers, binned, intervals, runs
from .csv_text import TRACK
from .source import File, name_of

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Schema

PART_SAMPLES = 15_000  # most samples in a part of Log.parts()
ROOM_TEMP_C = 25.0  # temperature for the firmware's modules if a log has no temperature

FirmwareRow = tuple[int, list[float], float]

BIN_S = 0.1  # length of a bin; faster changes are vibration
MOST_BINS = 36_000  # number of bins with samples that are used: one hour
GAP_BINS = 3  # number of successive bins without samples that make a gap; fewer bins are interpolated


@dataclass
class Table:
    """A dataclass whose arrays have one row per sample. Fields that are not arrays describe the whole table."""

    def columns(self) -> dict[str, NDArray[Any]]:
        """The arrays of the table, by the names of their fields."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def part(self, which: slice | Bools) -> Self:
        """Select samples by a slice or n booleans. With a slice, the result's arrays are views of these arrays."""
        return replace(self, **{name: values[which] for name, values in self.columns().items()})

    def to_pandas(self) -> "DataFrame":
        """A data frame of columns(). Raises InputError if pandas is not installed."""
        try:
            from pandas import DataFrame
        except ImportError as error:
            raise InputError("data frames need pandas: " + extra("rides")) from error
        return DataFrame(self.columns())


def float_schema(units: Mapping[str, str], fine: Container[str], about: dict[str, str]) -> "Schema":
    """Return the schema of a Parquet file.

    units: the unit of each column, by the column's name.
    fine: names of the columns that are 64-bit floats. All other columns are 32-bit floats.
    """
    import pyarrow

    return pyarrow.schema(
        [
            pyarrow.field(name, pyarrow.float64() if name in fine else pyarrow.float32(), metadata={"unit": unit})
            for name, unit in units.items()
        ],
        metadata=about,
    )


class Sparse:
    """A column of n numbers of which few are known, in increasing rows. It uses memory for the known numbers only."""

    def __init__(self, rows: Ints, values: Array, n: int) -> None:
        self._rows, self._values, self._n = rows, values, n

    def __len__(self) -> int:
        return self._n

    def __getitem__(self, which: slice | Bools) -> Array:
        """Return part of the column, NaN for a number that is not known. The whole column is read-only."""
        if not isinstance(which, slice):
            return self[:][which]
        begin, end, _ = which.indices(self._n)
        if not len(self._rows):
            return np.broadcast_to(np.nan, end - begin)
        within = slice(*np.searchsorted(self._rows, (begin, end)).tolist())
        column = np.full(end - begin, np.nan)
        column[self._rows[within] - begin] = self._values[within]
        column.flags.writeable = len(column) < self._n  # a change would be lost
        return column


@dataclass(eq=False)
class Log(Table):
    """One recording of n samples, in the sensor's own axes.

    t_s: time in s since the first sample, increasing, shape (n).
    accel_g: specific force in g, shape (n, 3).
    gyro_dps: angular rate in deg/s, shape (n, 3).
    speed_mps, temperature_c: speed in m/s and temperature in degrees Celsius, shape (n), optional.
    lat_deg, lon_deg: latitude and longitude in degrees, shape (n), optional.
    utc_s: Universal Time in s since 1970, shape (n), optional.
    start_s: the recorder's own time at the first sample, in s.
    own_times: False if reading the log has changed its times.

    Optional arrays are NaN in samples without a new value. t_s may start at any value, which is added to start_s.
    Raises InputError for wrong shapes and for times that do not increase.

    >>> t_s = np.arange(300) / 100.0
    >>> log = Log(t_s, accel_g=np.tile([0.0, 1.0, 0.0], (300, 1)), gyro_dps=np.zeros((300, 3)))
    >>> float(log.t_s[-1]), log.accel_g.shape
    (2.99, (300, 3))
    """

    t_s: Array
    accel_g: Array
    gyro_dps: Array
    speed_mps: Array = field(default_factory=lambda: np.zeros(0))
    temperature_c: Array = field(default_factory=lambda: np.zeros(0))
    start_s: float = 0.0
    name: str = "the log"
    notices: list[Message] = field(default_factory=list)
    lat_deg: Array = field(default_factory=lambda: np.zeros(0))
    lon_deg: Array = field(default_factory=lambda: np.zeros(0))
    utc_s: Array = field(default_factory=lambda: np.zeros(0))
    own_times: bool = True

    def __post_init__(self) -> None:
        self.t_s = np.asarray(self.t_s, dtype=float)
        self.accel_g, self.gyro_dps = np.asarray(self.accel_g, float), np.asarray(self.gyro_dps, float)
        n = len(self.t_s)
        self._sparse = {name: vars(self).pop(name) for name in TRACK if isinstance(getattr(self, name), Sparse)}
        shapes = {"t_s": (n,), "accel_g": (n, 3), "gyro_dps": (n, 3)}
        for name in (*TRACK, "temperature_c"):
            if name not in self._sparse:
                values = np.asarray(getattr(self, name), dtype=float)
                setattr(self, name, values if values.size else np.full(n, np.nan))
                shapes[name] = (n,)
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InputError(f"{self.name}: {name} has the shape {getattr(self, name).shape}, it must be {shape}")
        if n and not np.all(np.diff(np.rint(self.t_s * 1e6)) > 0):
            raise InputError(f"{self.name}: the time t_s must increase from sample to sample")
        if n and self.t_s[0] != 0.0:
            self.start_s += float(self.t_s[0])
            self.t_s = self.t_s - self.t_s[0]

    def __getattr__(self, name: str) -> Any:  # called only for the names in self._sparse
        if name in TRACK:
            return self._sparse[name][:]
        raise AttributeError(name)

    @classmethod
    def from_readings(cls, readings: ArrayLike, rate_hz: float, name: str = "the log") -> "Log":
        """Make a log from readings in the chip's order.

        readings: acceleration (3 columns, g), temperature (deg C) and rate (3 columns, deg/s), shape (n, 7).
        """
        table = np.asarray(readings, dtype=float)
        return cls(np.arange(len(table)) / rate_hz, table[:, :3], table[:, 4:], temperature_c=table[:, 3], name=name)

    @property
    def time_us(self) -> Ints:
        """The time since the first sample in microseconds, the firmware's unit, shape (n)."""
        return np.rint(self.t_s * 1e6).astype(np.int64)

    @property
    def readings(self) -> Array:
        """The samples in the form of from_readings(), shape (n, 7)."""
        return np.column_stack((self.accel_g, self.temperature_c, self.gyro_dps))

    @property
    def has_temperature(self) -> bool:
        return bool(np.any(~np.isnan(self.temperature_c)))

    @property
    def start_utc_s(self) -> float | None:
        """Universal Time at the first sample in s, None if unknown: the median, as a receiver sends some times late."""
        has_time = np.isfinite(self.utc_s)
        return float(np.median((self.utc_s - self.t_s)[has_time])) if np.any(has_time) else None

    def part(self, which: slice | Bools) -> Self:
        """Select samples. Their times still count from this log's first sample, unlike those of between()."""
        part = copy(self)
        columns = {name: values for name, values in vars(self).items() if isinstance(values, np.ndarray)}
        vars(part).update({name: values[which] for name, values in (columns | self._sparse).items()}, _sparse={})
        return part

    def rows_between(self, from_s: float | None, to_s: float | None) -> slice:
        """Return the rows of a stretch (see Stretch). Raises InputError if it has no sample."""
        length_s = float(self.t_s[-1]) if len(self.t_s) else 0.0
        begin_s, end_s = (None if t is None else t if t >= 0.0 else length_s + t for t in (from_s, to_s))
        begin_us, end_us = round(1e6 * (begin_s or 0.0)), np.inf if end_s is None else round(1e6 * end_s)
        if end_us <= begin_us:
            raise InputError(f"{self.name}: the stretch ends before it begins: give --from the smaller time")
        # Half a microsecond, because the limits are compared with times rounded to microseconds
        begin, end = np.searchsorted(self.t_s, ((begin_us - 0.5) / 1e6, (end_us + 0.5) / 1e6)).tolist()
        if begin == end:
            raise InputError(f"{self.name}: no samples in this stretch: the log is {length_s:.1f} s long")
        return slice(begin, end)

    def between(self, from_s: float | None, to_s: float | None) -> "Log":
        """Return a stretch as a log of its own, whose times count from its first sample. See rows_between()."""
        part = self.part(self.rows_between(from_s, to_s))
        return replace(part, t_s=(part.time_us - part.time_us[0]) * 1e-6, start_s=self.start_s + float(part.t_s[0]))

    def parts(
        self, selected: Bools, rows: slice = slice(None), most: int = PART_SAMPLES
    ) -> Iterator[tuple[slice, Self]]:
        """Yield the rows of successive parts of at most `most` samples, and the selected samples of these rows.

        selected: True for the samples to use, shape (n).
        rows: the part of the log to yield.
        """
        begin, end, _ = rows.indices(len(self.t_s))
        for start in range(begin, end, most):
            span = slice(start, min(start + most, end))
            part = self.part(span)
            yield span, part if np.all(selected[span]) else part.part(selected[span])

    def rows(self) -> Iterator[FirmwareRow]:
        """Yield the time in us, the reading, and the speed in m/s of each sample, for the firmware's modules.

        The reading has acceleration (3 values, g), temperature (deg C) and rate (3 values, deg/s). A missing
        temperature is replaced by ROOM_TEMP_C.
        """
        readings = self.readings
        readings[:, 3] = np.nan_to_num(readings[:, 3], nan=ROOM_TEMP_C)
        return zip(self.time_us.tolist(), readings.tolist(), self.speed_mps.tolist())

    def columns(self) -> dict[str, Array]:
        """The log's arrays, by the names of the columns in a CSV."""
        named: dict[str, Array] = {"t_s": self.t_s}
        named |= {f"a{axis}_g": values for axis, values in zip(AXES, self.accel_g.T)}
        named |= {f"g{axis}_dps": values for axis, values in zip(AXES, self.gyro_dps.T)}
        return named | {name: getattr(self, name) for name in TRACK} | {"temp_c": self.temperature_c}


@dataclass
class Stretch:
    """A part of a log, between two times in s since the log's first sample.

    A negative time counts back from the log's last sample. None means the log's start or end. Read as a log, its times
    count from the first sample of the stretch. Functions that compute the lean read the whole log, because the lean
    depends on earlier readings, and return the samples of the stretch with times that count from the start of the whole
    log.

    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> len(read_log(Stretch(log, 1.0, 2.0)).t_s), len(read_log(Stretch(log, from_s=-0.5)).t_s)
    (101, 51)
    """

    source: File | Log
    from_s: float | None = None
    to_s: float | None = None

    @property
    def name(self) -> str:
        return name_of(self.source)


Source = File | Log | Stretch  # everything that can be read as a log


@dataclass
class LogBins:
    """The last hour of a log in n successive bins of BIN_S. Vectors are along the sensor's axes."""

    bins: Bins  # means of force and rate, three columns each
    force: Array  # mean forces, shape (n, 3), in g; 0 where unknown
    rate: Array  # mean rates, shape (n, 3), in deg/s; 0 where unknown
    valid: Bools  # False in gaps, shape (n)
    speeds: Array  # the first speed of each second, shape (m, 2): time in s, speed in m/s
    positions: Array  # the first position of each second, shape (m, 3): time in s, latitude and longitude in degrees

    def integrals(self, time_s: Array) -> Array:
        """Integrate from the first bin to each of k times, shape (k, 7).

        The columns are the force (3, in g s), the rate (3, in degrees), and the duration of valid bins (s).
        """
        edges_s = (self.bins.first + np.arange(len(self.valid) + 1)) * BIN_S
        return np.column_stack([np.interp(time_s, edges_s, sums) for sums in self._sums])

    @cached_property
    def _sums(self) -> Array:
        values = np.column_stack((self.force, self.rate, self.valid)) * BIN_S
        sums = np.zeros((7, len(values) + 1))
        np.cumsum(values.T, axis=1, out=sums[:, 1:])
        return sums

    def means(self, over: int) -> tuple[Array, Array, Array]:
        """Average groups of `over` bins. Missing values are NaN.

        Returns the mean force of each group, shape (k, 3), in g; the mean rate, shape (k, 3), in deg/s; and the first
        speed, shape (k), in m/s.
        """
        merged = self.bins.merged(over)
        return merged.means[:, :3], merged.means[:, 3:], merged.latest[:, 0]


def log_bins(log: Log) -> LogBins | None:
    """Average a log to LogBins. Returns None without samples, or if gaps make the log too long for a ride."""
    bins = binned(log.t_s, BIN_S, [*log.accel_g.T, *log.gyro_dps.T], [log.speed_mps], MOST_BINS, longest=10 * MOST_BINS)
    if bins is None:
        return None
    has_samples = bins.count > 0
    valid = has_samples.copy()
    for begin, end in intervals(~has_samples):
        valid[begin:end] = end - begin < GAP_BINS
    number, sampled = np.arange(len(valid)), np.flatnonzero(has_samples)
    filled = np.column_stack([np.interp(number, sampled, column[sampled]) for column in bins.means.T]) * valid[:, None]
    first_s = bins.first * BIN_S
    speeds = _once_a_second(first_s, log.t_s, log.speed_mps)
    positions = _once_a_second(first_s, log.t_s, log.lat_deg, log.lon_deg)
    return LogBins(bins, filled[:, :3], filled[:, 3:], valid, speeds, positions)


def _once_a_second(first_s: float, time_s: Array, *columns: Array) -> Array:
    """Return the first row of each second from first_s on in which all columns have a value, with the time in front."""
    rows = np.flatnonzero(~np.isnan(columns[0]))
    values = np.column_stack([column[rows] for column in (time_s, *columns)])
    values = values[np.all(np.isfinite(values), axis=1) & (values[:, 0] >= first_s)]
    return values[runs(bin_numbers(values[:, 0], 1.0))] if len(values) else values
