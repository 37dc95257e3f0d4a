"""Calibrations from recorded poses with known results: averages, order, medians, and which part of a pose counts."""

import json

import numpy as np
import pytest
from kickstand_tools.calibration import poses, procedure
from kickstand_tools.calibration.file import CalibrationFile, calibration_path, read_calibration, write_calibration
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.logs.log import Log

OFFSET_G, SLOPE = np.array([0.01, -0.02, 0.03]), np.array([1.02, 0.99, 1.01])
SIX = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
FREE = [0.6, 0.0, 0.8]


def readings(up, n=400, bias_dps=(0.0, 0.0, 0.0), noise_g=0.002):
    """Return readings (n, 7) of a still sensor with this direction up. noise_g: also the noise of the rates in
    deg/s."""
    found = np.tile([*(np.array(up) - OFFSET_G) / SLOPE, 20.0, *bias_dps], (n, 1))
    found[:, [0, 1, 2, 4, 5, 6]] += np.random.default_rng(1).normal(0.0, noise_g, (n, 6))
    return found


def log(up, name="", **how):
    made = Log.from_readings(readings(up, **how), 100.0)
    made.name = name
    return made


def test_six_poses_give_offset_slope_and_the_median_bias():
    """The sides come in reverse order, and their biases are 0 to 5 deg/s. With the free pose, the biases are 0 to 6
    deg/s."""
    made = [log(up, "abcdef"[k], bias_dps=(k, -k, 2 * k)) for k, up in enumerate(SIX)][::-1]
    found = poses.fit_six_positions(made)
    assert found.calibration.accel_offset_g == pytest.approx(OFFSET_G, abs=0.001)
    assert found.calibration.accel_slope == pytest.approx(SLOPE, abs=0.001)
    assert found.calibration.gyro_bias_dps == pytest.approx([2.5, -2.5, 5.0], abs=0.01)
    assert found.calibration.six_done and not found.calibration.aligned
    assert [side.name for side in found.sides] == list("abcdef")
    assert np.array(found.tilt_deg) == pytest.approx([0.0] * 6, abs=2.5) and found.turns == 0
    assert (found.free_pose, found.free_pose_error_g, found.beyond_sheet) == (None, None, [])
    seven = poses.fit_six_positions([log(FREE, "free", bias_dps=(6, -6, 12)), *made])
    assert seven.calibration.gyro_bias_dps == pytest.approx([3.0, -3.0, 6.0], abs=0.01)
    assert seven.free_pose is not None and seven.free_pose.name == "free"
    assert seven.free_pose_error_g == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize("count", [0, 1, 5, 8])
def test_six_or_seven_poses_are_needed(count):
    with pytest.raises(InputError, match=f"^{count} captures given: six are needed"):
        poses.fit_six_positions([log(SIX[0])] * count)


def test_a_free_pose_that_is_off_is_named():
    made = [log(up, "abcdef"[k]) for k, up in enumerate(SIX)]
    with pytest.raises(RefusedInput, match=r"free.*the free pose reads 1\.0[45]\d g"):
        poses.fit_six_positions([*made, log(np.array(FREE) * 1.05, "free")])


def test_a_tilted_side_is_named_with_its_file():
    made = [log(up, "abcdef"[k]) for k, up in enumerate(SIX)]
    made[4] = log([np.sin(0.6), 0.0, np.cos(0.6)], "tilted")
    with pytest.raises(RefusedInput, match=r"tilted.*side \+z was 3[45] degrees off.*capture this side again"):
        poses.fit_six_positions(made)


def test_a_pose_is_the_mean_of_its_samples():
    found = poses.read_pose(log(FREE, "n", n=300, bias_dps=(1.0, 2.0, -3.0)))
    assert (found.name, found.samples) == ("n", 300)
    assert found.accel_g == pytest.approx((np.array(FREE) - OFFSET_G) / SLOPE, abs=0.001)
    assert found.gyro_dps == pytest.approx([1.0, 2.0, -3.0], abs=0.001)


def test_a_missing_temperature_does_not_matter():
    made = readings(FREE)
    made[:, 3] = np.nan
    assert poses.take_pose("n", made, "again").samples == 400


@pytest.mark.parametrize(("at", "place"), [(0, "n, sample 1: "), (56, "n, sample 57: ")])
def test_a_saturated_sample_is_named_by_its_number(at, place):
    """An axis is saturated from 1.99 g on."""
    made = readings([0.0, 0.0, 0.0], noise_g=0.0005)
    made[:, 1] += 1.95 - made[0, 1]
    made[at, 1] = 1.9899
    assert poses.take_pose("n", made, "again").samples == 400
    made[at, 1] = 1.9901
    with pytest.raises(RefusedInput, match=f"^{place}.*saturated.*: again$"):
        poses.take_pose("n", made, "again")


def test_a_pose_that_is_refused_as_a_whole_has_no_number():
    with pytest.raises(RefusedInput, match=r"^n: pose refused.*too short: 19 samples, at least 20 needed"):
        poses.take_pose("n", readings(FREE, n=19), "again")
    assert poses.take_pose("n", readings(FREE, n=20), "again").samples == 20


