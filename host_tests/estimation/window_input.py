"""Windows with chosen means, and rides at 50 samples per second, for the tests in this folder."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np
from kickstand_tools.api import Log, simulate_ride
from kickstand_tools.estimation.windows import Windows

RATE_HZ = 50


def windows(n: int = 20, rate: Any = (0.0, 0.0, 0.0), force: Any = (0.0, 1.0, 0.0), speed: Any = np.nan, **more):
    """Return n windows of 0.2 s each. rate, force: shape (3) or (n, 3). more: other fields of Windows."""
    rate, force = (np.array(np.broadcast_to(np.asarray(of, dtype=float), (n, 3))) for of in (rate, force))
    plain = Windows(
        np.asarray(np.arange(n + 1) * 0.2, dtype=float), rate, force, np.zeros(n),
        np.full(n, speed), np.zeros(n), np.zeros(n, dtype=bool), np.arange(n), np.full(n, 0.1), np.full(n, 0.1),
    )  # fmt: skip
    return replace(plain, **more)


@functools.cache
def ride_of(profile="street", seed=21, seconds=120.0):
    """Return a simulated ride. Its sensor is mounted at random and has the errors of its data sheet."""
    return simulate_ride(profile, seed, seconds)


def log_of(ride, speed=True):
    """Return the log of a ride at RATE_HZ, with one speed per second."""
    log = Log.from_readings(ride.readings[::4].copy(), RATE_HZ, "RIDE.csv")
    if speed:
        log.speed_mps[::RATE_HZ] = ride.truth["speed_mps"][::4][::RATE_HZ]
    return log


def still_log(seconds: float, hz: float = RATE_HZ, force=(0.0, 1.0, 0.0)):
    """Return the log of a sensor at rest, with noise."""
    n = round(seconds * hz)
    noise = np.random.default_rng(1).normal(0.0, 0.002, (n, 6))
    return Log(np.arange(n) / hz, noise[:, :3] + np.array(force), noise[:, 3:], name="n")
