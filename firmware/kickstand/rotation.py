"""3-vectors and 3x3 rotation matrices in preallocated float32 arrays.

A vector is array('f', 3); a matrix is array('f', 9), row-major. Results are written into the array given
first, which must not be one of the inputs. Vehicle frame (A. Nicolae): index 0 = left, 1 = up, 2 = forward.
"""

from array import array
from math import atan2, degrees, sqrt


def vector(x=0.0, y=0.0, z=0.0):
    """A new 3-vector."""
    return array("f", (x, y, z))


def matrix():
    """A new 3x3 matrix: the identity."""
    return array("f", (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))


def dot(a, b):
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(out, a, b):
    """out = a x b (Nicolae's equation 4, which as printed is zero)."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


def norm(a):
    """|a|"""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def normalize(a):
    """Scale a to length 1 in place; return its former length. ValueError for a null vector."""
    length = norm(a)
    if not length > 1e-9:  # also catches not-a-number
        raise ValueError("null vector has no direction")
    a[0] /= length
    a[1] /= length
    a[2] /= length
    return length


def rotate(out, m, a):
    """out = M a: sensor to vehicle (Nicolae's equation 15)."""
    x, y, z = a[0], a[1], a[2]
    out[0] = m[0] * x + m[1] * y + m[2] * z
    out[1] = m[3] * x + m[4] * y + m[5] * z
    out[2] = m[6] * x + m[7] * y + m[8] * z


def rotate_back(out, m, a):
    """out = M^T a: vehicle to sensor (equation 12; M is orthogonal, so its inverse is its transpose)."""
    x, y, z = a[0], a[1], a[2]
    out[0] = m[0] * x + m[3] * y + m[6] * z
    out[1] = m[1] * x + m[4] * y + m[7] * z
    out[2] = m[2] * x + m[5] * y + m[8] * z


def multiply(out, a, b):
    """out = A B: first b, then a."""
    for row in (0, 3, 6):
        for column in range(3):
            out[row + column] = a[row] * b[column] + a[row + 1] * b[3 + column] + a[row + 2] * b[6 + column]


def angle_deg(a, b):
    """Angle between two vectors, 0..180 degrees. By atan2: acos loses everything near 0 and 180 in
    float32."""
    c = vector()
    cross(c, a, b)
    return degrees(atan2(norm(c), dot(a, b)))


def is_rotation(m, tolerance=1e-4):
    """True if M is orthonormal and right-handed, every entry of M M^T - I within tolerance."""
    for i in (0, 3, 6):
        for j in (0, 3, 6):
            product = m[i] * m[j] + m[i + 1] * m[j + 1] + m[i + 2] * m[j + 2]
            if not abs(product - (1.0 if i == j else 0.0)) <= tolerance:  # "not <=" also refuses not-a-number
                return False
    determinant = (
        m[0] * (m[4] * m[8] - m[5] * m[7])
        - m[1] * (m[3] * m[8] - m[5] * m[6])
        + m[2] * (m[3] * m[7] - m[4] * m[6])
    )
    return determinant > 0
