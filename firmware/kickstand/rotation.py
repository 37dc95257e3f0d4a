"""3-vectors and 3x3 rotation matrices in preallocated float32 arrays.

A vector is an array('f', 3). A matrix is an array('f', 9), row by row. Results are written into the array `out`, which
must not be one of the inputs. A vector in the vehicle's axes (A. Nicolae) has the entries 0 left, 1 up, 2 forward.
"""

from array import array
from math import atan2, degrees, sqrt


def vector(x=0.0, y=0.0, z=0.0):
    """Return a new vector."""
    return array("f", (x, y, z))


def matrix(values=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)):
    """Return a new matrix of 9 values, by default the identity."""
    return array("f", values)


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


def rotate(out, m, a):
    """Write the product M a into out (Nicolae's equation 15, from the sensor's axes to the vehicle's). Here `out` may
    be the same array as `a`."""
    x, y, z = a[0], a[1], a[2]
    out[0] = m[0] * x + m[1] * y + m[2] * z
    out[1] = m[3] * x + m[4] * y + m[5] * z
    out[2] = m[6] * x + m[7] * y + m[8] * z


def product(out, a, b):
    """Write the product of two matrices A B into out."""
    for i in (0, 3, 6):
        for k in range(3):
            out[i + k] = a[i] * b[k] + a[i + 1] * b[3 + k] + a[i + 2] * b[6 + k]


def is_identity(m):
    """Return True if a matrix is exactly the identity."""
    for i in range(9):
        if m[i] != (1.0 if i % 4 == 0 else 0.0):
            return False
    return True


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


def is_rotation(m, tolerance=1e-4):
    """Return True if a matrix M is a rotation. Every entry of M M^T - I must be within the tolerance, and the
    determinant must be positive."""
    for i in (0, 3, 6):
        for j in (0, 3, 6):
            product = m[i] * m[j] + m[i + 1] * m[j + 1] + m[i + 2] * m[j + 2]
            if not abs(product - (1.0 if i == j else 0.0)) <= tolerance:  # "not <=" also rejects NaN
                return False
    determinant = (
        m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6])
    )
    return determinant > 0
