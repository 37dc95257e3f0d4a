"""Every reader of a log refuses a speed that is in another unit than m/s. No reader refuses a speed in m/s."""

import functools

import numpy as np
import pytest
from checked import bins_of, simulated, words
from kickstand_sim.simulation.profiles import PROFILES
from kickstand_sim.simulation.scripted.sensor_errors import random_mounting
from kickstand_tools.checks.log import check_log, speed_unit
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from support import driving_runs

MOUNT = random_mounting(3)


def said(time, force, speed) -> str:
    """Return the message about the unit of the speed, or "" if there is no message."""
    return words(speed_unit(bins_of(Log(time, force, np.zeros(force.shape), speed))))


KMH, MPH, KNOTS = 3.6, 2.2369, 1.9438


@functools.cache
def driven(brakings):
    """Return the force, rate and speed of a simulated ride with this number of braking events."""
    samples = list(driving_runs.samples(driving_runs.around(brakings), "motorcycle"))
    force, rate = (np.array([driving_runs.mounted(MOUNT, row[k]) for row in samples]) for k in (0, 1))
    return force, rate, [row[2] for row in samples]


def record(brakings=7, **source):
    """Return a log of the simulated ride. source: arguments of driving_runs.SpeedSource."""
    force, rate, mps = driven(brakings)
    gps = driving_runs.SpeedSource(**{"every_s": 1.0} | source)
    speed = np.array([gps.step_to(value) for value in mps], dtype=float)
    return Log(np.arange(len(mps)) / driving_runs.RATE_HZ, force, rate, speed, name="drive.csv")


@pytest.mark.parametrize(("every_s", "late_s"), [(0.1, 1.0), (0.1, 2.0), (1.0, 0.0)])
@pytest.mark.parametrize(
    ("scale", "words"),
    [
        (KMH, r"drive.csv: the speed changes 3\.[4-7] times as much as the force says: it is in km/h, m/s are needed"),
        (MPH, r"changes 2\.[12] times .*: it is in mph or knots, m/s are needed"),
        (KNOTS, r"changes (1\.9|2\.0) times .*: it is in mph or knots, m/s are needed"),
    ],
)
def test_other_units_are_refused(scale, words, every_s, late_s):
    with pytest.raises(InputError, match=words):
        check_log(record(scale=scale, every_s=every_s, late_s=late_s))


def test_one_impossible_reading_hides_nothing():
    """A log made in Python may hold any number."""
    log = record(scale=KMH)
    log.accel_g[1000] = 1e4
    with pytest.raises(InputError, match="it is in km/h"):
        check_log(log)


@pytest.mark.parametrize(("every_s", "late_s"), [(0.1, 0.0), (0.1, 3.0), (0.5, 1.0), (2.0, 0.0), (2.0, 3.0)])
def test_a_speed_in_mps_is_read(every_s, late_s):
    check_log(record(every_s=every_s, late_s=late_s, step=1 / 3.6))


@pytest.mark.parametrize("profile", PROFILES)
def test_no_simulated_ride_is_refused(profile):
    log = simulated(profile)
    check_log(log)
    time, force, speed = log.t_s, log.accel_g, log.speed_mps
    rng = np.random.default_rng(1)
    noisy = np.abs(speed + rng.normal(scale=0.5, size=len(speed)))
    lost = np.where(rng.random(len(speed)) < 0.2, 0.0, speed)  # a receiver may give 0 while the satellites are lost
    for wrong in noisy, np.round(speed), lost, rng.uniform(0.0, 50.0) * rng.random(len(speed)):
        assert said(time, force, np.where(np.isnan(speed), np.nan, wrong)) == ""


def test_a_speed_that_has_nothing_to_do_with_the_ride():
    """None of a hundred logs with random forces and speeds may look like a wrong unit by chance."""
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 60.0, 0.1)
    for _ in range(100):
        force = np.repeat(rng.normal(scale=0.2, size=(60, 3)), 10, axis=0) + [0.0, 0.0, 1.0]
        speed = np.where(np.arange(len(time)) % 10 == 0, rng.uniform(0.0, 50.0, len(time)), np.nan)
        assert said(time, force, speed) == ""


def test_recordings(shared_data):
    for log in sorted(shared_data.glob("*.csv.gz")):
        recording = read_log(log)
        time, force, speed = recording.t_s, recording.accel_g, recording.speed_mps
        if log.name.startswith("car-urban"):
            assert "it is in km/h" in said(time, force, speed * KMH)
            assert "it is in mph or knots" in said(time, force, speed * MPH)
