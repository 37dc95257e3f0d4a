"""The result of reading an app's files: each sensor on its own clock, in a log's units and signs."""

from dataclasses import dataclass, field

import numpy as np
from kickstand.errors import Notice

from ..signals import Array, Bools
from .sheets import Sheet
from .times import NO_TIME, REPEATED, Nanoseconds
from .units import ACCELERATIONS, RATES, SPEEDS, factor

SECOND_NS = 10**9
_ABSURD = 1e6  # g or deg/s: a larger value is a damaged cell


@dataclass
class Taken:
    """The source of a quantity: the file and the columns, their unit, and the change of sign.

    rate_hz: samples per second, 0 for none.
    """

    quantity: str
    source: str
    unit: str
    rate_hz: float = 0.0
    sign: str = ""


def rate_hz(time_ns: Nanoseconds) -> float:
    """Samples per second, gaps not counted; 0 if there are too few."""
    steps = np.diff(time_ns[time_ns > REPEATED])
    if not np.any(steps > 0):
        return 0.0
    whole = (steps >= 0) & (steps < 5.0 * np.median(steps[steps > 0]))
    return SECOND_NS * int(np.count_nonzero(whole)) / float(np.sum(steps[whole]))


@dataclass
class Sensor:
    """n samples: time_ns (n) of the recorder's clock, values (n, 3): g, +1 where the axis points up at rest, or deg/s,
    right-handed. name: for messages. damaged: number of rows of its file that are left out, because they have too many
    cells or their time or a value cannot be read; a row without any value is another sensor's. taken: its source."""

    name: str
    time_ns: Nanoseconds
    values: Array
    damaged: int = 0
    taken: list[Taken] = field(default_factory=list)

    def __post_init__(self) -> None:
        without = (self.time_ns == REPEATED) | np.all(np.isnan(self.values), axis=1)
        good = (self.time_ns > REPEATED) & np.all(np.abs(self.values) < _ABSURD, axis=1)  # no NaN either
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
) -> Sensor:
    """Three columns of a sheet. quantity: "accelerometer" or "gyro"; sign: what theirs is; turn: -1 where a log has the
    opposite one, one number or one an axis. Raises InputError for an unknown unit."""
    scale = turn * factor(unit, ACCELERATIONS if quantity == "accelerometer" else RATES, sheet.name)
    taken = Taken(quantity, sheet.named(places), unit, rate_hz(time_ns), sign)
    return Sensor(quantity, time_ns, sheet.table(places) * scale, sheet.left_out, [taken])


@dataclass
class Track:
    """A satellite receiver's m values on the same clock: speed in m/s, degrees north and east; NaN for none."""

    time_ns: Nanoseconds
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    taken: list[Taken] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Drop rows that repeat the values before, and speeds below 0, by which phones mark an unknown speed."""
        self.speed_mps = np.where(self.speed_mps >= 0.0, self.speed_mps, np.nan)
        nowhere = (self.lat_deg == 0.0) & (self.lon_deg == 0.0)
        nowhere |= ~((np.abs(self.lat_deg) <= 90.0) & (np.abs(self.lon_deg) <= 180.0))
        self.lat_deg, self.lon_deg = (np.where(nowhere, np.nan, place) for place in (self.lat_deg, self.lon_deg))
        rows = np.column_stack((self.speed_mps, self.lat_deg, self.lon_deg))
        there = (self.time_ns != NO_TIME) & ~np.all(np.isnan(rows), axis=1)
        self.keep(there)
        same = np.all((rows[there][1:] == rows[there][:-1]) | np.isnan(rows[there][1:]), axis=1)
        same &= np.diff(self.time_ns // SECOND_NS) == 0  # repeated values of a standstill are kept once a second
        self.keep(np.concatenate(([True], ~same)) if len(self.time_ns) else np.zeros(0, dtype=bool))

    def keep(self, which: Bools) -> None:
        """Drop the other rows."""
        for name in ("time_ns", "speed_mps", "lat_deg", "lon_deg"):
            setattr(self, name, getattr(self, name)[which])


def track_of(
    sheet: Sheet,
    time_ns: Nanoseconds,
    speed: int | None,
    lat: int | None,
    lon: int | None,
    speed_unit: str = "m/s",
    per_degree: tuple[float, float] = (1.0, 1.0),
) -> Track | None:
    """Speed and position of a sheet, by the numbers of their columns; None where there is neither.

    per_degree: factors on latitude and longitude.
    """
    if speed is None and (lat is None or lon is None):
        return None
    speed_mps = sheet.numbers(speed) * factor(speed_unit, SPEEDS, "speed")
    track = Track(time_ns, speed_mps, sheet.numbers(lat) * per_degree[0], sheet.numbers(lon) * per_degree[1])
    hz = rate_hz(track.time_ns)
    if speed is not None:
        track.taken.append(Taken("speed", sheet.named([speed]), speed_unit, hz))
    if lat is not None and lon is not None:
        track.taken.append(Taken("position", sheet.named([lat, lon]), "degrees", hz))
    return track


@dataclass
class Recording:
    """app: the app's name. utc_ns: UTC less the recorder's clock, ns since 1970; None if unknown.

    vehicle_axes: True if x points left, y up, z forward on the vehicle already, provided that its logger was mounted
    so. sign_known: True if at rest up reads +1 g according to the app's maker or its files; else that is only likely.
    """

    app: str
    accel: Sensor
    gyro: Sensor
    track: Track | None = None
    temp_c: Array | None = None
    notices: list[Notice] = field(default_factory=list)
    utc_ns: int | None = None
    vehicle_axes: bool = False
    sign_known: bool = True

    @property
    def taken(self) -> list[Taken]:
        """The sources of all quantities."""
        return [*self.accel.taken, *self.gyro.taken, *(self.track.taken if self.track else [])]
