"""The bike that is steered by hand: lean, speed, phases and sensor readings against numbers worked out by hand."""

from math import cos, exp, pi, radians, sin, tan

import pytest
from kickstand_tools.demo.hand_bike import HandBike

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


@pytest.mark.parametrize(("pose", "amplitude_deg"), [("upright", 0.1), ("riding", 0.5)])
def test_the_rider_sways_with_0_4_hz(pose, amplitude_deg):
    bike = HandBike(vibration_g=0.0)
    bike.stand("upright")
    if pose == "riding":
        bike.ride(15.0)
    bike.truth(25.0)  # ten periods of the sway, of 2.5 s each
    quarters = [bike.truth(25.0 + 0.625 * k)[0] for k in range(8)]
    assert quarters == pytest.approx([0.0, amplitude_deg, 0.0, -amplitude_deg] * 2, abs=0.03 * amplitude_deg)
    assert bike.motion(30.0)[5] == pytest.approx(amplitude_deg * 0.8 * pi, rel=0.03)  # the largest roll rate


@pytest.mark.parametrize(
    ("cruise_mps", "wish_deg", "lean_deg"),
    [(3.9, 20.0, 0.0), (4.2, 20.0, 20.0), (15.0, 49.0, 49.0), (15.0, 51.0, 50.0), (15.0, -80.0, -50.0)],
)
def test_it_leans_at_most_50_degrees_and_only_at_speed(cruise_mps, wish_deg, lean_deg):
    assert riding(cruise_mps, wish_deg).truth(30.0)[0] == pytest.approx(lean_deg, abs=0.1)


@pytest.mark.parametrize(
    ("lean_deg", "back_deg", "after_s", "phase"),
    [
        (25.0, None, 1.5, "roll"),  # the roll rate is under 0.02 rad/s after 1.58 s
        (25.0, None, 1.68, "held turn"),
        (25.0, 0.0, 1.1, "roll"),  # the lean is under 0.02 rad after 1.21 s
        (25.0, 0.0, 1.3, "straight"),
    ],
)
def test_a_turn_has_its_phases(lean_deg, back_deg, after_s, phase):
    bike, begin_s = riding(15.0, lean_deg), 20.0
    if back_deg is not None:
        bike.truth(30.0)
        bike.lean_to(back_deg)
        begin_s = 30.0
    assert bike.truth(begin_s + after_s)[3] == phase


def test_a_bike_that_stops_forgets_its_lean():
    bike = riding(15.0, 40.0)
    bike.truth(24.0)
    bike.stand("kickstand")
    assert abs(bike.truth(26.5)[0]) < 0.7 and bike.truth(40.0)[::3] == (pytest.approx(-12.0, abs=0.01), "kickstand")
    bike.stand("upright")
    assert bike.truth(40.5)[3] == "moving" and bike.truth(50.0)[3] == "upright"
    bike.ride(15.0)
    assert bike.truth(65.0)[0] == pytest.approx(0.0, abs=0.6)


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


def test_vibration_is_proportional_to_its_size():
    """The usual size is 0.05 g."""
    bikes = HandBike(0.0), HandBike(), HandBike(0.1)
    for bike in bikes:
        bike.ride(15.0)
    for t_s in (0.3, 1.0, 12.34):
        clean, usual, doubled = (bike.motion(t_s) for bike in bikes)
        vibration = [value - still for value, still in zip(usual, clean)]
        assert [value - still for value, still in zip(doubled, clean)] == pytest.approx([2.0 * v for v in vibration])
        assert max(map(abs, vibration)) > 1e-4
