"""Alignment from recorded drives, by the firmware's own module."""

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from kickstand.drive_alignment import verdict
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE, DriveAlignment
from kickstand.errors import AlignmentError, Notice

from ..errors import InputError
from ..logs.mended.frozen import believed
from ..logs.reader import Log, Source, read_log
from ..logs.source import Progress
from ..refusals import RefusedInput
from .drive_events import DriveEvent, DriveWatch
from .file import CalibrationFile
from .poses import refuse_same_file
from .published.viriciti import PublishedAlignment

METHODS = {"improved": DriveAlignment, "published": PublishedAlignment}
_BETWEEN_US = 3_600_000_000  # time that is assumed between two logs, so that they do not join
_SLOWEST_US = 50_000  # between samples
_CHUNK = 1000  # samples between two calls of progress


@dataclass
class PoseCheck:
    """An alignment of two poses, compared with the drive. verdict: a constant of kickstand.drive_alignment.verdict;
    yaw_deg: by how much the poses had forward turned about the vertical."""

    verdict: int
    yaw_deg: float


@dataclass
class DriveResult:
    """What drives give.

    vehicle: "car" or "motorcycle". used, turned: braking events that were counted, and those in turns that were not.
    quality_deg: standard error of forward about the vertical. ready_s: seconds of all logs until the alignment was
    ready. lag_s: by how much the speed is late; halves_deg: by how much two halves of the drive differ; None for the
    published method. poses: for a motorcycle that two poses had aligned before. notices: what is remarkable in the
    logs, with the log's name.
    """

    calibration: CalibrationFile
    vehicle: str
    method: str
    used: int
    turned: int
    stops: int
    quality_deg: float
    ready_s: float
    lag_s: float | None
    halves_deg: float | None
    poses: PoseCheck | None
    events: list[DriveEvent]
    notices: list[tuple[str, Notice]]


def fit_drive(
    logs: Sequence[Source],
    calibration: CalibrationFile | None = None,
    vehicle: str | None = None,
    method: str = "improved",
    progress: Progress | None = None,
    on_event: Callable[[DriveEvent], None] | None = None,
) -> DriveResult:
    """How the sensor sits on the vehicle, from logs of driving with speed: stops, and braking in straight lines.

    logs: of one mount in time order (see read_log). calibration: what is known already: offset and slope, and the two
    poses of a motorcycle. vehicle: "motorcycle" or "car"; if None, a motorcycle where calibration has two poses, else a
    car. method: "improved", or "published", ViriCiti's as it was published. progress: called with the samples done and
    all there are (each is gone through twice). on_event: called with each DriveEvent as it happens, also when the
    drive is refused in the end. Raises InputError; RefusedInput, a subclass with code and values, where the drive does
    not tell how the sensor sits.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("city", seed=3, seconds=240.0)
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once a second
    >>> found = fit_drive([log], vehicle="motorcycle")
    >>> found.used >= 5, found.quality_deg < 3.0, found.calibration.vehicle_from_sensor.shape
    (True, True, (3, 3))
    """
    refuse_same_file(logs)
    before = calibration or CalibrationFile()
    poses = before.aligned and before.vehicle != CAR
    kind = vehicle or (MOTORCYCLE if poses else CAR)
    up = before.vehicle_from_sensor[1].tolist() if kind == MOTORCYCLE and poses else None
    drives = [_read(source, len(logs) > 1) for source in logs]
    steps = _Steps(progress, 2 * sum(len(log.t_s) for log in drives))
    # the gyro's bias is found at a stop: a first pass looks for one, so that what came before it counts too
    scout = DriveAlignment(kind, up, [0.0] * 3)
    _feed(scout, drives, before, steps, None)
    known = scout.standing.stops or calibration is not None
    alignment = METHODS[method](kind, up, list(scout.standing.bias) if known else None)
    watch = DriveWatch(alignment, on_event)
    _feed(alignment, drives, before, steps, watch)
    matrix = array("f", [0.0] * 9)
    try:
        alignment.matrix(matrix)
    except AlignmentError as error:
        assumed = " (taken for a car: else --vehicle motorcycle)" if vehicle is None and kind == CAR else ""
        raise RefusedInput(error, ", ".join(log.name for log in drives), assumed) from error
    improved = alignment if isinstance(alignment, DriveAlignment) else None
    pose_check = None
    if improved and up is not None:
        posed = before.vehicle_from_sensor.ravel().tolist()
        pose_check = PoseCheck(verdict.compare(improved, posed), verdict.yaw_deg(improved.quality.fit, posed))
    result = replace(
        before,
        gyro_bias_dps=before.gyro_bias_dps + np.array(alignment.standing.bias),
        vehicle_from_sensor=np.array(matrix),
        aligned=True,
        trim_deg=0.0,
        vehicle=kind,
        kickstand_side="",
    )
    return DriveResult(
        result,
        kind,
        method,
        alignment.counted,
        alignment.turned,
        alignment.standing.stops,
        alignment.quality_deg,
        watch.ready_s,
        improved.events.lag_s if improved else None,
        improved.quality.halves_deg if improved else None,
        pose_check,
        watch.events,
        [(log.name, notice) for log in drives for notice in log.notices],
    )


def _read(source: Source, others: bool) -> Log:
    log = believed(read_log(source))
    if np.all(np.isnan(log.speed_mps)):
        instead = ", or leave this log out" if others else ""
        raise InputError(f"{log.name}: no speed: record a column speed_mps, from a GPS or a wheel{instead}")
    step_us = int(log.time_us[-1]) / (len(log.t_s) - 1)
    if step_us > _SLOWEST_US:
        raise InputError(f"{log.name}: a sample every {step_us / 1e6:.2f} s: at least 20 a second are needed")
    return log


def _feed(
    alignment: DriveAlignment | PublishedAlignment,
    logs: list[Log],
    calibration: CalibrationFile,
    steps: "_Steps",
    watch: DriveWatch | None,
) -> None:
    """Run the logs through an alignment; watch is told each time that something may have happened."""
    firmware = calibration.to_firmware()
    force, rate = [0.0] * 3, [0.0] * 3
    for log in logs:
        previous = -_BETWEEN_US if log is not logs[0] else 0
        if watch:
            watch.begin(log.name)
        for i, (now, reading, speed) in enumerate(log.rows(), 1):
            firmware.apply(reading, force, rate)
            try:
                alignment.update(force, rate, now - previous)
            except ValueError as error:  # of a null vector
                what = f"{log.name}, at {now / 1e6:.1f} s: accelerations of nearly 0"
                raise InputError(f"{what}: at rest 1 g is needed, check the sensor") from error
            previous = now
            if speed == speed:  # not NaN
                alignment.measure_speed(speed)
                if watch:
                    watch.look(now / 1e6)
            if i % _CHUNK == 0:
                steps.more(_CHUNK)
        steps.more(len(log.t_s) % _CHUNK)
        if log is logs[-1]:
            alignment.finish()
        if watch:
            watch.end(previous / 1e6)


class _Steps:
    """Counts samples for a progress callback."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress, self._done, self._total = progress, 0, total

    def more(self, samples: int) -> None:
        """So many more are done."""
        self._done += samples
        if self._progress:
            self._progress(self._done, self._total)
