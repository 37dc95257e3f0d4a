"""What is remarkable in a calibration, without a ride."""

import numpy as np
from kickstand.errors import Notice
from kickstand.units import AXES

from ..signals.rotations import rotation_vector
from .file import CalibrationFile

UPSIDE_DOWN = 0.87  # cosine: within 30 degrees
ANOTHER_MOUNT_DEG = 10.0


def remarks(found: CalibrationFile, before: CalibrationFile | None = None) -> list[Notice]:
    """Of an alignment that has been found, and of the one that was given to build on.

    upside-down: accelerations of the opposite sign look like a sensor upside down, and no log tells one from the other.
    A phone's x may point down: it lies on its side. another-mount: only offset and slope are taken from the one given.
    """
    notices = []
    up = found.vehicle_from_sensor[1]
    axis = int(np.argmax(np.abs(up)))
    if up[axis] < -UPSIDE_DOWN and AXES[axis] != "x":
        notices.append(Notice("upside-down", AXES[axis]))
    if before is not None and before.aligned:
        turn = rotation_vector(found.vehicle_from_sensor @ before.vehicle_from_sensor.T)
        turned_deg = float(np.degrees(np.linalg.norm(turn)))
        if turned_deg > ANOTHER_MOUNT_DEG:
            notices.append(Notice("another-mount", turned_deg))
    return notices
