"""Tests the exact content of each export format: channel, unit, sign and digits of each column.

Columns and signs follow the descriptions of the formats, which are named in the modules. The signs are also tested with
a sensor whose axes are the vehicle's axes.
"""

import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.analysis.channels import Channels
from kickstand_tools.analysis.export import export_columns, export_racechrono, export_vbo
from kickstand_tools.analysis.export.export import RowsShare, export
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs import reader
from kickstand_tools.logs.log import Log
from support import command
from support.recordings import analysis_rides

EVENING_S = 1_700_000_000.0  # Unix time of 22:13:20 UTC on 14/11/2023
VALUES = {
    "lean_deg": -12.34567,
    "lean_formula_deg": 23.4567,
    "left_g": 0.123456,
    "up_g": 0.987654,
    "forward_g": -0.234567,
    "lateral_g": 0.345678,
    "pitch_rate_dps": 1.23456,
    "yaw_rate_dps": -2.34567,
    "roll_rate_dps": 3.45678,
    "speed_mps": 10.5,
    "temp_c": 21.456,
    "shown_g": 7.0,
    "lean_sigma_deg": 0.98765,
    "resting": 5.0,
    "rolling": 6.0,
    "sure": 8.0,
    "doubtful": 9.0,
    "lat_deg": 52.123456789,
    "lon_deg": -0.5,
    "utc_s": 1_700_000_123.4567,
}
NOWHERE = dict.fromkeys(("lat_deg", "lon_deg", "utc_s"), np.nan)


def block(*times_s: float, **changed: float) -> Channels:
    """Return samples with VALUES in every channel, except the changed channels."""
    columns = {"t_s": np.array(times_s)}
    columns |= {name: np.full(len(times_s), value) for name, value in (VALUES | changed).items()}
    return Channels(*(columns[field.name] for field in fields(Channels)))


def written(write, path: Path, *blocks: Channels, start_s: float = EVENING_S) -> str:
    write(path, iter(blocks), start_s)
    return path.read_bytes().decode()


def expected(name: str) -> str:
    return (Path(__file__).parent / "expected" / name).read_text(encoding="utf-8")


def test_csv_to_the_letter(tmp_path):
    none = block(0.5, 1.25, speed_mps=np.nan, temp_c=np.nan, lean_formula_deg=np.nan, **NOWHERE)
    text = written(export_columns.write_csv, tmp_path / "x.csv", block(0.25), none, start_s=100.0)
    assert text == expected("ride.csv")


def test_racechrono_to_the_letter(tmp_path):
    """The time is the elapsed time since the first sample. The axis z points forward. Speed and position are written
    only in rows where they are new."""
    none = block(0.5, speed_mps=np.nan, **NOWHERE)
    text = written(export_racechrono.write, tmp_path / "x", block(0.25), none)
    assert text == expected("ride.racechrono.csv")


def test_vbo_to_the_letter(tmp_path):
    """In a VBO file a speed of 10.5 m/s is written as 37.8 km/h. The time of day starts again at midnight. Longitudes
    are in minutes, positive to the west."""
    evening = EVENING_S + 6400.0 - 0.25  # the ride begins in the last second before midnight
    moved = block(0.25, 61.5, 3661.75)
    moved.lon_deg[0] += 1e-5  # a move by 0.68 m to the east
    moved.lat_deg[2] = moved.lon_deg[2] = np.nan
    text = written(export_vbo.write, tmp_path / "x", block(0.0), moved, start_s=evening)
    assert text == expected("ride.vbo").replace("\n", "\r\n")


def test_vbo_without_lean_speed_and_temperature(tmp_path):
    bare = block(0.0, lean_deg=np.nan, speed_mps=np.nan, temp_c=np.nan, **NOWHERE)
    lines = written(export_vbo.write, tmp_path / "x", bare).split("\r\n")
    assert lines[12:14] == ["yaw-rate", "roll-rate"]
    assert lines[16:18] == ["deg/s", "deg/s"]
    assert lines[20:23] == [
        "Kickstand: satellites 4 stands for a position, 0 for none",
        "Log Rate (Hz) : at most 100.00",
        "no speed in the log: velocity 0 stands for none",
    ]
    row = "000 221320.00 +00000.000000 +00000.000000 000.000 000.00 +00000.00 -00.235 +00.346"
    assert lines[-2] == row + " -2.345670E+00 +3.456780E+00"


def test_vbo_has_a_channel_with_gaps(tmp_path):
    """A channel that has gaps in the first block is still written, with 0 in the gaps."""
    first = block(0.0, 0.1, speed_mps=np.nan)
    first.temp_c[1] = np.nan
    first.speed_mps[0] = 10.0
    lines = written(export_vbo.write, tmp_path / "x", first).split("\r\n")
    assert "temperature" in lines
    assert not any(line.startswith("no speed") for line in lines)
    assert lines[-3].split(" ")[4] == "036.000"
    assert lines[-2].endswith(" +0.000000E+00")


