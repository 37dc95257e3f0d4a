"""Simulated routes with fixed instead of random choices: the limits of speeds, times and bends, and the road."""

from math import atan, radians

import numpy as np
import pytest
from fixed_chance import Fixed
from kickstand.units import STANDARD_GRAVITY
from kickstand_fleet.simulation.route import Handling, Route, balance_lean, random_route

HANDLING = Handling((8.0, 19.0), (1.0, 2.4), (1.3, 3.4), (1.0, 3.0))
RATE_HZ = 50.0


def at(route, values, time_s):
    return float(np.interp(time_s, route.time, values))


@pytest.mark.parametrize(
    ("share", "speeds", "end_s"),
    [
        # stands until 7 s, cruises with 8 m/s from 15 s to 16.5 s, stands again from 22.7 s
        (0.0, {6.0: 0.0, 11.0: 4.0, 15.8: 8.0, 19.5: 4.1, 25.0: 0.0}, 16.5 + 8.0 / 1.3 + 2.0 * 4.5),
        # stands until 14 s, cruises with 19 m/s from 21.9 s to 27.9 s, stands again from 33.5 s
        (1.0, {13.0: 0.0, 18.0: 9.6, 25.0: 19.0, 30.0: 11.92, 40.0: 0.0}, 27.9167 + 19.0 / 3.4 + 2.0 * 11.0),
    ],
)
def test_a_straight_leg_ends_in_a_stop(share, speeds, end_s):
    route = random_route(Fixed(share, 0.49), HANDLING, 35.0 if share else 28.0, RATE_HZ)
    assert {time: at(route, route.speed, time) for time in speeds} == pytest.approx(speeds, abs=0.05)
    assert route.time[-1] == pytest.approx(end_s, abs=0.03)
    assert route.time[1] == 1.0 / RATE_HZ
    assert not np.any(route.yaw_rate)


@pytest.mark.parametrize(
    ("choice", "share", "heading_deg", "slowest", "seconds"),
    [
        (0.5, 0.0, -60.0, 4.0, 28.0),  # a junction, to the right
        (0.5, 1.0, -100.0, 7.0, 35.0),
        (0.75, 0.0, -10.0, 8.0, 28.0),  # a bend of the road
        (0.75, 1.0, -40.0, 19.0, 35.0),
    ],
)
def test_a_junction_and_a_bend_turn_by_their_angles(choice, share, heading_deg, slowest, seconds):
    route = random_route(Fixed(share, choice), HANDLING, seconds, RATE_HZ)
    assert np.degrees(np.sum(route.yaw_rate)) / RATE_HZ == pytest.approx(heading_deg, rel=0.03)
    turning = route.yaw_rate < 0.98 * route.yaw_rate.min()
    assert route.speed[turning] == pytest.approx(slowest, abs=0.01)
    lateral = HANDLING.lateral_mps2[share > 0.5]
    assert np.max(np.abs(route.speed * route.yaw_rate)) == pytest.approx(lateral, rel=0.06)


def test_a_turn_may_be_to_the_left():
    """The first choice is a junction, the second its side."""
    route = random_route(Fixed(0.0, 0.6, 0.6, 0.49), HANDLING, 28.0, RATE_HZ)
    assert np.degrees(np.sum(route.yaw_rate)) / RATE_HZ == pytest.approx(60.0, rel=0.03)


def test_around_a_junction_the_road_is_straight_for_a_second():
    route = random_route(Fixed(0.0, 0.6), HANDLING, 28.0, RATE_HZ)
    braked_s = 15.0 + 4.0 / 1.3
    turned_s = braked_s + 1.0 + radians(60.0) * 4.0 / 1.0
    for time in (braked_s + 0.1, turned_s + 0.9):
        assert at(route, route.yaw_rate, time) == pytest.approx(0.0, abs=1e-3)
        assert at(route, route.speed, time) == pytest.approx(4.0, abs=0.1)
    # After the bend the vehicle speeds up by 1 m/s2
    assert at(route, route.speed, turned_s + 3.0) == pytest.approx(6.0, abs=0.02)


def test_bends_of_the_road_are_apart():
    """A bend at 19 m/s with 3 m/s2 takes 4.4 s. A straight part of 5 s follows."""
    route = random_route(Fixed(1.0, 0.75), HANDLING, 60.0, RATE_HZ)
    begin_s = 14.0 + 19.0 / 2.4
    bend_s = radians(40.0) * 19.0 / 3.0
    for k in (0, 1):
        first_s = begin_s + k * (bend_s + 5.0)
        assert at(route, route.yaw_rate, first_s + bend_s / 2.0) == pytest.approx(-3.0 / 19.0, rel=1e-3)
        assert at(route, route.yaw_rate, first_s + bend_s + 2.5) == 0.0


