"""The estimators that are compared: the firmware's lean filter, the smoother, and other lean filters.

The other filters come from hobby projects and from the literature. Each filter takes Samples, and returns the lean of
every sample in degrees, positive to the right.

The filters of the packages `ahrs`, `vqf` and `imufusion` run twice: with the default gains of their authors, and with
tuned gains under the name "... best". The tuned gains have the least error on one ride of each profile with the seed
20, which is not used in the comparison. The filters of the packages start from the first reading.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from math import radians
from unittest.mock import patch

import numpy as np
from kickstand.lean import kalman, measurements
from kickstand.lean.bike_model import BIAS_LEFT
from kickstand.units import STANDARD_GRAVITY
from kickstand_sim.simulation.physics.chip import CALIBRATED_C, GYRO_DPS_PER_G
from kickstand_sim.simulation.ride import SimulatedRide
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.estimation.smooth import smooth
from kickstand_tools.logs.log import Log
from kickstand_tools.replay import replay_engine
from kickstand_tools.replay.replay import replay
from numpy.typing import NDArray

AVERAGE_S = 0.3  # averaging time of the formula's lean
COMPLEMENTARY = 0.98  # weight of the integrated lean at each sample. The force's direction has the remaining weight

_SHOWN, _FORMULA = (replay_engine.COLUMNS.index(name) for name in ("lean_deg", "lean_formula_deg"))
_TO_XYZ = [2, 0, 1]  # reorders left, up, forward to forward, left, up, the order of ahrs and vqf
PACKAGES = {"mahony": "ahrs", "madgwick": "ahrs", "vqf": "vqf", "fusion": "imufusion"}
PACKAGES |= {f"{name} best": package for name, package in PACKAGES.items()}


@dataclass
class Samples:
    time: NDArray[np.float64]  # evenly spaced times, shape (N), in s
    force: NDArray[np.float64]  # force along left, up, forward, shape (N, 3), in g
    rate: NDArray[np.float64]  # rate about the same axes, shape (N, 3), in deg/s

    @property
    def rate_hz(self) -> float:
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def calibrated(log: Log, calibration: CalibrationFile) -> Samples:
    """Return the calibrated samples of a log. All estimators get the same samples."""
    return Samples(log.t_s, *calibration.in_vehicle(log.readings))


def trailing_mean(x: NDArray, seconds: float, rate_hz: float) -> NDArray[np.float64]:
    """Return the mean over the last `seconds` at each sample. The first samples have shorter windows."""
    n = max(round(seconds * rate_hz), 1)
    total = np.cumsum(np.concatenate((np.zeros((1, *x.shape[1:])), x)), axis=0)
    first = np.maximum(np.arange(1, len(x) + 1) - n, 0)
    count = np.arange(1, len(x) + 1) - first
    return (total[1:] - total[first]) / count.reshape(-1, *[1] * (x.ndim - 1))


def complementary(samples: Samples) -> NDArray[np.float64]:
    """Run the filter of most hobby projects: the integrated roll rate, corrected by the force's direction."""
    left_g, up_g, _ = samples.force.T
    by_force_deg = np.degrees(np.arctan2(left_g, up_g))
    step_deg = samples.rate[:, 2] / samples.rate_hz
    result = np.empty_like(by_force_deg)
    lean = by_force_deg[0]
    for k in range(len(result)):
        lean = COMPLEMENTARY * (lean + step_deg[k]) + (1.0 - COMPLEMENTARY) * by_force_deg[k]
        result[k] = lean
    return result


def of_ahrs(name: str, samples: Samples, **gains: float) -> NDArray[np.float64]:
    from ahrs import filters

    gyro, accel = _xyz(samples)
    return _roll(getattr(filters, name)(gyr=gyro, acc=accel, frequency=samples.rate_hz, **gains).Q)


def vqf(samples: Samples, tau_s: float = 3.0) -> NDArray[np.float64]:
    from vqf import VQF

    gyro, accel = _xyz(samples)
    return _roll(VQF(1.0 / samples.rate_hz, tauAcc=tau_s).updateBatch(gyro, accel)["quat6D"])


def fusion(samples: Samples, **settings: float) -> NDArray[np.float64]:
    """Return the roll of imufusion in rad, shape (n). settings: of AhrsSettings."""
    import imufusion

    gyro, accel = _xyz(samples)
    gyro, accel = np.degrees(gyro), accel / STANDARD_GRAVITY
    ahrs, chosen = imufusion.Ahrs(), imufusion.AhrsSettings()
    for name, value in {"sample_rate": samples.rate_hz, **settings}.items():
        setattr(chosen, name, value)
    ahrs.set_settings(chosen)
    ahrs.set_sample_period(1.0 / samples.rate_hz)
    quaternions = np.empty((len(gyro), 4))
    for k in range(len(gyro)):
        ahrs.update_no_magnetometer(gyro[k], accel[k])
        quaternions[k] = ahrs.get_quaternion()
    return _roll(quaternions)


OTHERS: dict[str, Callable[[Samples], NDArray[np.float64]]] = {
    "complementary": complementary,
    "mahony": partial(of_ahrs, "Mahony"),
    "madgwick": partial(of_ahrs, "Madgwick"),
    "vqf": vqf,
    "fusion": fusion,
    "mahony best": partial(of_ahrs, "Mahony", k_P=0.05, k_I=1e-6),
    "madgwick best": partial(of_ahrs, "Madgwick", gain=0.005),
    "vqf best": partial(vqf, tau_s=30.0),
    "fusion best": partial(fusion, gain=0.03),
}


