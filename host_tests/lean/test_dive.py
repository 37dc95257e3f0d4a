"""Suspension dive: the effect of braking on the pitch is found and not treated as acceleration. Also runs on
MicroPython."""

from math import cos, degrees, radians, sin

from bike_motion import GRAVITY_MPS2, near
from kickstand.lean.dive import PRIOR_SHARE, Dive

WINDOW_S = 0.2


def ridden(share, seconds, road=0.0, dive=None, speed=20.0):
    """Return a Dive after alternate braking and acceleration for some seconds.

    share: true dive of the bike, in rad per g.
    road: amplitude of the pitch rate that the road causes, in rad/s.
    """
    dive = dive or Dive()
    for k in range(int(seconds / WINDOW_S)):
        t_s = k * WINDOW_S
        push, jerk = 0.5 * sin(1.5 * t_s), 0.75 * cos(1.5 * t_s)
        dive.update(push, share * jerk + road * sin(0.4 * t_s), speed, WINDOW_S)
    return dive


def test_the_dive_of_any_bike_is_found_on_a_hilly_road():
    for degrees_per_g in (-1.0, 0.0, 1.5, 3.0, 6.0):
        found = ridden(radians(degrees_per_g), 200.0, road=0.02)
        near(degrees(found.share), degrees_per_g, 0.5)


def test_no_dive_is_found_beyond_that_of_any_bike():
    near(degrees(ridden(radians(30.0), 200.0).share), 8.0, 0.1)
    near(degrees(ridden(radians(-30.0), 200.0).share), -2.0, 0.1)


def test_until_the_bike_has_braked_an_average_dive_is_assumed():
    assert Dive().share == PRIOR_SHARE
    assert ridden(0.1, 10.0, speed=4.0).share == PRIOR_SHARE  # the dive cannot be found below 5 m/s


def test_the_dive_is_the_speed_times_the_springs_pitch_rate():
    dive = Dive()
    dive.update(0.0, 0.0, 0.0, WINDOW_S)
    near(dive.update(0.1, 0.0, 4.0, WINDOW_S), 4.0 * PRIOR_SHARE * 0.5 / GRAVITY_MPS2, 1e-6)


def test_a_jolt_is_no_braking():
    dive = Dive()
    dive.update(0.0, 0.0, 20.0, WINDOW_S)
    assert dive.update(0.7, 1.0, 20.0, WINDOW_S) == 0.0
    assert dive.update(float("nan"), 1.0, 20.0, WINDOW_S) == 0.0
    assert dive.share == PRIOR_SHARE


def test_after_lost_readings_the_dive_found_before_holds():
    dive = ridden(radians(4.0), 100.0)
    before = dive.share
    dive.restart()
    assert dive.update(0.9, 1.0, 20.0, WINDOW_S) == 0.0  # the first window has no earlier force to compare with
    near(dive.share, before, 1e-9)
