"""The simulated sensor's errors and mountings, the logs it writes, and the same readings on both Pythons."""

import csv
import gzip
import itertools
import json

import numpy as np
import pytest
from kickstand_tools import unix_port
from kickstand_tools.simulation.data_sheet import MAX_OFFSET_G
from kickstand_tools.simulation.scripted.captures import capture
from kickstand_tools.simulation.scripted.script import Ride, accelerate, brake, kickstand, turn, upright
from kickstand_tools.simulation.scripted.sensor_errors import (
    ACCEL_NOISE_G,
    GYRO_NOISE_DPS,
    Sensor,
    axis_aligned_mountings,
    random_mounting,
    six_poses,
)

RIDE = [kickstand(2), upright(2), accelerate(14, 4), turn(-35, 3), brake(0, 4)]


def test_mountings_are_rotations():
    aligned = axis_aligned_mountings()
    assert len(set(aligned)) == 24
    for m in itertools.chain(aligned, (random_mounting(seed) for seed in range(100))):
        matrix = np.reshape(m, (3, 3))
        assert np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-12
        assert np.linalg.det(matrix) == pytest.approx(1.0)


def test_random_mountings_point_everywhere():
    up = np.array([random_mounting(seed)[3:6] for seed in range(2000)])
    assert np.abs(up.mean(axis=0)).max() < 0.05
    assert np.abs((up**2).mean(axis=0) - 1 / 3).max() < 0.03


def test_the_sensor_reads_what_its_errors_say():
    ride = Ride(RIDE, vibration_g=0.0)
    sensor = Sensor(seed=5)
    t = np.arange(0.0, ride.seconds, 0.01)
    truth = np.array([ride.motion(x) for x in t])
    read = np.array([sensor.read(ride.motion(x), x) for x in t])
    assert (read[:, 6] == 25.0).all()
    matrix = np.reshape(sensor.vehicle_from_sensor, (3, 3))
    force, rate = truth[:, :3] @ matrix, truth[:, 3:] @ matrix  # the transpose, for rows
    force_error = read[:, :3] - (sensor.accel_scale * force + sensor.accel_offset_g)
    rate_error = read[:, 3:6] - (sensor.gyro_scale * rate + sensor.gyro_bias_dps)
    assert np.abs(force_error.std(axis=0) / ACCEL_NOISE_G - 1).max() < 0.1
    assert np.abs(rate_error.std(axis=0) / GYRO_NOISE_DPS - 1).max() < 0.1
    assert np.abs(force_error.mean(axis=0)).max() < ACCEL_NOISE_G / 5
    assert np.abs(np.corrcoef(np.hstack([force_error, rate_error]).T) - np.eye(6)).max() < 0.1
    assert np.abs([np.corrcoef(e[1:], e[:-1])[0, 1] for e in force_error.T]).max() < 0.06  # white


def test_seeds_give_different_parts_and_the_same_again():
    parts = [Sensor(seed=s) for s in range(50)]
    offsets = np.array([p.accel_offset_g for p in parts])
    largest = np.abs(offsets).max(axis=0) / MAX_OFFSET_G
    assert (largest <= 1.0).all() and (largest > 0.8).all()
    assert len({p.vehicle_from_sensor for p in parts}) == 50
    ride = Ride(RIDE)
    first, again, other = Sensor(seed=1), Sensor(seed=1), Sensor(seed=2)
    assert first.world(ride.motion)(7.5) == again.world(ride.motion)(7.5) != other.world(ride.motion)(7.5)


def test_a_sensor_without_a_seed_is_perfect_but_for_noise():
    read = Sensor(noise=0.0).read((0.1, 0.9, -0.2, 1.0, 2.0, 3.0), 4.0)
    assert read == pytest.approx((0.1, 0.9, -0.2, 1.0, 2.0, 3.0, 25.0))


def test_six_poses_show_each_side_once_and_a_free_one():
    sensor = Sensor(seed=9, noise=0.0)
    poses = six_poses(sensor, off_deg=5.0)
    assert [name for name, _ in poses] == ["+x", "-x", "+y", "-y", "+z", "-z", "free"]
    offsets = []
    for name, world in poses:
        reading = world(1.0)
        true = (np.array(reading[:3]) - sensor.accel_offset_g) / sensor.accel_scale
        assert np.linalg.norm(true) == pytest.approx(1.0)
        assert reading[3:6] == pytest.approx(sensor.gyro_bias_dps)
        if name != "free":
            up = (1 if name[0] == "+" else -1) * true["xyz".index(name[1])]
            offsets.append(np.degrees(np.arccos(up)))
    assert max(offsets) <= 5.0 and max(offsets) > 1.0


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz"])
def test_capture_writes_the_log_format(tmp_path, name):
    world = Sensor(seed=4).world(Ride([kickstand(5), upright(5)]).motion)
    capture(world, 3.0, 100, tmp_path / name, start_s=1.0)
    with (gzip.open if name.endswith("gz") else open)(tmp_path / name, "rt") as log:
        rows = list(csv.DictReader(log))
    assert list(rows[0]) == ["t_s", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps"]
    assert len(rows) == 300
    assert [float(rows[i]["t_s"]) for i in (0, 1, 299)] == [0.0, 0.01, 2.99]
    assert float(rows[100]["ay_g"]) == pytest.approx(world(2.0)[1], abs=1e-6)
    assert float(rows[100]["gz_dps"]) == pytest.approx(world(2.0)[5], abs=1e-6)


_BOTH = """
import json
from kickstand_tools.demo.hand_bike import HandBike
from kickstand_tools.simulation.scripted.script import Ride, accelerate, brake, kickstand, straight, turn, upright
from kickstand_tools.simulation.scripted.sensor_errors import Sensor, six_poses

script = [kickstand(3), upright(3), accelerate(15, 4), turn(-30, 3), straight(3, slope_deg=4), brake(0, 4)]
ride = Ride(script)
bike = HandBike()
sensor = Sensor(seed=11)
worlds = [sensor.world(ride.motion), sensor.world(bike.motion)]
worlds += [world for _, world in six_poses(sensor, 4.0)]
readings = []
for n in range(60):
    if n % 10 == 5:
        bike.command("upright" if n < 10 else "right")
    readings.append([world(n * 0.37) for world in worlds])
"""


@pytest.mark.skipif(not unix_port.available(), reason="no MicroPython unix port for this system")
def test_the_same_readings_under_micropython():
    import mpy

    here: dict = {}
    exec(_BOTH, here)
    there = json.loads(mpy.run_mpy(_BOTH + "print(json.dumps(readings))"))
    assert np.abs(np.array(here["readings"]) - np.array(there)).max() < 1e-9
