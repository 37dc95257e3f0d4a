"""Checks whether an earlier alignment, from two poses or another drive, fits this drive.

If the kickstand is not on the side in the settings, forward and backward are exchanged. The poses cannot show this
error, but the first braking events do. A change of pitch between the poses causes a yaw error of a few degrees. Enough
braking events correct it. Any other difference means that the mount has moved.
"""

from math import atan2, degrees

from ..rotation import angle_deg, dot
from ..units import const
from .regression import Fit

UNKNOWN = 0  # not enough events yet
SAME = 1
REFINED = 2  # a yaw error of a few degrees: use the DriveAlignment's matrix()
REVERSED = 3  # forward points backward: use turn_round()
MOVED = 4  # the mount has moved: align again

_MIN_EVENTS_TO_REVERSE = const(2)  # least number of straight events, all of which must agree
_SAME_DEG = const(1.0)
# Largest yaw error: 2 degrees of pitch cause 22 at the smallest allowed tilt between two poses
_REFINED_DEG = const(30.0)
_REVERSED_DEG = const(135.0)
_UPRIGHT_DEG = const(8.0)  # largest difference of up: an inexact upright pose and the road's camber cause less


def compare(drive, matrix):
    """Return UNKNOWN, SAME, REFINED, REVERSED or MOVED. drive: a DriveAlignment; matrix: 9, rows left, up, forward."""
    events, quality = drive.events, drive.quality
    if quality.speed_problem is not None or events.straight_count < _MIN_EVENTS_TO_REVERSE:
        return UNKNOWN
    yaw = abs(yaw_deg(quality.fit, matrix))
    if yaw > _REVERSED_DEG and _all_backward(events, matrix):
        return REVERSED
    if drive.counted < drive.needed:
        return UNKNOWN
    if angle_deg(quality.fit.level, matrix[3:6]) > _UPRIGHT_DEG:
        return MOVED
    if not drive.ready:
        return UNKNOWN
    if yaw > _REFINED_DEG:
        return MOVED
    return REFINED if yaw > max(_SAME_DEG, quality.quality_deg) else SAME


def yaw_deg(fit, matrix):
    """The yaw error of the matrix: the angle from its forward to a Fit's forward about the matrix's up; > 0 to the
    left."""
    return degrees(atan2(dot(matrix[0:3], fit.forward), dot(matrix[6:9], fit.forward)))


def _all_backward(events, matrix):
    """True if each block of the drive shows forward as backward. events: its DrivingEvents."""
    regression, part = events.regression, Fit()
    for block in range(regression.filled):
        if regression.fit(part, events.lag, block, block + 1) and abs(yaw_deg(part, matrix)) < 90.0:
            return False
    return True


def turn_round(matrix):
    """Reverse forward and left in place: the result of the same poses with the other side set."""
    for i in (0, 1, 2, 6, 7, 8):
        matrix[i] = -matrix[i]
