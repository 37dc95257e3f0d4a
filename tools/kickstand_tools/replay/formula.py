"""Nicolae's lean of each reading alone, kickstand.lean.formula, on arrays; a test holds both equal."""

import numpy as np

from ..logs.table import Array

TOO_SMALL = 0.01  # g2, as in kickstand.lean: in free fall no force tells a direction


def static_lean_deg(left: Array, up: Array) -> Array:
    """(21) with a sign: of a standing bike, degrees, > 0 to the right."""
    return np.degrees(np.arctan2(left, up))


def formula_lean_deg(left: Array, up: Array, yaw_rate: Array) -> Array:
    """(25)-(26), degrees, > 0 to the right."""
    square = left * left + up * up
    size = np.sqrt(np.maximum(0.0, square - 1.0))
    sine = (left - np.sign(yaw_rate) * size * up) / np.maximum(square, TOO_SMALL)
    return np.where(square < TOO_SMALL, 0.0, np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))
