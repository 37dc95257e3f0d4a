"""A recording as the estimators get it: calibrated and in the vehicle's axes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..calibration.file import CalibrationFile
from ..logs.reader import Log


@dataclass
class Samples:
    """time (N, s), force (N, 3, g), rate (N, 3, deg/s); along and about left, up, forward; evenly spaced."""

    time: NDArray[np.float64]
    force: NDArray[np.float64]
    rate: NDArray[np.float64]

    @property
    def rate_hz(self) -> float:
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def calibrated(log: Log, calibration: CalibrationFile) -> Samples:
    """Nicolae's (18)-(20) and the matrix, in numpy: all estimators share the firmware's calibration."""
    readings = np.array(log.readings)
    matrix = np.reshape(calibration.matrix, (3, 3))
    force = readings[:, :3] * calibration.slope + calibration.offset
    rate = readings[:, 4:] - calibration.bias
    return Samples(np.array(log.time_us) * 1e-6, force @ matrix.T, rate @ matrix.T)
