"""Checks whether an earlier alignment, from two poses or another drive, fits this drive.

If SIDE in the settings is not the side of the kickstand, forward and backward are exchanged. The poses cannot show this
exchange, but the first braking events do. A change of pitch between the poses causes a yaw error of a few degrees. This
yaw error is corrected after enough braking events. Any other difference means that the mount has moved.
"""

from math import atan2, degrees

from ..rotation import angle_deg, dot
from ..units import const
from .regression import Fit

UNKNOWN = 0  # too few events for a verdict
SAME = 1
REFINED = 2  # the earlier alignment has a yaw error of a few degrees, and the DriveAlignment's matrix() is better
REVERSED = 3  # forward points backward, and turn_round() corrects the matrix
MOVED = 4  # the mount has moved, and the sensor must be aligned again

# Smallest number of straight events that can show REVERSED; each of them must show it
_MIN_EVENTS_TO_REVERSE = const(2)
_SAME_DEG = const(1.0)  # smallest yaw error that is corrected
# Largest yaw error of two poses. At the smallest allowed tilt, 2 degrees of pitch between the poses cause a yaw error
# of 22 degrees.
_REFINED_DEG = const(30.0)
_REVERSED_DEG = const(135.0)  # smallest yaw error that means REVERSED
# Largest difference between the two verticals. An inexact upright pose and the road's camber cause a smaller
# difference.
_UPRIGHT_DEG = const(8.0)


def compare(drive, matrix):
    """Compare an earlier alignment with a drive. Return UNKNOWN, SAME, REFINED, REVERSED or MOVED.

    Args:
        drive: a DriveAlignment.
        matrix: the earlier alignment, 9 values with the rows left, up, forward.
    """
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
    """Return the yaw error of a matrix in degrees.

    The yaw error is the angle from the matrix's forward to the Fit's forward, about the matrix's up. The yaw error is
    positive if the Fit's forward is farther to the left."""
    return degrees(atan2(dot(matrix[0:3], fit.forward), dot(matrix[6:9], fit.forward)))


def _all_backward(events, matrix):
    """Return True if in each block of a drive the matrix's forward points backward.

    Args:
        events: the DrivingEvents of the drive.
        matrix: the alignment.
    """
    regression, part = events.regression, Fit()
    for block in range(regression.filled):
        if regression.fit(part, events.lag, block, block + 1) and abs(yaw_deg(part, matrix)) < 90.0:
            return False
    return True


def turn_round(matrix):
    """Reverse forward and left in place. The same poses give this alignment if SIDE is the other side."""
    for i in (0, 1, 2, 6, 7, 8):
        matrix[i] = -matrix[i]
