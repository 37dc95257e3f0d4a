"""Test `kickstand calibrate drive`: results on simulated and recorded drives, and refusals."""

import csv
import gzip
import json

import numpy as np
import pytest
from kickstand_tools.calibration.drive import fit_drive
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.simulation.files import simulate
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting
from support import command, driving_runs
from support.driving_runs import RATE_HZ, STAND, around, mounted

# For each recording, the matrix from the sensor's axes to the vehicle's, with the rows left, up, forward. The matrix
# was measured with the recording's own receiver and has an error of 1 to 2 degrees.
RECORDED = {
    "car-urban-short-turn-loop-nominal-001": [
        [0.0124, 0.9995, 0.0302],
        [-0.0021, -0.0302, 0.9995],
        [0.9999, -0.0124, 0.0017],
    ],
    "car-urban-medium-turn-loop-nominal-002": [
        [0.0098, 0.9999, -0.0040],
        [0.0, 0.0040, 1.0],
        [1.0, -0.0098, 0.0],
    ],
}


def record(path, legs, mount, bias=(0.0, 0.0, 0.0), source=None, speed=True, **how):
    """Write a simulated drive as a log."""
    gps = driving_runs.SpeedSource(**(source or {}))
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(command.HEADER.split(",") + (["speed_mps"] if speed else []))
        for k, (force, rate, mps) in enumerate(driving_runs.samples(legs, **how)):
            value = gps.step_to(mps)
            turning = np.array(mounted(mount, rate)) + bias
            row = [f"{v:.5f}" for v in (k / RATE_HZ, *mounted(mount, force), *turning)]
            rows.writerow(row + (["" if value is None else f"{value:.3f}"] if speed else []))
    return path


def remount(source, path, q):
    """Copy a recorded log with all samples rotated by q, as if the sensor had been mounted differently."""
    with gzip.open(source, "rt") as file:
        lines = file.read().splitlines()
    cells = [line.split(",") for line in lines[1:]]
    values = np.array([row[1:7] for row in cells], float).reshape(-1, 2, 3) @ q.T
    with path.open("w") as file:
        file.write(lines[0] + "\n")
        for row, turned in zip(cells, values.reshape(-1, 6), strict=True):
            file.write(",".join([row[0], *(f"{v:.6f}" for v in turned), *row[7:]]) + "\n")
    return path


def matrix_in(path):
    return np.array(json.loads(path.read_text())["vehicle_from_sensor"])


def errors(found, true):
    """Return the yaw error and total error in degrees."""
    between = found @ np.asarray(true).reshape(3, 3).T
    yaw = np.degrees(np.arctan2(between[2, 0] - between[0, 2], between[0, 0] + between[2, 2]))
    return abs(yaw), np.degrees(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1)))


MOUNT = random_mounting(5)


@pytest.mark.parametrize("method", ["improved", "published"])
def test_a_car(tmp_path, method):
    log = record(tmp_path / "drive.csv", around(7), MOUNT, (1.0, -2.0, 3.0))
    out = tmp_path / "CAL.json"
    result = command.works("calibrate", "drive", log, "--vehicle", "car", "--method", method, "--out", out)
    assert max(errors(matrix_in(out), MOUNT)) < 0.3
    data = json.loads(out.read_text())
    assert data["gyro_bias_dps"] == pytest.approx([1.0, -2.0, 3.0], abs=0.02)
    assert (data["vehicle"], data["aligned"], data["six_positions"]) == ("car", True, False)
    assert "in a straight line: event 1" in result.out
    assert "quality: " in result.out
    assert "ready after" in result.out


def test_a_calibrated_accelerometer_keeps_its_parameters(tmp_path):
    identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    cal = command.write_cal(
        tmp_path / "SIX.json", accel_offset_g=[0.2, 0.0, 0.0], accel_slope=[1.0, 1.0, 1.0], vehicle_from_sensor=identity
    )
    log = record(tmp_path / "drive.csv", around(7), MOUNT, (1.0, -2.0, 3.0))
    out = tmp_path / "CAL.json"
    result = command.works("calibrate", "drive", log, "--calibration", cal, "--out", out)
    data = json.loads(out.read_text())
    assert data["accel_offset_g"] == [0.2, 0.0, 0.0]
    assert data["gyro_bias_dps"] == pytest.approx([1.0, -2.0, 3.0], abs=0.02)
    assert errors(matrix_in(out), MOUNT)[1] > 5.0  # the alignment is wrong, because the wrong offset of 0.2 g was used
    assert "no six-position" not in result.out
    assert result.out.count("car, method improved") == 1


