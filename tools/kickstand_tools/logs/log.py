"""Defines a log in memory (Log), some successive rows of a log (Block), and a part of a log between two times
(Stretch)."""

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from kickstand.units import AXES
from numpy.typing import ArrayLike, NDArray

from ..common.errors import InputError, extra
from ..common.messages import Message
from ..signals import Array, Bools, Ints
from .cells import TRACK
from .csv_reader import cells_of
from .source import File, name_of

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Schema

ROOM_TEMP_C = 25.0  # temperature for the firmware's modules if a log has no temperature

FirmwareRow = tuple[int, list[float], float]


@dataclass
class Table:
    """A dataclass whose arrays have one row per sample. Fields that are not arrays describe the whole table."""

    def columns(self) -> dict[str, NDArray[Any]]:
        """The arrays of the table, by the names of their fields."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def part(self, which: slice | Bools) -> Self:
        """Select samples.

        which: a slice, or an array of n booleans. With a slice, the result's arrays are views of this table's arrays.
        """
        # Call Table.columns(), because Log.columns() uses the names of the CSV columns, not of the fields.
        return replace(self, **{name: values[which] for name, values in Table.columns(self).items()})

    def to_pandas(self) -> "DataFrame":
        """A data frame of columns(). Raises InputError if pandas is not installed."""
        try:
            from pandas import DataFrame
        except ImportError as error:
            raise InputError("data frames need pandas: " + extra("rides")) from error
        return DataFrame(self.columns())


def float_schema(units: Mapping[str, str], fine: Container[str], about: dict[str, str]) -> "Schema":
    """The schema of a Parquet file.

    units: the unit of each column, by the column's name.
    fine: names of the columns that are 64-bit floats. All other columns are 32-bit floats.
    about: the file's metadata.
    """
    import pyarrow

    return pyarrow.schema(
        [
            pyarrow.field(name, pyarrow.float64() if name in fine else pyarrow.float32(), metadata={"unit": unit})
            for name, unit in units.items()
        ],
        metadata=about,
    )


def firmware_rows(time_us: Ints, readings: Array, speed_mps: Array) -> Iterator[FirmwareRow]:
    """Yield each sample for a replay by the firmware's modules.

    Yields:
        time: in us.
        reading: list of acceleration (3 values, g), temperature (deg C) and rate (3 values, deg/s). A missing
            temperature is replaced by ROOM_TEMP_C.
        speed: in m/s, NaN if missing.
    """
    readings = np.column_stack((readings[:, :3], np.nan_to_num(readings[:, 3], nan=ROOM_TEMP_C), readings[:, 4:]))
    return zip(time_us.tolist(), readings.tolist(), speed_mps.tolist())


@dataclass(eq=False)
class Log(Table):
    """One recording of n samples, in the sensor's own axes.

    t_s: time in s since the first sample, increasing, shape (n).
    accel_g: specific force in g, shape (n, 3).
    gyro_dps: angular rate in deg/s, shape (n, 3).
    speed_mps: speed in m/s, shape (n), optional.
    temperature_c: temperature in degrees Celsius, shape (n), optional.
    start_s: the recorder's own time at the first sample, in s.
    name: the log's name in messages.
    notices: remarks about the log.
    lat_deg, lon_deg: latitude and longitude in degrees, shape (n), optional.
    utc_s: Universal Time in s since 1970, shape (n), optional.

    Optional arrays are NaN in samples without a new value.

    t_s may start at any value. The first value is added to start_s and subtracted from t_s. Raises InputError for
    wrong shapes and for times that do not increase.

    >>> import numpy as np
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

    def __post_init__(self) -> None:
        self.t_s = np.asarray(self.t_s, dtype=float)
        self.accel_g, self.gyro_dps = np.asarray(self.accel_g, float), np.asarray(self.gyro_dps, float)
        for name in (*TRACK, "temperature_c"):
            setattr(self, name, self._optional(getattr(self, name)))
        n = len(self.t_s)
        shapes = {"t_s": (n,), "accel_g": (n, 3), "gyro_dps": (n, 3)} | dict.fromkeys((*TRACK, "temperature_c"), (n,))
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InputError(f"{self.name}: {name} has the shape {getattr(self, name).shape}, it must be {shape}")
        if n and not np.all(np.diff(np.rint(self.t_s * 1e6)) > 0):
            raise InputError(f"{self.name}: the time t_s must increase from sample to sample")
        if n and self.t_s[0] != 0.0:
            self.start_s += float(self.t_s[0])
            self.t_s = self.t_s - self.t_s[0]

    @classmethod
    def from_readings(cls, readings: ArrayLike, rate_hz: float, name: str = "the log") -> "Log":
        """Make a log from readings in the chip's order.

        readings: acceleration (3 columns, g), temperature (deg C) and rate (3 columns, deg/s), shape (n, 7).
        rate_hz: samples per second.
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
    def start_utc_s(self) -> float | None:
        """Universal Time at the first sample in s, None if unknown. The median is used, because the receiver sends some
        times late."""
        starts = (self.utc_s - self.t_s)[np.isfinite(self.utc_s)]
        return float(np.median(starts)) if len(starts) else None

    def rows(self) -> Iterator[FirmwareRow]:
        """Yield the samples for a replay by the firmware's modules. See firmware_rows()."""
        return firmware_rows(self.time_us, self.readings, self.speed_mps)

    def columns(self) -> dict[str, Array]:
        """The log's arrays, by the names of the columns in a CSV."""
        named: dict[str, Array] = {"t_s": self.t_s}
        named |= {f"a{axis}_g": values for axis, values in zip(AXES, self.accel_g.T)}
        named |= {f"g{axis}_dps": values for axis, values in zip(AXES, self.gyro_dps.T)}
        return named | {name: getattr(self, name) for name in TRACK} | {"temp_c": self.temperature_c}

    def _optional(self, values: ArrayLike) -> Array:
        array = np.asarray(values, dtype=float)
        return array if array.size else np.full(len(self.t_s), np.nan)


