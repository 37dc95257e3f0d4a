"""How a phone is mounted, as its user says it: a check of what the ride says, and a hint where that says little.

A phone's axes, seen by who looks at its screen: x to the right, y to the top, z out of the screen (W3C Device
Orientation; Android and iOS have the same).
"""

import numpy as np
from kickstand.errors import Refusal

from ..logs.table import Array
from .rotations import rotation_between

_X, _Y, _Z = np.eye(3)

# Rows left, up, forward. A screen that faces the rider looks backward; landscape: turned to either side.
PHONES = {
    "portrait": [np.array([-_X, _Y, -_Z])],
    "landscape": [np.array([_Y, _X, -_Z]), np.array([-_Y, -_X, -_Z])],
    "flat": [np.array([-_X, _Z, _Y])],
}
SIGMA_DEG = 20.0  # of a holder that is tilted towards the rider's eyes
_MAX_DEG = 45.0  # the ways are at least 90 degrees apart


def mounting(phone: str, found: Array) -> Array:
    """The matrix (3, 3) that the user means, of those that phone allows the one next to found. Raises Refusal where
    found is another one."""
    off, nearest = min(((_off_deg(found, matrix), i) for i, matrix in enumerate(PHONES[phone])))
    if off > _MAX_DEG:
        mirrored = found * [[1.0], [-1.0], [-1.0]]  # what accelerations of the opposite sign make of it
        if min(_off_deg(mirrored, matrix) for matrix in PHONES[phone]) < _MAX_DEG:
            raise Refusal("phone-upside-down", phone)
        raise Refusal("phone-otherwise", phone, off)
    return PHONES[phone][nearest]


def _off_deg(found: Array, matrix: Array) -> float:
    return float(np.degrees(np.linalg.norm(rotation_between(found, matrix))))
