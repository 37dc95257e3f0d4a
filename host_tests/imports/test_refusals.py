"""Unusable input is refused in one line that says what to do, and no file is written."""

import zipfile

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.imports.importing import NAMES
from kickstand_tools.replay import replay_engine
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import riding


@pytest.fixture
def ride():
    return riding().every(4)


def refused(directory, source, words, *more):
    return command.refused(directory, "import", source, "--out", directory / "RIDE.csv", *more, words=words)


def test_folder_without_tables_is_refused(tmp_path):
    (tmp_path / "in").mkdir()
    refused(
        tmp_path,
        tmp_path / "in",
        "contains no recording: give the file, the folder or the zip that an app",
    )
    (tmp_path / "in" / "a.jpg").write_bytes(b"\xff\xd8")
    refused(tmp_path, tmp_path / "in", "contains no recording")


DAMAGED = [lambda content, keep=keep: content[: int(keep * len(content))] for keep in (0.1, 0.5, 0.99)]
DAMAGED += [lambda content: content[:2000] + bytes(50) + content[2050:]]


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_zip_is_refused(tmp_path, ride, damage):
    source = app_exports.into(tmp_path / "p.zip", app_exports.phyphox(ride))
    source.write_bytes(damage(source.read_bytes()))
    refused(tmp_path, source, "p.zip is damaged or cut short: copy it again")


def test_two_recordings_in_one_folder_are_refused(tmp_path, ride):
    """Three cases are tested: one app in two folders, two apps in one folder, and one app with two names."""
    monday = app_exports.into(tmp_path / "all" / "monday", app_exports.phyphox(ride))
    app_exports.into(tmp_path / "all" / "tuesday", app_exports.phyphox(ride))
    refused(tmp_path, tmp_path / "all", "holds 2 recordings (monday, tuesday): give one of them")
    assert api.import_recording(monday).app == "phyphox"
    folder = app_exports.into(tmp_path / "in", {"a.csv": app_exports.racebox(ride), "b.vbo": app_exports.vbo(ride)})
    refused(tmp_path, folder, "holds 2 recordings (b.vbo, a.csv): give one of them")
    files = app_exports.sensor_kinetics(ride)
    files |= {name.replace("Ride", "Home"): text for name, text in files.items()}
    refused(tmp_path, app_exports.into(tmp_path / "k", files), "holds 2 recordings")


def test_two_zips_in_a_folder_are_refused_and_one_is_read(tmp_path, ride):
    (tmp_path / "in").mkdir()
    app_exports.into(tmp_path / "in" / "a.zip", app_exports.phyphox(ride))
    assert api.import_recording(tmp_path / "in").app == "phyphox"
    app_exports.into(tmp_path / "in" / "b.zip", app_exports.phyphox(ride))
    refused(tmp_path, tmp_path / "in", "holds 2 zip files: give one of them, such as")


def test_other_files_in_the_folder_do_not_matter(tmp_path, ride):
    files = app_exports.phyphox(ride)
    files |= {"notes.txt": "it rained", "__MACOSX/._Gyroscope.csv": "x", "Camera/list.csv": "a,b\n"}
    folder = app_exports.into(tmp_path / "in", files)
    (folder / "strange.csv").write_bytes(bytes(range(256)))
    assert api.import_recording(folder).app == "phyphox"


# For each missing part of a recording: the writer of the export, the files or the word to remove (with a replacement),
# and the message.
LACKING = {
    "phyphox": (app_exports.phyphox, ["Gyroscope.csv"], "no gyroscope: add it to the experiment"),
    "Sensor Logger, gyro": (app_exports.sensor_logger, ["Gyroscope.csv"], "no Gyroscope.csv: switch the gyroscope on"),
    "Sensor Logger, accelerometer": (
        app_exports.sensor_logger,
        ["TotalAcceleration.csv", "Accelerometer.csv", "Gravity.csv"],
        "no acceleration: switch Accelerometer and Gravity on",
    ),
    "Sensor Kinetics": (app_exports.sensor_kinetics, ["Ride_gyrm.csv"], "with NAME_accm.csv and NAME_gyrm.csv"),
    "SensorLog": (app_exports.sensorlog, "RotationRate", "no gyroRotation or motionRotationRate in it: log the gyro"),
    "RaceChrono": (app_exports.racechrono, "x_acc", "no x_acc to z_acc and x_rate_of_rotation to z_rate_of_rotation"),
    "RaceBox, gyro": (app_exports.racebox, "GyroZ", "no GyroX to GyroZ: export it from RaceBox's app on the phone"),
    "RaceBox, motorcycle": (
        app_exports.racebox,
        "GForceY LeanAngle",
        "as in its motorcycle mode: export it with",
    ),
    "VBO": (app_exports.vbo, "Y_Accel", "no channel Y_Accel"),
    "AiM": (app_exports.aim, "YawRate", "no channel YawRate: export the accelerometer's and the gyro's three channels"),
}


