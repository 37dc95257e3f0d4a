"""`kickstand calibrate` makes a CAL.json from captured poses and refuses every unusable pose."""

import json
import shutil

import numpy as np
import pytest
from kickstand_tools.calibration.file import read_calibration
from support import command
from test_calibration import tipped
from test_rotation import random_rotation

OFFSET, SLOPE = np.array([0.06, -0.04, 0.11]), np.array([1.02, 0.97, 0.99])
BIAS = (4.0, -11.0, 0.7)


def reads(force):
    """Return the reading of a sensor with the errors OFFSET and SLOPE. force: the true force in the sensor's axes."""
    return (np.asarray(force, float) - OFFSET) / SLOPE


def leaned(angle_deg):
    """Return the specific force (left, up, forward) of a bike at rest that leans to the right by this angle."""
    return np.array([np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg)), 0.0])


def two_poses(directory, stand, upright=(0.0, 1.0, 0.0), bias=(0.0, 0.0, 0.0)):
    """Write the logs of a pose on the kickstand and of an upright pose. stand, upright: their readings in g. bias: the
    gyro's readings in deg/s."""
    return [
        command.still(directory / "stand.csv", stand, bias),
        command.still(directory / "upright.csv", upright, bias, seed=1),
    ]


def aligned(poses, *more):
    """Run `calibrate two`. Return the content of CAL.json and the output."""
    out = poses[0].parent / "CAL.json"
    result = command.works("calibrate", "two", *poses, *more, "--out", out)
    return json.loads(out.read_text()), result.out


@pytest.fixture
def six_poses(tmp_path):
    """Write a pose for each of the six sides up, tilted by up to 10 degrees. Return the paths."""
    rng = np.random.default_rng(1)
    return [
        command.still(tmp_path / f"side{side}.csv", reads(tipped(axis, rng.uniform(0, 10), rng)), BIAS, seed=k)
        for k, (side, axis) in enumerate(command.AXES.items())
    ]


@pytest.fixture
def free_pose(tmp_path):
    return command.still(tmp_path / "free.csv", reads(np.array([1, -1, 1]) / np.sqrt(3)), BIAS, seed=9)


