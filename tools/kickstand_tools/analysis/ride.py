"""Computes the channels of a recorded ride part by part.

A ride is a log with its calibration. Its lean is the displayed lean or the smoothed lean.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kickstand.units import GAP_US

from ..calibration.file import ALIGN, CalibrationFile, calibration_path, read_calibration
from ..calibration.mount import read_ride
from ..checks.log import CheckedLog
from ..common.messages import InputError, Message, Remedy, kind
from ..estimation.smooth import COLUMNS, Smoother
from ..logs.cells import MOST_DPS, MOST_G
from ..logs.log import Log, Source, Stretch
from ..logs.reader import check_first_line
from ..logs.source import File, Progress, log_stem, name_of
from ..replay.replay import MeterAlong, Misfit
from ..signals import Array
from .channels import Channels, channels, joined

SMOOTH_US = 300_000  # time constant of the display's force, as in kickstand.lean.meter
_MAX_SIGMA_DEG = 3.0  # a smoothed lean with a larger standard deviation is not trusted


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
    """A checked log and its calibration. smoothed: True to use the smoothed lean, False for the displayed lean."""

    checked: CheckedLog
    calibration: CalibrationFile
    smoothed: bool = False

    @property
    def log(self) -> Log:
        """The whole log, even if the ride is a stretch of it."""
        return self.checked.log

    @property
    def name(self) -> str:
        """The log's name, with its path if it has one."""
        return self.log.name

    @property
    def stem(self) -> str:
        """The name without path and suffixes."""
        return log_stem(self.name)

    @property
    def car(self) -> bool:
        """True for a car, which has no lean; False for a motorcycle."""
        return self.calibration.vehicle == "car"

    @property
    def is_stretch(self) -> bool:
        """True if the ride is a stretch of the log."""
        return self.checked.rows != slice(None)

    def read(self, progress: Progress | None = None, keep: Callable[[Array], None] | None = None) -> "RideReading":
        """Compute the channels of the ride.

        progress: called with (done, total) of the log's samples.
        keep: called with the values of estimation.smooth.COLUMNS of successive samples, if the lean is smoothed.
        """
        return RideReading(self, progress, keep)


class RideReading:
    """Computes the channels of a ride part by part, so that memory hardly grows with its length. Call parts(), and at
    its end notices()."""

    def __init__(self, ride: Ride, progress: Progress | None, keep: Callable[[Array], None] | None) -> None:
        self._ride, self._progress, self._keep = ride, progress, keep
        self._smoother = Smoother(ride.checked, ride.calibration) if ride.smoothed else None
        self._meter, self._misfit = MeterAlong(ride.calibration), Misfit()
        self._absurd: Message | None = None
        self._slow = False

    def parts(self) -> Iterator[Channels]:
        """Yield the channels of successive samples. Frozen readings are left out, so they become gaps.

        Raises InputError if all readings are frozen.
        """
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
        """Run the firmware's meter over a part of the log."""
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
        return lean | {
            "lean_sigma_deg": sigma,
            "doubtful": np.zeros(len(sigma)),
        }  # only smooth() finds doubtful samples

    def _note_absurd(self, log: Log, row: int) -> None:
        """Note that the lean is lost at this row, with the largest readings of the previous second."""
        last_second = slice(int(np.searchsorted(log.t_s, log.t_s[row] - 1.0)), row + 1)
        rate, force = (float(np.max(np.abs(values[last_second]))) for values in (log.gyro_dps, log.accel_g))
        self._absurd = self._absurd or AbsurdReadings(float(log.t_s[row]), rate, force)


class _Smoothed:
    """The forward force, smoothed as on the display, part by part."""

    def __init__(self) -> None:
        self._last_s, self._last_g = -1e9, 0.0

    def of(self, log: Log, calibration: CalibrationFile) -> Array:
        """Return the smoothed force for the samples of the next part, shape (n), in g."""
        steps = np.diff(log.t_s, prepend=self._last_s)
        gains = np.where(steps > GAP_US * 1e-6, 1.0, steps / (SMOOTH_US * 1e-6 + steps))
        smooth, column = self._last_g, []
        for force, gain in zip(calibration.in_vehicle(log.readings)[0][:, 2].tolist(), gains.tolist()):
            smooth += gain * (force - smooth)
            column.append(smooth)
        if column:
            self._last_s, self._last_g = float(log.t_s[-1]), smooth
        return np.array(column)


def _largest(log: Log) -> int:
    """Return the row with the largest reading, as a share of the sensors' ranges."""
    shares = np.hstack((log.accel_g / MOST_G, log.gyro_dps / MOST_DPS))
    return int(np.argmax(np.max(np.abs(shares), axis=1)))


def calibration_beside(log: Path) -> Path:
    """Return the path of the calibration beside a log.

    Raises InputError if the calibration or the log does not exist, or if the file is not a log.
    """
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

    log: see read_log.
    calibration: an object or a file. None: NAME.cal.json beside the log.
    smoothed: use the lean of smooth() instead of the firmware's lean. It has no effect for a car, which has no lean.
    progress: called with the bytes read and the bytes of the file.
    Raises InputError, also for a calibration that is not aligned, because lean and braking are then unknown.

    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log
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
    """Return the whole ride in the vehicle's axes, with the firmware's lean.

    Forces are computed by Nicolae's formulas (18)-(20) and the matrix vehicle_from_sensor.

    log, calibration: see open_ride(), which raises the same errors.
    progress: called with (done, total) of the log's samples.

    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> channels = vehicle_channels(log, CalibrationFile(aligned=True))
    >>> bool(abs(channels.lean_deg).max() < 0.1), float(channels.up_g[-1])
    (True, 1.0)
    """
    return joined(open_ride(log, calibration).read(progress).parts())
