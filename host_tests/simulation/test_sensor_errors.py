"""Tests the simulated sensor's errors and mountings. CPython and MicroPython get the same readings."""

import json

import numpy as np
import pytest
from kickstand_tools.common import unix_port
from kickstand_tools.simulation.scripted.script import Ride, accelerate, brake, kickstand, turn, upright
from kickstand_tools.simulation.scripted.sensor_errors import (
    ACCEL_NOISE_G,
    GYRO_NOISE_DPS,
    MAX_OFFSET_G,
    Sensor,
    random_mounting,
    resting,
)

RIDE = [kickstand(2), upright(2), accelerate(14, 4), turn(-35, 3), brake(0, 4)]


def test_mountings_are_rotations():
    for seed in range(100):
        matrix = np.reshape(random_mounting(seed), (3, 3))
        assert np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-12
        assert np.linalg.det(matrix) == pytest.approx(1.0)


def test_readings_contain_the_stated_errors():
    ride = Ride(RIDE, vibration_g=0.0)
    sensor = Sensor(seed=5)
    t = np.arange(0.0, ride.seconds, 0.01)
    truth = np.array([ride.motion(x) for x in t])
    read = np.array([sensor.read(ride.motion(x), x) for x in t])
    assert (read[:, 6] == 25.0).all()
    matrix = np.reshape(sensor.vehicle_from_sensor, (3, 3))
    force, rate = truth[:, :3] @ matrix, truth[:, 3:] @ matrix  # vectors are rows, so the matrix acts as its transpose
    force_error = read[:, :3] - (sensor.accel_scale * force + sensor.accel_offset_g)
    rate_error = read[:, 3:6] - (sensor.gyro_scale * rate + sensor.gyro_bias_dps)
    assert np.abs(force_error.std(axis=0) / ACCEL_NOISE_G - 1).max() < 0.1
    assert np.abs(rate_error.std(axis=0) / GYRO_NOISE_DPS - 1).max() < 0.1
    assert np.abs(force_error.mean(axis=0)).max() < ACCEL_NOISE_G / 5
    assert np.abs(np.corrcoef(np.hstack([force_error, rate_error]).T) - np.eye(6)).max() < 0.1
    assert np.abs([np.corrcoef(e[1:], e[:-1])[0, 1] for e in force_error.T]).max() < 0.06  # white


def test_seed_determines_the_simulated_sensor():
    parts = [Sensor(seed=s) for s in range(50)]
    offsets = np.array([p.accel_offset_g for p in parts])
    largest = np.abs(offsets).max(axis=0) / MAX_OFFSET_G
    assert (largest <= 1.0).all() and (largest > 0.8).all()
    assert len({p.vehicle_from_sensor for p in parts}) == 50
    ride = Ride(RIDE)
    first, again, other = Sensor(seed=1), Sensor(seed=1), Sensor(seed=2)
    assert first.world(ride.motion)(7.5) == again.world(ride.motion)(7.5) != other.world(ride.motion)(7.5)


def test_sensor_at_rest_reads_one_g_with_its_errors():
    sensor = Sensor(seed=9, noise=0.0)
    reading = resting(sensor, (0.0, -2.0, 0.0))(1.0)
    assert reading[:3] == pytest.approx(np.array([0.0, -1.0, 0.0]) * sensor.accel_scale + sensor.accel_offset_g)
    assert reading[3:6] == pytest.approx(sensor.gyro_bias_dps)


_BOTH = """
import json
from kickstand_tools.demo.hand_bike import HandBike
from kickstand_tools.simulation.scripted.script import Ride, accelerate, brake, kickstand, straight, turn, upright
from kickstand_tools.simulation.scripted.sensor_errors import Sensor, resting

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


@pytest.mark.skipif(not unix_port.available(), reason="no MicroPython unix port for this system")
def test_the_same_readings_under_micropython():
    from support import mpy

    here: dict = {}
    exec(_BOTH, here)
    there = json.loads(mpy.run_mpy(_BOTH + "print(json.dumps(readings))"))
    assert np.abs(np.array(here["readings"]) - np.array(there)).max() < 1e-9
