"""Computes a calibration from recorded still poses, with the firmware's own modules.

Six poses give offset and slope of the accelerometer. If one log has all of them, the turns between them also calibrate
the gyro. Two poses give the alignment.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from kickstand.calibration import six_position
from kickstand.calibration.poses import StillPose, Turn, align
from kickstand.calibration.six_position import SIDES, SensorFit
from kickstand.errors import CaptureError, Refusal
from kickstand.units import AXES

from ..checks.log import check_log
from ..common.messages import InputError, Message, RefusedInput
from ..logs.log import ROOM_TEMP_C, Log, Source
from ..logs.reader import read_log
from ..signals import Array, intervals
from .file import CalibrationFile
from .refusals import FreePoseOff, SideTilted, UnprovedGyro, of_firmware

_MICRO = 1_000_000  # readings are in millionths of g and deg/s, because StillPose and Turn sum integers
_SATURATED = 1_990_000  # almost 2 g, the end of the smallest range: an axis that reads more may be at its limit
GOOD_FREE_POSE_G = 0.010  # largest difference from 1 g of a free pose that confirms the calibration
_SHEET_OFFSET_G = (0.05, 0.05, 0.08)  # largest offset of the MPU6050's axes by the data sheet
_SHEET_SLOPE_ERROR = 0.03  # largest error of the MPU6050's slope by the data sheet
# Least tilt of the free pose from its nearest axis, minus the tilt of the side pose from the same axis.
_EQUAL_TILT_DEG = 3.0


@dataclass
class Pose:
    """The mean of one still pose."""

    name: str  # the name of its log
    still: StillPose

    @property
    def samples(self) -> int:
        """Number of samples that were averaged."""
        return self.still.count

    @property
    def accel_g(self) -> Array:
        """Mean specific force along the sensor's axes, not calibrated, shape (3)."""
        return np.array(self.still.accel)

    @property
    def tilt_deg(self) -> float:
        """The tilt of the pose from the nearest axis."""
        return six_position.tilt_deg(self.still.accel)

    @property
    def side(self) -> int:
        """The index in SIDES of the side that is up."""
        return six_position.side_of(self.still.accel)

    @property
    def gyro_dps(self) -> Array:
        """Mean angular rate of the sensor at rest, which is the gyro's bias, shape (3)."""
        return np.array(self.still.gyro)


def read_pose(source: Source) -> Pose:
    """Average a recorded pose. Raises InputError that names the file, RefusedInput if the pose was not still."""
    log = read_log(source)
    check_log(log, axes=False)
    return take_pose(log.name, log.readings, "capture this pose again")


def take_pose(name: str, readings: Array, advice: str) -> Pose:
    """Average the readings of a still pose.

    readings: in the chip's order (g, C, deg/s), shape (n, 7).
    advice: what to do, for the RefusedInput that is raised if the pose was not still.
    """
    still = StillPose(_MICRO, _MICRO, _SATURATED, len(readings))
    where = f"{name}: pose refused"
    counts = np.round(np.nan_to_num(readings, nan=ROOM_TEMP_C) * _MICRO).astype(int).tolist()
    try:
        for number, row in enumerate(counts, 1):
            where = f"{name}, sample {number}"
            still.add(row)
        where = f"{name}: pose refused"
        still.finish()
    except CaptureError as error:
        raise RefusedInput(of_firmware(error), where, f": {advice}") from error
    return Pose(name, still)


def refuse_same_file(sources: Sequence[Source]) -> None:
    """Raise InputError if a path is given twice."""
    paths: set[Path] = set()
    for path in (Path(source) for source in sources if isinstance(source, (Path, str))):
        if path.resolve() in paths:
            raise InputError(f"{path} is given twice: each must be a separate recording")
        paths.add(path.resolve())


@dataclass
class SixPositions:
    """The calibration from six or seven poses.

    sides: the pose of each side, in the order of kickstand.calibration.six_position.SIDES (+x -x +y -y +z -z up).
    free_pose: the seventh, slanted pose; None without it.
    free_pose_error_g: the calibrated length of the seventh pose minus 1 g; None without it.
    turns: number of turns between poses that calibrated the gyro; 0 if each pose has its own log.
    all_turns: number of all turns between poses; 0 if each pose has its own log.
    """

    calibration: CalibrationFile
    sides: list[Pose]
    free_pose: Pose | None
    free_pose_error_g: float | None
    turns: int = 0
    all_turns: int = 0

    @property
    def tilt_deg(self) -> list[float]:
        """The tilt of each side from its axis."""
        return [pose.tilt_deg for pose in self.sides]

    @property
    def beyond_sheet(self) -> list[str]:
        """The axes whose offset or slope exceeds the data sheet's limits. Their sensor is still usable."""
        off = np.abs(self.calibration.accel_offset_g) > _SHEET_OFFSET_G
        off |= np.abs(self.calibration.accel_slope - 1.0) > _SHEET_SLOPE_ERROR
        return [axis for axis, is_off in zip(AXES, off) if is_off]