def test_notes_in_a_calibration_are_kept(tmp_path):
    """The notes of a calibration name, for example, the board and the sensor chip of a recorded ride."""
    log = record(tmp_path / "drive.csv", around(7), MOUNT)
    before = CalibrationFile(notes={"board": "Raspberry Pi Pico", "sensor": "MPU6050"})
    found = fit_drive([log], before).calibration
    assert found.notes == before.notes
    assert found.as_json()["board"] == "Raspberry Pi Pico"


def test_several_logs_of_one_mount_are_combined(tmp_path):
    """Each log alone has too few braking events."""
    logs = [record(tmp_path / f"{k}.csv", around(2), MOUNT) for k in range(3)]
    refused(tmp_path, "braking events in a straight line", logs[0])
    command.works("calibrate", "drive", *logs, "--out", tmp_path / "CAL.json")
    assert max(errors(matrix_in(tmp_path / "CAL.json"), MOUNT)) < 0.3


def test_the_used_parts_of_logs_are_reported_by_file_and_time(tmp_path):
    legs = {"a": around(3), "b": [[30.0, 0.0, 0.0]], "c": around(4)}
    logs = [record(tmp_path / f"{name}.csv", of, MOUNT) for name, of in legs.items()]
    said = command.works("calibrate", "drive", *logs, "--out", tmp_path / "CAL.json").out
    a, b, c = (said.partition(f"{log}:\n")[2].partition(".csv:\n")[0].split("\n") for log in logs)
    assert b[0].strip() == "no braking in it"
    whole = record(tmp_path / "alone.csv", around(8), MOUNT)
    alone = command.works("calibrate", "drive", whole, "--out", tmp_path / "CAL.json").out

    def times(lines):
        return [float(line.split(" s ")[0]) for line in lines if "in a straight line: event" in line]

    for part in times(a), times(c):
        assert len(part) >= 3
        assert part == pytest.approx(times(alone.split("\n"))[: len(part)], abs=1.0)
    assert "s of all logs" in said
    assert "alone.csv:" not in alone
    assert "s of all logs" not in alone


def test_a_log_without_speed_among_others(tmp_path):
    logs = [record(tmp_path / "a.csv", around(6), MOUNT), record(tmp_path / "b.csv", around(6), MOUNT, speed=False)]
    line = refused(tmp_path, "a GPS or a wheel, or leave this log out", *reversed(logs))
    assert "b.csv: no speed" in line


def test_a_drive_that_begins_in_motion_counts_from_its_beginning(tmp_path):
    """The gyro's bias is known only from the stop at the end, and is subtracted from the whole drive."""
    legs = [*around(6, stands=False)[1:], [20.0, -1.0, 0.0], list(STAND)]
    log = record(tmp_path / "drive.csv", legs, MOUNT, (5.0, -9.0, 3.0), start_mps=12.0)
    command.works("calibrate", "drive", log, "--out", tmp_path / "CAL.json")
    assert max(errors(matrix_in(tmp_path / "CAL.json"), MOUNT)) < 0.5


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_motorcycle_whose_pitch_changed_on_the_kickstand(tmp_path, side):
    """The pitch changes by 2 degrees between the two poses. The yaw error is then over 6 degrees, and the braking
    events reduce it to below 1.5 degrees. A wrong side of the kickstand is reported."""
    ride = simulate("city", 3, tmp_path, 320.0, pitch_change_deg=2.0, speed=True)
    poses = [tmp_path / f"POSE_{k}.csv" for k in range(1, 8)]
    six, two, out = tmp_path / "SIX.json", tmp_path / "TWO.json", tmp_path / "CAL.json"
    command.works("calibrate", "six", *poses, "--out", six)
    pair = tmp_path / "KICKSTAND.csv", tmp_path / "UPRIGHT.csv"
    command.works("calibrate", "two", *pair, "--calibration", six, "--side", side, "--out", two)
    result = command.works("calibrate", "drive", tmp_path / "RIDE.csv", "--calibration", two, "--out", out)
    before, after = (errors(matrix_in(path), ride.vehicle_from_sensor)[0] for path in (two, out))
    assert before > 6.0
    assert after < 1.5
    assert "motorcycle, method improved" in result.out
    assert ("the kickstand is on the other side" in result.out) is (side == "right")