@pytest.mark.parametrize(
    ("share", "choice", "expected"),
    [
        # {time: (speed, acceleration to the left)}. Fast and slow circles alternate if both are at their lower limits
        (0.0, 0.49, {10.8: (5.0, 1.75), 15.8: (2.0, 1.05), 20.8: (5.0, 1.75)}),
        (0.0, 0.5, {10.8: (5.0, -1.75), 15.8: (2.0, -1.05)}),
        (0.5, 0.49, {16.9: (6.5, 2.275), 25.4: (4.0, 1.4), 33.9: (6.5, 2.275)}),
        (1.0, 0.49, {23.0: (8.0, 2.8), 35.0: (6.0, 2.1), 47.0: (6.0, 2.1)}),
    ],
)
def test_circles_are_tight_and_slow(share, choice, expected):
    route = random_route(Fixed(share, choice), HANDLING, 60.0, RATE_HZ, straight=False)
    for time, (speed, lateral) in expected.items():
        assert at(route, route.speed, time) == pytest.approx(speed, abs=0.01)
        assert at(route, route.yaw_rate, time) == pytest.approx(lateral / speed, rel=0.01)


def test_a_bend_of_the_road_is_followed_by_a_straight_second():
    """A bend at 8 m/s with 1 m/s2 takes 1.4 s, and the next one begins 1 s later."""
    route = random_route(Fixed(0.0, 0.75), HANDLING, 40.0, RATE_HZ)
    bends = np.flatnonzero(np.diff((route.yaw_rate < -0.06).astype(int)) > 0) / RATE_HZ
    assert np.diff(bends)[:3] == pytest.approx(radians(10.0) * 8.0 / 1.0 + 1.0, abs=0.03)


def test_the_lateral_acceleration_takes_1_2_seconds_to_change():
    """It is a mean over twice the 0.6 s of the pedal. The yaw rate is a mean over 0.6 s once more, so it changes for
    1.8 s. At the beginning and at the end of a bend the vehicle goes straight."""
    route = random_route(Fixed(1.0, 0.75), HANDLING, 36.0, RATE_HZ)
    begin_s, bend_s = 14.0 + 19.0 / 2.4, radians(40.0) * 19.0 / 3.0
    lateral = -route.yaw_rate * 19.0
    for time, expected in ((-0.92, 0.0), (-0.3, 3.0 * 2.0 / 9.0), (0.0, 1.5), (0.3, 3.0 * 7.0 / 9.0), (0.92, 3.0)):
        assert at(route, lateral, begin_s + time) == pytest.approx(expected, abs=0.15)
        assert at(route, lateral, begin_s + bend_s - time) == pytest.approx(expected, abs=0.15)


def test_the_route_ends_some_seconds_after_the_wanted_time():
    """New legs begin until 12 s before the wanted time. After the last leg the vehicle brakes, and stands for 4.5 s."""
    assert random_route(Fixed(0.0, 0.75), HANDLING, 18.9, RATE_HZ).time[-1] == pytest.approx(7.0 + 4.5, abs=0.03)
    longer = random_route(Fixed(0.0, 0.75), HANDLING, 19.1, RATE_HZ)
    assert longer.time[-1] == pytest.approx(7.0 + 8.0 + 8.0 / 1.3 + 4.5, abs=0.03)


@pytest.mark.parametrize(
    ("share", "sigmas", "slope_deg", "camber_deg"),
    [(0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 1.5), (0.0, 1.0, 1.2, 0.7), (1.0, -1.0, -1.2, 0.8)],
)
def test_slope_and_camber_have_their_mean_and_scatter(share, sigmas, slope_deg, camber_deg):
    route = random_route(Fixed(share, 0.49, sigmas=sigmas), HANDLING, 28.0, RATE_HZ)
    assert np.degrees(route.slope) == pytest.approx(slope_deg) and np.degrees(route.camber) == pytest.approx(camber_deg)


def test_slopes_change_every_120_m():
    """The slope is linear between its random values."""
    route = random_route(np.random.default_rng(1), HANDLING, 200.0, RATE_HZ)
    distance = np.cumsum(route.speed) / RATE_HZ
    fast = route.speed > 5.0
    bent = np.abs(np.gradient(np.gradient(route.slope[fast], distance[fast]), distance[fast]))
    places = distance[fast][bent > 0.3 * bent.max()] % 120.0
    assert np.all(np.minimum(places, 120.0 - places) < 15.0)


def test_a_motorcycle_leans_into_the_bend():
    one = np.array([1.0])
    lean = balance_lean(Route(one, 10.0 * one, one, 0.3 * one, one, one))
    assert lean == pytest.approx([-atan(3.0 / STANDARD_GRAVITY)])  # a bend to the left is a lean to the left
