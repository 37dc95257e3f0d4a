"""Aligns the sensor by two still poses, on the kickstand and upright (A. Nicolae, section 2).

This module differs from the paper in three points:
* Equation (4) is the cross product of the upright and the tilted reading. As printed, the product is zero.
* Equation (5) takes y from the upright reading and divides y by its own length.
* If the kickstand is on the right, the paper's x and z point right and backward. So the signs of x and z are changed.
"""

from math import atan2, degrees

from ..errors import Refusal, SickSensor
from ..rotation import cross, dot, frame, matrix, norm, normalize, rotate, vector
from ..units import const

# Smallest tilt between the poses. If the pitch changes by one degree between the poses, the yaw error is 11 degrees at
# a tilt of 5 degrees, and 7 degrees at a tilt of 8 degrees.
_MIN_TILT_DEG = const(5.0)
WARN_TILT_DEG = 8.0
_MAX_TILT_DEG = const(60.0)
_SAME_POSE_DEG = const(1.0)
# Largest difference between a reading at rest and 1 g. The data sheet allows 80 mg of offset and 3 % of scale error,
# plus drift. After the six positions only 35 mg of drift over temperature remain.
_UNCALIBRATED_TOLERANCE_G = const(0.15)
_CALIBRATED_TOLERANCE_G = const(0.05)
# Largest difference between the turn by the gyro and the tilt between the poses. The limit is the sum of these terms:
# * GYRO_RAD, a constant in rad
# * GYRO_TILT_SHARE times the tilt, for uncalibrated sensors and the gyro's scale error
# * GYRO_TURN_SHARE times the whole turn, for cross-axis errors, for example while the bike is pushed about
# * GYRO_DRIFT, the drift of the gyro's bias in rad/s, times the duration
# * three standard deviations of the angle that the random walk of the gyro's bias causes; GYRO_WALK is in rad/s per
#   sqrt(s)
GYRO_RAD, GYRO_TILT_SHARE, GYRO_TURN_SHARE = 0.02, 0.15, 0.04
GYRO_DRIFT, GYRO_WALK = 0.0005, 0.0002


def check_one_g(force, tolerance_g, pose):
    """Raise Refusal unless the length of the force is within tolerance_g of 1 g.

    Args:
        force: 3 values in g.
        tolerance_g: the largest difference from 1 g.
        pose: "kickstand" or "upright", for the message.
    """
    size = norm(force)
    if not abs(size - 1.0) <= tolerance_g:
        raise Refusal("not-one-g", pose, size)


def two_position(out, kickstand, upright, side="left", tolerance_g=_UNCALIBRATED_TOLERANCE_G):
    """Compute the rotation from sensor axes to vehicle axes by equations 3-8. Raises Refusal.

    Args:
        out: array of 9 for the rotation matrix, with the rows left, up, forward.
        kickstand: mean specific force on the kickstand, 3 values in g, in the sensor's axes.
        upright: mean specific force in the upright pose, 3 values in g, in the sensor's axes.
        side: "left" or "right", the side to which the kickstand leans the bike.
        tolerance_g: largest difference between each force and 1 g.

    Returns:
        The tilt between the poses in degrees.
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
        raise Refusal("same-pose", tilt)
    if tilt < _MIN_TILT_DEG:
        raise Refusal("tilt-small", tilt, _MIN_TILT_DEG)
    if tilt > _MAX_TILT_DEG:
        raise Refusal("tilt-large", tilt, _MAX_TILT_DEG)
    if side == "right":
        z[0], z[1], z[2] = -z[0], -z[1], -z[2]
    frame(out, y, z)
    return tilt


def align(calibration, kickstand, upright, side):
    """Align a Calibration by two poses. Raises Refusal.

    The gyro's bias is taken from the kickstand pose, because a stand holds the bike stiller than a rider does.

    Args:
        calibration: a Calibration with offset and slope.
        kickstand, upright: the two finished poses, each a StillPose.
        side: "left" or "right", the side to which the kickstand leans the bike.

    Returns:
        calibration: a new, aligned Calibration.
        tilt: the tilt between the poses in degrees.
    """
    vehicle_from_sensor = matrix()
    poses = calibration.correct(kickstand.accel), calibration.correct(upright.accel)
    tolerance_g = _CALIBRATED_TOLERANCE_G if calibration.six_done else _UNCALIBRATED_TOLERANCE_G
    tilt = two_position(vehicle_from_sensor, *poses, side, tolerance_g)
    return calibration.with_alignment(vehicle_from_sensor, kickstand.gyro), tilt


def check_turn(calibration, kickstand, upright, turn):
    """Raise SickSensor unless the gyro's turn between the two poses agrees with the tilt between them.

    The longer the turn took, the more difference is allowed. After a minute the check hardly limits a tilt of 12
    degrees. If readings were lost, nothing is checked.

    Args:
        calibration: a Calibration with offset and slope.
        kickstand, upright: the two finished poses, each a StillPose.
        turn: the ended Turn between them.
    """
    if turn.lost:
        return
    u, v = calibration.correct(kickstand.accel), calibration.correct(upright.accel)
    normalize(u)
    normalize(v)
    axis, inverse, claimed = vector(), vector(), vector()
    cross(axis, u, v)
    tilt = atan2(norm(axis), dot(u, v))
    misfit = 9.9
    # Try two biases. The bias of the kickstand pose is better without drift, because a stand holds the bike stiller.
    # The mean bias of both poses is better if the bias has drifted.
    for share in (0.0, 0.5):
        r = turn.attitude(upright.gyro, share)
        rotate(inverse, r, v)
        misfit = min(misfit, norm([u[i] - inverse[i] for i in range(3)]))
    seconds = turn.seconds
    tolerance = GYRO_RAD + GYRO_TILT_SHARE * tilt + GYRO_TURN_SHARE * turn.angle()
    tolerance += GYRO_DRIFT * seconds + GYRO_WALK * (seconds**3 / 3) ** 0.5
    if misfit > tolerance:
        rotate(claimed, (r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]), u)
        normalize(axis)
        cross(inverse, u, claimed)
        raise SickSensor("gyro-tilt", degrees(tilt), degrees(atan2(dot(inverse, axis), dot(u, claimed))))
