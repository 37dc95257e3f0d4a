"""Reads a recorded ride block by block.

A ride is a log with its calibration. Its lean is the displayed lean or the smoothed lean.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..calibration.file import ALIGN, CalibrationFile, calibration_path, read_calibration
from ..common.errors import InputError
from ..common.messages import Message, Remedy
from ..estimation.smooth import smooth_blocks
from ..logs.log import Block, Stretch
from ..logs.reader import Source, check_first_line, read_blocks, split_stretch
from ..logs.source import File, Progress, log_stem, name_of
from ..replay.meter_along import MeterAlong, Misfit
from ..signals import Array, Bools
from .channels import Channels, channels, joined

_MAX_SIGMA_DEG = 3.0  # a smoothed lean with a larger standard deviation is not trusted


class SmoothSlow(Message):
    """There are too few samples per second to smooth the lean."""

    code = "smooth-slow"
    text = (
        "the smoothed lean needs 10 samples per second: where the log has fewer, the lean is the one that the display "
        "showed"
    )


class AbsurdReadings(Message):
    """The log has implausible readings.

    at_s: time in the log.
    rate_dps: largest rate in the second before at_s.
    force_g: largest force in the second before at_s.
    """

    at_s: float
    rate_dps: float
    force_g: float

    code = "absurd-readings"
    text = (
        "implausible readings at {at_s:.1f} s, up to {rate_dps:.0f} deg/s and {force_g:.1f} g, where the lean is not "
        "known"
    )
    todo = Remedy("check the sensor, and the units in the log")


@dataclass
class Ride:
    """A log and its calibration. smoothed: True to use the smoothed lean, False for the displayed lean."""

    log: Source
    calibration: CalibrationFile
    smoothed: bool = False

    @property
    def name(self) -> str:
        """The log's name, with its path if it has one."""
        return name_of(self.log)

    @property
    def stem(self) -> str:
        """The name without path and suffixes."""
        return log_stem(self.name)

    @property
    def car(self) -> bool:
        """True for a car, which has no lean; False for a motorcycle."""
        return self.calibration.vehicle == "car"

    def blocks(self, progress: Progress | None = None, notices: list[Message] | None = None) -> Iterator[Channels]:
        """Yield the channels of the ride block by block. Frozen readings are left out, so they become gaps.

        progress, notices: see read_blocks(). They are about the whole log, even if the ride is a stretch of the log.
        Raises InputError.
        """
        along, absurd, slow, any_block = MeterAlong(self.calibration), False, False, False
        log, stretch = split_stretch(self.log)
        misfit = Misfit()
        for raw_block, smoothed_values in self._read(log, progress, notices):
            block = raw_block.measured
            if not len(block.time_us):
                continue
            lean, variance, odd = _lean_along(along, block, displayed=smoothed_values is None)
            misfit.add(block.t_s, odd)
            if notices is not None and not absurd and np.any(variance < 0.0):
                absurd = True
                notices.append(_divergence_notice(block, int(np.argmax(variance < 0.0))))
            slow |= self.smoothed and smoothed_values is None
            if smoothed_values is not None:
                lean_deg, sigma_deg, _, _, doubtful = smoothed_values[~raw_block.frozen].T
                sure = sigma_deg <= _MAX_SIGMA_DEG  # False for NaN
                lean |= {"lean_deg": lean_deg, "lean_sigma_deg": sigma_deg, "doubtful": doubtful}
                lean["sure"] = sure.astype(float)
            part = channels(block, self.calibration, lean, self.car)
            if stretch is not None:
                in_stretch = stretch.holds(block)
                if not in_stretch.any():
                    continue
                part = part.part(in_stretch)
            any_block = True
            yield part
        if not any_block:
            raise InputError(f"{self.name}: all readings are frozen, so that nothing is known: check the sensor")
        if notices is not None and not self.car:
            notices += misfit.remarks(notices)
        if notices is not None and slow:
            notices.append(SmoothSlow())

    def _read(
        self, log: Source, progress: Progress | None, notices: list[Message] | None
    ) -> Iterator[tuple[Block, Array | None]]:
        """Yield the blocks of the log, each with its smoothed values (see smooth_blocks()).

        The values are None if the ride is not smoothed, or if the log has under 10 samples per second.
        """
        if self.smoothed:
            return smooth_blocks(log, self.calibration, progress, notices, lines=False)
        blocks = read_blocks(log, 2, progress, notices, lines=False, calibration=self.calibration)
        return ((block, None) for block in blocks)


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


