"""A recorded ride, which is a log with its calibration, in the vehicle's axes, part by part.

The lean of each sample is the displayed or the smoothed lean. numpy computes everything that does not depend on earlier
samples. A test compares these values with the firmware's values.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from kickstand.lean.meter import FALLEN_DEG
from kickstand.units import GAP_US

from ..calibration.file import ALIGN, CalibrationFile, calibration_path, read_calibration
from ..calibration.mount import read_ride
from ..checks.log import CheckedLog
from ..common.messages import InputError, Message, Remedy, kind
from ..estimation.smooth import COLUMNS, Smoother
from ..logs.csv_text import MOST_DPS, MOST_G
from ..logs.log import ROOM_TEMP_C, Log, Source, Stretch, Table
from ..logs.reader import check_first_line
from ..logs.source import File, Progress, log_stem, name_of
from ..replay.replay import MeterAlong, Misfit, formula_lean_deg
from ..signals import Array, Bools, Ints, bin_numbers, run_latest, run_means, runs

_LAST = ("lat_deg", "lon_deg", "utc_s")
GAP_S = 5.0  # longest time between two positions over which positions are interpolated

SMOOTH_US = 300_000  # time constant of the display's force, as in kickstand.lean.meter
_MAX_SIGMA_DEG = 3.0  # a smoothed lean with a larger standard deviation is not trusted


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
        """True where the display shows the lean and updates its maxima: a sure lean under FALLEN_DEG."""
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
    """Join the parts of a ride. A column without any value uses no memory, and is read-only."""
    columns: list[list[Array]] = [[] for _ in fields(Channels)]
    for part in parts:
        for column, field in zip(columns, fields(Channels)):
            column.append(getattr(part, field.name))
    return Channels(*map(_concatenated, columns))  # in the order of fields()


def _concatenated(parts: list[Array]) -> Array:
    """Join the parts of a column. Clear the list, so that the parts of each column are freed before the next one."""
    column = np.concatenate([np.zeros(0), *parts], dtype=float)
    parts.clear()
    return np.broadcast_to(np.nan, len(column)) if np.all(np.isnan(column)) else column


def thinned(course: Channels, step_s: float) -> Channels:
    """Average a whole ride over steps of step_s. A ride with at most one sample per step is returned unchanged."""
    if np.all(np.diff(bin_numbers(course.t_s, step_s)) > 0):
        return course
    return joined(downsampled([course], step_s))


def spacing_s(course: Channels) -> float:
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
        step = bin_numbers(block.t_s, step_s, rounded)
        last = int(np.searchsorted(step, step[-1]))  # the last stretch may continue in the next block
        remainder = block.part(slice(last, None))
        if last:
            yield _means(block.part(slice(0, last)), step[:last])
    if remainder is not None:
        yield _means(remainder, np.zeros(len(remainder.t_s), int))


def rounded_to(t_s: Array, step_s: float) -> Array:
    """Round times to multiples of step_s. Two stretches of downsampled(..., rounded=True) never get the same time."""
    return bin_numbers(t_s, step_s, True).astype(float) * step_s


def _means(block: Channels, step: Ints) -> Channels:
    starts = runs(step)
    if len(starts) == len(step):
        return block
    columns = block.columns().items()
    return Channels(*[(run_latest if name in _LAST else run_means)(values, starts) for name, values in columns])


@dataclass
class LogTrack:
    """m positions, in degrees north and east, with their times in s since the log's first sample."""

    t_s: Array
    lat_deg: Array
    lon_deg: Array

    def at(self, t_s: Array) -> tuple[Array, Array]:
        """Interpolate latitude and longitude at n times along straight lines, also across 180 degrees.

        Results are NaN before the first position, after the last position, and in gaps of over GAP_S.
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
    valid = np.isfinite(part.lat_deg) & np.isfinite(part.lon_deg)
    return LogTrack(part.t_s[valid], part.lat_deg[valid], part.lon_deg[valid])


SmoothSlow = kind(
    "smooth-slow",
    text="the smoothed lean needs 10 samples per second: where the log has fewer, the lean is the one that the display "
    "showed",
)
# at_s: time in the log; rate_dps, force_g: largest rate and force in the second before it
AbsurdReadings = kind(
    "absurd-readings",
    "at_s rate_dps force_g",
    "implausible readings at {at_s:.1f} s, up to {rate_dps:.0f} deg/s and {force_g:.1f} g, where the lean is not known",
    Remedy("check the sensor, and the units in the log"),
)


@dataclass
class Ride:
    """A checked log and its calibration. smoothed: True to use the smoothed lean, False for the displayed."""

    checked: CheckedLog
    calibration: CalibrationFile
    smoothed: bool = False

    @property
    def log(self) -> Log:
        return self.checked.log

    @property
    def name(self) -> str:
        return self.log.name

    @property
    def stem(self) -> str:
        return log_stem(self.name)

    @property
    def car(self) -> bool:
        return self.calibration.vehicle == "car"

    @property
    def is_stretch(self) -> bool:
        return self.checked.rows != slice(None)

    def read(self, progress: Progress | None = None, keep: Callable[[Array], None] | None = None) -> "RideReading":
        """Compute the channels of the ride.

        keep: called with the values of estimation.smooth.COLUMNS of successive samples, if the lean is smoothed.
        """
        return RideReading(self, progress, keep)


class RideReading:
    """Computes the channels of a ride by parts(), so that memory hardly grows with its length; then its notices()."""

    def __init__(self, ride: Ride, progress: Progress | None, keep: Callable[[Array], None] | None) -> None:
        self._ride, self._progress, self._keep = ride, progress, keep
        self._smoother = Smoother(ride.checked, ride.calibration) if ride.smoothed else None
        self._meter, self._misfit = MeterAlong(ride.calibration), Misfit()
        self._absurd: Message | None = None
        self._slow = False

    def parts(self) -> Iterator[Channels]:
        """Yield the channels of successive samples. Frozen readings become gaps. Raises InputError if all froze."""
        ride, has_readings = self._ride, False
        first, last, _ = ride.checked.rows.indices(len(ride.log.t_s))
        for span, log, lean in self._leans():
            part = channels(log, ride.calibration, lean, ride.car)
            if span.start < first or span.stop > last:
                rows = np.flatnonzero(ride.checked.measured[span]) + span.start
                part = part.part((rows >= first) & (rows < last))
            if len(part.t_s):
                has_readings = True
                yield part
        if not has_readings:
            raise InputError(f"{ride.name}: all readings are frozen, so that nothing is known: check the sensor")

    def notices(self) -> list[Message]:
        """Return the remarks about the whole log and its calibration, after the last part."""
        notices = self._smoother.notices() if self._smoother else self._ride.checked.notices
        notices = [*notices, *([self._absurd] if self._absurd else [])]
        notices += [] if self._ride.car else self._misfit.remarks(notices)
        return [*notices, SmoothSlow()] if self._slow else notices

    def _leans(self) -> Iterator[tuple[slice, Log, dict[str, Array]]]:
        """Yield the rows of successive parts in the log, their measured samples, and their lean for channels()."""
        log, measured = self._ride.log, self._ride.checked.measured
        if self._smoother is None:
            for span, part in log.parts(measured):
                yield span, part, self._displayed(part)
                if self._progress:
                    self._progress(span.stop, len(log.t_s))
            return
        pushes = _Smoothed()
        for span, values in self._smoother.batches(self._progress):
            part = log.part(span).part(measured[span])
            if values is not None and self._keep:
                self._keep(values[:, : len(COLUMNS)])
            if values is None:
                self._slow = True
                yield span, part, self._displayed(part)
                continue
            lean_deg, sigma_deg, _, _, doubtful, standing, rolling = values[measured[span]].T
            if len(lean_deg) and np.all(np.isnan(lean_deg)):
                self._note_absurd(part, _largest(part))
            lean = {"lean_deg": lean_deg, "lean_sigma_deg": sigma_deg, "doubtful": doubtful}
            lean |= {"resting": standing == 1.0, "rolling": rolling == 1.0, "sure": sigma_deg <= _MAX_SIGMA_DEG}
            yield span, part, lean | {"shown_g": pushes.of(part, self._ride.calibration)}

    def _displayed(self, log: Log) -> dict[str, Array]:
        names = ("lean_deg", "shown_g", "variance", "resting", "rolling", "odd", "sure")
        rows = [
            (
                meter.lean_deg,
                meter.smooth_force[2],
                meter.filter.variance,
                meter.filter.at_rest,
                meter.filter.rolling,
                meter.odd is not None,
                meter.trusted,
            )
            for meter in self._meter.after_each(log, *self._meter.in_vehicle(log))
        ]
        lean: dict[str, Array] = dict(zip(names, np.array(rows, dtype=float).reshape(-1, len(names)).T))
        self._misfit.add(log.t_s, lean.pop("odd") > 0.0)
        variance = lean.pop("variance")
        if np.any(variance < 0.0):
            self._note_absurd(log, int(np.argmax(variance < 0.0)))
        sigma = np.degrees(np.sqrt(np.where(variance >= 0.0, variance, np.nan)))
        # Only smooth() finds doubtful samples
        return lean | {"lean_sigma_deg": sigma, "doubtful": np.zeros(len(sigma))}

    def _note_absurd(self, log: Log, row: int) -> None:
        """Note that the lean is lost at this row, with the largest readings of the previous second."""
        last_second = slice(int(np.searchsorted(log.t_s, log.t_s[row] - 1.0)), row + 1)
        rate, force = (float(np.max(np.abs(values[last_second]))) for values in (log.gyro_dps, log.accel_g))
        self._absurd = self._absurd or AbsurdReadings(float(log.t_s[row]), rate, force)


class _Smoothed:
    """The forward force in g, smoothed as on the display, part by part."""

    def __init__(self) -> None:
        self._last_s, self._last_g = -1e9, 0.0

    def of(self, log: Log, calibration: CalibrationFile) -> Array:
        """Return the forward force, shape (n), smoothed as for the display. Logs must follow each other."""
        steps = np.diff(log.t_s, prepend=self._last_s)
        gains = np.where(steps > GAP_US * 1e-6, 1.0, steps / (SMOOTH_US * 1e-6 + steps))
        smooth, column = self._last_g, []
        force, _ = calibration.in_vehicle(log.readings)
        for forward_g, gain in zip(force[:, 2].tolist(), gains.tolist()):
            smooth += gain * (forward_g - smooth)
            column.append(smooth)
        if column:
            self._last_s, self._last_g = float(log.t_s[-1]), smooth
        return np.array(column)


def _largest(log: Log) -> int:
    """Return the row with the largest reading, as a share of the sensors' ranges."""
    shares = np.hstack((log.accel_g / MOST_G, log.gyro_dps / MOST_DPS))
    return int(np.argmax(np.max(np.abs(shares), axis=1)))


