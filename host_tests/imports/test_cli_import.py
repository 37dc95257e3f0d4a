"""`kickstand import` reports its choices, and every other command reads its logs."""

import json

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.imports import importing
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import riding


def test_import_reports_its_choices_and_the_next_step(tmp_path):
    ride = riding().every(2).without(10.0, 12.0)
    ride.t_s = 1.25 * ride.t_s  # make the ride long enough for an alignment
    source, out = app_exports.into(tmp_path / "p.zip", app_exports.phyphox(ride)), tmp_path / "RIDE.csv"
    result = command.works("import", source, "--out", out)
    words = " ".join(result.out.split())
    assert words.startswith("phyphox quantity from unit rate axes and sign accelerometer Accelerometer.csv: X")
    for part in ("m/s2", "80 Hz", "+1 g up, on every phone", "rad/s", "40 Hz", "Location.csv: Velocity"):
        assert part in words
    assert f"written: {out}, 2598 samples in 35.0 s" in result.out
    assert " samples in 35.0 s, 80 per second, 1 gap of 2.5 s in all\n" in result.out
    assert f"next: kickstand calibrate ride {out} --out {tmp_path / 'RIDE.cal.json'}\n" in result.out
    assert f"kickstand report {out}\n" in result.out and f"kickstand plot {out} --out plots\n" in result.out
    assert result.err == ""


@pytest.mark.parametrize("name", ["EXPORT.zip", "EXPORT"])
def test_report_reads_an_export_directly(tmp_path, name):
    """`report` imports and aligns the export, and a line says so. If a calibration is beside the export, it is
    used."""
    ride = riding().every(4)
    again = app_exports.Riding(*(np.concatenate([column] * 3) for column in vars(ride).values()))
    again.t_s = np.arange(len(again.t_s)) / 50.0
    files = {n: text for n, text in app_exports.phyphox(again).items() if n in ("Accelerometer.csv", "Gyroscope.csv")}
    source = app_exports.into(tmp_path / name, files)
    before = command.snapshot(tmp_path)
    result = command.works("report", source, "--json")
    assert command.snapshot(tmp_path) == before
    assert result.err.startswith(f"{source}: imported from phyphox, 4199 samples, 50 per second; aligned by its bends")
    data = json.loads(result.out)
    assert data["max_left_deg"]["value"] == pytest.approx(25.0, abs=1.5)
    assert data["max_right_deg"]["value"] == pytest.approx(35.0, abs=1.5)
    api.write_calibration(
        tmp_path / "EXPORT.cal.json", api.CalibrationFile(vehicle_from_sensor=app_exports.PHONE.T, aligned=True)
    )
    assert "aligned" not in command.works("report", source, "--json", "--live").err


def test_export_of_one_file_is_read(tmp_path):
    """The export of RaceChrono is a single CSV file. A file of an unknown app is refused as a log."""
    (tmp_path / "r.csv").write_text(app_exports.racechrono(riding().every(4)))
    words = "s of riding: at least 30 s with bends are needed"
    assert "r.csv: only" in command.refused(tmp_path, "report", tmp_path / "r.csv", words=words)
    (tmp_path / "any.csv").write_text(app_exports.any_table(riding().every(4)))
    command.refused(tmp_path, "report", tmp_path / "any.csv", words="has to go through kickstand import first")
    (tmp_path / "t.gpx").write_text("<?xml version='1.0'?>\n")
    command.refused(tmp_path, "report", tmp_path / "t.gpx", words="t.gpx is a track: kickstand join adds it to a ride")
    command.write_cal(tmp_path / "A.cal.json")
    command.refused(
        tmp_path, "report", tmp_path / "A.cal.json", words="is not a log: give the ride, and a calibration with"
    )
    (tmp_path / "any").mkdir()
    command.refused(tmp_path, "report", tmp_path / "any", words="any contains no recording")


