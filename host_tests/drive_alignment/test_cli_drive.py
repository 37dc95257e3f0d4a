"""Test `kickstand calibrate drive`: results on simulated and recorded drives, and refusals."""

import csv
import functools
import gzip
import json

import numpy as np
import pytest
from kickstand_sim.simulation.files import simulate
from kickstand_sim.simulation.scripted.sensor_errors import random_mounting
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
MOUNT = random_mounting(5)
BIAS = [1.0, -2.0, 3.0]


@functools.cache
def samples(legs, start_mps):
    return list(driving_runs.samples(json.loads(legs), start_mps=start_mps))


def record(path, legs, mount=MOUNT, source=None, speed=True, start_mps=0.0):
    """Write a simulated drive as a log with 50 samples per second."""
    gps = driving_runs.SpeedSource(**(source or {}))
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(command.HEADER.split(",") + (["speed_mps"] if speed else []))
        for k, (force, rate, mps) in enumerate(samples(json.dumps(legs), start_mps)):
            value = gps.step_to(mps)
            if k % 2:
                continue
            turning = np.array(mounted(mount, rate)) + BIAS
            row = [f"{v:.5f}" for v in (k / RATE_HZ, *mounted(mount, force), *turning)]
            rows.writerow(row + (["" if value is None else f"{value:.3f}"] if speed else []))
    return path


def matrix_in(path):
    return np.array(json.loads(path.read_text())["vehicle_from_sensor"])


def errors(matrix, true):
    """Return the yaw error and total error in degrees."""
    between = matrix @ np.asarray(true).reshape(3, 3).T
    yaw = np.degrees(np.arctan2(between[2, 0] - between[0, 2], between[0, 0] + between[2, 2]))
    return abs(yaw), np.degrees(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1)))