def calibration_beside(log: Path) -> Path:
    """Return the path of the calibration beside a log. Raises InputError without one, or if it is not a log."""
    if not log.is_file():
        problem = "is a directory: give the name of a ride in it" if log.is_dir() else "there is no such file"
        raise InputError(f"{log}: {problem}")
    path = calibration_path(log)
    if not path.exists():
        check_first_line(log)
        raise InputError(
            f"{log}: no calibration {path.name} beside it: give one with --calibration, or make it from a "
            f"motorcycle's ride: kickstand calibrate ride {log} --out {path}"
        )
    return path


def open_ride(
    log: Source,
    calibration: CalibrationFile | File | None = None,
    smoothed: bool = False,
    progress: Progress | None = None,
) -> Ride:
    """Read and check a log with its calibration.

    calibration: an object or a file. None: NAME.cal.json beside the log.
    smoothed: use the lean of smooth() instead of the firmware's lean. It has no effect for a car, which has no lean.
    Raises InputError, also for a calibration that is not aligned, because lean and braking are then unknown.

    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> open_ride(log, CalibrationFile(aligned=True)).car
    False
    """
    file = log.source if isinstance(log, Stretch) else log
    if calibration is None:
        if not isinstance(file, (Path, str)):
            raise InputError(f"{name_of(log)}: an open file has no calibration beside it: give one")
        calibration = calibration_beside(Path(file))
    parameters = calibration if isinstance(calibration, CalibrationFile) else read_calibration(calibration)
    if not parameters.aligned:
        name = "the calibration" if isinstance(calibration, CalibrationFile) else name_of(calibration)
        raise InputError(f"{name} is not aligned, so lean and braking are unknown", ALIGN)
    ride = read_ride(log, parameters, progress)
    return Ride(ride, parameters, smoothed and parameters.vehicle != "car")


def vehicle_channels(
    log: Source, calibration: CalibrationFile | File | None = None, progress: Progress | None = None
) -> Channels:
    """Return the whole ride in the vehicle's axes, with the firmware's lean. Raises InputError as open_ride().

    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> channels = vehicle_channels(log, CalibrationFile(aligned=True))
    >>> bool(abs(channels.lean_deg).max() < 0.1), float(channels.up_g[-1])
    (True, 1.0)
    """
    return joined(open_ride(log, calibration).read(progress).parts())
