"""The geometry of a calibration: lengths, angles and frames of 3-vectors, which rotation.py describes."""

from math import atan2, degrees, sqrt

from ..rotation import vector


def dot(a, b):
    """Return the dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(out, a, b):
    """Write the cross product a x b into out (Nicolae's equation 4, which gives zero as printed)."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


def norm(a):
    """Return the length of a vector."""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def normalize(a):
    """Scale a vector to length 1 in place. Return its earlier length. Raises ValueError for a null vector."""
    length = norm(a)
    if not length > 1e-9:  # also catches NaN
        raise ValueError("null vector has no direction")
    a[0] /= length
    a[1] /= length
    a[2] /= length
    return length


def frame(out, up, forward):
    """Write the matrix with the rows left, up, forward into out.

    The third row is the part of `forward` that is perpendicular to up, scaled to length 1. Raises ValueError if that
    part is zero.

    Args:
        out: the matrix for the result.
        up: a vector of length 1.
        forward: a vector of any length.
    """
    left, ahead = vector(), vector()
    cross(left, up, forward)
    normalize(left)
    cross(ahead, left, up)
    for i in range(3):
        out[i], out[3 + i], out[6 + i] = left[i], up[i], ahead[i]


def angle_deg(a, b):
    """Return the angle between two vectors, from 0 to 180 degrees. The angle comes from atan2, because acos of a 32-bit
    float is useless near 0 and 180 degrees."""
    c = vector()
    cross(c, a, b)
    return degrees(atan2(norm(c), dot(a, b)))