def missing() -> list[str]:
    """Return the names of the packages that are not installed. estimate() leaves out their filters."""
    return sorted({package for package in PACKAGES.values() if find_spec(package) is None})


def estimate(log: Log, calibration: CalibrationFile) -> dict[str, NDArray[np.float64]]:
    """Run each installed estimator over a log, without the log's speed.

    Returns the lean in degrees, positive to the right, by the name of the estimator.
    """
    engine = replay_engine.Replay(calibration.to_firmware())
    shown, formula = np.empty(len(log.t_s)), np.empty(len(log.t_s))
    for i, (time_us, reading, _) in enumerate(log.rows()):
        values = engine.step(time_us, reading)
        shown[i], formula[i] = values[_SHOWN], values[_FORMULA]
    samples = calibrated(log, calibration)
    absent = missing()
    return {
        "kickstand": shown,
        "smoothed": smooth(replace(log, speed_mps=np.zeros(0)), calibration).lean_deg,
        "formula": formula,
        "formula 0.3 s": trailing_mean(formula, AVERAGE_S, samples.rate_hz),
        **{name: lean(samples) for name, lean in OTHERS.items() if PACKAGES.get(name) not in absent},
    }


def _xyz(samples: Samples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rates in rad/s and forces in m/s^2 along forward, left, up, shape (N, 3) each."""
    gyro = np.ascontiguousarray(np.radians(samples.rate[:, _TO_XYZ]))
    return gyro, np.ascontiguousarray(samples.force[:, _TO_XYZ] * STANDARD_GRAVITY)


def _roll(q: NDArray) -> NDArray[np.float64]:
    """Compute the lean from quaternions, in degrees.

    q: rotations from body to earth, shape (N, 4), in the order w, x, y, z. The body axes are forward, left, up.
    """
    w, x, y, z = q.T
    return np.degrees(np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))


NAME = "possible"
GPS_HZ = (1.0, 10.0)
# Standard deviation of the noise of each component of a receiver's velocity, from the data sheets of u-blox M8 and M9
GPS_MPS = 0.05
# Parameters of the filter that give the oracle the least error, found on two seeds of each profile
_ORACLE = {
    "SIGMA_START": tuple(s if i < BIAS_LEFT else 1e-3 * s for i, s in enumerate(measurements.SIGMA_START)),
    "SIGMA_FRESH_BIAS": 1e-4,
    "_SIGMA_MEASURED_SPEED": 0.1,
    "_SIGMA_SPEED_SCALE": 0.016,
    "_MEASURED_SPEED_LATE_S": 0.0,
    "_SIGMA_LEFT": 0.02,
    "NOISE_ANGLE": radians(0.12),
    "NOISE_BIAS": radians(0.008),
}


def oracle(ride: SimulatedRide) -> NDArray[np.float64]:
    """The lean with the least error that a filter can reach with this sensor, shape (N), in degrees."""
    readings, chip = ride.readings, ride.chip
    warm = (readings[:, 3] - CALIBRATED_C)[:, None]
    force = readings[:, :3] - chip.accel_offset - warm * chip.accel_per_c
    force = force @ np.linalg.inv(chip.accel_matrix).T
    rate = readings[:, 4:] - chip.gyro_bias - warm * chip.gyro_per_c - GYRO_DPS_PER_G * force
    rate = rate @ np.linalg.inv(chip.gyro_matrix).T
    calibration = CalibrationFile(vehicle_from_sensor=ride.vehicle_from_sensor, aligned=True, six_done=True)
    log = Log(ride.time, force, rate, ride.truth["speed_mps"].copy(), name="RIDE.csv")
    with _oracle_parameters():
        return replay(log, calibration).lean_deg


@contextmanager
def _oracle_parameters() -> Iterator[None]:
    with patch.multiple(measurements, **_ORACLE), patch.object(kalman, "MAX_TRIM", 0.0):
        yield


def gps_lean(ride: SimulatedRide, rate_hz: float) -> NDArray[np.float64]:
    """The lean as in phone apps, shape (N), in degrees, with rate_hz positions per second.

    The lean is atan(speed x change of course / g) at each position, and stays the same until the next position.
    """
    time, truth = ride.time, ride.truth
    chance = np.random.default_rng(len(time))
    fix_s = np.arange(time[0], time[-1], 1.0 / rate_hz)
    course = np.cumsum(np.radians(truth["yaw_rate_dps"])) / ride.rate_hz
    speed, course = (np.interp(fix_s, time, values) for values in (truth["speed_mps"], course))
    speed, course = (
        speed + GPS_MPS * chance.normal(size=len(fix_s)),
        course + GPS_MPS / np.maximum(speed, 1.0) * chance.normal(size=len(fix_s)),
    )
    yaw_rate = np.diff(course, prepend=course[0]) * rate_hz
    lean = -np.degrees(np.arctan(speed * yaw_rate / STANDARD_GRAVITY))
    return lean[np.searchsorted(fix_s, time, side="right").clip(1) - 1]


def leans(ride: SimulatedRide) -> dict[str, NDArray[np.float64]]:
    """Return oracle(), and gps_lean() at each rate in GPS_HZ, by name."""
    return {NAME: oracle(ride), **{f"GPS {rate_hz:g} Hz": gps_lean(ride, rate_hz) for rate_hz in GPS_HZ}}