def test_vbo_keeps_the_heading_at_standstill(tmp_path):
    """The vehicle goes north and then east, and then stands. At standstill the position moves 0.8 mm north, like the
    noise of a receiver. The heading must not follow this small movement of the position."""
    ridden, stood = block(0.0, 1.0, 2.0), block(3.0, 4.0)
    ridden.lat_deg[1:] += 1e-5
    ridden.lon_deg[2] += 1e-5
    stood.lat_deg[:], stood.lon_deg[:] = ridden.lat_deg[2], ridden.lon_deg[2]
    stood.lat_deg[1] += 0.8e-3 / 111_195.0
    rows = written(export_vbo.write, tmp_path / "x", ridden, stood).split("\r\n")[-6:-1]
    assert [row.split(" ")[5] for row in rows] == ["000.00", "000.00", "090.00", "090.00", "090.00"]


RATE_HZ = 100.0
SQUARE = CalibrationFile(aligned=True, vehicle="car")  # the sensor's axes are left, up, forward like the vehicle's


def squarely(seconds: float = 2.0, start_s: float = 0.0, speed_mps=()) -> Log:
    """Simulate braking in a left turn, with a different reading on each axis."""
    n = round(seconds * RATE_HZ)
    force, rate = np.tile([0.2, 1.0, -0.4], (n, 1)), np.tile([5.0, 7.0, 9.0], (n, 1))
    return Log(start_s + np.arange(n) / RATE_HZ, force, rate, np.asarray(speed_mps, dtype=float))


def test_a_left_turn_under_braking_has_the_signs_of_each_format(tmp_path):
    """The rates about left, up and forward have the gyro's sign. If the nose rises, the rate about left is negative."""
    ride = open_ride(squarely(), SQUARE)
    out = tmp_path / "out"
    export(ride, "racechrono", out)
    row = dict(zip([name for name, *_ in export_racechrono.COLUMNS], out.read_text().split("\n")[-2].split(",")))
    found = {name: float(row[name]) for name in row if "acc" in name or "rate" in name}
    expected = {"lateral_acc": 0.2, "longitudinal_acc": -0.4, "x_acc": 0.2, "y_acc": 1.0, "z_acc": -0.4}
    expected |= {f"{axis}_rate_of_rotation": dps for axis, dps in zip("xyz", (5.0, 7.0, 9.0))}
    assert found == pytest.approx(expected, abs=1e-3)
    assert row["lean_angle"] == ""  # a car has no lean to export
    export(ride, "vbo", out)
    cells = [float(cell) for cell in out.read_text().split("\n")[-2].split(" ")]
    assert cells[7:9] == [-0.4, 0.2]  # long accel is positive forward, lat accel is positive in a left turn
    assert cells[9:] == pytest.approx([7.0, 9.0])  # yaw is positive in a left turn, roll is positive to the right
    export(ride, "csv", out)
    row = dict(zip(export_columns.COLUMNS, out.read_text().split("\n")[-2].split(",")))
    assert [float(row[f"{name}_rate_dps"]) for name in ("pitch", "yaw", "roll")] == pytest.approx([-5.0, 7.0, 9.0])


def test_exported_lean_is_smoothed_unless_live(tmp_path):
    ride = analysis_rides.short(tmp_path, rate_hz=50)
    for more, other in (((), "smooth"), (("--live",), "replay")):
        command.works("export", ride, "--to", "csv", *more, "--out", tmp_path / "export.csv")
        command.works(other, ride, "--out", tmp_path / "lean.csv")
        exported, expected = (analysis_rides.table(tmp_path / name) for name in ("export.csv", "lean.csv"))
        assert exported["lean_deg"] == pytest.approx(expected["lean_deg"], abs=1e-3), other


def first_time(path: Path, form: str) -> float:
    """Return the Unix time of the first row or, for vbo, its time of day."""
    lines = path.read_text().split("\n")
    if form == "racechrono":
        return float(lines[lines.index("") + 4].partition(",")[0])
    clock = lines[lines.index("[data]") + 1].split(" ")[1]
    return int(clock[:2]) * 3600 + int(clock[2:4]) * 60 + float(clock[4:])


@pytest.mark.parametrize("form", ["racechrono", "vbo"])
@pytest.mark.parametrize(
    ("start_s", "now_s", "first_s"),
    [
        (1e8, EVENING_S, 1e8),  # a time after 3 March 1973 is a Unix time
        # An earlier time counts from power-on, here three years and two months ago
        (1e8 - 1.0, EVENING_S, EVENING_S - 2.0),
        (0.0, EVENING_S + 0.985, EVENING_S - 2.0),  # the log begins 1.99 s before now, rounded to whole seconds
        (0.0, 1.0, 0.0),  # if the computer's clock was never set, no time before 1970 is written
    ],
)
def test_log_in_memory_without_a_clock_ends_now(tmp_path, monkeypatch, form, start_s, now_s, first_s):
    monkeypatch.setattr(time, "time", lambda: now_s)
    export(open_ride(squarely(start_s=start_s), SQUARE), form, tmp_path / "out")
    assert first_time(tmp_path / "out", form) == pytest.approx(first_s % (86400 if form == "vbo" else 1e12), abs=0.006)