def fit_six_positions(poses: Sequence[Source]) -> SixPositions:
    """Find offset (g) and slope of each axis from six still poses, each side up once, in any order.

    The equations are (16)-(20) of Nicolae's paper, section 4. The solution makes each calibrated reading 1 g long, even
    if an axis does not point exactly up. The gyro's bias is the median of the poses.

    poses: six logs, or seven with a slanted pose that checks the result (see read_log).
    Raises InputError, RefusedInput if the firmware refuses a pose or the result.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("parked", seed=1, seconds=20.0)
    >>> fit = fit_six_positions([Log.from_readings(pose, ride.rate_hz) for pose in ride.poses])
    >>> fit.calibration.accel_offset_g.shape, abs(fit.free_pose_error_g) < 0.01
    ((3,), True)
    """
    if len(poses) not in (6, 7):
        raise _wrong_number(len(poses))
    refuse_same_file(poses)
    sides, free = _sides([read_pose(source) for source in poses])
    try:
        offset, slope, error_g = _accelerometer(sides, free)
    except Refusal as error:
        reason = of_firmware(error)
        side = _refused_side(reason, sides)
        if side:
            raise RefusedInput(reason, side.name, ": capture this side again") from error
        raise RefusedInput(reason, free.name if free and isinstance(reason, FreePoseOff) else "") from error
    bias = np.median([pose.gyro_dps for pose in (*sides, *([free] if free else []))], axis=0)
    calibration = CalibrationFile(np.array(offset), np.array(slope), bias, six_done=True)
    return SixPositions(calibration, sides, free, error_g)


def _wrong_number(captures: int) -> InputError:
    return InputError(
        f"{captures} captures given: six are needed, one for each side up, or seven with a free pose; or one log of "
        "the whole procedure"
    )


def _sides(poses: list[Pose]) -> tuple[list[Pose], Pose | None]:
    """Return the pose of each side, in the order of SIDES, and the free pose or None.

    Of seven poses, two have the same side up. The pose that is further from the axis is the free pose.
    """
    by_side: dict[int, list[Pose]] = {}
    for pose in poses:
        by_side.setdefault(pose.side, []).append(pose)
    for of_side in by_side.values():
        of_side.sort(key=lambda pose: pose.tilt_deg)
    missing = [name for i, name in enumerate(SIDES) if i not in by_side]
    free = None
    for side, (near, *further) in by_side.items():
        if not further:
            continue
        names = " and ".join(pose.name for pose in (near, *further))
        if missing or len(poses) == 6:
            lacking = f"side {', '.join(missing)} is missing, and " if missing else ""
            raise InputError(f"{lacking}side {SIDES[side]} is there {1 + len(further)} times ({names}): one each")
        (free,) = further  # seven poses without a missing side: one side has two
        if free.tilt_deg < six_position.FREE_TILT_DEG or free.tilt_deg - near.tilt_deg < _EQUAL_TILT_DEG:
            raise InputError(
                f"side {SIDES[side]} exists twice ({names}): the seventh pose must be "
                f"slanted, over {six_position.FREE_TILT_DEG:.0f} degrees from every side"
            )
    return [by_side[side][0] for side in range(6)], free


def _accelerometer(sides: list[Pose], free: Pose | None) -> tuple[list[float], list[float], float | None]:
    """Return offset (g) and slope, and the error of the free pose in g. Raises Refusal."""
    offset, slope = six_position.fit([pose.still.accel for pose in sides])
    return offset, slope, six_position.check_free_pose(offset, slope, free.still.accel) if free else None


def _refused_side(reason: Message, sides: list[Pose]) -> Pose | None:
    """The pose of the side that a refusal names."""
    return sides[SIDES.index(reason.side)] if isinstance(reason, SideTilted) else None


@dataclass
class TwoPositions:
    """The alignment from two poses.

    tilt_deg: the angle between the poses. If it is under 8 degrees, forward is uncertain.
    """

    calibration: CalibrationFile
    kickstand: Pose
    upright: Pose
    tilt_deg: float


