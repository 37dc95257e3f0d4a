"""Tests tables from any source, with various separators, decimal marks, character sets, units and times. Also tests the
messages about unknown files."""

import shlex

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.imports import findings, layout, units
from kickstand_tools.imports.files import RecordingFile
from kickstand_tools.logs import csv_reader
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import riding

NAMES = app_exports.ANY_NAMES
UNITS = {"a": "m/s2", "g": "rad/s", "speed": "km/h"}
COLUMNS = ",".join(f"{key}={name}" for key, name in NAMES.items())
DRESSES = {
    "commas": (",", False, "utf-8", "\n"),
    "semicolons": (";", False, "utf-8", "\r\n"),
    "semicolons and decimal commas": (";", True, "utf-8", "\n"),
    "tabs and decimal commas": ("\t", True, "utf-8", "\n"),
    "byte order mark": (",", False, "utf-8-sig", "\n"),
    "UTF-16": (";", True, "utf-16", "\r\n"),
    "UTF-16 without its mark": (",", False, "utf-16-le", "\n"),
    "carriage returns": (",", False, "utf-8", "\r"),
}


@pytest.mark.parametrize("name", DRESSES)
def test_table_in_another_format_is_the_same_ride(tmp_path, name):
    separator, comma, encoding, end = DRESSES[name]
    ride = riding().every(4)
    text = app_exports.any_table(ride, separator, comma).replace("\n", end)
    (tmp_path / "log.csv").write_bytes(text.encode(encoding))
    found = api.import_recording(tmp_path / "log.csv", NAMES, UNITS)
    assert np.allclose(found.log.accel_g, ride.phone_g, atol=1e-5)
    assert np.allclose(found.log.gyro_dps, np.degrees(ride.phone_rad), atol=1e-4)
    there = np.isfinite(found.log.speed_mps)
    assert np.count_nonzero(there) == 14
    assert np.allclose(found.log.speed_mps[there], ride.speed_mps[there], atol=1e-3)


def test_lines_before_the_names_and_columns_by_number(tmp_path):
    ride = riding().every(4)
    (tmp_path / "log.csv").write_text("Logger 3000\n\nMade,by nobody\n" + app_exports.any_table(ride))
    by_number = {key: f"#{k + 1}" for k, key in enumerate(NAMES)}
    for names in NAMES, by_number:
        found = api.import_recording(tmp_path / "log.csv", names, UNITS)
        assert np.allclose(found.log.accel_g, ride.phone_g, atol=1e-5)


def test_units_in_brackets_need_no_others(tmp_path):
    ride = riding().every(4)
    head = ["Time [ms]", "X (m/s^2)", "Y (m/s²)", "Z (m/s2)", "P (°/s)", "Q (dps)", "R (deg/s)", "v (km/h)"]
    columns = (1000 * ride.t_s, app_exports.G * ride.phone_g, np.degrees(ride.phone_rad), 3.6 * ride.speed_mps)
    (tmp_path / "log.csv").write_text(app_exports.lines(head, np.column_stack(columns).tolist()), encoding="utf-8")
    names = dict(zip(NAMES, ("Time", "X", "Y", "Z", "P", "Q", "R", "v")))
    found = api.import_recording(tmp_path / "log.csv", names)
    assert np.allclose(found.log.accel_g, ride.phone_g, atol=1e-5)
    assert np.allclose(found.log.gyro_dps, np.degrees(ride.phone_rad), atol=1e-4)
    assert [taken.unit for taken in found.taken] == ["ms", "m/s^2, m/s², m/s2", "°/s, dps, deg/s", "km/h"]


def test_minus_reverses_all_axes_or_one(tmp_path):
    ride = riding().every(4)
    (tmp_path / "log.csv").write_text(app_exports.any_table(ride))
    found = api.import_recording(tmp_path / "log.csv", NAMES, UNITS | {"a": "-m/s2", "gz": "-rad/s"})
    assert np.allclose(found.log.accel_g, -ride.phone_g, atol=1e-5)
    assert np.allclose(found.log.gyro_dps, np.degrees(ride.phone_rad) * [1.0, 1.0, -1.0], atol=1e-4)
    assert [taken.sign for taken in found.taken] == ["", "turned", "turned in part", ""]


def test_speeds_and_spellings_of_units():
    speeds = {"m/s": 1.0, "km/h": 3.6, "kph": 3.6, "mph": 2.236936, "knots": 1.943844, "kt": 1.943844}
    for unit, size in speeds.items():
        assert size * units.factor(unit, units.SPEEDS, "speed") == pytest.approx(1.0, abs=1e-6), unit
    same = {"m/s^2": "m/s2", "m s-2": "m/s2", "G": "g", "°/s": "deg/s", "KM/H": "km/h", "μs": "us"}
    assert {text: units.unit(text) for text in same} == same


