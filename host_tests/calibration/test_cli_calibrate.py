"""`kickstand calibrate` makes a CAL.json from captured poses and refuses every unusable pose."""

import json
import shutil

import numpy as np
import pytest
from kickstand_sim.simulation.ride import random_rotation
from motions import leaned, tipped
from support import command

OFFSET, SLOPE = np.array([0.06, -0.04, 0.11]), np.array([1.02, 0.97, 0.99])
BIAS = (4.0, -11.0, 0.7)


def reads(force):
    """Return the reading of a sensor with the errors OFFSET and SLOPE. force: the true force in the sensor's axes."""
    return (np.asarray(force, float) - OFFSET) / SLOPE


def two_poses(directory, stand, upright=(0.0, 1.0, 0.0), bias=(0.0, 0.0, 0.0)):
    """Write the logs of a pose on the kickstand and of an upright pose. stand, upright: their readings in g. bias: the
    gyro's readings in deg/s."""
    return [
        command.still(directory / "stand.csv", stand, bias),
        command.still(directory / "upright.csv", upright, bias, seed=1),
    ]


def calibrated(out, *words):
    """Run `calibrate`. Return the content of the file and the output."""
    result = command.works("calibrate", *words, "--out", out)
    return json.loads(out.read_text()), result.out


@pytest.fixture
def six_poses(tmp_path):
    """Write a pose for each of the six sides up, tilted by up to 10 degrees. Return the paths."""
    chance = np.random.default_rng(1)
    return [
        command.still(tmp_path / f"side{side}.csv", reads(tipped(axis, chance.uniform(0, 10), chance)), BIAS, seed=k)
        for k, (side, axis) in enumerate(command.AXES.items())
    ]


@pytest.fixture
def free_pose(tmp_path):
    return command.still(tmp_path / "free.csv", reads(np.array([1, -1, 1]) / np.sqrt(3)), BIAS, seed=9)


def test_six_finds_offset_slope_and_bias(tmp_path, six_poses, free_pose):
    data, out = calibrated(tmp_path / "CAL.json", "six", free_pose, *six_poses)
    assert data["accel_offset_g"] == pytest.approx(OFFSET, abs=0.002)
    assert data["accel_slope"] == pytest.approx(SLOPE, abs=0.002)
    assert data["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.02)
    assert data["vehicle_from_sensor"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert f"free pose: {free_pose}" in out
    assert "good" in out
    assert "warning: x, z is beyond the data sheet" in out.replace("are", "is")


@pytest.mark.parametrize(("seed", "side"), [(0, "left"), (1, "right")])
def test_six_and_two_find_the_mounting_to_0_3_degrees(tmp_path, six_poses, free_pose, seed, side):
    mounting = random_rotation(np.random.default_rng(seed))
    stand, upright = (reads(mounting.T @ leaned(lean)) for lean in (-12.0 if side == "left" else 12.0, 0.0))
    poses = two_poses(tmp_path, stand, upright, BIAS)
    six, _ = calibrated(tmp_path / "CAL.json", "six", *six_poses, free_pose)
    options = "--side", side, "--calibration", tmp_path / "CAL.json"  # written over by its successor
    data, _ = calibrated(tmp_path / "CAL.json", "two", *poses, *options)
    assert (data["accel_offset_g"], data["accel_slope"]) == (six["accel_offset_g"], six["accel_slope"])
    assert data["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.02)
    between = np.array(data["vehicle_from_sensor"]) @ mounting.T
    assert np.degrees(np.arccos(min(1.0, (np.trace(between) - 1) / 2))) < 0.3


def refused(tmp_path, *arguments, words):
    """Run `calibrate`. Test that the command refuses and keeps the older CAL.json. Return the message."""
    (tmp_path / "CAL.json").write_text("the one from yesterday\n")
    return command.refused(tmp_path, "calibrate", *arguments, "--out", tmp_path / "CAL.json", words=words)


def test_a_wrong_seventh_or_repeated_pose_is_named(tmp_path, six_poses):
    repeated = shutil.copy(six_poses[2], tmp_path / "again.csv")
    line = refused(tmp_path, "six", *six_poses[:5], repeated, words="side -z is missing")
    assert "side +y is there 2 times" in line
    assert "again.csv" in line
    flat = command.still(tmp_path / "flat.csv", reads(command.AXES["+y"]), BIAS, seed=5)
    assert "flat.csv" in refused(tmp_path, "six", *six_poses, flat, words="must be slanted")
    heavy = command.still(tmp_path / "free.csv", reads(1.03 * np.array([1, 1, 1]) / np.sqrt(3)), BIAS)
    assert "free.csv" in refused(tmp_path, "six", *six_poses, heavy, words="the free pose reads 1.0")
    refused(tmp_path, "six", *six_poses[:5], six_poses[0], words="is given twice")


def test_a_bad_calibration_to_build_on(tmp_path):
    cal = command.write_cal(tmp_path / "SIX.json", accel_slope=[2, 1, 1])
    refused(tmp_path, "two", *two_poses(tmp_path, leaned(-12)), "--calibration", cal, words="slope of x is 2")
