"""`kickstand import` reports its choices, and every other command reads its logs. `report` reads an export directly. A
real drive is imported, aligned and reported."""

import json
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools import api
from support import command
from support.recordings import app_exports, drawn_tables
from support.recordings.app_exports import riding

CAR = Path(__file__).parent.parent / "recordings" / "car_drive.csv.gz"


def test_import_reports_its_choices_and_the_next_step(tmp_path):
    ride = riding().every(2).without(10.0, 12.0)
    ride.t_s = 1.25 * ride.t_s  # make the ride long enough for an alignment
    source, out = app_exports.into(tmp_path / "p.zip", app_exports.phyphox(ride)), tmp_path / "RIDE.csv"
    result = command.works("import", source, "--out", out)
    words = " ".join(result.out.split())
    assert words.startswith("phyphox quantity from unit rate axes and sign accelerometer Accelerometer.csv: X")
    for part in ("m/s2", "80 Hz", "+1 g up, on every phone", "rad/s", "40 Hz", "Location.csv: Velocity"):
        assert part in words
    assert f"written: {out}, 2598 samples in 35.0 s, 80 per second, 1 gap of 2.5 s in all\n" in result.out
    assert f"next: kickstand calibrate ride {out} --out {tmp_path / 'RIDE.cal.json'}\n" in result.out
    assert f"kickstand report {out}\n" in result.out and f"kickstand plot {out} --out plots\n" in result.out
    assert result.err == ""


def test_import_reports_at_once_why_no_lean_is_possible(tmp_path):
    t_s, force_g, rates_dps = drawn_tables.motion("hand", 10.0, np.random.default_rng(5))
    rows = np.column_stack((t_s, force_g, rates_dps)).tolist()
    (tmp_path / "log.csv").write_text(app_exports.lines("t,ax,ay,az,gx,gy,gz".split(","), rows))
    result = command.works("import", tmp_path / "log.csv", "--out", tmp_path / "R.csv")
    assert "10 samples per second: at least 20 are needed" in result.err and "next:" not in result.out
    assert "at least 30 s of riding are needed" in result.err
    assert "gyro: in it the rates turn gravity as it turns" in result.out


def calibrate(source):
    """Write a calibration beside an export."""
    axes = api.CalibrationFile(vehicle_from_sensor=app_exports.PHONE.T, aligned=True)
    api.write_calibration(source.with_name("EXPORT.cal.json"), axes)
    return source


@pytest.mark.parametrize("name", ["EXPORT.zip", "EXPORT"])
def test_report_reads_an_export_directly(tmp_path, name):
    """`report` imports and aligns the export, and a line says so. A calibration beside the export is used."""
    ride = riding().every(4)
    thrice = app_exports.Riding(*(np.concatenate([column] * 3) for column in vars(ride).values()))
    thrice.t_s = np.arange(len(thrice.t_s)) / 50.0
    files = {n: text for n, text in app_exports.phyphox(thrice).items() if n in ("Accelerometer.csv", "Gyroscope.csv")}
    source = app_exports.into(tmp_path / name, files)
    contents = command.snapshot(tmp_path)
    result = command.works("report", source, "--json")
    assert command.snapshot(tmp_path) == contents
    assert result.err.startswith(f"{source}: imported from phyphox, 4199 samples, 50 per second; aligned by its bends")
    data = json.loads(result.out)
    assert data["max_left_deg"]["value"] == pytest.approx(25.0, abs=1.5)
    assert data["max_right_deg"]["value"] == pytest.approx(35.0, abs=1.5)
    calibrate(source)
    assert "aligned" not in command.works("report", source, "--json", "--live").err


def test_report_refuses_what_is_no_log(tmp_path):
    """The export of RaceChrono is a single CSV file. A table is refused with the reason that import prints."""
    (tmp_path / "r.csv").write_text(app_exports.racechrono(riding().every(4)))
    lines = app_exports.any_table(riding().every(4)).split("\n")[:120]
    (tmp_path / "any.csv").write_text("\n".join(lines))
    (tmp_path / "names.csv").write_text("t_s,ax_g\n" + "0,1\n" * 9)
    (tmp_path / "t.gpx").write_text("<?xml version='1.0'?>\n")
    command.write_cal(tmp_path / "A.cal.json")
    (tmp_path / "any").mkdir()
    for name, words in (
        ("r.csv", "s of riding: at least 30 s with bends are needed"),
        ("any.csv", "its noise at rest is"),
        ("names.csv", "has to go through kickstand import first"),
        ("t.gpx", "t.gpx is a track: kickstand join adds it to a ride"),
        ("A.cal.json", "is not a log: give the ride, and a calibration with"),
        ("any", "any contains no recording"),
    ):
        command.refused(tmp_path, "report", tmp_path / name, words=words)


