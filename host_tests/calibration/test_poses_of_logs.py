"""Calibrations from recorded poses with known results, and which part of a recording counts as a pose."""

import numpy as np
import pytest
from kickstand_sim.simulation import hands
from kickstand_sim.simulation.physics.chip import Chip
from kickstand_tools.calibration import poses
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.poses import fit_procedure
from kickstand_tools.common.messages import InputError, RefusedInput
from kickstand_tools.logs.log import Log
from motions import OFFSET_G, SIDES, SLANTED, SLOPE, leaned, still, still_log


def sides(bias_dps=(0.0, 0.0, 0.0)):
    """Return a log for each side, named a to f, whose biases are 0 to 5 times bias_dps."""
    return [still_log(side, "abcdef"[k], bias_dps=k * np.array(bias_dps)) for k, side in enumerate(SIDES)]


def test_six_poses_in_any_order_give_offset_slope_and_the_median_bias():
    fit = poses.fit_six_positions(sides((1, -1, 2))[::-1])
    assert fit.calibration.accel_offset_g == pytest.approx(OFFSET_G, abs=0.001)
    assert fit.calibration.accel_slope == pytest.approx(SLOPE, abs=0.001)
    assert fit.calibration.gyro_bias_dps == pytest.approx([2.5, -2.5, 5.0], abs=0.01)
    assert fit.calibration.six_done and not fit.calibration.aligned
    assert [side.name for side in fit.sides] == list("abcdef")
    assert np.array(fit.tilt_deg) == pytest.approx([0.0] * 6, abs=2.5)
    assert (fit.free_pose, fit.free_pose_error_g, fit.beyond_sheet, fit.turns) == (None, None, [], 0)


def test_a_free_pose_proves_the_six():
    fit = poses.fit_six_positions([still_log(SLANTED, "free", bias_dps=(6, -6, 12)), *sides((1, -1, 2))])
    assert fit.calibration.gyro_bias_dps == pytest.approx([3.0, -3.0, 6.0], abs=0.01)
    assert fit.free_pose is not None and fit.free_pose.name == "free"
    assert fit.free_pose_error_g == pytest.approx(0.0, abs=0.001)


def slanted(deg):
    return [np.sin(np.radians(deg)), 0.0, np.cos(np.radians(deg))]


@pytest.mark.parametrize(
    ("captures", "words"),
    [
        ([], "^0 captures given: six are needed"),
        (sides()[:1], "^1 captures given"),
        (sides()[:5], "^5 captures given"),
        (sides() + sides()[:2], "^8 captures given"),
        ([*sides(), still_log(SLANTED * 1.05, "free")], r"free.*the free pose reads 1\.0[45]\d g"),
        ([*sides()[:4], still_log(slanted(34.0), "tilted"), sides()[5]], r"tilted.*side \+z was 3[45] degrees off"),
        ([*sides(), still_log(slanted(15.0), "g")], r"side \+z exists twice \(e and g\)"),
        ([*sides()[:5], still_log(slanted(20.0), "g")], r"side -z is missing, and side \+z is there 2 times"),
    ],
)
def test_captures_that_are_not_six_sides_are_refused(captures, words):
    with pytest.raises(InputError, match=words):
        poses.fit_six_positions(captures)


def test_a_pose_is_the_mean_of_its_samples_also_without_a_temperature():
    readings = still(SLANTED, count=20, bias_dps=(1.0, 2.0, -3.0))
    readings[:, 3] = np.nan
    fit = poses.take_pose("n", readings, "again")
    assert (fit.name, fit.samples) == ("n", 20)
    assert fit.accel_g == pytest.approx(readings[:, :3].mean(axis=0))
    assert fit.gyro_dps == pytest.approx(readings[:, 4:].mean(axis=0))


def test_the_same_path_twice_is_refused(tmp_path):
    poses.refuse_same_file([tmp_path / "a", str(tmp_path / "b"), still_log(SLANTED), still_log(SLANTED)])
    with pytest.raises(InputError, match="is given twice"):
        poses.refuse_same_file([tmp_path / "a", tmp_path / "b", str(tmp_path / "x" / ".." / "a")])


@pytest.mark.parametrize(("side", "left"), [("left", -1.0), ("right", 1.0)])
def test_two_poses_show_which_way_is_left(side, left):
    """On a left kickstand the bike leans to its left. Seen from the leaning bike, up turns to the right."""
    six = CalibrationFile(accel_offset_g=OFFSET_G, accel_slope=SLOPE, six_done=True, trim_deg=1.0, vehicle="car")
    stand, upright = still_log(leaned(10.0), bias_dps=(1.0, 2.0, 3.0)), still_log([0.0, 1.0, 0.0])
    fit = poses.fit_two_positions(stand, upright, six, side)
    calibration = fit.calibration
    assert fit.tilt_deg == pytest.approx(10.0, abs=0.1)
    assert calibration.vehicle_from_sensor == pytest.approx(np.diag([left, 1.0, left]), abs=0.01)
    assert calibration.gyro_bias_dps == pytest.approx([1.0, 2.0, 3.0], abs=0.001)
    assert (
        calibration.kickstand_side,
        calibration.vehicle,
        calibration.trim_deg,
        calibration.aligned,
        calibration.six_done,
    ) == (side, "", 0.0, True, True)
    assert calibration.accel_offset_g.tolist() == OFFSET_G.tolist()


def test_two_equal_poses_are_refused_by_name():
    with pytest.raises(RefusedInput, match=r"^a and b"):
        poses.fit_two_positions(still_log([0.0, 1.0, 0.0], "a"), still_log([0.0, 1.0, 0.0], "b"))


@pytest.fixture(scope="module")
def handled():
    """Return the readings of an ideal sensor in the six positions and the slanted one, with the turns between them."""
    ideal = Chip(np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), 0.0)
    return hands.procedure(np.random.default_rng(2), ideal, np.array([*SIDES, SLANTED]), 25.0)


def procedure_of(readings):
    return fit_procedure(Log.from_readings(readings, 200.0))


def test_one_recording_has_all_poses_and_turns(handled):
    fit = procedure_of(handled)
    assert (fit.turns, fit.all_turns) == (6, 6)
    assert fit.calibration.accel_offset_g == pytest.approx([0.0] * 3, abs=0.002)
    assert fit.free_pose_error_g == pytest.approx(0.0, abs=0.002)
    assert [float(np.round(side.accel_g[k // 2])) for k, side in enumerate(fit.sides)] == [1, -1, 1, -1, 1, -1]


def test_a_recording_without_movement_or_too_short_is_refused():
    with pytest.raises(InputError, match="1 captures given"):
        procedure_of(still(SLANTED, count=2000))
    with pytest.raises(InputError, match="too short for the six positions"):
        procedure_of(still(SLANTED, count=40))


def test_a_pose_that_vibrates_is_refused(handled):
    readings = handled.copy()
    readings[::2, 2] += 0.05
    with pytest.raises(InputError):
        procedure_of(readings)