def test_export_in_vehicle_axes_needs_no_alignment(tmp_path):
    (tmp_path / "v.vbo").write_text(app_exports.vbo(riding().every(2)))
    result = command.works("import", tmp_path / "v.vbo", "--out", tmp_path / "RIDE.csv")
    assert "x is left, y up, z forward, as far as the logger was mounted so" in result.out
    assert "VBO" in result.out
    (position,) = [taken for taken in api.import_recording(tmp_path / "v.vbo").taken if taken.quantity == "position"]
    assert position.unit == "minutes, west positive"


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_mutated_export_gives_a_log_or_one_line(tmp_path):
    """The result of an import is a readable log or a message of one line, never a traceback or a numpy warning."""
    ride = riding().every(8).every(1, 100)
    exports = [app_exports.racebox(ride), app_exports.vbo(ride), app_exports.aim(ride), app_exports.sensorlog(ride)]
    exports += [app_exports.racechrono(ride), app_exports.sensor_kinetics(ride)["Ride_accm.csv"]]
    random = np.random.default_rng(5)
    tokens = [*b'nan inf 1e308 99999999999999999999 " , ; - 25:61:99'.split(), b"\n", b"\x00", b"\xff\xfe"]
    gyro = app_exports.sensor_kinetics(ride)["Ride_gyrm.csv"]
    ended = {"read": 0, "refused": 0}
    for k in range(60):
        content = exports[k % len(exports)].encode()
        at = int(random.integers(500 if k % 3 else len(content)))
        length = int(random.integers(300))
        cut = [content[:at], content[at:], content[:at] + content[at + length :], content[: at + length] + content[at:]]
        cut += [content[:at] + tokens[int(random.integers(len(tokens)))] + content[at + 2 :]] * 3
        files = {"Ride_gyrm.csv": gyro} if k % len(exports) == 5 else {}
        folder = app_exports.into(tmp_path / str(k), files)
        folder.mkdir(exist_ok=True)
        (folder / "Ride_accm.csv").write_bytes(cut[int(random.integers(len(cut)))])
        try:
            api.write_imported(tmp_path / "R.csv", api.import_recording(folder))
        except api.InputError as error:
            assert "\n" not in str(error).strip()
            ended["refused"] += 1
        else:
            api.read_log(tmp_path / "R.csv")
            ended["read"] += 1
    assert min(ended.values()) > 10


def aligned_export(target, files):
    """Return an export with a calibration beside it."""
    api.write_calibration(
        target.with_name("EXPORT.cal.json"), api.CalibrationFile(vehicle_from_sensor=app_exports.PHONE.T, aligned=True)
    )
    return app_exports.into(target, files)


def test_no_output_destroys_a_file_of_the_export(tmp_path):
    """Commands that read an export must not overwrite its files. test_refusals.py tests the same for `import`."""
    source = aligned_export(tmp_path / "EXPORT", app_exports.phyphox(riding().every(4)))
    given = "export", source, "--to", "csv", "--out", source / "Accelerometer.csv"
    command.refused(tmp_path, *given, words="Accelerometer.csv is also an input")


def test_remarks_of_an_import_are_in_report_and_page(tmp_path):
    """Each notice appears once, although the log is checked both by the import and by the report."""
    source = aligned_export(tmp_path / "EXPORT", app_exports.sensor_kinetics(riding().every(4)))
    result = command.works("report", source, "--json", "--live")
    assert [remark["code"] for remark in json.loads(result.out)["remarks"]].count("import-sign") == 1
    assert result.err.count("is not certain") == 1
    pytest.importorskip("matplotlib")
    pytest.importorskip("plotly")
    command.works("plot", source, "--live", "--out", tmp_path / "plots")
    assert "is not certain" in (tmp_path / "plots" / "EXPORT.html").read_text()


def test_an_export_is_unpacked_once(tmp_path, monkeypatch):
    source = aligned_export(tmp_path / "EXPORT.zip", app_exports.phyphox(riding().every(4)))
    given, read_files = [], importing.read_files
    monkeypatch.setattr(importing, "read_files", lambda path: given.append(path) or read_files(path))
    command.works("report", source, "--json", "--live")
    assert given == [source]