def test_a_damaged_export_gives_a_log_or_one_line(tmp_path):
    """The result of an import is a readable log or a message of one line, never a traceback."""
    ride = riding().every(8).every(1, 100)
    exports = [app_exports.racebox(ride), app_exports.vbo(ride), app_exports.aim(ride), app_exports.sensorlog(ride)]
    exports += [app_exports.racechrono(ride), app_exports.sensor_kinetics(ride)["Ride_accm.csv"]]
    random = np.random.default_rng(5)
    tokens = [*b'nan inf 1e308 99999999999999999999 " , ; - 25:61:99'.split(), b"\n", b"\x00", b"\xff\xfe"]
    gyro = app_exports.sensor_kinetics(ride)["Ride_gyrm.csv"]
    results = {"read": 0, "refused": 0}
    for k in range(36):
        content = exports[k % len(exports)].encode()
        begin = int(random.integers(500 if k % 3 else len(content)))
        length = int(random.integers(300))
        cut = [
            content[:begin],
            content[begin:],
            content[:begin] + content[begin + length :],
            content[: begin + length] + content[begin:],
        ]
        cut += [content[:begin] + tokens[int(random.integers(len(tokens)))] + content[begin + 2 :]] * 3
        files = {"Ride_gyrm.csv": gyro} if k % len(exports) == 5 else {}
        folder = app_exports.into(tmp_path / str(k), files)
        folder.mkdir(exist_ok=True)
        (folder / "Ride_accm.csv").write_bytes(cut[int(random.integers(len(cut)))])
        try:
            api.write_imported(tmp_path / "R.csv", api.import_recording(folder))
        except api.InputError as error:
            assert "\n" not in str(error).strip()
            results["refused"] += 1
        else:
            api.read_log(tmp_path / "R.csv")
            results["read"] += 1
    assert min(results.values()) > 6


# Rows left, up, forward in the sensor's axes, by the recording's own receiver; exact to 2 degrees
CAR_AXES = np.array([[0.0124, 0.9995, 0.0302], [-0.0021, -0.0302, 0.9995], [0.9999, -0.0124, 0.0017]])
MOUNT = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])  # another mount of the same sensor


def test_a_real_drive_is_imported_aligned_and_reported(tmp_path):
    """80 s of a car in a town, as a table in other units and with another mount of the sensor."""
    drive = api.read_log(CAR)
    columns = np.column_stack(
        (1e3 * drive.t_s, 9.80665 * drive.accel_g @ MOUNT.T, np.radians(drive.gyro_dps @ MOUNT.T))
    )
    rows = [
        ";".join(f"{value:.5f}".replace(".", ",") for value in row) + (f";{3.6 * v:.2f}" if v == v else ";")
        for row, v in zip(columns.tolist(), drive.speed_mps.tolist())
    ]
    names = "ms;accX;accY;accZ;gyrX (rad/s);gyrY (rad/s);gyrZ (rad/s);speed (km/h)"
    (tmp_path / "drive.csv").write_text("\n".join([names, *rows]) + "\n")
    result = command.works("import", tmp_path / "drive.csv", "--out", tmp_path / "RIDE.csv")
    assert "7960 samples in 80.0 s" in result.out and "which sign accelerations have" in result.err
    log = api.read_log(tmp_path / "RIDE.csv")
    assert log.accel_g == pytest.approx(drive.accel_g @ MOUNT.T, abs=1e-5)
    assert log.gyro_dps == pytest.approx(drive.gyro_dps @ MOUNT.T, abs=1e-3)
    assert np.nanmax(log.speed_mps) == pytest.approx(12.2, abs=0.1)
    calibration = tmp_path / "RIDE.cal.json"
    command.works("calibrate", "drive", tmp_path / "RIDE.csv", "--out", calibration)
    error = api.read_calibration(calibration).vehicle_from_sensor @ MOUNT @ CAR_AXES.T
    assert np.degrees(np.arccos((np.trace(error) - 1.0) / 2.0)) < 3.0
    data = json.loads(command.works("report", tmp_path / "RIDE.csv", "--json").out)
    assert data["duration_s"] == pytest.approx(80.0, abs=0.1) and data["vehicle"] == "car"
    assert 70.0 < data["riding_s"] < 80.0 and data["max_speed_mps"]["value"] == pytest.approx(12.2, abs=0.1)
    assert 0.15 < data["max_brake_g"]["value"] < 0.35 and 0.15 < data["max_accel_g"]["value"] < 0.35
    assert abs(data["alignment"]["roll_deg"]) < 3.0 and abs(data["alignment"]["yaw_deg"]) < 3.0
