"""If all accelerations of a log have the opposite sign, the log is a mirror image of the ride. Positions show this."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from checked import bins_of, made_up
from kickstand_sim.simulation.files import positions
from kickstand_tools import api
from kickstand_tools.checks.axes import course_agrees
from kickstand_tools.checks.log import check_log
from kickstand_tools.logs.log import Log


@functools.cache
def simulated(profile: str = "street", late_s: float = 0.6) -> Log:
    """Simulate the log of a board with a gyro bias. The log has 50 readings per second and one position per second. The
    positions are late by late_s seconds, as from a satellite receiver."""
    ride = made_up(profile)
    thinned = slice(None, None, 4)
    times, readings = ride.time[thinned], ride.readings[thinned]
    has_position = np.arange(len(times)) % 50 == 10
    track = [np.where(has_position, np.interp(times - late_s, ride.time, column), np.nan) for column in positions(ride)]
    assert np.max(np.abs(np.mean(readings[:50, 4:], axis=0))) > 3.0
    return Log(times, readings[:, :3], readings[:, 4:], **dict(zip(("lat_deg", "lon_deg", "utc_s"), track)))


def codes(log: Log) -> list[str]:
    return [notice.code for notice in check_log(log).notices]


def mirrored(log: Log) -> Log:
    return replace(log, accel_g=-log.accel_g)


@pytest.mark.parametrize("profile", ["street", "city", "sweeper"])
def test_a_mirrored_log_is_reported_and_a_right_one_is_not(profile):
    assert codes(simulated(profile)) == []
    assert codes(mirrored(simulated(profile))) == ["mirrored"]
    assert "left and right are exchanged" in api.sentence(check_log(mirrored(simulated(profile))).notices[0])


@pytest.mark.parametrize("bias_dps", [[20.0, 0.0, 0.0], [0.0, -20.0, 0.0], [-12.0, 12.0, 12.0]])
def test_a_bias_of_the_gyro_is_no_turning(bias_dps):
    log = simulated()
    biased = replace(log, gyro_dps=log.gyro_dps + bias_dps)
    assert codes(biased) == []
    assert codes(mirrored(biased)) == ["mirrored"]


def circling(both_sides: bool, bias_dps: float, wavering_dps: float = 0.0) -> bool | None:
    """Return the result of the check for a ride in circles at 10 m/s.

    both_sides: True if the ride turns to the left and later to the right, False for only left turns.
    bias_dps: the gyro's bias about up, in deg/s.
    wavering_dps: amplitude of a slow change of the track's yaw rate. The gyro measures the slow change with the
        opposite sign.
    """
    t_s = np.arange(0.0, 120.0, 0.02)
    turning_dps = np.where(both_sides & (t_s > 60.0), -10.0, 10.0)
    wave_dps = wavering_dps * np.sin(t_s)
    yaw_dps = turning_dps + wave_dps
    way = np.cumsum(np.radians(yaw_dps)) * 0.02
    lat, lon = (np.cumsum(10.0 * wave(way)) * 0.02 * 9e-6 for wave in (np.sin, np.cos))
    has_position = np.arange(len(t_s)) % 50 == 0
    rates = np.column_stack((0 * t_s, turning_dps - wave_dps + bias_dps, 0 * t_s))
    places = [np.where(has_position, coordinate, np.nan) for coordinate in (lat, lon)]
    up = np.tile([0.0, 1.0, 0.0], (len(t_s), 1))
    return course_agrees(bins_of(Log(t_s, up, rates, lat_deg=places[0], lon_deg=places[1])))


def test_turns_to_one_side_might_be_a_bias_and_show_nothing():
    assert circling(False, -20.0) is None
    assert circling(False, 0.0) is None
    assert circling(False, 0.0, wavering_dps=3.0) is None
    for bias_dps in (-20.0, 0.0, 20.0):
        assert circling(True, bias_dps) is True


def test_a_gyro_of_the_opposite_sign_is_reported_as_that_alone():
    log = simulated()
    assert codes(replace(log, gyro_dps=-log.gyro_dps)) == ["left-handed"]


def test_gaps_change_nothing():
    log = simulated()
    recorded = (log.t_s % 20.0) > 2.0
    assert codes(mirrored(log)) == ["mirrored"]
    assert codes(log.part(recorded)) == []
    assert codes(mirrored(log.part(recorded))) == ["mirrored"]


def test_without_enough_positions_nothing_is_reported():
    log = mirrored(simulated())
    assert codes(replace(log, lat_deg=np.zeros(0), lon_deg=np.zeros(0))) == []
    few = np.where(log.t_s < 7.0, log.lat_deg, np.nan)
    assert codes(replace(log, lat_deg=few)) == []


@pytest.mark.parametrize("seed", range(10))
def test_errors_of_the_positions_are_no_turns(seed):
    """The bike goes nearly straight at 15 m/s. Errors of 0.5 m turn the course by some degrees per second."""
    chance, t_s = np.random.default_rng(seed), np.arange(0.0, 40.0, 0.02)
    has_position = np.arange(len(t_s)) % 50 == 0
    east, north = chance.normal(0.0, 0.5, len(t_s)), 15.0 * t_s + chance.normal(0.0, 0.5, len(t_s))
    lat, lon = (np.where(has_position, coordinate * 9e-6, np.nan) for coordinate in (north, east))
    rates = np.column_stack((0 * t_s, 2.0 * np.sin(t_s + seed), 0 * t_s))
    up = np.tile([0.0, 1.0, 0.0], (len(t_s), 1))
    assert course_agrees(bins_of(Log(t_s, up, rates, lat_deg=lat, lon_deg=lon))) is None
