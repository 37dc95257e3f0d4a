"""Helpers for the tests of the checks: logs in the form that the checks take, and cached simulated rides."""

import functools
from dataclasses import replace

import numpy as np
from kickstand_sim.simulation.ride import SimulatedRide, ride
from kickstand_tools.common.messages import sentence
from kickstand_tools.logs.log import Log, LogBins, log_bins
from kickstand_tools.signals import rotation_matrix


def bins_of(log: Log, accel=None, gyro=None, speed=True) -> LogBins:
    """Return the bins of a log with changed axes.

    accel: matrix (3, 3) that exchanges and reverses the accelerometer's axes.
    gyro: the same for the gyro, or a multiple of the identity matrix to scale its readings.
    speed: False to leave out the log's speed.
    """
    force = log.accel_g if accel is None else log.accel_g @ np.transpose(accel)
    rate = log.gyro_dps if gyro is None else log.gyro_dps @ np.transpose(gyro)
    mps = log.speed_mps if speed else np.full(len(log.t_s), np.nan)
    bins = log_bins(replace(log, accel_g=force, gyro_dps=rate, speed_mps=mps))
    assert bins is not None
    return bins


def words(notice) -> str:
    """Return the text of a remark, or "" if there is no remark."""
    return sentence(notice) if notice else ""


@functools.cache
def made_up(profile: str) -> SimulatedRide:
    """Simulate a ride that is measured by an MPU6050. The sensor has the errors that its data sheet allows. In the pose
    that should be upright, the bike leans by 3.5 degrees to the right or left."""
    return ride(profile, 3, 150.0, 3.5 * (-1) ** len(profile))


@functools.cache
def simulated(profile: str) -> Log:
    """Return the ride of made_up() as a log with 50 samples and one speed per second."""
    ride = made_up(profile)
    readings, mps = ride.readings[::4], np.full(len(ride.time[::4]), np.nan)
    mps[::50] = ride.truth["speed_mps"][::200]
    return Log(ride.time[::4], readings[:, :3], readings[:, 4:], mps)


def hand(seconds: float = 60.0, seed: int = 0, hz: int = 50) -> Log:
    """Simulate a phone that is waved in the hand. The phone turns by up to 90 degrees and moves by a few decimetres."""
    chance = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / hz)
    waves = [chance.uniform(0.1, 0.7, (4, 3)), chance.uniform(0.0, 6.3, (4, 3)), chance.normal(0.0, 0.3, (4, 3))]
    angle = np.sum(waves[2] * np.sin(2 * np.pi * waves[0] * time[:, None, None] + waves[1]), axis=1)
    rates = np.diff(angle, axis=0, append=angle[-1:]) * hz
    rotation = [np.eye(3)]
    for turn in rotation_matrix(rates[:-1] / hz):
        rotation.append(rotation[-1] @ turn)
    moved = np.sin(2 * np.pi * 0.8 * time)[:, None] * chance.normal(0.0, 0.1, 3)
    pushed = np.clip(np.diff(moved, n=2, axis=0, prepend=0, append=0) * hz * hz / 9.81, -1.0, 1.0)
    force = np.einsum("nji,nj->ni", np.array(rotation), pushed + [0.0, 0.0, 1.0])
    return Log(time, force + chance.normal(0.0, 0.01, force.shape), np.degrees(rates))
