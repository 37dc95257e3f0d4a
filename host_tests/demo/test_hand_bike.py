"""The bike that is steered by hand: lean, speed, phases and sensor readings against numbers worked out by hand."""

from math import cos, exp, radians, sin, tan

import pytest
from kickstand_sim.demo.hand_bike import HandBike

G = 9.80665


def riding(cruise_mps=15.0, lean_deg=0.0):
    """Return a bike without vibration, 20 s after it set off, that begins to lean."""
    bike = HandBike(vibration_g=0.0)
    bike.ride(cruise_mps)
    bike.truth(20.0)
    bike.lean_to(lean_deg)
    return bike


def test_it_begins_on_the_kickstand():
    bike = HandBike()
    assert bike.truth(0.0) == (pytest.approx(-12.0), 0.0, 0.0, "kickstand")
    resting = (sin(radians(-12.0)), cos(radians(-12.0)), 0.0, 0.0, 0.0, 0.0)
    assert bike.motion(5.0) == pytest.approx(resting, abs=1e-9)  # a standing bike has no vibration


@pytest.mark.parametrize("lean_deg", [-30.0, 50.0])
@pytest.mark.parametrize("after_s", [0.1, 0.5, 1.0])
def test_the_lean_follows_its_command_without_overshoot(lean_deg, after_s):
    """A critically damped oscillator of 4 rad/s. Sway of at most 0.5 degrees is added."""
    expected = lean_deg * (1.0 - (1.0 + 4.0 * after_s) * exp(-4.0 * after_s))
    assert riding(15.0, lean_deg).truth(20.0 + after_s)[0] == pytest.approx(expected, abs=0.02 * abs(lean_deg) + 0.5)


def test_it_speeds_up_with_3_mps2_and_brakes_with_5():
    """Near its goal, the speed has a time constant of 1/1.5 s. It accelerates until 1 m/s below its goal."""
    bike = HandBike(vibration_g=0.0)
    bike.ride(15.0)
    for t_s, speed in ((1.0, 3.0), (4.0, 12.0), (5.0, 15.0 - 2.0 * exp(-1.5 * (5.0 - 13.0 / 3.0))), (9.0, 15.0)):
        assert bike.truth(t_s)[1] == pytest.approx(speed, abs=0.03)
        assert (bike.truth(t_s)[3] == "accelerate") is (t_s < 4.8)
    bike = riding(20.0)
    bike.stand("upright")
    for after_s, speed in ((1.0, 15.0), (3.0, 5.0), (3.5, 10.0 / 3.0 * exp(-1.5 * (3.5 - 10.0 / 3.0)))):
        assert bike.truth(20.0 + after_s)[1::2] == (pytest.approx(speed, abs=0.04), "brake")
    assert bike.motion(23.5)[2] == pytest.approx(-1.5 * bike.truth(23.5)[1] / G, abs=0.01)
    assert bike.truth(28.0)[1] == 0.0


@pytest.mark.parametrize("lean_deg", [-25.0, 25.0])
def test_a_bike_in_a_turn_is_in_balance(lean_deg):
    """The force is along the bike's up. A bike that leans to the right turns right, so its yaw rate is negative."""
    bike = riding(15.0, lean_deg)
    lean, speed, yaw_rate_dps, phase = bike.truth(30.0)
    assert phase == "held turn" and speed == pytest.approx(15.0, abs=0.01)
    assert radians(yaw_rate_dps) == pytest.approx(-G * tan(radians(lean)) / 15.0, rel=1e-3)
    motion = bike.motion(30.0)
    assert motion[:3] == pytest.approx((0.0, 1.0 / cos(radians(lean)), 0.0), abs=0.002)
    assert motion[3:5] == pytest.approx([yaw_rate_dps * part(radians(lean)) for part in (sin, cos)], rel=0.01)


def test_keys_set_the_bike_off_and_lean_it_five_degrees():
    bike = HandBike(vibration_g=0.0)
    for name, until_s, lean_deg, speed_mps in (
        ("left", 2.0, -12.0, 0.0),  # no key sets off a bike on its kickstand
        ("upright", 5.0, 0.0, 0.0),
        ("left", 20.0, 0.0, 15.0),  # the first key only sets the bike off
        ("left", 30.0, -5.0, 15.0),
        ("right", 40.0, 0.0, 15.0),
        ("right", 50.0, 5.0, 15.0),
        ("unknown", 60.0, 5.0, 15.0),
        ("kickstand", 80.0, -12.0, 0.0),
    ):
        bike.command(name)
        assert bike.truth(until_s)[:2] == (pytest.approx(lean_deg, abs=0.6), pytest.approx(speed_mps, abs=0.01)), name
