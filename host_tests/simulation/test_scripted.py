"""Scripted rides, the ride that a user steers by hand, and the simulated sensor of the simulated board."""

import json

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY as G
from kickstand_sim.simulation.physics.bike import Bike, Motion, body_rates, specific_force
from kickstand_sim.simulation.scripted import sensor_errors
from kickstand_sim.simulation.scripted.script import (
    KICKSTAND_DEG,
    Ride,
    accelerate,
    brake,
    kickstand,
    straight,
    turn,
    upright,
    wait,
    yaw_rate_in_balance,
)
from kickstand_sim.simulation.scripted.sensor_errors import ACCEL_NOISE_G, GYRO_NOISE_DPS, MAX_OFFSET_G, Sensor
from kickstand_tools.common import installation
from kickstand_tools.signals import rotation_matrix
from support import mpy

HILLY = [
    kickstand(2), upright(2), accelerate(14, 4), turn(-35, 3), straight(3, slope_deg=6), turn(40, 3),
    straight(3, slope_deg=-5), accelerate(22, 3), turn(-50, 4), brake(0, 4), wait(2),
]  # fmt: skip


def test_scripted_motion_matches_the_simulated_kinematics():
    """test_physics.py shows that the rates and forces are the derivatives of attitude and position."""
    ride = Ride(HILLY, vibration_g=0.0)
    t = np.arange(0.0, ride.seconds, 0.001)
    lean, speed, yaw_rate, slope = np.array([[ride.state(x)[i] for i in (1, 3, 5, 6)] for x in t]).T
    on_the_roll_axis = Bike(sensor_height=0.06, sensor_forward=0.0)
    simulated = Motion(1000.0, speed, slope, yaw_rate, lean, slope, np.zeros_like(t))
    motion = np.array([ride.motion(x) for x in t])
    assert np.all(np.ptp(motion, axis=0) > (0.001, 0.3, 0.5, 10.0, 40.0, 40.0))
    assert np.abs(specific_force(simulated, on_the_roll_axis) / G - motion[:, :3])[1:-1].max() < 1e-3
    assert np.abs(np.degrees(body_rates(simulated)) - motion[:, 3:])[1:-1].max() < 0.01
    distance = np.array([ride.state(x)[8] for x in t])
    assert np.abs(distance - np.cumsum(speed) * 0.001).max() < 0.1
    riding = [ride.truth(x) for x in t[10_000:-8_000:50]]
    assert all(abs(ride.motion(x)[0]) < 1e-9 for x in t[10_000:-8_000:50])  # in balance
    held_turn = np.array([state[:3] for state in riding if state[3] == "held turn"])
    assert np.tan(np.radians(held_turn[:, 0])) == pytest.approx(-held_turn[:, 1] * np.radians(held_turn[:, 2]) / G)
    assert {*np.sign(held_turn[:, 0])} == {1.0, -1.0}


@pytest.mark.parametrize(("mps", "share"), [(1.0, 0.0), (2.5, 0.5), (4.0, 1.0)])
def test_feet_help_below_4_mps(mps, share):
    assert yaw_rate_in_balance(np.radians(-45.0), G, mps) == pytest.approx(share * G / mps)


def test_kickstand_and_upright_poses_have_their_leans():
    # The kickstand is on the right
    assert Ride([kickstand(5, lean_deg=15)]).motion(1.0)[0] == pytest.approx(np.sin(np.radians(15)))
    ride = Ride([kickstand(5), upright(5)])
    left, up, forward, *rates = ride.motion(1.0)
    assert ride.truth(1.0)[0] == pytest.approx(KICKSTAND_DEG) and ride.truth(0.0)[3] == "kickstand"
    assert (left, up) == pytest.approx((np.sin(np.radians(KICKSTAND_DEG)), np.cos(np.radians(KICKSTAND_DEG))))
    assert left < 0.0 and forward == 0.0 and not any(rates)
    lean = np.array([ride.truth(x)[0] for x in np.arange(7.0, 12.0, 0.01)])
    assert 0.01 < np.abs(lean).max() < 0.2  # a person holds the bike, so it sways
    assert ride.truth(9.0)[1:] == (0.0, 0.0, "upright")


@pytest.mark.parametrize("vibration_g", [0.05, 0.10])
def test_vibration_has_its_size_and_stops_with_the_engine(vibration_g):
    script = [upright(4), accelerate(15, 4), straight(20)]
    ride, calm = Ride(script, vibration_g=vibration_g), Ride(script, vibration_g=0.0)
    shake = np.array([np.subtract(ride.motion(x), calm.motion(x)) for x in np.arange(10.0, 26.0, 0.0037)])
    assert ride.motion(2.0) == calm.motion(2.0)
    assert np.std(shake[:, 1]) == pytest.approx(vibration_g, rel=0.05) and 0.2 < np.std(shake[:, 3]) < 4.0


