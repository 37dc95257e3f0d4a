"""Computes leans for comparison, from data that a board does not have.

oracle() runs the firmware's own filter with the true alignment and the true speed. The readings for oracle() have
noise, but no other sensor errors, so the filter must only estimate the motion. gps_lean() computes the lean as phone
apps do, from the speed and the change of course of a GPS receiver.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from math import radians
from unittest.mock import patch

import numpy as np
from kickstand.lean import measurements, upright_trim
from kickstand.lean.bike_model import BIAS_LEFT
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log
from kickstand_tools.replay.replay import replay
from kickstand_tools.simulation.physics.chip import CALIBRATED_C, GYRO_DPS_PER_G
from kickstand_tools.simulation.ride import SimulatedRide
from numpy.typing import NDArray

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


def oracle(made: SimulatedRide) -> NDArray[np.float64]:
    """The lean with the least error that a filter can reach with this sensor, shape (N), in degrees."""
    readings, chip = made.readings, made.chip
    warm = (readings[:, 3] - CALIBRATED_C)[:, None]
    force = readings[:, :3] - chip.accel_offset - warm * chip.accel_per_c
    force = force @ np.linalg.inv(chip.accel_matrix).T
    rate = readings[:, 4:] - chip.gyro_bias - warm * chip.gyro_per_c - GYRO_DPS_PER_G * force
    rate = rate @ np.linalg.inv(chip.gyro_matrix).T
    calibration = CalibrationFile(vehicle_from_sensor=made.vehicle_from_sensor, aligned=True, six_done=True)
    log = Log(made.time, force, rate, made.truth["speed_mps"].copy(), name="RIDE.csv")
    with _oracle_parameters():
        return replay(log, calibration).lean_deg


@contextmanager
def _oracle_parameters() -> Iterator[None]:
    """A context that sets the filter's parameters to _ORACLE, in this process."""
    with patch.multiple(measurements, **_ORACLE), patch.object(upright_trim, "MAX_TRIM", 0.0):
        yield


def gps_lean(made: SimulatedRide, rate_hz: float) -> NDArray[np.float64]:
    """The lean as in phone apps, shape (N), in degrees.

    The lean is atan(speed x change of course / g) at each position, and stays the same until the next position.

    rate_hz: number of positions per second.
    """
    time, truth = made.time, made.truth
    chance = np.random.default_rng(len(time))
    fix_s = np.arange(time[0], time[-1], 1.0 / rate_hz)
    course = np.cumsum(np.radians(truth["yaw_rate_dps"])) / made.rate_hz
    speed, course = (np.interp(fix_s, time, values) for values in (truth["speed_mps"], course))
    speed, course = (
        speed + GPS_MPS * chance.normal(size=len(fix_s)),
        course + GPS_MPS / np.maximum(speed, 1.0) * (chance.normal(size=len(fix_s))),
    )
    yaw_rate = np.diff(course, prepend=course[0]) * rate_hz
    lean = -np.degrees(np.arctan(speed * yaw_rate / STANDARD_GRAVITY))
    return lean[np.searchsorted(fix_s, time, side="right").clip(1) - 1]


def leans(made: SimulatedRide) -> dict[str, NDArray[np.float64]]:
    """Return the lean of oracle(), and the lean of gps_lean() at each rate in GPS_HZ, by name."""
    return {NAME: oracle(made), **{f"GPS {rate_hz:g} Hz": gps_lean(made, rate_hz) for rate_hz in GPS_HZ}}
