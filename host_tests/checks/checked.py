"""Logs and arrays in the form that the checks take, and simulated rides that are each made once."""

import functools

import numpy as np
from kickstand_tools.checks.cells import CellTable, LogCells
from kickstand_tools.common.messages import sentence
from kickstand_tools.logs.log import Log
from kickstand_tools.simulation.ride import SimulatedRide, ride


def cells_of(log: Log, accel=None, gyro=None, speed=True) -> LogCells:
    """accel, gyro: a matrix (3, 3) that exchanges and reverses the sensor's axes, or a factor on its readings."""
    force = log.accel_g if accel is None else log.accel_g @ np.transpose(accel)
    rate = log.gyro_dps if gyro is None else log.gyro_dps @ np.transpose(gyro)
    mps = log.speed_mps if speed else np.full(len(log.t_s), np.nan)
    table = CellTable()
    table.add(log.t_s, force, rate, mps, log.lat_deg, log.lon_deg)
    cells = table.cells()
    assert cells is not None
    return cells


def words(notice) -> str:
    """The remark as text, "" for none."""
    return sentence(notice) if notice else ""


@functools.cache
def made_up(profile: str) -> SimulatedRide:
    """Simulate a ride read by an MPU6050 with the errors that its data sheet allows. In the upright pose the bike
    leaned by 3.5 degrees to the right or left."""
    return ride(profile, 3, 150.0, 3.5 * (-1) ** len(profile))


@functools.cache
def simulated(profile: str) -> Log:
    """Return the ride of made_up() at 50 Hz, with one speed per second."""
    made = made_up(profile)
    readings, mps = made.readings[::4], np.full(len(made.time[::4]), np.nan)
    mps[::50] = made.truth["speed_mps"][::200]
    return Log(made.time[::4], readings[:, :3], readings[:, 4:], mps)
