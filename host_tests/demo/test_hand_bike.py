"""The lean and the speed of the bike that is steered by hand, and the readings of its sensor, are compared with known
numbers."""

from math import cos, exp, radians, sin, tan

import pytest
from kickstand_tools.demo.hand_bike import HandBike

G = 9.80665


def riding(cruise_mps=15.0):
    """Return a bike without vibration, 20 s after it set off."""
    bike = HandBike(vibration_g=0.0)
    bike.ride(cruise_mps)
    bike.truth(20.0)
    return bike


def test_it_begins_on_the_kickstand():
    bike = HandBike()
    lean, *motion = bike.truth(0.0)
    assert lean == pytest.approx(-12.0) and motion == [0.0, 0.0, "kickstand"]
    expected = (sin(radians(-12.0)), cos(radians(-12.0)), 0.0, 0.0, 0.0, 0.0)
    assert bike.motion(5.0) == pytest.approx(expected, abs=1e-9)  # a standing bike has no vibration


@pytest.mark.parametrize("lean_deg", [-30.0, 20.0, 50.0])
@pytest.mark.parametrize("after_s", [0.1, 0.25, 0.5, 1.0])
def test_the_lean_follows_its_command_without_overshoot(lean_deg, after_s):
    """A critically damped oscillator of 4 rad/s. Sway of at most 0.5 degrees is added."""
    bike = riding()
    bike.lean_to(lean_deg)
    expected = lean_deg * (1.0 - (1.0 + 4.0 * after_s) * exp(-4.0 * after_s))
    assert bike.truth(20.0 + after_s)[0] == pytest.approx(expected, abs=0.02 * abs(lean_deg) + 0.5)


def test_the_speed_first_rises_steadily_and_then_approaches_its_goal():
    """The speed rises by 3 m/s2 until 13 m/s, then with a time constant of 1/1.5 s."""
    bike = HandBike(vibration_g=0.0)
    bike.ride(15.0)
    for t_s, speed in ((1.0, 3.0), (4.0, 12.0), (5.0, 15.0 - 2.0 * exp(-1.5 * (5.0 - 13.0 / 3.0))), (9.0, 15.0)):
        assert bike.truth(t_s)[1] == pytest.approx(speed, abs=0.03)
    assert bike.motion(10.0)[2] == pytest.approx(0.0, abs=0.001)


def test_it_brakes_with_5_mps2_until_it_stands():
    bike = riding(20.0)
    bike.stand("upright")
    for after_s, speed in ((1.0, 15.0), (3.0, 5.0), (3.5, 10.0 / 3.0 * exp(-1.5 * (3.5 - 10.0 / 3.0)))):
        assert bike.truth(20.0 + after_s)[1] == pytest.approx(speed, abs=0.04)
    assert bike.motion(20.0 + 3.5)[2] == pytest.approx(-1.5 * bike.truth(23.5)[1] / G, abs=0.01)
    assert bike.truth(26.0)[1] > 0.0
    assert bike.truth(28.0)[1] == 0.0


def test_a_bike_that_brakes_is_upright_until_it_stands_on_its_kickstand():
    bike = riding()
    bike.lean_to(40.0)
    bike.truth(24.0)
    bike.stand("kickstand")
    assert abs(bike.truth(26.5)[0]) < 0.7 and bike.truth(26.5)[3] == "brake"
    assert bike.truth(40.0)[0] == pytest.approx(-12.0, abs=0.01) and bike.truth(40.0)[3] == "kickstand"
    bike.ride(15.0)
    assert bike.truth(55.0)[0] == pytest.approx(0.0, abs=0.6)  # the lean before the stop is forgotten


@pytest.mark.parametrize("lean_deg", [-25.0, 25.0])
def test_a_bike_in_a_turn_is_in_balance(lean_deg):
    """The force is along the bike's up. A bike that leans to the right turns right, so its yaw rate is negative."""
    bike = riding(15.0)
    bike.lean_to(lean_deg)
    lean, speed, yaw_rate_dps, phase = bike.truth(30.0)
    assert phase == "held turn" and speed == pytest.approx(15.0, abs=0.01)
    assert radians(yaw_rate_dps) == pytest.approx(-G * tan(radians(lean)) / 15.0, rel=1e-3)
    force = bike.motion(30.0)[:3]
    assert force == pytest.approx((0.0, 1.0 / cos(radians(lean)), 0.0), abs=0.002)
    rates = bike.motion(30.0)[3:5]
    assert rates == pytest.approx((yaw_rate_dps * sin(radians(lean)), yaw_rate_dps * cos(radians(lean))), rel=0.01)