def test_six_finds_offset_slope_and_bias_in_any_order(tmp_path, six_poses, free_pose):
    poses = [*six_poses, free_pose]
    np.random.default_rng(0).shuffle(poses)
    result = command.works("calibrate", "six", *poses, "--out", tmp_path / "CAL.json")
    data = json.loads((tmp_path / "CAL.json").read_text())
    assert data["accel_offset_g"] == pytest.approx(OFFSET, abs=0.002)
    assert data["accel_slope"] == pytest.approx(SLOPE, abs=0.002)
    assert data["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.02)
    assert data["vehicle_from_sensor"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert "free pose: " + str(free_pose) in result.out
    assert "good" in result.out
    assert "warning: x, z is beyond the data sheet" in result.out.replace("are", "is")


def test_six_without_a_free_pose_says_what_is_unproven(tmp_path, six_poses):
    result = command.works("calibrate", "six", *six_poses, "--out", tmp_path / "CAL.json")
    assert "warning: no free pose" in result.out


@pytest.mark.parametrize(("seed", "side"), [(0, "left"), (1, "right")])
def test_six_and_two_find_the_mounting_to_0_3_degrees(tmp_path, six_poses, free_pose, seed, side):
    rng = np.random.default_rng(seed)
    mounting = random_rotation(rng)  # rotation from the sensor's axes to the vehicle's axes
    stand, upright = (reads(mounting.T @ leaned(lean)) for lean in (-12.0 if side == "left" else 12.0, 0.0))
    poses = two_poses(tmp_path, stand, upright, BIAS)
    command.works("calibrate", "six", *six_poses, free_pose, "--out", tmp_path / "SIX.json")
    data, _ = aligned(poses, "--side", side, "--calibration", tmp_path / "SIX.json")
    six = json.loads((tmp_path / "SIX.json").read_text())
    assert data["accel_offset_g"] == six["accel_offset_g"]
    assert data["accel_slope"] == six["accel_slope"]
    assert data["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.02)
    between = np.array(data["vehicle_from_sensor"]) @ mounting.T
    error_deg = np.degrees(np.arccos(min(1.0, (np.trace(between) - 1) / 2)))
    assert error_deg < 0.3


def test_two_alone_assumes_a_perfect_accelerometer(tmp_path):
    data, said = aligned(two_poses(tmp_path, leaned(-10)))
    assert (data["accel_offset_g"], data["accel_slope"]) == ([0, 0, 0], [1, 1, 1])
    assert np.array(data["vehicle_from_sensor"]) == pytest.approx(np.eye(3), abs=0.005)
    assert data["kickstand_side"] == read_calibration(tmp_path / "CAL.json").kickstand_side == "left"
    assert "warning: no six-position calibration" in said


def test_two_may_write_over_the_calibration_it_builds_on(tmp_path):
    cal = command.write_cal(tmp_path / "CAL.json", accel_offset_g=[0.01, 0.0, 0.0], accel_slope=[1.0, 1.0, 1.0])
    assert aligned(two_poses(tmp_path, leaned(-10)), "--calibration", cal)[0]["accel_offset_g"] == [0.01, 0.0, 0.0]


def test_a_small_tilt_is_warned_of(tmp_path):
    assert "warning: under 8 degrees" in aligned(two_poses(tmp_path, leaned(-6)))[1]


def test_the_bias_of_the_six_positions_is_the_median(tmp_path, six_poses):
    """The sensor turns during one of the six poses, for example because somebody moves the table. The median ignores
    the spoilt pose."""
    command.still(six_poses[2], reads(command.AXES["+y"]), np.array(BIAS) + 20.0, seed=2)
    command.works("calibrate", "six", *six_poses, "--out", tmp_path / "CAL.json")
    assert json.loads((tmp_path / "CAL.json").read_text())["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.05)


def six_refused(tmp_path, poses, words):
    return command.refused(tmp_path, "calibrate", "six", *poses, "--out", tmp_path / "CAL.json", words=words)


@pytest.mark.parametrize("count", [1, 5, 8])
def test_six_requires_six_or_seven_poses(tmp_path, six_poses, free_pose, count):
    poses = ([*six_poses, free_pose] * 2)[:count]
    six_refused(tmp_path, poses, f"{count} captures given")


def test_a_repeated_side_and_the_missing_side_are_named(tmp_path, six_poses):
    shutil.copy(six_poses[2], tmp_path / "again.csv")
    line = six_refused(tmp_path, [*six_poses[:5], tmp_path / "again.csv"], "side -z is missing")
    assert "side +y is there 2 times" in line
    assert "again.csv" in line


def test_a_seventh_pose_on_a_side_proves_nothing(tmp_path, six_poses):
    flat = command.still(tmp_path / "flat.csv", reads(command.AXES["+y"]), BIAS, seed=5)
    line = six_refused(tmp_path, [*six_poses, flat], "must be slanted")
    assert "flat.csv" in line


def test_the_same_file_twice(tmp_path, six_poses):
    six_refused(tmp_path, [*six_poses[:5], six_poses[0]], "is given twice")


def test_a_free_pose_that_is_not_1_g(tmp_path, six_poses):
    wrong = command.still(tmp_path / "free.csv", reads(1.03 * np.array([1, 1, 1]) / np.sqrt(3)), BIAS)
    line = six_refused(tmp_path, [*six_poses, wrong], "the free pose reads 1.0")
    assert "free.csv" in line


@pytest.mark.parametrize("which", ["six", "stand", "upright"])
def test_a_spoilt_pose_is_refused_by_name(tmp_path, six_poses, which):
    """Other causes of a spoilt pose are tested in test_still_pose.py."""
    poses = two_poses(tmp_path, leaned(-12))
    path = six_poses[3] if which == "six" else tmp_path / f"{which}.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:16]))
    line = six_refused(tmp_path, six_poses, "too short") if which == "six" else two_refused(poses, "too short")
    assert str(path) in line


def two_refused(poses, words, *more):
    """Run `calibrate two`. Test that the command refuses the poses and keeps the older CAL.json. Return the message."""
    directory = poses[0].parent
    (directory / "CAL.json").write_text("the one from yesterday\n")
    return command.refused(directory, "calibrate", "two", *poses, *more, "--out", directory / "CAL.json", words=words)


@pytest.mark.parametrize(
    ("stand", "words"), [(leaned(-0.3), "both poses are the same"), (leaned(-12) * 0.8, "is 0.800 g, not 1 g")]
)
def test_poses_that_do_not_fix_the_mounting(tmp_path, stand, words):
    line = two_refused(two_poses(tmp_path, stand), words)
    assert "stand.csv" in line
    assert "upright.csv" in line


def test_a_bad_calibration_to_build_on(tmp_path):
    cal = command.write_cal(tmp_path / "SIX.json", accel_slope=[2, 1, 1])
    two_refused(two_poses(tmp_path, leaned(-12)), "slope of x is 2", "--calibration", cal)