def fit_two_positions(
    kickstand: Source, upright: Source, calibration: CalibrationFile | None = None, side: str = "left"
) -> TwoPositions:
    """Find the alignment of a sensor on a bike from two poses: on the kickstand, and upright.

    The equations are (3)-(8) of Nicolae's paper, section 2. The gyro's bias is its mean reading in the pose on the
    kickstand.

    kickstand, upright: logs (see read_log).
    calibration: of fit_six_positions(), with offset and slope. None if the readings are calibrated.
    side: side of the kickstand, "left" or "right".
    Raises InputError, RefusedInput if the firmware refuses the poses.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("parked", seed=1, seconds=20.0)
    >>> kickstand, upright = (Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright))
    >>> fit = fit_two_positions(kickstand, upright)
    >>> fit.calibration.vehicle_from_sensor.shape, 8.0 < fit.tilt_deg < 16.0
    ((3, 3), True)
    """
    refuse_same_file([kickstand, upright])
    earlier = calibration or CalibrationFile()
    first, second = read_pose(kickstand), read_pose(upright)
    try:
        aligned, tilt_deg = align(earlier.to_firmware(), first.still, second.still, side)
    except Refusal as error:
        raise RefusedInput(of_firmware(error), f"{first.name} and {second.name}") from error
    result = replace(
        earlier,
        gyro_bias_dps=first.gyro_dps,
        vehicle_from_sensor=np.array(aligned.vehicle_from_sensor),
        aligned=True,
        trim_deg=0.0,
        vehicle="",
        kickstand_side=side,
    )
    return TwoPositions(result, first, second, tilt_deg)


# Six positions in one log

_WINDOW_S = 0.5  # length of the windows in which the sensor must be still
_LEAST_S = 1.0  # a shorter pose is not used
_MARGIN_S = 0.1  # time that is left out at both ends of a pose
_STILL_G, _STILL_DPS = 0.1, 6.0  # largest change of an axis in a still window
_STILL_SPREAD_G = 0.02  # largest standard deviation in a still window
_STILL_DRIFT_G = 0.007  # largest difference between the means of the halves of a still window
_ROUGH_TILT_DEG = 30.0  # largest tilt of a side pose from its axis
_RANGES_DPS = (250.0, 500.0, 1000.0, 2000.0)  # possible ranges of the gyro, because a log does not contain its range
# If the largest rate is between these shares of a range, the gyro reached the end of that range.
_AT_RANGE = 0.985, 1.01
_QUICK = 0.95  # a rate over this share of the range may have been clipped before the chip's low-pass filter


def fit_procedure(source: Source) -> SixPositions:
    """Calibrate the whole sensor from one log of the six positions.

    In the log, the sensor is still on each side once, in any order, and slanted at least once. The turns between the
    poses are in it, too. The result also has the cross-axis errors of both sensors, and the scale of the gyro (see
    kickstand.calibration.six_position). Raises InputError, RefusedInput if the firmware refuses a pose or the result.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("parked", seed=1, seconds=20.0)
    >>> fit = fit_procedure(Log.from_readings(ride.procedure, ride.rate_hz))
    >>> fit.calibration.gyro_matrix.shape, fit.turns
    ((3, 3), 6)
    """
    log = read_log(source)
    check_log(log, axes=False)
    spans = _still_intervals(log)
    if len(spans) == 1:
        raise _wrong_number(1)
    poses = [_pose(log, first, last) for first, last in spans]
    sides = _best_sides(log, poses)
    turns = _turns(log, spans, poses)
    slanted = [pose for pose in poses if pose.tilt_deg >= six_position.FREE_TILT_DEG and pose not in sides]
    free = next(iter(slanted), None)
    try:
        offset, slope, error_g = _accelerometer(sides, free)
        for pose in slanted[1:]:
            six_position.check_free_pose(offset, slope, pose.still.accel)
        fit = SensorFit([pose.still.accel for pose in poses], turns, offset, slope)
        fit.finish()
        if fit.unproved:
            raise RefusedInput(UnprovedGyro(fit.unproved[0]), log.name)
    except Refusal as error:
        reason = of_firmware(error)
        raise RefusedInput(reason, (_refused_side(reason, sides) or log).name) from error
    bias = np.median([pose.gyro_dps for pose in poses], axis=0)
    matrices: dict[str, Any] = {name: getattr(fit, name) for name in ("accel_matrix", "gyro_matrix", "gyro_sigma")}
    calibration = CalibrationFile(np.array(fit.offset), np.array(fit.slope), bias, six_done=True, **matrices)
    measured = sum(turn is not None for turn in turns)
    return SixPositions(calibration, sides, free, error_g, measured, len(turns))