def refused(tmp_path, words, *arguments):
    (tmp_path / "CAL.json").write_text("the one from yesterday\n")
    line = command.refused(tmp_path, "calibrate", "drive", *arguments, "--out", tmp_path / "CAL.json", words=words)
    assert str(arguments[0]) in line
    return line


@pytest.mark.parametrize(
    ("method", "words", "legs", "how"),
    [
        ("improved", "no speed: record a column speed_mps", around(6), {"speed": False}),
        ("published", "no speed: record a column speed_mps", around(6), {"source": {"silent": (-1.0, 1e9)}}),
        ("published", "it never stood still", around(6, stands=False), {"start_mps": 5.0}),
        ("published", "it is in km/h", around(6), {"source": {"scale": 3.6}}),
        ("published", "stuck at", around(8), {"source": {"stuck_from_s": 20.0}}),
        ("published", "2.5 s late", around(8), {"source": {"late_s": 2.5}}),
    ],
)
def test_refusals(tmp_path, method, words, legs, how):
    """test_drive_alignment.py tests the other refusals of the improved method."""
    log = record(tmp_path / "drive.csv", legs, MOUNT, **how)
    refused(tmp_path, words, log, "--method", method)


def test_the_same_log_twice(tmp_path):
    log = record(tmp_path / "drive.csv", [list(STAND)], MOUNT)
    refused(tmp_path, "is given twice", log, log)


def test_a_log_with_too_few_samples_per_second_is_refused(tmp_path):
    rows = np.column_stack((np.arange(20) / 10.0, np.tile([0, 0, 1, 0, 0, 0], (20, 1))))
    log = tmp_path / "slow.csv"
    lines = [",".join(f"{v:.3f}" for v in row) + ",0.0" for row in rows]
    log.write_text("\n".join([command.HEADER + ",speed_mps", *lines]) + "\n")
    refused(tmp_path, "at least 20 per second", log)


@pytest.mark.parametrize("name", RECORDED)
def test_recorded_cars_remounted_at_random(tmp_path, shared_data, name):
    """The result differs from a reference matrix by less than 1.6 degrees in yaw and 3 degrees in total. The reference
    matrix has an error of 1 to 2 degrees."""
    q = np.reshape(random_mounting(1), (3, 3))
    log = remount(shared_data / f"{name}.csv.gz", tmp_path / "log.csv", q)
    command.works("calibrate", "drive", log, "--out", tmp_path / "CAL.json")
    yaw, total = errors(matrix_in(tmp_path / "CAL.json"), RECORDED[name] @ q.T)
    assert yaw < 1.6
    assert total < 3.0


UPSIDE_DOWN = [0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0]  # rows left, up, forward; the sensor's z points down


def test_a_log_of_opposite_sign_looks_upside_down(tmp_path):
    """All accelerations of this log have the opposite sign. In the log of a car only a notice shows the mistake."""
    log, out = record(tmp_path / "drive.csv", around(8), UPSIDE_DOWN), tmp_path / "CAL.json"
    said = command.works("calibrate", "drive", log, "--out", out)
    assert "the sensor's z points down: if it is not mounted upside down, all accelerations are of the" in said.err
    right = record(tmp_path / "right.csv", around(8), [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    assert command.works("calibrate", "drive", right, "--out", out).err == ""


def test_a_calibration_that_contradicts_the_drive_is_reported(tmp_path):
    log, cal = record(tmp_path / "drive.csv", around(8), MOUNT), tmp_path / "CAL.json"
    command.works("calibrate", "drive", log, "--out", cal)
    again = "calibrate", "drive", log, "--vehicle", "car", "--out", tmp_path / "AGAIN.json"
    assert command.works(*again, "--calibration", cal).err == ""
    data = json.loads(cal.read_text())
    left, up, forward = data["vehicle_from_sensor"]
    cal.write_text(json.dumps(data | {"vehicle_from_sensor": [forward, up, [-value for value in left]]}))
    said = command.works(*again, "--calibration", cal).err
    assert f"warning: {log}: by the speed of this ride forward is " in said
    assert "calibrate drive" in said
