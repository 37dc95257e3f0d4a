"""Calibrates a sensor from one log of the six positions.

It finds the still poses in the log, and calibrates the gyro by the turns between the poses.
"""

from typing import Any

import numpy as np
from kickstand.calibration import six_position
from kickstand.calibration.poses import Turn
from kickstand.calibration.six_position import SIDES, SensorFit
from kickstand.errors import Refusal

from ..checks.log import check_log
from ..common.messages import InputError, RefusedInput
from ..logs.log import Log, Source
from ..logs.reader import read_log
from .file import CalibrationFile
from .poses import Pose, SixPositions, beyond_sheet, take_pose, wrong_number
from .refusals import SideTilted, UnprovedGyro, of_firmware

_WINDOW_S = 0.5  # length of the windows in which the sensor must be still
_LEAST_S = 1.0  # a shorter pose is not used
_MARGIN_S = 0.1  # time that is left out at both ends of a pose
_STILL_G, _STILL_DPS = 0.1, 6.0  # largest change of an axis in a still window
_STILL_SPREAD_G = 0.02  # largest standard deviation in a still window
_STILL_DRIFT_G = 0.007  # largest difference between the means of the halves of a still window
_ROUGH_TILT_DEG = 30.0  # largest tilt of a side pose from its axis
_MICRO = 1_000_000  # readings are in millionths of deg/s, because Turn sums integers
_RANGES_DPS = (250.0, 500.0, 1000.0, 2000.0)  # possible ranges of the gyro, because a log does not contain its range
# If the largest rate is between these shares of a range, the gyro reached the end of that range.
_AT_RANGE = 0.985, 1.01
_QUICK = 0.95  # a rate over this share of the range may have been clipped before the chip's low-pass filter


def fit_procedure(source: Source) -> SixPositions:
    """Calibrate the whole sensor from one log of the six positions.

    In the log, the sensor is still on each side once, in any order, and slanted at least once. The log also contains
    the turns between the poses. Every still pose and every turn counts.

    The result has offset, slope and cross-axis errors of the accelerometer, and bias, scale and cross-axis errors of
    the gyro (see kickstand.calibration.six_position).

    source: see read_log.
    Raises InputError. Raises its subclass RefusedInput if the firmware refuses a pose or the result.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("parked", seed=1, seconds=20.0)
    >>> fit = fit_procedure(Log.from_readings(ride.procedure, ride.rate_hz))
    >>> fit.calibration.gyro_matrix.shape, fit.turns
    ((3, 3), 6)
    """
    log = read_log(source)
    check_log(log, axes=False)
    intervals = _still_intervals(log)
    if len(intervals) == 1:
        raise wrong_number(1)
    poses = [_pose(log, first, last) for first, last in intervals]
    means = [pose.accel_g.tolist() for pose in poses]
    sides = _sides(log, means)
    turns = _turns(log, intervals, poses)
    slanted = [k for k, mean in enumerate(means) if six_position.tilt_deg(mean) >= six_position.FREE_TILT_DEG]
    free = [k for k in slanted if k not in sides]
    try:
        offset, slope = six_position.fit([means[k] for k in sides])
        errors = [six_position.check_free_pose(offset, slope, means[k]) for k in free]
        fit = SensorFit(means, turns, offset, slope)
        fit.finish()
        if fit.unproved:
            raise RefusedInput(UnprovedGyro(fit.unproved[0]), log.name)
    except Refusal as error:
        reason = of_firmware(error)
        side = isinstance(reason, SideTilted)
        raise RefusedInput(reason, poses[sides[SIDES.index(reason.side)]].name if side else log.name) from error
    bias = np.median([pose.gyro_dps for pose in poses], axis=0)
    matrices: dict[str, Any] = {name: getattr(fit, name) for name in ("accel_matrix", "gyro_matrix", "gyro_sigma")}
    calibration = CalibrationFile(np.array(fit.offset), np.array(fit.slope), bias, six_done=True, **matrices)
    return SixPositions(
        calibration,
        [poses[k] for k in sides],
        [six_position.tilt_deg(means[k]) for k in sides],
        poses[free[0]] if free else None,
        errors[0] if free else None,
        beyond_sheet(fit.offset, fit.slope),
        sum(turn is not None for turn in turns),
        len(turns),
    )


def _still_intervals(log: Log) -> list[tuple[int, int]]:
    """Find the intervals in which the sensor was still.

    Returns the index of the first sample, and the index after the last sample, of each stretch.
    """
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
    lies = np.zeros(len(log.t_s) + 2, dtype=int)
    for start in starts[still]:
        lies[start + 1 : start + 1 + n] = 1
    lies[1:-2][np.diff(log.t_s) > _WINDOW_S] = 0  # the sensor may be moved in a gap, so a stretch ends at it
    edges = np.flatnonzero(np.diff(lies))
    margin = round(_MARGIN_S / step_s)
    intervals = [(first + margin, last - margin) for first, last in zip(edges[::2].tolist(), edges[1::2].tolist())]
    return [(first, last) for first, last in intervals if (last - first) * step_s >= _LEAST_S]


def _pose(log: Log, first: int, last: int) -> Pose:
    """Average these samples.

    The sensor may still tilt a little, for example while a hand puts it down slowly. Then average only the middle half
    of the samples. If the sensor tilts in the middle half too, average only the last half.
    """
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


def _sides(log: Log, means: list[list[float]]) -> list[int]:
    """Return the index of the pose for each side, in the order of SIDES.

    If a side has several poses, the least tilted pose is used.
    """
    best: dict[int, int] = {}
    for k, mean in enumerate(means):
        side = six_position.side_of(mean)
        if six_position.tilt_deg(mean) <= _ROUGH_TILT_DEG and (
            side not in best or six_position.tilt_deg(mean) < six_position.tilt_deg(means[best[side]])
        ):
            best[side] = k
    missing = [name for side, name in enumerate(SIDES) if side not in best]
    if missing:
        raise InputError(
            f"{log.name}: {len(means)} still poses, none with side {', '.join(missing)} up: one log has to have all "
            "six sides, each held still for two seconds"
        )
    return [best[side] for side in range(6)]


def _turns(log: Log, intervals: list[tuple[int, int]], poses: list[Pose]) -> list[tuple[list[float], float] | None]:
    """Return the turns between the poses, for SensorFit; None for a turn with missing or clipped readings."""
    times_us = np.round(log.t_s * 1e6).astype(int)
    steps_us = np.diff(times_us, prepend=times_us[0])
    rates = np.round(log.gyro_dps * _MICRO).astype(int).tolist()
    most = float(np.max(np.abs(log.gyro_dps)))
    low, high = _AT_RANGE
    limit = next((_QUICK * end for end in _RANGES_DPS if low * end <= most <= high * end), 2 * most + 1)
    turn = Turn(_MICRO, int(np.median(steps_us[1:])), int(limit * _MICRO))
    turns: list[tuple[list[float], float] | None] = []
    for (_, begin), (end, _), first, second in zip(intervals, intervals[1:], poses, poses[1:]):
        turn.start(first.gyro_dps.tolist())
        for k in range(begin, end):
            turn.add((0, 0, 0, 0, *rates[k]), 1, int(steps_us[k]))
        turn.end()
        turns.append(None if turn.lost or turn.quick else (list(turn.packed(second.gyro_dps.tolist())), turn.seconds))
    return turns