def test_every_row_of_a_vbo_has_a_speed(tmp_path):
    """The log has a speed at 0.5 s and at 1.5 s. Between 0.5 s and 1.5 s the speed is interpolated."""
    speed = np.full(200, np.nan)
    speed[[50, 150]] = 10.0, 20.0
    ride = open_ride(squarely(speed_mps=speed), SQUARE)
    assert export(ride, "vbo", tmp_path / "vbo") == 200
    lines = (tmp_path / "vbo").read_text().split("\n")
    kmh = [float(line.split(" ")[4]) for line in lines[lines.index("[data]") + 1 : -1]]
    assert kmh == pytest.approx(np.interp(np.arange(200), [50, 150], [36.0, 72.0]), abs=2e-3)
    export(ride, "racechrono", tmp_path / "racechrono")
    cells = [line.split(",")[6] for line in (tmp_path / "racechrono").read_text().split("\n")[12:-1]]
    assert [(k, cell) for k, cell in enumerate(cells) if cell] == [(50, "10.000"), (150, "20.000")]


@pytest.mark.parametrize(("form", "rows"), [("csv", 400), ("parquet", 400), ("racechrono", 400), ("vbo", 201)])
def test_vbo_has_at_most_100_rows_per_second(tmp_path, form, rows):
    """The returned number of rows is right, however the log is divided into blocks."""
    if form == "parquet":
        pytest.importorskip("pyarrow")
    n = 400
    log = Log(np.arange(n) / 200.0, np.tile([0.0, 1.0, 0.0], (n, 1)), np.zeros((n, 3)))
    for size in 60_000, 150:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(reader, "BLOCK_SAMPLES", size)
            assert export(open_ride(log, SQUARE), form, tmp_path / "out") == rows


@pytest.mark.parametrize("start_s", [1e8, 1e8 + 0.0043, 1e8 + 0.00065])
@pytest.mark.parametrize(("form", "step_s", "columns"), [("racechrono", 0.001, (0, 3)), ("vbo", 0.01, (1,))])
def test_no_time_is_written_twice(tmp_path, form, step_s, columns, start_s):
    """Some samples are closer together than the smallest time step of the format. The samples' times are just before or
    after a time step, or in the middle between two steps. The returned number of rows still includes every sample."""
    t_s = step_s * np.array([0.0, 0.96, 1.04, 2.5, 3.5, 4.5, 5.49, 5.51, 6.4, 7.0, 8.0, 9.96, 10.04, 10.5])
    log = Log(t_s, np.tile([0.0, 1.0, 0.0], (len(t_s), 1)), np.zeros((len(t_s), 3)), start_s=start_s)
    notices = []
    count = export(open_ride(log, SQUARE), form, tmp_path / "out", notices=notices)
    lines = (tmp_path / "out").read_text().strip().split("\n")
    rows = [line.replace(" ", ",").split(",") for line in lines[-count:]]
    for column in columns:
        assert np.all(np.diff([float(row[column]) for row in rows]) > 0.0)
    assert [notice for notice in notices if notice.code == "rows-share"] == [RowsShare(len(t_s), count, step_s)]


def test_progress_and_notices_are_passed_on(tmp_path):
    """The readings of the ride are frozen for two seconds, which gives a notice."""
    n = 3000
    force, rate = np.tile([0.0, 1.0, 0.0], (n, 1)), np.zeros((n, 3))
    rate[200::2] += 1e-4
    done, notices = [], []
    ride = open_ride(Log(np.arange(n) / 100.0, force, rate), SQUARE)
    export(ride, "csv", tmp_path / "out", lambda *both: done.append(both), notices)
    assert done == [(n, n)]
    assert [notice.code for notice in notices] == ["frozen-readings"]


def test_parquet_has_the_same_columns_with_their_units(tmp_path):
    pytest.importorskip("pyarrow")
    from pyarrow.parquet import ParquetFile

    export_columns.write_parquet(tmp_path / "x", iter([block(0.25), block(0.5, 0.75, speed_mps=np.nan)]), EVENING_S)
    file = ParquetFile(tmp_path / "x")
    assert file.num_row_groups == 2
    units = "s deg deg g g g g deg/s deg/s deg/s m/s Cel g deg deg deg s".split()
    assert {field.name: field.metadata[b"unit"].decode() for field in file.schema_arrow} == dict(
        zip(export_columns.COLUMNS, units, strict=True)
    )
    assert [str(field.type) for field in file.schema_arrow] == ["double", *["float"] * 13, *["double"] * 3]
    assert file.schema_arrow.metadata[b"axes"] == b"left, up, forward; lean > 0 to the right"
    table = file.read()
    assert table["t_s"].to_pylist() == [EVENING_S + 0.25, EVENING_S + 0.5, EVENING_S + 0.75]
    assert np.isnan(table["speed_mps"].to_pylist()[1:]).all()
    for name in list(export_columns.COLUMNS)[1:]:
        assert table[name][0].as_py() == pytest.approx(VALUES[name], rel=1e-6), name
