"""Alignment from two still poses, on the kickstand and upright (A. Nicolae, section 2).

Differences from the paper: (4) is the cross product of the upright and the tilted reading, which as printed is zero.
(5) takes y from the upright reading and divides by its own length. Where the kickstand leans the bike to the right, x
and z come out pointing right and backward, and both signs are changed.
"""

from math import atan2, degrees

from ..errors import AlignmentError
from ..rotation import cross, dot, frame, matrix, norm, normalize, vector

# Least tilt between the poses. At 5 degrees, one degree of pitch between them makes a yaw error of 11 degrees; at 8, 7.
MIN_TILT_DEG = 5.0
WARN_TILT_DEG = 8.0
MAX_TILT_DEG = 60.0
SAME_POSE_DEG = 1.0
# Largest difference of a reading at rest from 1 g. The data sheet allows 80 mg of offset and 3 % of scale, plus drift;
# after the six positions there remain 35 mg of drift over temperature.
UNCALIBRATED_TOLERANCE_G = 0.15
CALIBRATED_TOLERANCE_G = 0.05


def check_one_g(force, tolerance_g, pose):
    """Raise AlignmentError unless the length of force (3, g) is within tolerance_g of 1. pose: "kickstand" or
    "upright"."""
    size = norm(force)
    if not abs(size - 1.0) <= tolerance_g:
        raise AlignmentError("not-one-g", pose, size)


def two_position(out, kickstand, upright, side="left", tolerance_g=UNCALIBRATED_TOLERANCE_G):
    """Fill out (9, rows left, up, forward) with the rotation from sensor to vehicle axes; return the tilt between the
    poses in degrees. Equations 3-8.

    kickstand, upright: mean specific force of each pose (3, g, sensor's axes). side: "left" or "right", to which the
    kickstand leans the bike. Raises AlignmentError.
    """
    check_one_g(kickstand, tolerance_g, "kickstand")
    check_one_g(upright, tolerance_g, "upright")
    y, tilted = vector(*upright), vector(*kickstand)
    normalize(y)
    normalize(tilted)
    z = vector()
    cross(z, y, tilted)
    tilt = degrees(atan2(norm(z), dot(y, tilted)))
    if tilt < SAME_POSE_DEG:
        raise AlignmentError("same-pose", tilt)
    if tilt < MIN_TILT_DEG:
        raise AlignmentError("tilt-small", tilt, MIN_TILT_DEG)
    if tilt > MAX_TILT_DEG:
        raise AlignmentError("tilt-large", tilt, MAX_TILT_DEG)
    if side == "right":
        z[0], z[1], z[2] = -z[0], -z[1], -z[2]
    frame(out, y, z)
    return tilt


def align(calibration, kickstand, upright, side):
    """A new Calibration, aligned by two finished poses (StillPose each), and the tilt between them in degrees.

    calibration: that with offset and slope. side: "left" or "right", to which the kickstand leans the bike. The gyro's
    bias is that of the kickstand pose: a stand holds the bike stiller than a rider does. Raises AlignmentError.
    """
    vehicle_from_sensor = matrix()
    poses = calibration.correct(kickstand.accel), calibration.correct(upright.accel)
    tolerance_g = CALIBRATED_TOLERANCE_G if calibration.six_done else UNCALIBRATED_TOLERANCE_G
    tilt = two_position(vehicle_from_sensor, *poses, side, tolerance_g)
    return calibration.with_alignment(vehicle_from_sensor, kickstand.gyro), tilt