@pytest.mark.parametrize(("pose", "amplitude_deg"), [("upright", 0.1), ("riding", 0.5)])
def test_the_rider_sways_with_0_4_hz(pose, amplitude_deg):
    bike = HandBike(vibration_g=0.0)
    bike.stand("upright")
    if pose == "riding":
        bike.ride(15.0)
    bike.truth(25.0)  # ten periods of the sway, of 2.5 s each
    quarters = [bike.truth(25.0 + 0.625 * k)[0] for k in range(8)]
    assert quarters == pytest.approx([0.0, amplitude_deg, 0.0, -amplitude_deg] * 2, abs=0.03 * amplitude_deg)
    # The largest roll rate of the sway
    assert bike.motion(30.0)[5] == pytest.approx(amplitude_deg * 0.8 * 3.14159, rel=0.03)


@pytest.mark.parametrize(("cruise_mps", "leans"), [(3.9, False), (4.2, True)])
def test_it_leans_only_at_speed(cruise_mps, leans):
    bike = riding(cruise_mps)
    bike.lean_to(20.0)
    assert (bike.truth(30.0)[0] > 15.0) is leans


@pytest.mark.parametrize(("wish", "lean"), [(49.0, 49.0), (51.0, 50.0), (-49.0, -49.0), (-51.0, -50.0)])
def test_it_leans_at_most_50_degrees(wish, lean):
    bike = riding()
    bike.lean_to(wish)
    assert bike.truth(30.0)[0] == pytest.approx(lean, abs=0.05)


def test_keys_do_nothing_on_the_kickstand_and_set_off_upright():
    bike = HandBike(vibration_g=0.0)
    bike.command("left")
    assert bike.truth(2.0)[1:] == (0.0, 0.0, "kickstand")
    bike.command("upright")
    bike.truth(5.0)
    bike.command("left")  # the first command only sets the bike off
    assert bike.truth(20.0)[0] == pytest.approx(0.0, abs=0.6) and bike.truth(20.0)[1] == pytest.approx(15.0, abs=0.01)
    bike.command("left")
    bike.command("left")
    assert bike.truth(30.0)[0] == pytest.approx(-10.0, abs=0.1)
    bike.command("right")
    assert bike.truth(40.0)[0] == pytest.approx(-5.0, abs=0.1)
    bike.command("unknown")
    bike.command("kickstand")
    assert bike.truth(60.0)[3] == "kickstand"


def test_vibration_is_proportional_to_its_size():
    """The usual size is 0.05 g."""
    calm, shaking, doubled = HandBike(0.0), HandBike(), HandBike(0.1)
    for bike in (calm, shaking, doubled):
        bike.ride(15.0)
    for t_s in (0.3, 1.0, 12.34):
        clean = calm.motion(t_s)
        one = [value - was for value, was in zip(shaking.motion(t_s), clean)]
        two = [value - was for value, was in zip(doubled.motion(t_s), clean)]
        assert two == pytest.approx([2.0 * value for value in one]) and max(map(abs, one)) > 1e-4


@pytest.mark.parametrize(("t_s", "accelerates"), [(1.0, True), (4.79, True), (4.81, False)])
def test_it_accelerates_until_1_mps_below_its_goal(t_s, accelerates):
    bike = HandBike(vibration_g=0.0)
    bike.stand("upright")
    bike.truth(10.0)
    bike.ride(15.0)
    assert (bike.truth(10.0 + t_s)[3] == "accelerate") is accelerates


@pytest.mark.parametrize(("after_s", "phase"), [(1.5, "roll"), (1.68, "held turn")])
def test_a_turn_is_held_when_the_roll_rate_is_under_0_02_rad_per_s(after_s, phase):
    """In a roll to 25 degrees, the lean has the tested rate after 1.58 s, and is then within 0.006 rad of its goal."""
    bike = riding()
    bike.lean_to(25.0)
    assert bike.truth(20.0 + after_s)[3] == phase


@pytest.mark.parametrize(("after_s", "phase"), [(1.1, "roll"), (1.3, "straight")])
def test_a_bike_is_straight_below_a_lean_of_0_02_rad(after_s, phase):
    """A roll from 25 degrees back to 0 reaches the tested lean after 1.21 s."""
    bike = riding()
    bike.lean_to(25.0)
    bike.truth(30.0)
    bike.lean_to(0.0)
    assert bike.truth(30.0 + after_s)[3] == phase
