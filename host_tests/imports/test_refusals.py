"""Recordings that lack a part, contradictions, and mistakes in the options are refused in one line that says what to
do. An uncertain table gives a command line that works as typed."""

import re
import shlex

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.imports.importing import NAMES
from kickstand_tools.replay import replay_engine
from support import command
from support.recordings import app_exports, drawn_tables
from support.recordings.app_exports import riding


@pytest.fixture
def ride():
    return riding().every(8)


def refused(directory, source, words, *more):
    return command.refused(directory, "import", source, "--out", directory / "RIDE.csv", *more, words=words)


# For each missing part of a recording: the writer of the export, the files or the word to remove (with a replacement),
# and the message.
LACKING = {
    "phyphox": (app_exports.phyphox, ["Gyroscope.csv"], "no gyroscope: add it to the experiment"),
    "Sensor Logger, gyro": (app_exports.sensor_logger, ["Gyroscope.csv"], "no Gyroscope.csv: switch the gyroscope on"),
    "Sensor Logger, accelerometer": (
        app_exports.sensor_logger, ["TotalAcceleration.csv", "Accelerometer.csv", "Gravity.csv"],
        "no acceleration: switch Accelerometer and Gravity on",
    ),
    "Sensor Kinetics": (app_exports.sensor_kinetics, ["Ride_gyrm.csv"], "with NAME_accm.csv and NAME_gyrm.csv"),
    "SensorLog": (app_exports.sensorlog, "RotationRate", "no gyroRotation or motionRotationRate in it: log the gyro"),
    "RaceChrono": (app_exports.racechrono, "x_acc", "no x_acc to z_acc and x_rate_of_rotation to z_rate_of_rotation"),
    "RaceBox, gyro": (app_exports.racebox, "GyroZ", "no GyroX to GyroZ: export it from RaceBox's app on the phone"),
    "RaceBox, motorcycle": (app_exports.racebox, "GForceY LeanAngle", "as in its motorcycle mode: export it with"),
    "VBO": (app_exports.vbo, "Y_Accel", "no channel Y_Accel"),
    "AiM": (app_exports.aim, "YawRate", "no channel YawRate: export the accelerometer's and the gyro's three channels"),
    "AiM, unit": (app_exports.aim, "km/h furlongs", "is not known: 'furlongs'"),
}  # fmt: skip


def test_each_app_has_a_test_of_missing_parts():
    untried = [name for name in NAMES if not any(key.startswith(name) for key in LACKING)]
    assert untried == ["Kickstand"], f"add to LACKING above what each but Kickstand says of a missing sensor: {untried}"


@pytest.mark.parametrize("name", LACKING)
def test_a_missing_part_of_a_recording_is_reported(tmp_path, ride, name):
    write, missing, words = LACKING[name]
    export = write(ride)
    if isinstance(export, str):
        word, _, other = str(missing).partition(" ")
        files = {"ride.vbo" if name == "VBO" else "ride.csv": export.replace(word, other or "Other")}
    else:
        files = {file: text for file, text in export.items() if file not in missing}
    refused(tmp_path, app_exports.into(tmp_path / "in.zip", files), words)


def test_sensors_without_common_time_are_refused(tmp_path, ride):
    files = app_exports.sensor_kinetics(ride)
    head, *rows = files["Ride_gyrm.csv"].splitlines()
    rows = [f"{float(row.split(',')[0]) + 600:.4f},{row.partition(',')[2]}" for row in rows]
    files["Ride_gyrm.csv"] = "\n".join([head, *rows])
    refused(tmp_path, app_exports.into(tmp_path / "k", files), "have no time in common: were they recorded together?")


def test_outputs_of_kickstand_without_readings_are_refused(tmp_path, ride):
    log = api.Log(ride.t_s, ride.force_g, ride.rates_dps)
    api.export(api.open_ride(log, api.CalibrationFile(aligned=True)), "vbo", tmp_path / "r.vbo")
    line = refused(tmp_path, tmp_path / "r.vbo", "no channel Y_Accel, Z_Accel, X_Accel, PitchRate")
    assert "take the log that it was made from" in line
    names = ("t_s", *replay_engine.COLUMNS)
    (tmp_path / "LEAN.csv").write_text(app_exports.lines(names, [range(len(names))] * 3))
    refused(tmp_path, tmp_path / "LEAN.csv", "contains a lean but no readings: give the log")


