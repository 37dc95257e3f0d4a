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
    matrix = calibration.vehicle_from_sensor
    force = log.accel_g * calibration.accel_slope + calibration.accel_offset_g
    rate = log.gyro_dps - calibration.gyro_bias_dps
    return Samples(log.t_s, force @ matrix.T, rate @ matrix.T)
