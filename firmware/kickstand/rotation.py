"""3-vectors and 3x3 rotation matrices in preallocated float32 arrays, and their products. calibration/vectors.py
has the functions that only a calibration needs, so that they take no heap while riding.

A vector is an array('f', 3). A matrix is an array('f', 9), row by row. Results are written into the array `out`, which
must not be one of the inputs. A vector in the vehicle's axes (A. Nicolae) has the entries 0 left, 1 up, 2 forward.
"""

from array import array


def vector(x=0.0, y=0.0, z=0.0):
    """Return a new vector."""
    return array("f", (x, y, z))


def matrix(values=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)):
    """Return a new matrix of 9 values, by default the identity."""
    return array("f", values)


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