def test_known_units_are_not_asked_for(tmp_path, ride):
    source = app_exports.into(tmp_path / "p.zip", app_exports.phyphox(ride))
    refused(tmp_path, source, "is phyphox's, whose units are known: leave --units out", "--units", "a=g")
    refused(tmp_path, source, "holds 6 files: give --columns with one, such as", "--columns", "t=a")
    command.refused(tmp_path, "import", source, "--out", tmp_path / "no" / "RIDE.csv", words="make it first")


def test_a_speed_of_unknown_unit_is_left_out_unless_given(tmp_path, ride):
    ride.lat_deg = ride.lon_deg = np.zeros(len(ride.t_s))
    (tmp_path / "r.csv").write_text(app_exports.racebox(ride))
    source, out = tmp_path / "r.csv", tmp_path / "RIDE.csv"
    warning = command.works("import", source, "--out", out).err
    assert "Speed has no unit, and the positions do not show it, so the speed is left out" in warning
    assert "speed_mps" not in out.read_text()[:200]
    assert "Speed" not in command.works("import", source, "--out", out, "--units", "speed=km/h").err
    assert np.nanmax(api.read_log(out).speed_mps) == pytest.approx(14.0, abs=0.05)
    command.refused(tmp_path, "import", source, "--out", out, "--units", "speed=furlongs", words="km/h")