def _still_intervals(log: Log) -> list[tuple[int, int]]:
    """Return the first sample, and the sample after the last one, of each interval in which the sensor was still."""
    step_s = float(np.median(np.diff(log.t_s))) if len(log.t_s) > 1 else 1.0
    n = max(4, round(_WINDOW_S / step_s))
    if len(log.t_s) < n:
        raise InputError(f"{log.name}: it is too short for the six positions")
    starts = np.arange(0, len(log.t_s) - n + 1, max(1, n // 10))
    within = starts[:, None] + np.arange(n)
    accel = log.accel_g[within]
    still = np.all(np.ptp(accel, axis=1) <= _STILL_G, axis=1) & np.all(np.std(accel, axis=1) <= _STILL_SPREAD_G, axis=1)
    half = n // 2
    drift = np.mean(accel[:, half:], axis=1) - np.mean(accel[:, :half], axis=1)
    still &= np.all(np.abs(drift) <= _STILL_DRIFT_G, axis=1)
    still &= np.all(np.ptp(log.gyro_dps[within], axis=1) <= _STILL_DPS, axis=1)
    still &= log.t_s[within[:, -1]] - log.t_s[starts] < 2 * _WINDOW_S  # a window must not extend across a gap
    is_still = np.zeros(len(log.t_s), dtype=bool)
    for start in starts[still]:
        is_still[start : start + n] = True
    is_still[:-1][np.diff(log.t_s) > _WINDOW_S] = False  # the sensor may be moved in a gap, so a stretch ends at it
    margin = round(_MARGIN_S / step_s)
    shortened = [(first + margin, last - margin) for first, last in intervals(is_still).tolist()]
    return [(first, last) for first, last in shortened if (last - first) * step_s >= _LEAST_S]


def _pose(log: Log, first: int, last: int) -> Pose:
    """Average these samples. If the sensor still tilts, as while a hand puts it down slowly, average only the middle
    half of them. If it tilts there too, average only the last half."""
    name = f"{log.name}, {log.t_s[first]:.1f} to {log.t_s[last - 1]:.1f} s"
    quarter = (last - first) // 4
    problem = None
    for begin, end in ((first, last), (first + quarter, last - quarter), (last - 2 * quarter, last)):
        try:
            return take_pose(name, log.readings[begin:end], "record the procedure again")
        except RefusedInput as error:
            problem = problem or error
    assert problem is not None
    raise problem


def _best_sides(log: Log, poses: list[Pose]) -> list[Pose]:
    """Return the pose of each side, in the order of SIDES: the least tilted one, if a side has several."""
    best: dict[int, Pose] = {}
    for pose in sorted(poses, key=lambda pose: pose.tilt_deg):
        if pose.tilt_deg <= _ROUGH_TILT_DEG:
            best.setdefault(pose.side, pose)
    missing = [name for side, name in enumerate(SIDES) if side not in best]
    if missing:
        raise InputError(
            f"{log.name}: {len(poses)} still poses, none with side {', '.join(missing)} up: one log has to have all "
            "six sides, each held still for two seconds"
        )
    return [best[side] for side in range(6)]


def _turns(log: Log, spans: list[tuple[int, int]], poses: list[Pose]) -> list[tuple[list[float], float] | None]:
    """Return the turns between the poses, for SensorFit; None for a turn with missing or clipped readings.

    spans: see _still_intervals().
    """
    times_us = np.round(log.t_s * 1e6).astype(int)
    steps_us = np.diff(times_us, prepend=times_us[0])
    rates = np.round(log.gyro_dps * _MICRO).astype(int).tolist()
    most = float(np.max(np.abs(log.gyro_dps)))
    low, high = _AT_RANGE  # if no range fits, the limit is over all rates
    limit = next((_QUICK * end for end in _RANGES_DPS if low * end <= most <= high * end), 2 * most + 1)
    turn = Turn(_MICRO, int(np.median(steps_us[1:])), int(limit * _MICRO))
    turns: list[tuple[list[float], float] | None] = []
    for (_, begin), (end, _), first, second in zip(spans, spans[1:], poses, poses[1:]):
        turn.start(first.gyro_dps.tolist())
        for k in range(begin, end):
            turn.add((0, 0, 0, 0, *rates[k]), 1, int(steps_us[k]))
        turn.end()
        turns.append(None if turn.lost or turn.quick else (list(turn.packed(second.gyro_dps.tolist())), turn.seconds))
    return turns
