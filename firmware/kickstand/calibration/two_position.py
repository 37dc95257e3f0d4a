"""Aligns the sensor by two still poses, on the kickstand and upright (A. Nicolae, section 2).

Differences from the paper: Equation (4) is the cross product of the upright and the tilted reading; as printed it is
zero. Equation (5) takes y from the upright reading and divides y by its own length. If the kickstand is on the right, x
and z would point right and backward, so both signs are changed.
"""

from math import atan2, degrees

from ..errors import AlignmentError, GyroError
from ..rotation import cross, dot, frame, matrix, norm, normalize, rotate, vector
from ..units import const

# Least tilt between the poses. At a tilt of 5 degrees, one degree of pitch between the poses causes a yaw error of 11
# degrees; at 8 degrees, of 7.
_MIN_TILT_DEG = const(5.0)
WARN_TILT_DEG = 8.0
_MAX_TILT_DEG = const(60.0)
_SAME_POSE_DEG = const(1.0)
# Largest difference of a reading at rest from 1 g. The data sheet allows 80 mg of offset and 3 % of scale, plus drift.
# After the six positions only 35 mg of drift over temperature remain.
_UNCALIBRATED_TOLERANCE_G = const(0.15)
_CALIBRATED_TOLERANCE_G = const(0.05)
# Largest difference between the gyro's turn and the tilt between the poses. The limit is the sum of: a constant (rad);
# a share of the tilt, for uncalibrated sensors and the gyro's scale; a share of the whole turn, for cross-axis errors,
# for example while the bike is pushed about; drift (rad/s) and random walk (rad/s per sqrt(s), 3 sigma) of the gyro's
# bias
GYRO_RAD, GYRO_TILT_SHARE, GYRO_TURN_SHARE = 0.02, 0.15, 0.04
GYRO_DRIFT, GYRO_WALK = 0.0005, 0.0002


def check_one_g(force, tolerance_g, pose):
    """Raise AlignmentError unless the length of force (3, g) is within tolerance_g of 1. pose: "kickstand" or
    "upright"."""
    size = norm(force)
    if not abs(size - 1.0) <= tolerance_g:
        raise AlignmentError("not-one-g", pose, size)


def two_position(out, kickstand, upright, side="left", tolerance_g=_UNCALIBRATED_TOLERANCE_G):
    """Compute the rotation from sensor to vehicle axes into out (9, rows left, up, forward); return the tilt between
    the poses in degrees. Equations 3-8.

    kickstand, upright: mean specific force of each pose (3, g, sensor's axes). side: "left" or "right", the side to
    which the kickstand leans the bike. Raises AlignmentError.
    """
    check_one_g(kickstand, tolerance_g, "kickstand")
    check_one_g(upright, tolerance_g, "upright")
    y, tilted = vector(*upright), vector(*kickstand)
    normalize(y)
    normalize(tilted)
    z = vector()
    cross(z, y, tilted)
    tilt = degrees(atan2(norm(z), dot(y, tilted)))
    if tilt < _SAME_POSE_DEG:
        raise AlignmentError("same-pose", tilt)
    if tilt < _MIN_TILT_DEG:
        raise AlignmentError("tilt-small", tilt, _MIN_TILT_DEG)
    if tilt > _MAX_TILT_DEG:
        raise AlignmentError("tilt-large", tilt, _MAX_TILT_DEG)
    if side == "right":
        z[0], z[1], z[2] = -z[0], -z[1], -z[2]
    frame(out, y, z)
    return tilt


def align(calibration, kickstand, upright, side):
    """Return a new Calibration, aligned by two finished poses (StillPose each), and the tilt between them in degrees.

    calibration: a Calibration with offset and slope. side: "left" or "right", the side to which the kickstand leans the
    bike. The gyro's bias is taken from the kickstand pose: a stand holds the bike stiller than a rider does. Raises
    AlignmentError.
    """
    vehicle_from_sensor = matrix()
    poses = calibration.correct(kickstand.accel), calibration.correct(upright.accel)
    tolerance_g = _CALIBRATED_TOLERANCE_G if calibration.six_done else _UNCALIBRATED_TOLERANCE_G
    tilt = two_position(vehicle_from_sensor, *poses, side, tolerance_g)
    return calibration.with_alignment(vehicle_from_sensor, kickstand.gyro), tilt


def check_turn(calibration, kickstand, upright, turn):
    """Raise GyroError unless the gyro's turn between the two poses (StillPose each) agrees with the tilt between them.
    turn: the Turn, ended; calibration: as for align().

    The longer the turn took, the weaker is the check: after a minute it hardly checks a tilt of 12 degrees. If readings
    were lost, nothing is checked.
    """
    if turn.lost:
        return
    u, v = calibration.correct(kickstand.accel), calibration.correct(upright.accel)
    normalize(u)
    normalize(v)
    axis, back, claimed = vector(), vector(), vector()
    cross(axis, u, v)
    tilt = atan2(norm(axis), dot(u, v))
    misfit = 9.9
    # first with the bias of the stand, which is stiller than the upright pose; then with an even drift of the
    # bias
    for share in (0.0, 0.5):
        r = turn.attitude(upright.gyro, share)
        rotate(back, r, v)
        misfit = min(misfit, norm([u[i] - back[i] for i in range(3)]))
    seconds = turn.seconds
    tolerance = GYRO_RAD + GYRO_TILT_SHARE * tilt + GYRO_TURN_SHARE * turn.angle()
    tolerance += GYRO_DRIFT * seconds + GYRO_WALK * (seconds**3 / 3) ** 0.5
    if misfit > tolerance:
        rotate(claimed, (r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]), u)
        normalize(axis)
        cross(back, u, claimed)
        raise GyroError("gyro-tilt", degrees(tilt), degrees(atan2(dot(back, axis), dot(u, claimed))))
