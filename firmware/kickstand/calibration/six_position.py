"""Computes offset and slope of the accelerometer from six still poses, one on each side (A. Nicolae, section 4).

The closed form, equations 16-17, assumes that each axis points exactly up or down. A pose that is 10 degrees off causes
an error of 0.6 degrees of lean. fit() uses the same six mean readings, but only assumes that each calibrated reading
has a length of 1 g, as it has in any pose. The fit starts from the closed form and takes a few Gauss-Newton steps. The
error of the fit is about 0.1 degrees.

Six poses determine six numbers exactly, so their residual proves nothing. Only a seventh, free pose can verify the
result.
"""

from math import acos, degrees

from ..errors import Refusal
from ..units import AXES, const
from .parameters import MAX_OFFSET_G, MAX_SLOPE, MIN_SLOPE

SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")  # the axis that points up, in the order of the six poses
_MAX_TILT_DEG = const(20.0)  # largest angle between a side's axis and the vertical
FREE_TILT_DEG = 20.0  # the free pose must be tilted by more, because a pose near a side adds little information
# Largest error of the free pose. A good sensor can have this error, because six numbers cannot describe its cross-axis
# sensitivity of 2 %.
_FREE_MAX_G = const(0.028)


def side_of(accel):
    """Return the index in SIDES of the side that is up.

    Args:
        accel: mean reading of the accelerometer, 3 values in g.
    """
    axis = 0
    for i in (1, 2):
        if abs(accel[i]) > abs(accel[axis]):
            axis = i
    return 2 * axis + (1 if accel[axis] < 0 else 0)


def tilt_deg(force):
    """Return the angle in degrees between the vertical and the axis nearest to it.

    Args:
        force: 3 values in any unit. For a null vector the result is 90.
    """
    size = sum(f * f for f in force) ** 0.5
    if not size > 1e-6:
        return 90.0
    return degrees(acos(min(1.0, max(abs(f) for f in force) / size)))


def closed_form(poses):
    """Compute offset and slope by equations 16-17. Raises Refusal for an axis that does not change.

    Args:
        poses: six mean readings of the accelerometer, each of 3 values in g, in the order of SIDES.

    Returns:
        offset: 3 values in g.
        slope: 3 values.
    """
    offset, slope = [0.0] * 3, [0.0] * 3
    for i in range(3):
        high, low = poses[2 * i][i], poses[2 * i + 1][i]
        if not high - low > 0.5:
            raise Refusal("dead-axis", AXES[i], high - low)
        offset[i] = -(high + low) / (high - low)
        slope[i] = 2.0 / (high - low)
    return offset, slope


def fit(poses):
    """Compute the offset and slope for which all six calibrated readings have a length of 1 g.

    Arguments and results are those of closed_form(). Raises Refusal."""
    offset, slope = closed_form(poses)
    rows = [[0.0] * 7 for _ in range(6)]
    for _ in range(8):  # more than enough: 3 to 5 steps suffice
        for pose, row in zip(poses, rows):
            square = 0.0
            for i in range(3):
                value = slope[i] * pose[i] + offset[i]
                square += value * value
                row[i] = 2.0 * value
                row[3 + i] = 2.0 * value * pose[i]
            row[6] = 1.0 - square
        if not _solve(rows):
            raise Refusal("unclear")
        for i in range(3):
            offset[i] += rows[i][6]
            slope[i] += rows[3 + i][6]
        if max(abs(row[6]) for row in rows) < 1e-6:
            break
    check_plausible(offset, slope, poses)
    return offset, slope


def check_plausible(offset, slope, poses):
    """Raise Refusal unless offset and slope are plausible, and in each pose one axis was within _MAX_TILT_DEG
    of the vertical."""
    for i in range(3):
        if not (abs(offset[i]) < MAX_OFFSET_G and MIN_SLOPE < slope[i] < MAX_SLOPE):
            raise Refusal("odd-axis", AXES[i], offset[i], slope[i])
    for k in range(6):
        tilt = tilt_deg([slope[i] * poses[k][i] + offset[i] for i in range(3)])
        if tilt > _MAX_TILT_DEG:
            raise Refusal("side-tilted", SIDES[k], tilt, _MAX_TILT_DEG)


def check_free_pose(offset, slope, accel):
    """Verify offset and slope with a seventh, slanted pose. Return by how much the calibrated force of this pose
    exceeds 1 g.

    Args:
        offset, slope: as returned by fit().
        accel: mean reading of the accelerometer in the seventh pose, 3 values in g.

    Raises:
        Refusal: the force differs from 1 g by more than _FREE_MAX_G.
    """
    force = [slope[i] * accel[i] + offset[i] for i in range(3)]
    error = sum(f * f for f in force) ** 0.5 - 1.0
    if not abs(error) <= _FREE_MAX_G:
        raise Refusal("free-pose-off", 1.0 + error)
    return error


def _solve(rows):
    """Solve six linear equations in place, by Gauss-Jordan elimination with partial pivoting.

    Args:
        rows: six lists, one per equation. Each list has six coefficients and the right-hand side, which the solution
            replaces.

    Returns:
        False if the equations are singular.
    """
    for k in range(6):
        pivot = k
        for r in range(k + 1, 6):
            if abs(rows[r][k]) > abs(rows[pivot][k]):
                pivot = r
        if not abs(rows[pivot][k]) > 1e-4:
            return False
        rows[k], rows[pivot] = rows[pivot], rows[k]
        lead = rows[k][k]
        for c in range(k, 7):
            rows[k][c] /= lead
        for r in range(6):
            if r != k and rows[r][k] != 0.0:
                factor = rows[r][k]
                for c in range(k, 7):
                    rows[r][c] -= factor * rows[k][c]
    return True
