"""Alignment from two recorded poses, by the firmware's own module."""

from dataclasses import dataclass, replace

import numpy as np
from kickstand.calibration import two_position
from kickstand.errors import AlignmentError

from ..logs.reader import Source
from ..refusals import RefusedInput
from .file import CalibrationFile
from .poses import Pose, read_pose, refuse_same_file


@dataclass
class TwoPositions:
    """The alignment by two poses. tilt_deg: the angle between them; under 8 degrees, forward is uncertain."""

    calibration: CalibrationFile
    kickstand: Pose
    upright: Pose
    tilt_deg: float


def fit_two_positions(
    kickstand: Source, upright: Source, calibration: CalibrationFile | None = None, side: str = "left"
) -> TwoPositions:
    """The alignment of a sensor on a bike, from a pose on the kickstand and one upright: rows left, up, forward.

    kickstand, upright: logs (see read_log). calibration: that of fit_six_positions(), with offset and slope; None: the
    readings are taken as calibrated. side: "left" or "right", to which the kickstand leans the bike. The gyro's bias is
    that of the pose on the kickstand. Nicolae's paper, section 2, equations (3)-(8). Raises InputError; RefusedInput, a
    subclass with code and values, where the firmware refuses the poses.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("parked", seed=1, seconds=20.0)
    >>> kickstand, upright = (Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright))
    >>> found = fit_two_positions(kickstand, upright)
    >>> found.calibration.vehicle_from_sensor.shape, 8.0 < found.tilt_deg < 16.0
    ((3, 3), True)
    """
    refuse_same_file([kickstand, upright])
    before = calibration or CalibrationFile()
    first, second = read_pose(kickstand), read_pose(upright)
    try:
        aligned, tilt_deg = two_position.align(before.to_firmware(), first.still, second.still, side)
    except AlignmentError as error:
        raise RefusedInput(error, f"{first.name} and {second.name}") from error
    result = replace(
        before,
        gyro_bias_dps=first.gyro_dps,
        vehicle_from_sensor=np.array(aligned.vehicle_from_sensor),
        aligned=True,
        trim_deg=0.0,
        vehicle="",
        kickstand_side=side,
    )
    return TwoPositions(result, first, second, tilt_deg)
