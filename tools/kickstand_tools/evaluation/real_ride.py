"""The recorded motorcycle ride has neither a calibration nor a reference: both are made from the ride itself.

Vertical and gyro bias: the means of the first second, at rest. Forward: the horizontal force regressed on
dv/dt of the 1 Hz speed, with an intercept, where the bike turns slowly; the speed's lateness is the one that
fits best. Reference: atan(v * yaw rate / g), the yaw rate about the bike's own up axis, averaged over 1 s. It
reads low (1 Hz speed, wide tyres, an axis that leans with the bike) and knows no slope or bank: it compares
methods and shows decay, it claims no degrees.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..calibration.file import CalibrationFile
from ..errors import InputError
from ..logs.reader import Log, read_log
from .estimators import GRAVITY_MPS2, estimate
from .metrics import rms, slope
from .samples import calibrated

REST_S = 1.0
AVERAGE_S = 1.0
_SLOW_DPS = 5.0
_LATE_S = np.arange(0.0, 2.01, 0.1)
_RIDING_MPS = 2.0
_LEANED_DEG = 5.0  # the reference is beyond 10 degrees too seldom


@dataclass
class RealScore:
    """Against the rough reference: rms in degrees; slope: shown over it where it is beyond 5 degrees."""

    rms: float
    slope: float


def compare(path: Path) -> tuple[dict[str, RealScore], dict[str, NDArray[np.float64]]]:
    """Scores by estimator, and leans by name with "time" and "reference". Raises InputError."""
    log = read_log(path)
    speed, calibration = _speed(log), calibration_of(log)
    reference = reference_lean(log, calibration)
    time = log.t_s
    riding = speed > _RIDING_MPS
    shown = estimate(log, calibration)
    scores = {
        name: RealScore(rms((lean - reference)[riding]), slope(lean[riding], reference[riding], _LEANED_DEG))
        for name, lean in shown.items()
    }
    return scores, {"time": time, "reference": reference, **shown}


def reference_lean(log: Log, calibration: CalibrationFile) -> NDArray[np.float64]:
    """atan(v * yaw rate / g) in degrees, > 0 to the right, averaged over 1 s."""
    samples = calibrated(log, calibration)
    centripetal = _speed(log) * np.radians(samples.rate[:, 1])
    return _averaged(-np.degrees(np.arctan(centripetal / GRAVITY_MPS2)), samples.rate_hz)


def calibration_of(log: Log) -> CalibrationFile:
    """Matrix and gyro bias from the ride itself. Raises InputError if it has no straight acceleration."""
    time = log.t_s
    rest = time < REST_S
    up = log.accel_g[rest].mean(axis=0)
    up /= np.linalg.norm(up)
    bias = log.gyro_dps[rest].mean(axis=0)
    rate_hz = (len(time) - 1) / (time[-1] - time[0])
    force = np.column_stack([_averaged(column, rate_hz) for column in log.accel_g.T])
    level = force - np.outer(force @ up, up)
    yaw = _averaged((log.gyro_dps - bias) @ up, rate_hz)
    straight = np.abs(yaw) < _SLOW_DPS
    found, most = np.zeros(3), 0.0
    for late in _LATE_S:
        change = np.gradient(_averaged(np.interp(time + late, time, _speed(log)), rate_hz), time)
        a, b = change[straight] - change[straight].mean(), level[straight] - level[straight].mean(axis=0)
        along = a @ b / np.sqrt(max(float(a @ a), 1e-9))
        if np.linalg.norm(along) > most:
            found, most = along, float(np.linalg.norm(along))
    if most == 0.0:
        raise InputError(f"{log.name}: no straight acceleration in it: forward cannot be told")
    forward = found - up * (found @ up)
    forward /= np.linalg.norm(forward)
    matrix = np.concatenate((np.cross(up, forward), up, forward))
    return CalibrationFile(gyro_bias_dps=bias, vehicle_from_sensor=matrix, aligned=True)


def _speed(log: Log) -> NDArray[np.float64]:
    """m/s at each sample, straight lines between the values there are."""
    there = ~np.isnan(log.speed_mps)
    if np.count_nonzero(there) < 2:
        raise InputError(f"{log.name} has no speed: without it there is no reference")
    return np.interp(log.t_s, log.t_s[there], log.speed_mps[there])


def _averaged(x: NDArray, rate_hz: float) -> NDArray[np.float64]:
    """Mean over 1 s about each sample."""
    n = max(round(AVERAGE_S * rate_hz), 1)
    padded = np.pad(x, (n // 2, n - 1 - n // 2), mode="edge")
    return np.convolve(padded, np.full(n, 1.0 / n), mode="valid")
