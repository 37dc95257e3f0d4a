"""Estimators compared on a recorded ride, which has neither a calibration nor a true lean: both come from the ride.

Vertical and gyro bias are the means of the first second, at rest. Forward is found by regressing the horizontal force
on dv/dt of the 1 Hz speed, with an intercept, where the bike turns slowly; the delay of the speed is the one that
fits best. The reference lean is atan(v * yaw rate / g), averaged over 1 s, with the yaw rate about the bike's own up
axis. It reads low (1 Hz speed, wide tyres, an axis that leans with the bike) and ignores slope and bank of the road:
it can compare methods and show a lean that decays in a turn, but its degrees are not to be trusted.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from kickstand.errors import Notice
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..calibration.file import CalibrationFile
from ..errors import InputError
from ..logs.reader import Log, read_log
from ..replay.mount_check import contradiction
from .estimators import estimate
from .metrics import rms, slope
from .samples import calibrated

REST_S = 1.0
AVERAGE_S = 1.0
_SLOW_DPS = 5.0  # yaw rate below which the bike rides straight on
_DELAY_S = np.arange(0.0, 2.01, 0.1)  # of the speed, tried
_RIDING_MPS = 2.0  # scored where the speed is higher
_LEANED_DEG = 5.0  # the slope is fitted beyond: the reference is rarely over 10 degrees


@dataclass
class RealScore:
    """Against the rough reference. slope: shown over reference lean where that is over 5 degrees."""

    rms_deg: float
    slope: float


@dataclass
class Comparison:
    """name: of the recording's file. scores: by estimator.

    traces: (N,) each: "time" in s; "reference" and each estimator's lean in degrees, > 0 to the right. notices: what is
    remarkable in the recording, or contradicts the calibration that was found in it.
    """

    name: str
    scores: dict[str, RealScore]
    traces: dict[str, NDArray[np.float64]]
    notices: list[Notice] = field(default_factory=list)


def compare(path: Path) -> Comparison:
    """Run every estimator over a recorded ride with speed. Raises InputError if it cannot be used."""
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
    wrong = contradiction(log, calibration)
    notices = [*log.notices, *([wrong] if wrong else [])]
    return Comparison(path.name, scores, {"time": time, "reference": reference, **shown}, notices)


def reference_lean(log: Log, calibration: CalibrationFile) -> NDArray[np.float64]:
    """atan(v * yaw rate / g) in degrees, > 0 to the right, averaged over 1 s."""
    samples = calibrated(log, calibration)
    centripetal = _speed(log) * np.radians(samples.rate[:, 1])
    return _averaged(-np.degrees(np.arctan(centripetal / STANDARD_GRAVITY)), samples.rate_hz)


def calibration_of(log: Log) -> CalibrationFile:
    """Mounting matrix and gyro bias from the ride itself. Raises InputError if it never accelerates straight on."""
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
    for delay_s in _DELAY_S:
        change = np.gradient(_averaged(np.interp(time + delay_s, time, _speed(log)), rate_hz), time)
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
    """Speed in m/s at each sample, interpolated between the logged values."""
    there = ~np.isnan(log.speed_mps)
    if np.count_nonzero(there) < 2:
        raise InputError(f"{log.name} has no speed: without it there is no reference")
    return np.interp(log.t_s, log.t_s[there], log.speed_mps[there])


def _averaged(x: NDArray, rate_hz: float) -> NDArray[np.float64]:
    """The mean over 1 s around each sample."""
    n = max(round(AVERAGE_S * rate_hz), 1)
    padded = np.pad(x, (n // 2, n - 1 - n // 2), mode="edge")
    return np.convolve(padded, np.full(n, 1.0 / n), mode="valid")