@dataclass
class Block(Table):
    """Some successive rows of a log, in the units of the firmware's modules.

    time_us: time in us since the log's first sample, shape (n).
    readings: acceleration (3 columns, g), temperature (deg C) and rate (3 columns, deg/s), shape (n, 7).
    speed_mps, lat_deg, lon_deg, utc_s: as in a Log. Missing values are NaN.
    frozen: True for repeated readings (see frozen.py), shape (n).
    has_temp: True if the log has temperatures.
    start_s: the recorder's own time at the log's first sample, in s.
    """

    time_us: Ints
    readings: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    utc_s: Array
    frozen: Bools
    has_temp: bool
    start_s: float
    done: int  # bytes read of the file before unpacking; for a log in memory, number of samples
    lines: list[str] = field(default_factory=list)  # the rows as CSV, empty for a log in memory
    names: tuple[str, ...] = ()  # names of the columns in lines
    own_times: bool = True  # False if even_times.py changed the times, so they differ from the times in `lines`

    def rows(self) -> Iterator[FirmwareRow]:
        """Yield the samples for a replay by the firmware's modules. See firmware_rows()."""
        return firmware_rows(self.time_us, self.readings, self.speed_mps)

    @property
    def t_s(self) -> Array:
        """The time since the log's first sample in s, shape (n)."""
        return self.time_us.astype(float) * 1e-6

    @property
    def time_text(self) -> list[str]:
        """The times in s as texts. Unchanged times are copied from the file."""
        if not self.lines or not self.own_times:
            return [f"{self.start_s + t:.6f}" for t in self.t_s.tolist()]
        place = self.names.index("t_s")
        return [cells_of(line)[place].strip() for line in self.lines]

    def part(self, which: slice | Bools) -> "Block":
        """Select rows. See Table.part()."""
        if isinstance(which, slice):
            lines = self.lines[which]
        else:
            lines = [line for line, wanted in zip(self.lines, which.tolist()) if wanted]
        return replace(super().part(which), lines=lines)

    @property
    def measured(self) -> "Block":
        """The block without frozen rows."""
        return self.part(~self.frozen) if np.any(self.frozen) else self


@dataclass
class Stretch:
    """A part of a log.

    source: the log.
    from_s, to_s: its limits, in s since the log's first sample. A negative value counts back from the log's last
        sample. None means the log's start or end.

    A Stretch can be used like a log. If it is read as a log, its times count from the first sample of the stretch.
    Functions that compute the lean read the whole log, because the lean depends on earlier readings. These functions
    return only the samples of the stretch, with times that count from the start of the whole log.

    >>> import numpy as np
    >>> from kickstand_tools.api import Log, read_log
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> len(read_log(Stretch(log, 1.0, 2.0)).t_s), len(read_log(Stretch(log, from_s=-0.5)).t_s)
    (101, 51)
    """

    source: File | Log
    from_s: float | None = None
    to_s: float | None = None

    @property
    def name(self) -> str:
        """The log's name."""
        return name_of(self.source)

    def of_length(self, length_s: float) -> "Stretch":
        """The same stretch, with both limits counted from the log's start. length_s: duration of the log."""
        times = [None if t is None else t if t >= 0.0 else length_s + t for t in (self.from_s, self.to_s)]
        return Stretch(self.source, *times)

    def holds(self, block: Block) -> Bools:
        """Return True for each sample of a block that is in the stretch, shape (n).

        The block's times and both limits of the stretch must count from the start of the whole log.
        """
        begin_us, end_us = self._ends_us()
        return (block.time_us >= begin_us) & (block.time_us <= end_us)

    def _ends_us(self) -> tuple[float, float]:
        return round(1e6 * (self.from_s or 0.0)), float("inf") if self.to_s is None else round(1e6 * self.to_s)

    def cut(self, blocks: Iterator[Block]) -> Iterator[Block]:
        """Yield the samples of the stretch. blocks: the whole log. Raises InputError if the stretch has no sample."""
        begin_us, end_us = self._ends_us()
        if end_us <= begin_us:
            raise InputError(f"{self.name}: the stretch ends before it begins: give --from the smaller time")
        from_us, length_s = None, 0.0
        for block in blocks:
            length_s = float(block.t_s[-1])
            if block.time_us[0] > end_us:
                break
            within = self.holds(block)
            if not within.any():
                continue
            part = block if within.all() else block.part(within)
            from_us = int(part.time_us[0]) if from_us is None else from_us
            yield replace(part, time_us=part.time_us - from_us, start_s=part.start_s + from_us / 1e6)
        if from_us is None:
            raise InputError(f"{self.name}: no samples in this stretch: the log is {length_s:.1f} s long")


def within(stretch: Stretch | None, block: Block, values: Array) -> Iterator[tuple[Block, Array]]:
    """Yield the rows of a block that are in the stretch, and the values of these rows. Yield nothing if the block has
    no such rows.

    stretch: None selects all rows.
    block: a block of the whole log.
    values: one row per row of the block, shape (n, ...).
    """
    if stretch is None:
        yield block, values
    elif (which := stretch.holds(block)).any():
        yield block.part(which), values[which]
