"""Computes the alignment from recorded drives with the firmware's own module.

DriveAlignment uses only sums of its samples over 100 ms. These sums are computed with numpy here. The results are the
same. A drive of ten minutes at 200 Hz takes 0.2 s instead of 0.9 s.
"""

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE, DriveAlignment, compare, yaw_deg
from kickstand.errors import Refusal

from ..checks.log import read_with_notices, without_frozen
from ..common.messages import InputError, Message, RefusedInput
from ..logs.log import Log, Source
from ..logs.source import Progress
from ..signals import Array
from .drive_events import DriveEvent, DriveWatch
from .feed import counted, feed, standing_of
from .file import CalibrationFile
from .poses import refuse_same_file
from .published import PublishedAlignment
from .refusals import of_firmware

METHODS = {"improved": DriveAlignment, "published": PublishedAlignment}
_SLOWEST_US = 50_000  # longest allowed time between samples
# Standard error of up, pitch and roll combined. A slope or camber that lasts for the whole drive, or the whole pose,
# causes it.
UP_DEG = 1.1


@dataclass
class PoseCheck:
    """The alignment from two poses, compared with the drive."""

    verdict: int  # a constant of kickstand.drive_alignment.alignment
    yaw_deg: float  # yaw error of the alignment from the poses


@dataclass
class DriveFit:
    """The alignment from drives.

    calibration: the alignment; with a refusal, the earlier calibration.
    vehicle: "car" or "motorcycle".
    method: a key of METHODS.
    used: number of braking events that count.
    turned: number of braking events in bends, which do not count.
    stops: number of stops.
    quality_deg: standard error of forward about the vertical.
    ready_s: seconds of all logs together until the alignment was ready.
    lag_s: delay of the speed; None for the published method.
    halves_deg: difference between the two halves of the drive; None for the published method.
    poses: comparison with an earlier alignment from two poses; None for a car, or without an earlier alignment.
    events: what happened in the drives.
    notices: remarks about the logs, each with the name of its log.
    bias_dps: the gyro's bias, shape (3).
    refusal: the reason why the drives do not determine the alignment, otherwise None.
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
    notices: list[tuple[str, Message]]
    bias_dps: Array
    refusal: RefusedInput | None = None

    @property
    def status(self) -> str:
        """ "aligned" or "refused"."""
        return "refused" if self.refusal else "aligned"

    @property
    def attitude_deg(self) -> float:
        """Standard error of the whole alignment, including up."""
        return math.hypot(self.quality_deg, UP_DEG)

    @property
    def reason(self) -> str:
        """The code of the refusal, or "" without a refusal."""
        return self.refusal.code if self.refusal else ""


def fit_drive(
    logs: Sequence[Source],
    calibration: CalibrationFile | None = None,
    vehicle: str | None = None,
    method: str = "improved",
    progress: Progress | None = None,
    on_event: Callable[[DriveEvent], None] | None = None,
) -> DriveFit:
    """Find the alignment of a sensor on a vehicle from logs of drives.

    The logs need a speed, stops, and braking in straight lines.

    logs: recorded with one mount, in chronological order (see read_log).
    calibration: an earlier calibration with offset and slope and, for a motorcycle, the alignment from two poses.
    vehicle: "motorcycle" or "car". None: a motorcycle if `calibration` is aligned and not a car's, otherwise a car.
    method: "improved", or "published" for ViriCiti's published method.
    progress: called with (done, total). Each sample counts twice, because the logs are read twice.
    on_event: called with each DriveEvent as it happens, even if the drive is refused later.
    Raises InputError, RefusedInput if the drive does not determine the sensor's mounting.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("city", seed=3, seconds=240.0)
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once per second
    >>> fit = fit_drive([log], vehicle="motorcycle")
    >>> fit.used >= 5, fit.quality_deg < 3.0, fit.calibration.vehicle_from_sensor.shape
    (True, True, (3, 3))
    """
    refuse_same_file(logs)
    usable_logs = [usable(read_with_notices(source), len(logs) > 1) for source in logs]
    fit = fit_logs(usable_logs, calibration, vehicle, method, progress, on_event)
    if fit.refusal:
        raise fit.refusal
    return fit


def fit_logs(
    logs: Sequence[Log],
    calibration: CalibrationFile | None = None,
    vehicle: str | None = None,
    method: str = "improved",
    progress: Progress | None = None,
    on_event: Callable[[DriveEvent], None] | None = None,
) -> DriveFit:
    """Run fit_drive() on logs from usable(). A refusal is not raised, but is in the result with the counts."""
    earlier = calibration or CalibrationFile()
    poses = earlier.aligned and earlier.vehicle != CAR
    kind = vehicle or (MOTORCYCLE if poses else CAR)
    up = earlier.vehicle_from_sensor[1].tolist() if kind == MOTORCYCLE and poses else None
    count = counted(progress, 2 * sum(len(log.t_s) for log in logs))
    # A first pass finds the gyro's bias at a stop. Then the driving before the first stop also counts.
    stood = standing_of(logs, earlier, count)
    measured = stood.stops or calibration is not None
    alignment = METHODS[method](kind, up, list(stood.bias) if measured else None)
    watch = DriveWatch(alignment, on_event)
    feed(alignment, logs, earlier, count, watch)
    # The bias from `standing` is a calibrated rate. The calibration file needs the bias as a reading.
    bias = earlier.gyro_bias_dps + np.linalg.solve(earlier.gyro_matrix, alignment.standing.bias)
    refusal, result = None, earlier
    try:
        result = _aligned(earlier, alignment, bias, kind)
    except Refusal as error:
        assumed = " (taken for a car: else --vehicle motorcycle)" if vehicle is None and kind == CAR else ""
        refusal = RefusedInput(of_firmware(error), ", ".join(log.name for log in logs), assumed)
    improved = alignment if isinstance(alignment, DriveAlignment) else None
    pose_check = None
    if improved and up is not None and not refusal:
        posed = earlier.vehicle_from_sensor.ravel().tolist()
        pose_check = PoseCheck(compare(improved, posed), yaw_deg(improved.quality.fit, posed))
    return DriveFit(
        result,
        kind,
        method,
        used=alignment.counted,
        turned=alignment.turned,
        stops=alignment.standing.stops,
        quality_deg=alignment.quality_deg,
        ready_s=watch.ready_s,
        lag_s=improved.events.lag_s if improved else None,
        halves_deg=improved.quality.halves_deg if improved else None,
        poses=pose_check,
        events=watch.events,
        notices=[(log.name, notice) for log in logs for notice in log.notices],
        bias_dps=bias,
        refusal=refusal,
    )


def _aligned(
    earlier: CalibrationFile, alignment: DriveAlignment | PublishedAlignment, bias: Array, vehicle: str
) -> CalibrationFile:
    """Return a calibration with the alignment and the gyro's bias. Raises Refusal if the alignment is not ready."""
    matrix = array("f", [0.0] * 9)
    alignment.matrix(matrix)
    frame = np.array(matrix)
    return replace(
        earlier,
        gyro_bias_dps=bias,
        vehicle_from_sensor=frame,
        aligned=True,
        trim_deg=0.0,
        vehicle=vehicle,
        kickstand_side="",
    )


def usable(log: Log, others: bool) -> Log:
    """Return the log without frozen readings. Raises InputError without a speed, or with too few samples per second.

    others: True if the user gave other logs, and can leave this log out.
    """
    log = without_frozen(log)
    if np.all(np.isnan(log.speed_mps)):
        instead = ", or leave this log out" if others else ""
        raise InputError(f"{log.name}: no speed: record a column speed_mps, from a GPS or a wheel{instead}")
    step_us = int(log.time_us[-1]) / (len(log.t_s) - 1)
    if step_us > _SLOWEST_US:
        raise InputError(f"{log.name}: a sample every {step_us / 1e6:.2f} s: at least 20 per second are needed")
    return log
