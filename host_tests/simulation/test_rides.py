"""Scripted rides, and the ride that a user steers by hand: balance, poses, vibration and kinematics."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.demo.hand_bike import CRUISE_MPS, HandBike
from kickstand_tools.simulation.physics.bike import Bike
from kickstand_tools.simulation.physics.kinematics import Motion, body_rates, specific_force
from kickstand_tools.simulation.scripted.script import (
    KICKSTAND_DEG,
    Ride,
    accelerate,
    brake,
    kickstand,
    straight,
    turn,
    upright,
    wait,
)

HILLY = [
    kickstand(2),
    upright(2),
    accelerate(14, 4),
    turn(-35, 3),
    straight(3, slope_deg=6),
    turn(40, 3),
    straight(3, slope_deg=-5),
    accelerate(22, 3),
    turn(-50, 4),
    brake(0, 4),
    wait(2),
]


def test_scripted_motion_matches_the_simulated_kinematics():
    """test_simulation_kinematics.py shows that the rates and forces are the derivatives of attitude and position."""
    ride = Ride(HILLY, vibration_g=0.0)
    rate_hz = 1000.0
    t = np.arange(0.0, ride.seconds, 1.0 / rate_hz)
    lean, speed, yaw_rate, slope = np.array([[ride.state(x)[i] for i in (1, 3, 5, 6)] for x in t]).T
    on_the_roll_axis = Bike(sensor_height=0.06, sensor_forward=0.0)
    same = Motion(rate_hz, speed, slope, yaw_rate, lean, slope, np.zeros_like(t))
    motion = np.array([ride.motion(x) for x in t])
    assert np.all(np.ptp(motion, axis=0) > (0.001, 0.3, 0.5, 10.0, 40.0, 40.0))  # something happened
    assert np.abs(specific_force(same, on_the_roll_axis) / STANDARD_GRAVITY - motion[:, :3])[1:-1].max() < 1e-3
    assert np.abs(np.degrees(body_rates(same)) - motion[:, 3:])[1:-1].max() < 0.01


def test_balance_has_no_side_force_and_the_right_yaw_rate():
    ride = Ride(HILLY, vibration_g=0.0)
    seen = set()
    for t in np.arange(10.0, ride.seconds - 8.0, 0.05):
        lean, speed, yaw_rate, phase = ride.truth(t)
        assert speed > 4.0
        assert abs(ride.motion(t)[0]) < 1e-9
        if phase == "held turn":
            assert np.tan(np.radians(lean)) == pytest.approx(-speed * np.radians(yaw_rate) / STANDARD_GRAVITY)
            assert np.sign(yaw_rate) == -np.sign(lean)
            seen.add(bool(lean > 0))
    assert seen == {True, False}


def test_kickstand_and_upright_poses_have_their_leans():
    # The kickstand is on the right
    assert Ride([kickstand(5, lean_deg=15)]).motion(1.0)[0] == pytest.approx(np.sin(np.radians(15)))
    ride = Ride([kickstand(5), upright(5)])
    assert ride.truth(0.0)[3] == "kickstand"
    assert ride.truth(1.0)[0] == pytest.approx(KICKSTAND_DEG)
    left, up, forward, *rates = ride.motion(1.0)
    assert left == pytest.approx(np.sin(np.radians(KICKSTAND_DEG))) and left < 0
    assert up == pytest.approx(np.cos(np.radians(KICKSTAND_DEG)))
    assert forward == 0.0 and not any(rates)
    lean = np.array([ride.truth(x)[0] for x in np.arange(7.0, 12.0, 0.01)])
    assert 0.01 < np.abs(lean).max() < 0.2  # a person holds the bike, so it sways
    assert ride.truth(9.0)[1:] == (0.0, 0.0, "upright")


def test_vibration_has_its_size_and_stops_with_the_engine():
    def rms(vibration_g):
        ride = Ride([upright(4), accelerate(15, 4), straight(20)], vibration_g=vibration_g)
        clean = Ride([upright(4), accelerate(15, 4), straight(20)], vibration_g=0.0)
        t = np.arange(10.0, 26.0, 0.0037)
        shake = np.array([np.subtract(ride.motion(x), clean.motion(x)) for x in t])
        assert ride.motion(2.0) == clean.motion(2.0)
        return np.sqrt((shake**2).mean(axis=0))

    assert rms(0.05)[1] == pytest.approx(0.05, rel=0.05)
    assert rms(0.10)[1] == pytest.approx(0.10, rel=0.05)
    assert 0.2 < rms(0.05)[3] < 2.0


def test_bike_steered_by_hand_stays_in_balance():
    bike = HandBike(vibration_g=0.0)
    assert bike.truth(1.0)[3] == "kickstand"
    bike.command("left")
    assert bike.truth(2.0)[:2] == (pytest.approx(KICKSTAND_DEG), 0.0)  # the bike does not ride off from the kickstand
    bike.command("upright")
    assert bike.truth(5.0)[0] == pytest.approx(0.0, abs=0.2)
    for _ in range(5):
        bike.command("left")  # the first command only sets the bike off
    lean, speed, yaw_rate, phase = bike.truth(16.0)
    assert (lean, speed) == (pytest.approx(-20.0, abs=0.6), pytest.approx(CRUISE_MPS, rel=0.01))
    assert phase == "held turn" and yaw_rate > 0
    left, up, _, w_left, w_up, _ = bike.motion(16.0)
    assert left == pytest.approx(0.0, abs=1e-9) and up == pytest.approx(1 / np.cos(np.radians(lean)))
    assert np.hypot(w_left, w_up) == pytest.approx(yaw_rate)
    bike.command("kickstand")
    assert min(bike.motion(t)[2] for t in np.arange(16.0, 18.0, 0.1)) < -0.4
    assert bike.truth(30.0) == (pytest.approx(KICKSTAND_DEG), 0.0, 0.0, "kickstand")


def test_rates_by_hand_follow_from_the_motion():
    bike = HandBike(vibration_g=0.0)
    bike.command("upright")
    seen, dt = [], 0.005
    for n in range(4000):
        if n % 300 == 299:
            bike.command("right" if n < 1600 else "left")
        t = n * dt
        seen.append((*bike.motion(t), *bike.truth(t)[:2]))
    seen = np.array(seen)
    roll_rate, acceleration = (np.gradient(seen[:, i], dt) for i in (6, 7))
    assert np.ptp(seen[:, 6]) > 20
    # a new command causes a jump, so 1 % of the samples may differ
    assert np.quantile(np.abs(roll_rate - seen[:, 5]), 0.99) < 0.5
    assert np.quantile(np.abs(acceleration / STANDARD_GRAVITY - seen[:, 2]), 0.99) < 0.005
    assert np.ptp(seen[:, 2]) > 0.25