def open_ride(log: Source, calibration: CalibrationFile | File | None = None, smoothed: bool = False) -> Ride:
    """Open a ride from a log and its calibration.

    log: see read_log.
    calibration: an object or a file. None: NAME.cal.json beside the log.
    smoothed: use the lean of smooth() instead of the firmware's lean. It has no effect for a car, which has no lean.
    Raises InputError, also for a calibration that is not aligned, because lean and braking are then unknown.

    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> open_ride(log, CalibrationFile(aligned=True)).car
    False
    """
    source = calibration
    file = log.source if isinstance(log, Stretch) else log
    if source is None and isinstance(file, (Path, str)):
        source = calibration_beside(Path(file))
    if source is None:
        raise InputError(f"{name_of(log)}: an open file has no calibration beside it: give one")
    parameters = source if isinstance(source, CalibrationFile) else read_calibration(source)
    if not parameters.aligned:
        name = "the calibration" if isinstance(source, CalibrationFile) else name_of(source)
        raise InputError(f"{name} is not aligned, so lean and braking are unknown", ALIGN)
    return Ride(log, parameters, smoothed and parameters.vehicle != "car")


def vehicle_channels(
    log: Source, calibration: CalibrationFile | File | None = None, progress: Progress | None = None
) -> Channels:
    """Return the whole ride in the vehicle's axes, with the firmware's lean.

    Forces are computed by Nicolae's formulas (18)-(20) and the matrix vehicle_from_sensor.

    log, calibration: see open_ride(), which raises the same errors.
    progress: called with (done, total) of the log.

    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> channels = vehicle_channels(log, CalibrationFile(aligned=True))
    >>> bool(abs(channels.lean_deg).max() < 0.1), float(channels.up_g[-1])
    (True, 1.0)
    """
    return joined(open_ride(log, calibration).blocks(progress))


def _divergence_notice(block: Block, row: int) -> Message:
    """Return the notice that the lean filter diverged at row `at`, with the largest readings of the previous second."""
    last_second = slice(int(np.searchsorted(block.time_us, block.time_us[row] - 1_000_000)), row + 1)
    largest = np.max(np.abs(block.readings[last_second]), axis=0)
    return AbsurdReadings(block.time_us[row] / 1e6, float(np.max(largest[4:])), float(np.max(largest[:3])))


def _lean_along(along: MeterAlong, block: Block, displayed: bool) -> tuple[dict[str, Array], Array, Bools]:
    """Run the firmware's meter over a block of n samples.

    displayed: True to compute the displayed lean. False leaves lean_deg and sure at 0, which saves a tenth of the time.
    Returns:
        lean: the argument `lean` of channels().
        variance: variance of the lean, shape (n), in rad2; negative if the filter diverged.
        odd: True where the meter reports that the sensor's readings contradict each other, shape (n).
    """
    names = ("lean_deg", "shown_g", "variance", "resting", "rolling", "odd", "sure")
    columns: list[list[float]] = [[] for _ in names]
    lean_deg, forward, variance, resting, rolling, odd, sure = (column.append for column in columns)
    for meter in along.after_each(block, *along.in_vehicle(block)):
        lean = meter.filter
        forward(meter.smooth_force[2])
        variance(lean.variance)
        resting(lean.at_rest)
        rolling(lean.rolling)
        odd(meter.odd is not None)
        if displayed:
            lean_deg(meter.lean_deg)
            sure(meter.trusted)
    n = len(block.time_us)
    columns_by_name = {name: np.array(column or np.zeros(n), dtype=float) for name, column in zip(names, columns)}
    variances = columns_by_name.pop("variance")
    columns_by_name["doubtful"] = np.zeros(n)  # only smooth() finds doubtful samples
    columns_by_name["lean_sigma_deg"] = np.degrees(np.sqrt(np.where(variances >= 0.0, variances, np.nan)))
    return columns_by_name, variances, columns_by_name.pop("odd") > 0.0