COLUMNS = ",".join(f"{key}={name}" for key, name in app_exports.ANY_NAMES.items())
MISTAKES = {
    "no such column": (COLUMNS.replace("Acc_Y", "Acc_W"), "a=g,g=deg/s", "no column 'Acc_W' for ay: its columns are"),
    "one missing": (COLUMNS.replace("gz=Gyro_Z,", ""), "a=g,g=deg/s", "--columns: gz is missing"),
    "one column for two": (COLUMNS.replace("Acc_Y", "Acc_X"), "a=g,g=deg/s", "'Acc_X' is given for ax and for ay"),
    "strange key": (COLUMNS + ",roll=Note", "a=g", "--columns: 'roll' is not one of t, ax"),
    "strange unit": (COLUMNS, "a=stone,g=deg/s", "unit 'stone' is not known: write one of g, m/s2, mg"),
    "no unit": (COLUMNS, "a=m/s2", "not known of Gyro_X, Gyro_Y, Gyro_Z: add --units g=deg/s (g is one of deg/s, rad"),
    "no pair": (COLUMNS, "m/s2", "--units: 'm/s2' is not NAME=VALUE; separate the pairs with commas"),
    "twice": ("t=Millis,t=Millis", "a=g", "--columns: 't' is given twice"),
    "no time in it": (COLUMNS.replace("t=Millis", "t=Note"), "a=g,g=deg/s,speed=m/s", "no time"),
    "m/s2 as g": (COLUMNS, "a=g,g=rad/s,speed=km/h", "where gravity makes it 1: they look like m/s2"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_in_the_options_is_refused(tmp_path, name):
    columns, units, words = MISTAKES[name]
    lines = app_exports.any_table(riding().every(8))
    (tmp_path / "log.csv").write_text(lines)
    refused(tmp_path, tmp_path / "log.csv", words, "--columns", columns, "--units", units)


def hand_table(names, force=1.0, rates=1.0):
    t_s, force_g, rates_dps = drawn_tables.motion("hand", 50.0, np.random.default_rng(5))
    rows = np.column_stack((t_s, force * force_g, rates * rates_dps)).tolist()
    return app_exports.lines(names, rows)


@pytest.mark.parametrize(("unit", "words"), [("rad/s", "57[.0-9]* times too far"), ("mdeg/s", "1e\\+03 times too li")])
def test_a_unit_that_does_not_turn_gravity_is_refused(tmp_path, unit, words):
    names = ["t", "ax", "ay", "az", "gx", "gy", "gz"]
    (tmp_path / "log.csv").write_text(hand_table(names))
    with pytest.raises(api.InputError, match=f"in this unit the rates turn gravity {words}"):
        api.import_recording(tmp_path / "log.csv", dict(zip(names, names)), {"t": "s", "a": "g", "g": unit})


def test_a_bias_that_would_turn_gravity_round_is_refused(tmp_path):
    head = "t,ax,ay,az,gx,gy,gz"
    (tmp_path / "log.csv").write_text("\n".join([head, *(f"{20 * k},0,0,1,-2.5,1,1" for k in range(300))]) + "\n")
    columns = ",".join(f"{name}={name}" for name in head.split(","))
    words = "keeps its direction while the rates, in this unit, turn"
    refused(tmp_path, tmp_path / "log.csv", words, "--columns", columns, "--units", "t=ms,a=g,g=rad/s")


@pytest.mark.parametrize("name", ["my log.csv", "it's.csv"])
def test_an_uncertain_table_gives_a_command_line_that_works(tmp_path, monkeypatch, name):
    """At rest nothing shows the unit of the rates for certain. The proposed line works without a change."""
    monkeypatch.chdir(tmp_path)
    lines = app_exports.any_table(riding().every(4)).split("\n")[:120]
    lines[0] = lines[0].replace("Acc_Y", '"Acc, Y"')
    (tmp_path / name).write_text("\n".join(lines) + "\n")
    line = command.refused(tmp_path, "import", name, "--out", "R.csv", words="not a file of an app that is known")
    assert "its columns are Millis, Acc_X" in line and "a: gravity at rest is 9.807 long; g: its noise at rest" in line
    words = shlex.split(line.partition("type: kickstand ")[2])
    assert words[:4] == ["import", name, "--out", "RIDE.csv"]
    assert "written: RIDE.csv, 119 samples in 2.4 s, 50 per second" in command.works(*words).out
    assert api.read_log("RIDE.csv").accel_g[0] == pytest.approx(riding().phone_g[0], abs=1e-4)


TYPED = {  # names of the columns, factors of the time, the forces and the rates, and words of the refusal
    "exchanged names": ("t,rx,ry,rz,ax,ay,az", 1.0, 1.0, 1.0, "so these columns are the accelerometer's"),
    "3000 rows per second": ("t,ax,ay,az,gx,gy,gz", 1.0 / 60.0, 1.0, 1.0, "samples per second, which is doubtful"),
    "a speed without a unit": ("t,ax,ay,az,gx,gy,gz,speed", 1.0, 1.0, 1.0, "its noise at rest"),
    "names twice": ("t,x,y,z,x,y,z", 1.0, 1.0, 1.0, "its noise at rest"),
}


@pytest.mark.parametrize("name", TYPED)
def test_a_doubtful_table_is_refused_with_a_line_that_works(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    head, time, force, rates, words = TYPED[name]
    t_s, force_g, rates_dps = drawn_tables.motion(
        "rest" if "noise" in words else "hand", 50.0, np.random.default_rng(5)
    )
    columns = np.column_stack((t_s * time, force_g * force, rates_dps * rates))
    if name == "exchanged names":
        columns = np.column_stack((columns[:, 0], force_g, rates_dps))
    if "speed" in head:
        columns = np.column_stack((columns, 20.0 + t_s))
    rows = [",".join(f"{value:.6f}" for value in row) for row in columns.tolist()]
    (tmp_path / "log.csv").write_text("\n".join([head, *rows]) + "\n")
    line = command.refused(tmp_path, "import", "log.csv", "--out", "R.csv", words=words)
    typed = shlex.split(line.partition("type: kickstand ")[2])
    command.works(*typed)
    log = api.read_log("RIDE.csv")
    assert log.accel_g == pytest.approx(force_g, abs=1e-4) and log.gyro_dps == pytest.approx(rates_dps, abs=1e-3)
    assert log.t_s[-1] == pytest.approx(t_s[-1], abs=0.01)


@pytest.mark.parametrize(
    ("lat", "lon", "words"),
    [
        (lambda north, east: east, lambda north, east: north, "latitude and longitude are exchanged"),
        (lambda north, east: 100.0 * north, lambda north, east: 100.0 * east, "they are no degrees"),
        (lambda north, east: north / 57.0, lambda north, east: east / 57.0, "do not move as fast as the speed says"),
        (lambda north, east: north, lambda north, east: east, ""),
    ],
)
def test_wrong_positions_are_left_out(tmp_path, lat, lon, words):
    """They do not turn the sign of the accelerations. The speed shows an exchange, because a degree of longitude is
    shorter."""
    ride = riding().every(4)
    north, east = ride.lat_deg, ride.lon_deg
    columns = (ride.t_s, ride.phone_g, np.degrees(ride.phone_rad), ride.speed_mps, lat(north, east), lon(north, east))
    names = "t,ax (g),ay (g),az (g),gx (deg/s),gy (deg/s),gz (deg/s),speed (m/s),lat,lon".split(",")
    (tmp_path / "log.csv").write_text(app_exports.lines(names, np.column_stack(columns).tolist()))
    imported = api.import_recording(tmp_path / "log.csv")
    assert imported.log.accel_g == pytest.approx(ride.phone_g, abs=1e-4)
    assert bool(np.isfinite(imported.log.lat_deg).any()) is not bool(words)
    notices = [notice.line() for notice in imported.notices if notice.code == "import-positions"]
    assert len(notices) == bool(words) and words in "".join(notices)


def test_south_and_west_have_their_letters(tmp_path):
    """Without them the track would be a mirror image, and the sign of the accelerations would be turned."""
    ride = riding().every(4)
    columns = np.column_stack((ride.t_s, ride.phone_g, np.degrees(ride.phone_rad), ride.lat_deg, 20.0 - ride.lon_deg))
    rows = [f"{','.join(map(str, row))},W" for row in columns.tolist()]
    head = "t,ax (g),ay (g),az (g),gx (deg/s),gy (deg/s),gz (deg/s),lat,lon,E/W"
    (tmp_path / "log.csv").write_text("\n".join([head, *rows]))
    imported = api.import_recording(tmp_path / "log.csv")
    assert imported.log.accel_g == pytest.approx(ride.phone_g, abs=1e-4)
    assert np.nanmax(imported.log.lon_deg) < 0.0 and not imported.notices


@pytest.mark.parametrize("unit", ["g", "m/s^2"])
def test_a_table_with_names_like_phyphoxs_is_not_phyphoxs(tmp_path, unit):
    """So the sign of the accelerations is not certain."""
    axes = [f"Accelerometer {axis} ({unit})" for axis in "XYZ"] + [f"Gyroscope {axis} (rad/s)" for axis in "XYZ"]
    size = -1.0 if unit == "g" else -9.80665
    (tmp_path / "log.csv").write_text(hand_table(["Time (s)", *axes], size, np.pi / 180.0))
    imported = api.import_recording(tmp_path / "log.csv")
    assert imported.app == "a table" and "import-sign" in [notice.code for notice in imported.notices]


def random_table(seed, path):
    """Return the result of importing a random table: "right", "refused", or the error."""
    drawn = drawn_tables.draw(seed)
    path.write_text(drawn.text)
    try:
        imported = api.import_recording(path)
    except api.InputError as error:
        line = re.search(r"kickstand (import .*)", str(error))
        if line is None or "?" in line[1]:
            return "refused"
        words = shlex.split(line[1])
        columns, units = (words[words.index(option) + 1].split(",") for option in ("--columns", "--units"))
        try:
            imported = api.import_recording(
                path, dict(pair.split("=", 1) for pair in columns), dict(pair.split("=", 1) for pair in units)
            )
        except api.InputError:
            return "refused"
    log = imported.log
    if abs(log.t_s[-1] - drawn.time_s[-1]) > 0.02 * drawn.time_s[-1] + 0.05:
        return f"{drawn.said}: {log.t_s[-1]} s"
    for values, truth, limit in ((log.accel_g, drawn.force_g, 0.03), (log.gyro_dps, drawn.rates_dps, 0.7)):
        expected = np.column_stack([np.interp(log.t_s, drawn.time_s, column) for column in truth.T])
        if np.mean(np.abs(values - expected) < limit) < 0.9:
            return f"{drawn.said}: {values[5]} in place of {expected[5]}"
    return "right"


@pytest.mark.parametrize("seeds", [range(1, 20, 2), pytest.param(range(21, 400, 2), marks=pytest.mark.long)])
def test_no_random_table_is_imported_wrongly(tmp_path, seeds):
    """The tables with odd seeds were not used for development."""
    results = [random_table(seed, tmp_path / "log.csv") for seed in seeds]
    assert [result for result in results if result not in ("right", "refused")] == []
    assert results.count("right") >= 0.99 * len(seeds)
