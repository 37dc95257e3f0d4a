"""Rotations as vectors: the axis times the angle in rad."""

import numpy as np

from ..logs.table import Array


def turned(matrix: Array, rotation: Array) -> Array:
    """matrix (3, 3) after a rotation (3, rad) about the axes of its rows (O. Rodrigues' formula)."""
    angle = float(np.linalg.norm(rotation))
    if angle < 1e-12:
        return matrix
    x, y, z = rotation / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return (np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k) @ matrix


def rotation_between(found: Array, other: Array) -> Array:
    """(3, rad) the rotation about the axes of its rows that makes found of other; both (3, 3). Under 180 degrees."""
    r = found @ other.T
    axis = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = float(np.linalg.norm(axis))
    return axis * (np.arctan2(sine, 0.5 * (np.trace(r) - 1.0)) / max(sine, 1e-12))