@pytest.mark.parametrize("method", ["improved", "published"])
def test_a_car(tmp_path, method):
    log, out = record(tmp_path / "drive.csv", around(7)), tmp_path / "CAL.json"
    result = command.works("calibrate", "drive", log, "--vehicle", "car", "--method", method, "--out", out)
    assert max(errors(matrix_in(out), MOUNT)) < 0.4
    data = json.loads(out.read_text())
    assert data["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.06)
    assert (data["vehicle"], data["aligned"], data["six_positions"]) == ("car", True, False)
    for words in ("in a straight line: event 1", "quality: ", "ready after", f"car, method {method}"):
        assert words in result.out
    assert "s of all logs" not in result.out and "drive.csv:" not in result.out and result.err == ""


def test_a_calibrated_accelerometer_keeps_its_parameters(tmp_path):
    """The alignment is wrong, because the wrong offset of 0.2 g is used."""
    plain = {"accel_slope": [1.0, 1.0, 1.0], "vehicle_from_sensor": np.eye(3).tolist()}
    cal = command.write_cal(tmp_path / "SIX.json", accel_offset_g=[0.2, 0.0, 0.0], **plain)
    log, out = record(tmp_path / "drive.csv", around(7)), tmp_path / "CAL.json"
    command.works("calibrate", "drive", log, "--calibration", cal, "--out", out)
    data = json.loads(out.read_text())
    assert data["accel_offset_g"] == [0.2, 0.0, 0.0]
    assert data["gyro_bias_dps"] == pytest.approx(BIAS, abs=0.06)
    assert errors(matrix_in(out), MOUNT)[1] > 5.0


def test_several_logs_of_one_mount_are_combined(tmp_path):
    """Each log alone has too few braking events. The events are reported by file and time."""
    legs = {"a": around(3), "b": [[30.0, 0.0, 0.0]], "c": around(4)}
    logs = [record(tmp_path / f"{name}.csv", leg) for name, leg in legs.items()]
    refused(tmp_path, "braking events in a straight line", logs[0])
    printed = command.works("calibrate", "drive", *logs, "--out", tmp_path / "CAL.json").out
    assert max(errors(matrix_in(tmp_path / "CAL.json"), MOUNT)) < 0.4
    a, b, c = (printed.partition(f"{log}:\n")[2].partition(".csv:\n")[0].split("\n") for log in logs)
    assert b[0].strip() == "no braking in it" and "s of all logs" in printed
    ends = np.cumsum([leg[0] for leg in around(4)])[3::4]  # 2 s after each braking event
    for lines in a, c:
        times = [float(line.split(" s ")[0]) for line in lines if "in a straight line: event" in line]
        assert len(times) >= 3 and times == pytest.approx(list(ends[: len(times)]), abs=2.0)


@pytest.mark.long
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
    assert errors(matrix_in(two), ride.vehicle_from_sensor)[0] > 6.0
    assert errors(matrix_in(out), ride.vehicle_from_sensor)[0] < 1.5
    assert "motorcycle, method improved" in result.out
    assert ("the kickstand is on the other side" in result.out) is (side == "right")


def refused(tmp_path, words, *arguments):
    (tmp_path / "CAL.json").write_text("the one from yesterday\n")
    line = command.refused(tmp_path, "calibrate", "drive", *arguments, "--out", tmp_path / "CAL.json", words=words)
    assert str(arguments[0]) in line
    return line


@pytest.mark.parametrize(
    ("method", "words", "legs", "options"),
    [
        ("improved", "no speed: record a column speed_mps", around(1), {"speed": False}),
        ("published", "no speed: record a column speed_mps", around(1), {"source": {"silent": (-1.0, 1e9)}}),
        ("published", "it never stood still", around(2, stands=False), {"start_mps": 5.0}),
        ("published", "it is in km/h", around(5), {"source": {"scale": 3.6}}),
        ("published", "stuck at", around(7), {"source": {"stuck_from_s": 20.0}}),
        ("published", "2.5 s late", around(6), {"source": {"late_s": 2.5}}),
    ],
)
def test_unusable_drives_are_refused(tmp_path, method, words, legs, options):
    """test_drive_alignment.py tests the other refusals of the improved method."""
    refused(tmp_path, words, record(tmp_path / "drive.csv", legs, **options), "--method", method)


def test_unusable_logs_are_refused(tmp_path):
    log = record(tmp_path / "a.csv", [list(STAND)])
    refused(tmp_path, "is given twice", log, log)
    silent = record(tmp_path / "b.csv", [list(STAND)], speed=False)
    assert "b.csv: no speed" in refused(tmp_path, "a GPS or a wheel, or leave this log out", silent, log)
    lines = [f"{k / 10},0,0,1,0,0,0,0" for k in range(20)]
    (tmp_path / "slow.csv").write_text("\n".join([command.HEADER + ",speed_mps", *lines]) + "\n")
    refused(tmp_path, "at least 20 per second", tmp_path / "slow.csv")


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.long) for name in RECORDED])
def test_recorded_cars_remounted_at_random(tmp_path, shared_data, name):
    """All samples are rotated, as if the sensor had been mounted differently. The result differs from a reference
    matrix by less than 1.6 degrees in yaw and 3 degrees in total. The reference has an error of 1 to 2 degrees."""
    q = np.reshape(random_mounting(1), (3, 3))
    with gzip.open(shared_data / f"{name}.csv.gz", "rt") as file:
        header, *lines = file.read().splitlines()
    cells = [line.split(",") for line in lines]
    values = (np.array([row[1:7] for row in cells], float).reshape(-1, 2, 3) @ q.T).reshape(-1, 6)
    rows = [
        ",".join([row[0], *(f"{v:.6f}" for v in turned), *row[7:]]) for row, turned in zip(cells, values, strict=True)
    ]
    log = tmp_path / "log.csv"
    log.write_text("\n".join([header, *rows]) + "\n")
    command.works("calibrate", "drive", log, "--out", tmp_path / "CAL.json")
    assert np.all(np.array(errors(matrix_in(tmp_path / "CAL.json"), RECORDED[name] @ q.T)) < [1.6, 3.0])


def test_a_log_of_opposite_sign_looks_upside_down(tmp_path):
    """All accelerations of this log have the opposite sign. In the log of a car only a notice shows the mistake."""
    upside_down = [0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0]  # rows left, up, forward; the sensor's z points down
    log = record(tmp_path / "drive.csv", around(6), upside_down)
    result = command.works("calibrate", "drive", log, "--out", tmp_path / "CAL.json")
    assert "the sensor's z points down: if it is not mounted upside down, all accelerations are of the" in result.err


def test_a_calibration_that_contradicts_the_drive_is_reported(tmp_path):
    log, cal = record(tmp_path / "drive.csv", around(6)), tmp_path / "CAL.json"
    command.works("calibrate", "drive", log, "--out", cal)
    arguments = "calibrate", "drive", log, "--vehicle", "car", "--out", tmp_path / "AGAIN.json"
    assert command.works(*arguments, "--calibration", cal).err == ""
    data = json.loads(cal.read_text())
    left, up, forward = data["vehicle_from_sensor"]
    cal.write_text(json.dumps(data | {"vehicle_from_sensor": [forward, up, [-value for value in left]]}))
    assert (
        f"warning: {log}: by the speed of this ride forward is " in command.works(*arguments, "--calibration", cal).err
    )
