"""A recorded log in memory."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from kickstand.errors import Notice
from kickstand.units import AXES
from numpy.typing import ArrayLike

from ..errors import InputError
from ..signals import Array, Ints
from .cells import TRACK
from .table import Table

ROOM_TEMP_C = 25.0  # temperature for the firmware's modules where a log has none

FirmwareRow = tuple[int, list[float], float]


def firmware_rows(time_us: Ints, readings: Array, speed_mps: Array) -> Iterator[FirmwareRow]:
    """Each sample for a replay by the firmware's modules: time (us), reading (7, the chip's order: g, deg C, deg/s),
    speed (m/s, NaN for none). Where a log has no temperature it is ROOM_TEMP_C."""
    readings = np.column_stack((readings[:, :3], np.nan_to_num(readings[:, 3], nan=ROOM_TEMP_C), readings[:, 4:]))
    return zip(time_us.tolist(), readings.tolist(), speed_mps.tolist())


@dataclass(eq=False)
class Log(Table):
    """One recording in the sensor's own axes: n samples.

    t_s (n): seconds since the first sample, increasing. accel_g (n, 3): specific force, g. gyro_dps (n, 3): angular
    rate, deg/s. speed_mps (n): m/s. temperature_c (n). lat_deg, lon_deg (n): the position, degrees north and east.
    utc_s (n): Universal Time, s since 1970. These are NaN where there is no new value. start_s: the recorder's own time
    at the first sample, s. name: what messages call the log. notices: what is remarkable in it
    (kickstand_tools.refusals.sentence puts a notice into words).

    Made of arrays, those that may be NaN may be left out, and t_s may start anywhere. Raises InputError for shapes that
    do not fit and for a time that does not increase.

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
    notices: list[Notice] = field(default_factory=list)
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
                raise InputError(f"{self.name}: {name} has the shape {getattr(self, name).shape}, it has to be {shape}")
        if n and not np.all(np.diff(np.rint(self.t_s * 1e6)) > 0):
            raise InputError(f"{self.name}: the time t_s has to increase from sample to sample")
        if n and self.t_s[0] != 0.0:
            self.start_s += float(self.t_s[0])
            self.t_s = self.t_s - self.t_s[0]

    @classmethod
    def from_readings(cls, readings: ArrayLike, rate_hz: float, name: str = "the log") -> "Log":
        """readings (n, 7): acceleration (3, g), temperature (C), rate (3, deg/s), the order in which the chip has them.

        rate_hz: samples per second.
        """
        table = np.asarray(readings, dtype=float)
        return cls(np.arange(len(table)) / rate_hz, table[:, :3], table[:, 4:], temperature_c=table[:, 3], name=name)

    @property
    def time_us(self) -> Ints:
        """(n) microseconds since the first sample, the firmware's unit."""
        return np.rint(self.t_s * 1e6).astype(np.int64)

    @property
    def readings(self) -> Array:
        """(n, 7) as from_readings() takes them."""
        return np.column_stack((self.accel_g, self.temperature_c, self.gyro_dps))

    @property
    def start_utc_s(self) -> float | None:
        """Universal Time at the first sample: the median of what the rows say, because some come late; None without."""
        starts = (self.utc_s - self.t_s)[np.isfinite(self.utc_s)]
        return float(np.median(starts)) if len(starts) else None

    def rows(self) -> Iterator[FirmwareRow]:
        """The samples as firmware_rows() has them, for a replay by the firmware's modules."""
        return firmware_rows(self.time_us, self.readings, self.speed_mps)

    def columns(self) -> dict[str, Array]:
        """The samples by the names that the columns have in a CSV."""
        named: dict[str, Array] = {"t_s": self.t_s}
        named |= {f"a{axis}_g": values for axis, values in zip(AXES, self.accel_g.T)}
        named |= {f"g{axis}_dps": values for axis, values in zip(AXES, self.gyro_dps.T)}
        return named | {name: getattr(self, name) for name in TRACK} | {"temp_c": self.temperature_c}

    def _optional(self, values: ArrayLike) -> Array:
        array = np.asarray(values, dtype=float)
        return array if array.size else np.full(len(self.t_s), np.nan)
