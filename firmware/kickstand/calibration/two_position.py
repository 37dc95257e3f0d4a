"""Sensor to vehicle from two still poses: on the kickstand and upright (A. Nicolae, section 2).

The paper's slips, put right: (4) is the cross product upright x tilted; (5) takes y from the upright reading,
divided by its own length; with the bike leaned to the right, x and z come out reversed and are turned round.
"""

from math import atan2, degrees

from ..errors import AlignmentError
from ..rotation import cross, dot, matrix, norm, normalize, vector

MIN_TILT_DEG = 5.0  # below, 1 degree of pitch change between the poses turns forward by over 11 degrees
WARN_TILT_DEG = 8.0
MAX_TILT_DEG = 60.0
SAME_POSE_DEG = 1.0
UNCALIBRATED_TOLERANCE_G = 0.15  # data sheet: 80 mg of offset and 3 % of scale, and a little drift
CALIBRATED_TOLERANCE_G = 0.05  # after six positions only drift over temperature is left: 35 mg


def check_one_g(force, tolerance_g, pose):
    """Raise AlignmentError unless |force| is within tolerance of 1 g. pose: its name for the rider."""
    size = norm(force)
    if not abs(size - 1.0) <= tolerance_g:
        raise AlignmentError("not-one-g", pose, size)


def two_position(out, kickstand, upright, side="left", tolerance_g=UNCALIBRATED_TOLERANCE_G):
    """Fill out (9, rows left, up, forward) with vehicle-from-sensor; return the tilt between the poses in
    degrees.

    kickstand, upright: mean specific force of each pose in the sensor's axes, g. side: where the kickstand
    leans the bike to. Raises AlignmentError. Equations 3-8.
    """
    check_one_g(kickstand, tolerance_g, "kickstand")
    check_one_g(upright, tolerance_g, "upright")
    y = vector(upright[0], upright[1], upright[2])
    tilted = vector(kickstand[0], kickstand[1], kickstand[2])
    normalize(y)
    normalize(tilted)
    z = vector()
    cross(z, y, tilted)
    tilt = degrees(atan2(norm(z), dot(y, tilted)))
    if tilt < SAME_POSE_DEG:
        raise AlignmentError("same-pose", tilt)
    if tilt < MIN_TILT_DEG:
        raise AlignmentError("tilt-too-small", tilt, MIN_TILT_DEG)
    if tilt > MAX_TILT_DEG:
        raise AlignmentError("tilt-too-large", tilt, MAX_TILT_DEG)
    normalize(z)
    if side == "right":
        z[0], z[1], z[2] = -z[0], -z[1], -z[2]
    x = vector()
    cross(x, y, z)
    normalize(x)
    for i in range(3):
        out[i] = x[i]
        out[3 + i] = y[i]
        out[6 + i] = z[i]
    return tilt


def align(calibration, kickstand, upright, side):
    """A new Calibration, aligned by two finished poses (StillPose each), and the tilt between them in degrees.

    calibration: gives offset and slope. side: where the kickstand leans the bike to, "left" or "right". The gyro's bias
    is that of the kickstand pose: a stand holds the bike stiller than a rider does. Raises AlignmentError.
    """
    vehicle_from_sensor = matrix()
    tilt = two_position(
        vehicle_from_sensor,
        calibration.correct(kickstand.accel),
        calibration.correct(upright.accel),
        side,
        CALIBRATED_TOLERANCE_G if calibration.six_done else UNCALIBRATED_TOLERANCE_G,
    )
    return calibration.with_alignment(vehicle_from_sensor, kickstand.gyro), tilt
