"""Rotation vectors (the axis times the angle in rad) and rotation matrices, any number of them at once.

The exponential map and its inverse, e.g. Sola, "Quaternion kinematics for the error-state Kalman filter" (2017),
section 2.3.
"""

import numpy as np

from . import Array


def rotated(matrix: Array, *vectors: Array) -> tuple[Array, ...]:
    """Each of vectors (n, 3) along the axes that are the rows of matrix (3, 3), such as vehicle_from_sensor."""
    return tuple(vector @ matrix.T for vector in vectors)


def cross_matrix(vector: Array) -> Array:
    """(..., 3, 3) the skew-symmetric matrix K of vectors (..., 3): K @ other = vector x other."""
    matrix = np.zeros((*vector.shape, 3))
    x, y, z = np.moveaxis(vector, -1, 0)
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def rotation_matrix(vector: Array) -> Array:
    """(..., 3, 3) exp: the matrix of rotation vectors (..., 3, rad), by Rodrigues' formula."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None] / np.pi
    cross = cross_matrix(vector)
    # numpy's sinc(x) is sin(pi x) / (pi x), which is exact near 0
    return np.eye(3) + np.sinc(angle) * cross + 0.5 * np.sinc(angle / 2.0) ** 2 * (cross @ cross)


def rotation_vector(matrix: Array) -> Array:
    """(..., 3, rad) log: the rotation vector of matrices (..., 3, 3), each of under 180 degrees."""
    axis = np.stack([matrix[..., i, j] - matrix[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=-1)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)  # twice the sine of the angle
    angle = np.arctan2(sine, np.trace(matrix, axis1=-2, axis2=-1)[..., None] - 1.0)
    return axis / np.maximum(sine, 1e-12) * angle
