"""A recording as the estimators take it: calibrated, and along the vehicle's axes."""

from dataclasses import dataclass

import numpy as np
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.reader import Log
from numpy.typing import NDArray


@dataclass
class Samples:
    """time (N,) in s, evenly spaced; force (N, 3) in g and rate (N, 3) in deg/s along left, up, forward."""

    time: NDArray[np.float64]
    force: NDArray[np.float64]
    rate: NDArray[np.float64]

    @property
    def rate_hz(self) -> float:
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def calibrated(log: Log, calibration: CalibrationFile) -> Samples:
    """Apply a calibration with numpy: Nicolae's (18)-(20), then the mounting matrix. All estimators use the same."""
    return Samples(log.t_s, *calibration.in_vehicle(log.readings))