def test_each_app_has_a_test_of_missing_parts():
    untried = [name for name in NAMES if not any(key.startswith(name) for key in LACKING)]
    assert untried == ["Kickstand"], f"add to LACKING above what each but Kickstand says of a missing sensor: {untried}"


@pytest.mark.parametrize("name", LACKING)
def test_missing_part_of_a_recording_is_reported(tmp_path, ride, name):
    write, taken, words = LACKING[name]
    written = write(ride)
    if isinstance(written, str):
        word, _, other = str(taken).partition(" ")
        files = {"ride.vbo" if name == "VBO" else "ride.csv": written.replace(word, other or "Other")}
    else:
        files = {file: text for file, text in written.items() if file not in taken}
    refused(tmp_path, app_exports.into(tmp_path / "in.zip", files), words)


def test_sensors_without_common_time_are_refused(tmp_path, ride):
    files = app_exports.sensor_kinetics(ride)
    later = app_exports.sensor_kinetics(ride)["Ride_gyrm.csv"].splitlines()
    rows = [f"{float(row.split(',')[0]) + 600:.4f},{row.partition(',')[2]}" for row in later[1:]]
    files["Ride_gyrm.csv"] = "\n".join([later[0], *rows])
    refused(tmp_path, app_exports.into(tmp_path / "k", files), "have no time in common: were they recorded together?")


def test_replay_output_and_own_vbo_are_refused(tmp_path, ride):
    log = api.Log(ride.t_s, ride.force_g, ride.rates_dps)
    calibration = api.CalibrationFile(aligned=True)
    api.export(api.open_ride(log, calibration), "vbo", tmp_path / "r.vbo")
    words = "no channel Y_Accel, Z_Accel, X_Accel, PitchRate"
    line = refused(tmp_path, tmp_path / "r.vbo", words)
    assert "take the log that it was made from" in line
    names = ("t_s", *replay_engine.COLUMNS)
    (tmp_path / "LEAN.csv").write_text(app_exports.lines(names, [range(len(names))] * 3))
    refused(tmp_path, tmp_path / "LEAN.csv", "contains a lean but no readings: give the log")


def test_known_units_are_not_asked_for(tmp_path, ride):
    source = app_exports.into(tmp_path / "p.zip", app_exports.phyphox(ride))
    refused(tmp_path, source, "is phyphox's, whose units are known: leave --units out", "--units", "a=g")
    refused(tmp_path, source, "holds 6 files: give --columns with one, such as", "--columns", "t=a")


def test_speed_of_unknown_unit_is_left_out_unless_given(tmp_path, ride):
    ride.lat_deg = ride.lon_deg = np.zeros(len(ride.t_s))
    (tmp_path / "r.csv").write_text(app_exports.racebox(ride))
    out = tmp_path / "RIDE.csv"
    result = command.works("import", tmp_path / "r.csv", "--out", out)
    assert "Speed has no unit, and the positions do not show it, so the speed is left out" in result.err
    assert "speed_mps" not in out.read_text()[:200]
    result = command.works("import", tmp_path / "r.csv", "--out", out, "--units", "speed=km/h")
    assert "Speed" not in result.err
    assert np.nanmax(api.read_log(out).speed_mps) == pytest.approx(14.0, abs=0.05)
    command.refused(tmp_path, "import", tmp_path / "r.csv", "--out", out, "--units", "speed=furlongs", words="km/h")


def test_input_is_never_overwritten(tmp_path, ride):
    folder = app_exports.into(tmp_path / "in", app_exports.phyphox(ride))
    out = ["--out", folder / "Gyroscope.csv"]
    command.refused(tmp_path, "import", folder, *out, words="is also an input: give --out another name")
    out = ["--out", tmp_path / "no" / "RIDE.csv"]
    command.refused(tmp_path, "import", folder, *out, words="make it first")


def test_zip_with_a_password_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("a.csv", "time,x\n0,1\n")
    content = bytearray((tmp_path / "a.zip").read_bytes())
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(mark) + place] |= 1  # set the flag of an encrypted entry
    (tmp_path / "a.zip").write_bytes(content)
    refused(tmp_path, tmp_path / "a.zip", "is packed with a password, or in another way: unpack it first")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.zip", None, "there is no such file"),
        ("a.csv.gz", b"\x1f\x8b\x08\x00\x00\x00\x00\x00", "a.csv.gz is damaged or cut short"),
        ("a.png", bytes(range(256)) * 4, "not text: give what an app has exported as CSV or VBO"),
        ("a.csv", b"", "contains no recording"),
        ("b.csv", b"Record,Time,Speed,GForceX,GForceY,GForceZ,GyroX,GyroY,GyroZ\n", "no rows under the names of the"),
        ("mk.py", b"import os\nprint('x')\n", "no table of sensors ('import os')"),
        ("old.xls", b"\xd0\xcf\x11\xe0" + bytes(600), "a table of Excel: export it as CSV"),
    ],
)
def test_file_that_is_not_a_recording_is_refused(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    refused(tmp_path, tmp_path / name, words)
