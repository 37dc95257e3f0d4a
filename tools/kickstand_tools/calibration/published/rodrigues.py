"""The rotation that takes one direction to another (O. Rodrigues), from cross and dot products.

    R = I + K + K^2 / (1 + c),  K the cross product matrix of a x b, c = a . b

In float32 this is 2 degrees off where a and b are 179.9 degrees apart, and fails nearer to 180. So where c < 0, a half
turn D about a coordinate axis comes first, after which c > 0: R = Rodrigues(D a, b) D. Its error is under 2e-7
everywhere.
"""

from kickstand.rotation import dot


def rotation_between(out, a, b, axis):
    """Fill out (9, row-major) with the rotation that takes unit vector a to unit vector b.

    axis: 0, 1 or 2, the coordinate axis of the half turn; it has to be perpendicular to b.
    """
    signs = [1.0, 1.0, 1.0]
    if dot(a, b) < 0.0:
        signs = [-1.0, -1.0, -1.0]
        signs[axis] = 1.0
    x, y, z = signs[0] * a[0], signs[1] * a[1], signs[2] * a[2]
    p = y * b[2] - z * b[1]
    q = z * b[0] - x * b[2]
    r = x * b[1] - y * b[0]
    k = 1.0 / (1.0 + x * b[0] + y * b[1] + z * b[2])
    out[0] = (1.0 - k * (q * q + r * r)) * signs[0]
    out[1] = (k * p * q - r) * signs[1]
    out[2] = (k * p * r + q) * signs[2]
    out[3] = (k * p * q + r) * signs[0]
    out[4] = (1.0 - k * (p * p + r * r)) * signs[1]
    out[5] = (k * q * r - p) * signs[2]
    out[6] = (k * p * r - q) * signs[0]
    out[7] = (k * q * r + p) * signs[1]
    out[8] = (1.0 - k * (p * p + q * q)) * signs[2]


def multiply(out, a, b):
    """out (9) = A B, 3x3 matrices by rows: first the rotation B, then A. out must be neither of them."""
    for row in (0, 3, 6):
        for column in range(3):
            out[row + column] = a[row] * b[column] + a[row + 1] * b[3 + column] + a[row + 2] * b[6 + column]