def test_the_same_path_twice_is_refused(tmp_path):
    poses.refuse_same_file([tmp_path / "a", str(tmp_path / "b"), log(FREE), log(FREE)])
    with pytest.raises(InputError, match="is given twice"):
        poses.refuse_same_file([tmp_path / "a", tmp_path / "b", str(tmp_path / "x" / ".." / "a")])


@pytest.mark.parametrize(("side", "left"), [("left", -1.0), ("right", 1.0)])
def test_two_poses_show_which_way_is_left(side, left):
    """On a left kickstand the bike leans to its left. Seen from the leaning bike, up turns to the right."""
    lean = np.radians(10.0)
    straight = CalibrationFile(accel_offset_g=OFFSET_G, accel_slope=SLOPE, six_done=True)
    stand, upright = log([np.sin(lean), np.cos(lean), 0.0], bias_dps=(1.0, 2.0, 3.0)), log([0.0, 1.0, 0.0])
    found = poses.fit_two_positions(stand, upright, straight, side)
    assert found.tilt_deg == pytest.approx(10.0, abs=0.1)
    assert found.calibration.vehicle_from_sensor[0] == pytest.approx([left, 0.0, 0.0], abs=0.01)
    assert found.calibration.vehicle_from_sensor[1] == pytest.approx([0.0, 1.0, 0.0], abs=0.01)
    assert found.calibration.vehicle_from_sensor[2] == pytest.approx([0.0, 0.0, left], abs=0.01)
    assert found.calibration.gyro_bias_dps == pytest.approx([1.0, 2.0, 3.0], abs=0.001)
    assert found.calibration.kickstand_side == side
    with pytest.raises(RefusedInput, match=r"^a and b"):
        poses.fit_two_positions(log([0.0, 1.0, 0.0], "a"), log([0.0, 1.0, 0.0], "b"))


@pytest.mark.parametrize(
    ("tilting", "kept"),
    [(range(0), (0, 400)), (range(60), (100, 300)), (range(340, 400), (100, 300)), (range(190), (200, 400))],
)
def test_the_still_part_of_a_pose_counts(tilting, kept):
    """If the sensor tilts, the middle half is averaged. If that tilts, too, the last half is averaged."""
    made = readings(FREE, n=600)
    made[100:500, 0] += 0.001 * np.arange(400) / 400
    for k in tilting:
        made[100 + k, 2] += 0.045
    whole = Log.from_readings(made, 100.0)
    whole.name = "n"
    found = procedure._pose(whole, 100, 500)
    assert (found.name, found.samples) == ("n, 1.0 to 5.0 s", kept[1] - kept[0])
    assert found.accel_g == pytest.approx(made[100 + kept[0] : 100 + kept[1], :3].mean(axis=0), abs=1e-6)


def test_a_pose_that_is_never_still_has_the_reason_of_the_whole():
    made = readings(FREE, n=400)
    made[::2, 2] += 0.05
    with pytest.raises(RefusedInput, match=r"not still: vibration.*record the procedure again"):
        procedure._pose(Log.from_readings(made, 100.0), 0, 400)


def test_every_entry_of_a_file_reads_back(tmp_path):
    made = CalibrationFile(
        vehicle_from_sensor=np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), aligned=True, notes={"mine": [1]},
        vehicle="motorcycle", kickstand_side="right", gyro_delay_s=0.0, trim_deg=1.5,
    )  # fmt: skip
    write_calibration(tmp_path / "a.json", made)
    found = read_calibration(tmp_path / "a.json")
    assert (found.vehicle, found.kickstand_side, found.gyro_delay_s, found.trim_deg) == ("motorcycle", "right", 0, 1.5)
    assert json.loads((tmp_path / "a.json").read_text())["mine"] == [1]
    assert found != made and CalibrationFile(found.accel_offset_g) == CalibrationFile() != 5
    plain = set(CalibrationFile().as_json())
    assert plain == {
        "version", "accel_offset_g", "accel_slope", "gyro_bias_dps", "vehicle_from_sensor", "six_positions", "aligned",
        "trim_deg",
    }  # fmt: skip


def test_a_rides_calibration_is_beside_it(tmp_path):
    assert calibration_path(tmp_path / "RIDE.csv.gz") == tmp_path / "RIDE.cal.json"


def test_readings_are_turned_to_the_vehicle():
    """The sensor's y axis points to the left, and its x axis points down."""
    made = CalibrationFile(
        accel_offset_g=np.array([0.1, 0.0, 0.0]), accel_slope=np.array([2.0, 1.0, 1.0]),
        gyro_bias_dps=np.array([0.0, 0.0, 4.0]), vehicle_from_sensor=np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    )  # fmt: skip
    force, rate = made.in_vehicle(np.array([[-0.5, 0.2, 0.3, 99.0, 10.0, 20.0, 34.0]]))
    assert force == pytest.approx(np.array([[0.2, 0.9, 0.3]])) and rate == pytest.approx(np.array([[20, -10, 30]]))