def test_positions_in_minutes(tmp_path):
    ride = riding().every(4)
    columns = (ride.t_s, ride.phone_g, np.degrees(ride.phone_rad), 60 * ride.lat_deg, -60 * ride.lon_deg)
    (tmp_path / "log.csv").write_text(app_exports.lines(list("tabcpqruv"), np.column_stack(columns).tolist()))
    keys: list[str] = ["t", "ax", "ay", "az", "gx", "gy", "gz", "lat", "lon"]
    names = dict(zip(keys, "tabcpqruv"))
    found = api.import_recording(tmp_path / "log.csv", names, {"a": "g", "g": "deg/s", "lat": "min", "lon": "-min"})
    assert np.nanmin(found.log.lat_deg) == pytest.approx(ride.lat_deg.min(), abs=1e-5)
    assert np.nanmin(found.log.lon_deg) == pytest.approx(ride.lon_deg.min(), abs=1e-5)


START_NS = 1_715_938_200_250_000_000
TIMES = {
    "s": [f"{0.01 * k:.2f}" for k in range(9)],
    "ms": [str(10 * k) for k in range(9)],
    "us": [str(10_000 * k) for k in range(9)],
    "ns": [str(10_000_000 * k) for k in range(9)],
    "s since 1970": [f"{1_715_938_200.25 + 0.01 * k:.2f}" for k in range(9)],
    "ms since 1970": [str(START_NS // 10**6 + 10 * k) for k in range(9)],
    "us since 1970": [str(START_NS // 1000 + 10_000 * k) for k in range(9)],
    "ns since 1970": [str(START_NS + 10_000_000 * k) for k in range(9)],
    "UTC": [f"2024-05-17T09:30:00.{25 + k}Z" for k in range(9)],
    "a zone": [f"2024-05-17 11:30:00.{25 + k}0 +0200" for k in range(9)],
    "no zone": [f"2024-05-17 09:30:00.{25 + k}" for k in range(9)],
    "a clock": [f"23:59:59.{96 + k}" if k < 4 else f"00:00:00.0{k - 4}" for k in range(9)],
    "minutes": [f"12:00.0{k}" for k in range(9)],
}


def column(texts):
    """Return the column that the reader makes of these cells."""
    return csv_reader.columns_of([[text] for text in texts], 1)[0]


@pytest.mark.parametrize("name", TIMES)
def test_times_of_any_kind_without_a_unit(name):
    found = units.times_ns(column(TIMES[name]))
    # A double rounds times in ns since 1970 by some hundred ns
    assert np.allclose(np.diff(found), 10_000_000, atol=600)
    if "1970" in name or "zone" in name or name == "UTC":
        assert found[0] == pytest.approx(START_NS, abs=600)


def test_slow_times_in_ms_are_not_read_as_seconds():
    """The cases have 10 to 400 samples per second, with times in ms, s or us."""
    for step, unit in ((100, 1e6), (40, 1e6), (2.5, 1e6), (0.1, 1e9), (0.0025, 1e9), (100_000, 1e3), (2500, 1e3)):
        found = units.times_ns(np.array([step * k for k in range(20)]))
        assert np.allclose(np.diff(found), step * unit), (step, unit)


def test_cell_without_a_time_is_marked():
    found = units.times_ns(column(["0.0", "0.01", "", "x", "1e300", "inf", "0.06"]))
    assert (found == units.NO_TIME).tolist() == [False, False, True, True, True, True, False]


def test_uncertain_table_gives_a_command_line_that_works(tmp_path, monkeypatch):
    """The message proposes a command line, which works without a change."""
    monkeypatch.chdir(tmp_path)
    rest = app_exports.any_table(riding().every(4)).split("\n")[:120]
    (tmp_path / "my log.csv").write_text("\n".join(rest) + "\n")
    line = command.refused(
        tmp_path, "import", "my log.csv", "--out", "R.csv", words="not a file of an app that is known"
    )
    assert "its columns are Millis, Acc_X, Acc_Y, Acc_Z, Gyro_X, Gyro_Y, Gyro_Z, Speed_kmh, Note" in line
    assert "a: gravity at rest is 9.807 long; g: its noise at rest is" in line
    typed = line.partition("type: kickstand ")[2]
    assert typed.startswith("import 'my log.csv' --out RIDE.csv --columns t=Millis,ax=Acc_X,")
    result = command.works(*shlex.split(typed))
    assert "written: RIDE.csv, 119 samples in 2.4 s, 50 per second" in result.out
    assert api.read_log("RIDE.csv").accel_g[0] == pytest.approx(riding().phone_g[0], abs=1e-4)


@pytest.mark.parametrize(
    ("names", "units"),
    [
        ("time,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,speed_mps", "t=ms,a=g,g=deg/s,speed=m/s"),
        ("time,ax,ay,az,gx_rads,gy_rads,gz_rads,speed_kmh", "t=ms,a=g,g=rad/s,speed=km/h"),
        ("t,a_x (m/s^2),a_y,a_z,g_x (deg/s),g_y,g_z,Speed (mph)", "t=ms,a=m/s2,g=deg/s,speed=mph"),
    ],
)
def test_units_in_the_names_are_found(names, units):
    gravity = 9.81 if "m/s" in names.split("speed")[0] and "a_x" in names else 1.0
    rows = "".join(f"{20 * k},0,{gravity},0,0.1,0,0,3\n" for k in range(40))
    sheet = layout.sheet_in(RecordingFile("log.csv", b"", names + "\n" + rows))
    assert sheet is not None
    assert ",".join(f"{key}={unit}" for key, unit in findings.find(sheet).units.items()) == units


def test_missing_columns_of_a_table_are_reported(tmp_path):
    rows = "".join(f"{0.02 * k:.2f},0,1,0,3\n" for k in range(40))
    (tmp_path / "log.csv").write_text("time,ax,ay,az,speed\n" + rows)
    given = "import", tmp_path / "log.csv", "--out", tmp_path / "R.csv"
    command.refused(tmp_path, *given, words="and no gyro found in it: without one there is no lean")
    (tmp_path / "log.csv").write_text("ax,ay,az,gx,gy,gz\n" + "0,1,0,0,0,0.1\n" * 40)
    command.refused(tmp_path, *given, words="no time found in it: write the time of each row, such as millis()")


MISTAKES = {
    "no such column": (
        COLUMNS.replace("Acc_Y", "Acc_W"),
        "a=g,g=deg/s",
        "no column 'Acc_W' for ay: its columns are Millis",
    ),
    "one missing": (COLUMNS.replace("gz=Gyro_Z,", ""), "a=g,g=deg/s", "--columns: gz is missing"),
    "one column for two": (
        COLUMNS.replace("ay=Acc_Y", "ay=Acc_X"),
        "a=g,g=deg/s",
        "'Acc_X' is given for ax and for ay",
    ),
    "strange key": (COLUMNS + ",roll=Note", "a=g", "--columns: 'roll' is not one of t, ax"),
    "strange unit": (COLUMNS, "a=stone,g=deg/s", "unit 'stone' is not known: write one of g, m/s2, mg"),
    "strange unit key": (COLUMNS, "accel=g", "--units: 'accel' is not one of t, a, g"),
    "no unit": (
        COLUMNS,
        "a=m/s2",
        "the unit is not known of Gyro_X, Gyro_Y, Gyro_Z: add --units g=deg/s (g is one of deg/s, rad/s",
    ),
    "no pair": (COLUMNS, "m/s2", "--units: 'm/s2' is not NAME=VALUE; separate the pairs with commas"),
    "twice": ("t=Millis,t=Millis", "a=g", "--columns: 't' is given twice"),
    "no time in it": (COLUMNS.replace("t=Millis", "t=Note"), "a=g,g=deg/s,speed=m/s", "no time"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_in_the_options_is_refused(tmp_path, name):
    columns, given, words = MISTAKES[name]
    (tmp_path / "log.csv").write_text(app_exports.any_table(riding().every(8)))
    out = tmp_path / "R.csv"
    arguments = ["--out", out, "--columns", columns, "--units", given]
    command.refused(tmp_path, "import", tmp_path / "log.csv", *arguments, words=words)


def test_columns_are_whole_numbers_floats_or_text():
    text = '1,0.5,start,7\n2, 1.5 ,,\n\n3,NA,"a, ""b""",9\n4,x,1_0,1\n'
    (whole, floats, words, few), left_out = csv_reader.columns_of_text(text, ",", 4)
    assert whole.dtype.kind == "i" and whole.tolist() == [1, 2, 3, 4]
    assert floats.tolist() == ["0.5", " 1.5 ", "", "x"]
    assert np.allclose(csv_reader.numbers_of(floats), [0.5, 1.5, np.nan, np.nan], equal_nan=True)
    assert words.tolist() == ["start", "", 'a, "b"', "1_0"]
    assert np.all(np.isnan(csv_reader.numbers_of(words)))  # Python would read 1_0 as a number
    assert left_out == 0
    assert few.dtype.kind == "f" and np.isnan(few[1]) and csv_reader.filled(few).tolist() == [True, False, True, True]


def test_a_damaged_row_costs_itself(monkeypatch):
    """The damaged rows have an unclosed quotation mark, too few or too many cells, a line that is too long, or text
    after numbers."""
    monkeypatch.setattr(csv_reader, "ROWS", 2)
    rows = ['"1","2","3"', '"4","5,"6"', "7,8,9,10", "11", f"12,13,{14:0200000d}", "15,stop,16"]
    (first, second, third), left_out = csv_reader.columns_of_text("\n".join(rows), ",", 3)
    assert (first.tolist(), left_out) == ([1, 4, 11, 15], 2)
    assert second.tolist() == ["2", "5", "", "stop"]
    assert np.allclose(csv_reader.numbers_of(third), [3, 6, np.nan, 16], equal_nan=True)
