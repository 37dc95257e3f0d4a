"""The checks in bends report rates in rad/s. Correct logs get no remark."""

import numpy as np
import pytest
from checked import bins_of, simulated, words
from kickstand_sim.simulation.profiles import PROFILES
from kickstand_sim.simulation.scripted.sensor_errors import random_mounting
from kickstand_tools.checks.axes import handedness
from kickstand_tools.checks.leaning import bends
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from kickstand_workshop.evaluation.drawn_rides import drawn_ride


def judged(log, scale=1.0):
    """Return the remark on a log whose rates are multiplied by `scale`."""
    return words(bends(bins_of(log, gyro=scale * np.eye(3))))


@pytest.mark.parametrize("profile", PROFILES)
def test_simulated_rides(profile):
    log = simulated(profile)
    assert judged(log) == ""
    assert ("are they in rad/s?" in judged(log, np.radians(1.0))) is (profile != "parked")


def test_a_short_ride_shows_it_too():
    log = simulated("city")
    log = log.part(log.t_s < 120.0)
    assert "are they in rad/s?" in judged(log, np.radians(1.0))


def test_one_long_steady_bend_is_not_the_gyros_bias():
    """The bend takes 60 s of a ride of 92 s, so it contains most of the calmest seconds. The check measures the gyro's
    bias in the calmest seconds, and must not take the bend's yaw rate for a bias."""
    log = drawn_ride(1036, mounts=["firm"], kind="sweepers").logs[0]
    assert words(handedness(bins_of(log)) or bends(bins_of(log))) == ""
    log.gyro_dps = -log.gyro_dps
    assert "the gyro of the opposite sign" in words(handedness(bins_of(log)) or bends(bins_of(log)))


TURN = np.reshape(random_mounting(3), (3, 3))


def straight_on(time, forward, up):
    """Return the remark on a vehicle that hardly turns. forward and up are the forces along these axes, in g."""
    force = np.column_stack((0.05 * np.sin(0.3 * time), up * np.ones(len(time)), forward)) @ TURN
    rate = 0.01 * np.column_stack((np.cos(time), np.sin(time), time % 1.0)) @ TURN
    return judged(Log(time, force, rate))


@pytest.mark.parametrize("slope", [0.2, 0.0, -0.2])
def test_braking_and_dips_are_no_bends(slope):
    """The vehicle brakes hard on a level road, uphill and downhill. The forces of braking must not look like a bend."""
    time = np.arange(0.0, 300.0, 0.02)
    brake = np.where(time % 20.0 < 5.0, -0.9, 0.0)
    assert straight_on(time, slope + brake, 1.0 + 0.1 * np.sin(time)) == ""


def test_recordings(shared_data):
    """With rates in rad/s, only the motorcycle's recording gets a remark, because cars do not lean."""
    for path in shared_data.glob("*.csv.gz"):
        log = read_log(path)
        assert judged(log) == "", path
        assert bool(judged(log, np.radians(1.0))) is path.name.startswith("motorcycle"), path