def test_readings_contain_the_stated_errors():
    ride, sensor = Ride(HILLY[:5], vibration_g=0.0), Sensor(seed=5)
    t = np.arange(0.0, ride.seconds, 0.01)
    truth = np.array([ride.motion(x) for x in t])
    read = np.array([sensor.read(ride.motion(x), x) for x in t])
    assert (read[:, 6] == 25.0).all()
    matrix = np.reshape(sensor.vehicle_from_sensor, (3, 3))  # vectors are rows, so it acts as its transpose
    force_error = read[:, :3] - (sensor.accel_scale * (truth[:, :3] @ matrix) + sensor.accel_offset_g)
    rate_error = read[:, 3:6] - (sensor.gyro_scale * (truth[:, 3:] @ matrix) + sensor.gyro_bias_dps)
    assert np.abs(force_error.std(axis=0) / ACCEL_NOISE_G - 1).max() < 0.1
    assert np.abs(rate_error.std(axis=0) / GYRO_NOISE_DPS - 1).max() < 0.1
    assert np.abs(force_error.mean(axis=0)).max() < ACCEL_NOISE_G / 5
    assert np.abs(np.corrcoef(np.hstack([force_error, rate_error]).T) - np.eye(6)).max() < 0.12
    assert np.abs([np.corrcoef(e[1:], e[:-1])[0, 1] for e in force_error.T]).max() < 0.08  # white
    quiet = Sensor(seed=9, noise=0.0)
    reading = sensor_errors.resting(quiet, (0.0, -2.0, 0.0))(1.0)
    assert reading[:3] == pytest.approx(np.array([0.0, -1.0, 0.0]) * quiet.accel_scale + quiet.accel_offset_g)
    assert reading[3:6] == pytest.approx(quiet.gyro_bias_dps)


def test_seed_determines_the_simulated_sensor():
    sensors = [Sensor(seed=seed) for seed in range(50)]
    largest = np.abs([sensor.accel_offset_g for sensor in sensors]).max(axis=0) / MAX_OFFSET_G
    assert (largest <= 1.0).all() and (largest > 0.8).all()
    mountings = np.array([np.reshape(sensor.vehicle_from_sensor, (3, 3)) for sensor in sensors])
    assert np.abs(mountings @ np.swapaxes(mountings, 1, 2) - np.eye(3)).max() < 1e-12
    assert np.linalg.det(mountings) == pytest.approx(np.ones(50)) and len(np.unique(mountings, axis=0)) == 50
    ride = Ride(HILLY)
    first, repeated, different = (Sensor(seed=seed).world(ride.motion)(7.5) for seed in (1, 1, 2))
    assert first == repeated != different
    numbers = [sensor_errors.normal(sensor_errors.scrambled(k)) for k in range(4000)]
    assert np.mean(numbers) == pytest.approx(0.0, abs=0.05) and np.std(numbers) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    ("first", "last", "degrees"),
    [
        ([0, 0, 2], [0.6, 0.0, 0.8], np.degrees(np.arctan2(0.6, 0.8))),
        ([1, 2, 2], [2, -2, 1], 90.0),
        ([0, 1, 0], [0, -1, 0], 180.0),
        ([1, 1, 1], [-1, -1, -1], 180.0),
    ],
)
def test_the_rates_of_a_hand_turn_gravity_to_the_next_pose(first, last, degrees):
    """The test integrates the direction up, u, in the sensor's axes: du/dt = -rate x u. The turn lasts from 1 to 3 s.
    Halfway through the turn, at 2 s, the rate is largest: 15 / 8 of the mean rate."""
    sensor = Sensor(seed=1, noise=0.0)
    world = sensor_errors.turning(sensor, first, last, 1.0, 3.0)

    def true(t_s):
        reading = np.array(world(t_s))
        force = (reading[:3] - sensor.accel_offset_g) / sensor.accel_scale
        return force, (reading[3:6] - sensor.gyro_bias_dps) / sensor.gyro_scale

    start, end = (np.array(up) / np.linalg.norm(up) for up in (first, last))
    up, step_s = start, 0.002
    for t_s in np.arange(0.5, 3.5, step_s) + step_s / 2:
        force, rate = true(t_s)
        assert np.linalg.norm(force) == pytest.approx(1.0, abs=1e-6)
        up = rotation_matrix(-np.radians(rate) * step_s) @ up
    assert up == pytest.approx(end, abs=1e-3)
    assert true(0.5)[0] == pytest.approx(start, abs=1e-6) and true(3.5)[0] == pytest.approx(end, abs=1e-6)
    assert np.linalg.norm(true(2.0)[1]) == pytest.approx(degrees / 2.0 * 15.0 / 8.0, rel=1e-6)
    assert true(2.0)[0] @ end == pytest.approx(np.cos(np.radians(degrees / 2.0)), abs=1e-6)


BOTH = """
import json
from kickstand_sim.demo.hand_bike import HandBike
from kickstand_sim.simulation.scripted.script import Ride, accelerate, brake, kickstand, straight, turn, upright
from kickstand_sim.simulation.scripted.sensor_errors import Sensor, resting

script = [kickstand(3), upright(3), accelerate(15, 4), turn(-30, 3), straight(3, slope_deg=4), brake(0, 4)]
ride = Ride(script)
bike = HandBike()
sensor = Sensor(seed=11)
worlds = [sensor.world(ride.motion), sensor.world(bike.motion), resting(sensor, (0.5, 0.6, -0.7))]
readings = []
for n in range(60):
    if n % 10 == 5:
        bike.command("upright" if n < 10 else "right")
    readings.append([world(n * 0.37) for world in worlds])
"""


@pytest.mark.skipif(not installation.has_micropython(), reason="no MicroPython unix port for this system")
def test_the_same_readings_under_micropython():
    host: dict = {}
    exec(BOTH, host)
    board = json.loads(mpy.run_mpy(BOTH + "print(json.dumps(readings))"))
    assert np.abs(np.array(host["readings"]) - np.array(board)).max() < 1e-9
