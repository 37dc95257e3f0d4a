"""Accelerometer offset and slope from six recorded poses, by the firmware's own module."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from kickstand.calibration import six_position
from kickstand.calibration.six_position import SIDES
from kickstand.errors import CalibrationError
from kickstand.units import AXES

from ..errors import InputError
from ..logs.reader import Source
from ..refusals import RefusedInput
from .file import CalibrationFile
from .poses import Pose, read_pose, refuse_same_file

GOOD_FREE_POSE_G = 0.010  # a free pose that is nearer to 1 g than this confirms a good calibration
_SHEET_OFFSET_G = (0.05, 0.05, 0.08)  # the data sheet's limit of the MPU6050's offset, for each axis
_SHEET_SLOPE_ERROR = 0.03
_EQUAL_TILT_DEG = 3.0  # least tilt of the free pose from its nearest axis, beyond that of the side pose there


@dataclass
class SixPositions:
    """The calibration by six or seven poses.

    sides: the pose of each side in the order of kickstand.calibration.six_position.SIDES (+x -x +y -y +z -z up);
    tilt_deg: the tilt of each from its axis. free_pose, free_pose_error_g: the seventh, slanted one, and its calibrated
    length less 1 g; None without one. beyond_sheet: axes whose offset or slope exceeds the data sheet's limits.
    """

    calibration: CalibrationFile
    sides: list[Pose]
    tilt_deg: list[float]
    free_pose: Pose | None
    free_pose_error_g: float | None
    beyond_sheet: list[str]


def fit_six_positions(poses: Sequence[Source]) -> SixPositions:
    """Offset (g) and slope of each axis from six still poses, each side up once, in any order.

    poses: six logs, or seven with a slanted one that checks the result (see read_log for what a log may be). Nicolae's
    paper, section 4, equations (16)-(20), solved so that each calibrated reading is 1 g long whether or not the axis
    points exactly up. The gyro's bias is the median of the poses. Raises InputError; RefusedInput, a subclass with
    code and values, where the firmware refuses a pose or the result.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("parked", seed=1, seconds=20.0)
    >>> found = fit_six_positions([Log.from_readings(pose, ride.rate_hz) for pose in ride.poses])
    >>> found.calibration.accel_offset_g.shape, abs(found.free_pose_error_g) < 0.01
    ((3,), True)
    """
    if len(poses) not in (6, 7):
        raise InputError(
            f"{len(poses)} captures given: six are needed, one for each side up, or seven with a free pose"
        )
    refuse_same_file(poses)
    sides, free = _sides([read_pose(source) for source in poses])
    means = [pose.accel_g.tolist() for pose in sides]
    try:
        offset, slope = six_position.fit(means)
        error_g = six_position.check_free_pose(offset, slope, free.accel_g.tolist()) if free else None
    except CalibrationError as error:
        raise _with_file(error, sides, free) from error
    bias = np.median([pose.gyro_dps for pose in (*sides, *([free] if free else []))], axis=0)
    return SixPositions(
        CalibrationFile(np.array(offset), np.array(slope), bias, six_done=True),
        sides,
        [six_position.tilt_deg(mean) for mean in means],
        free,
        error_g,
        _beyond_sheet(offset, slope),
    )


def _sides(poses: list[Pose]) -> tuple[list[Pose], Pose | None]:
    """The pose of each side in the order of SIDES, and the free pose (None without one).

    Of seven poses two have the same side nearest to up: the one further from the axis is the free pose.
    """
    found: dict[int, list[Pose]] = {}
    for pose in poses:
        found.setdefault(six_position.side_of(pose.accel_g.tolist()), []).append(pose)
    free = None
    missing = [name for i, name in enumerate(SIDES) if i not in found]
    for side, same in found.items():
        if len(same) == 1:
            continue
        same.sort(key=_tilt_deg)
        names = " and ".join(pose.name for pose in same)
        if missing or len(poses) == 6:
            lacking = f"side {', '.join(missing)} is missing, and " if missing else ""
            raise InputError(f"{lacking}side {SIDES[side]} is there {len(same)} times ({names}): one each")
        near, free = same
        if _tilt_deg(free) < six_position.FREE_TILT_DEG or _tilt_deg(free) - _tilt_deg(near) < _EQUAL_TILT_DEG:
            raise InputError(
                f"side {SIDES[side]} is there twice ({names}): the seventh pose has to be "
                f"slanted, over {six_position.FREE_TILT_DEG:.0f} degrees from every side"
            )
    return [found[side][0] for side in range(6)], free


def _tilt_deg(pose: Pose) -> float:
    return six_position.tilt_deg(pose.accel_g.tolist())


def _with_file(error: CalibrationError, sides: list[Pose], free: Pose | None) -> RefusedInput:
    """The refusal with the file that it is about, where it is about one."""
    if error.code == "side-tilted":
        return RefusedInput(error, sides[SIDES.index(error.values[0])].name, ": capture this side again")
    return RefusedInput(error, free.name if free and error.code == "free-pose-off" else "")


def _beyond_sheet(offset: Sequence[float], slope: Sequence[float]) -> list[str]:
    """The axes whose offset or slope exceeds the data sheet's limits: usable, but worth a warning."""
    return [
        axis
        for axis, o, s, most in zip(AXES, offset, slope, _SHEET_OFFSET_G, strict=True)
        if abs(o) > most or abs(s - 1.0) > _SHEET_SLOPE_ERROR
    ]
