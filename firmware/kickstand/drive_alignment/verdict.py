"""Does the alignment of the two presses fit what driving shows?

A kickstand on the other side than the setting says turns forward into backward, which the poses cannot show and the
first brakings do. A pitch change between the poses turns it by some degrees, which enough brakings put right. Anything
else is a mount that has moved.
"""

from math import atan2, degrees

from ..rotation import angle_deg, dot
from .regression import Fit

UNKNOWN = 0  # not enough brakings yet
SAME = 1
REFINED = 2  # a little off: take the DriveAlignment's matrix()
REVERSED = 3  # forward is backward: turn_round()
MOVED = 4  # align again

MIN_BRAKINGS = 2  # that have to agree before REVERSED is said
SAME_DEG = 1.0
REFINED_DEG = 30.0  # 2 degrees of pitch at the smallest tilt of two poses make 22
REVERSED_DEG = 135.0
UPRIGHT_DEG = 8.0  # an upright pose that was not quite upright, and the road's camber


def compare(drive, matrix):
    """UNKNOWN, SAME, REFINED, REVERSED or MOVED. drive: a DriveAlignment; matrix: 9, rows left, up, forward."""
    if drive.quality.speed_problem is not None or drive.events.count < MIN_BRAKINGS:
        return UNKNOWN
    yaw = abs(yaw_deg(drive.quality.fit, matrix))
    if yaw > REVERSED_DEG and _all_backward(drive, matrix):
        return REVERSED
    if drive.counted < drive.needed:
        return UNKNOWN
    if angle_deg(drive.quality.fit.level, matrix[3:6]) > UPRIGHT_DEG:
        return MOVED
    if not drive.ready:
        return UNKNOWN
    if yaw > REFINED_DEG:
        return MOVED
    return REFINED if yaw > max(SAME_DEG, drive.quality_deg) else SAME


def yaw_deg(fit, matrix):
    """From the matrix's forward to that of a Fit, about the matrix's up; > 0 to the left."""
    return degrees(atan2(dot(matrix[0:3], fit.forward), dot(matrix[6:9], fit.forward)))


def _all_backward(drive, matrix):
    """True if each part of the drive says so."""
    part = Fit()
    for block in range(drive.events.regression.filled):
        if drive.events.regression.fit(part, drive.events.lag, block, block + 1) and abs(yaw_deg(part, matrix)) < 90.0:
            return False
    return True


def turn_round(matrix):
    """Left and forward the other way round, in place: what the poses would have given with the other side set."""
    for i in (0, 1, 2, 6, 7, 8):
        matrix[i] = -matrix[i]
