"""The exact content of each export format: channel, unit, sign and digits of each column.

Columns and signs follow the descriptions of the formats, which are named in the modules.
"""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.analysis import export as exporting
from kickstand_tools.analysis.export import RACECHRONO, export, write_racechrono, write_vbo
from kickstand_tools.analysis.ride import Channels, joined, open_ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log
from support import command

EVENING_S = 1_700_000_000.0  # Unix time of 22:13:20 UTC on 14/11/2023
VALUES = {
    "lean_deg": -12.34567, "lean_formula_deg": 23.4567, "left_g": 0.123456, "up_g": 0.987654, "forward_g": -0.234567,
    "lateral_g": 0.345678, "pitch_rate_dps": 1.23456, "yaw_rate_dps": -2.34567, "roll_rate_dps": 3.45678,
    "speed_mps": 10.5, "temp_c": 21.456, "shown_g": 7.0, "lean_sigma_deg": 0.98765, "resting": 5.0, "rolling": 6.0,
    "sure": 8.0, "doubtful": 9.0, "lat_deg": 52.123456789, "lon_deg": -0.5, "utc_s": 1_700_000_123.4567,
}  # fmt: skip
NOWHERE = dict.fromkeys(("lat_deg", "lon_deg", "utc_s"), np.nan)


def block(*times_s, **changed):
    """Return samples with VALUES in every channel, except the changed channels."""
    columns = {"t_s": np.array(times_s)}
    columns |= {name: np.full(len(times_s), value) for name, value in (VALUES | changed).items()}
    return Channels(*(columns[field.name] for field in fields(Channels)))


def written(write, path, *blocks, start_s=EVENING_S):
    write(path, iter(blocks), start_s)
    return path.read_bytes().decode()


def expected(name):
    return (Path(__file__).parent / "expected" / name).read_text(encoding="utf-8")


def test_csv_to_the_letter(tmp_path):
    empty_block = block(0.5, 1.25, speed_mps=np.nan, temp_c=np.nan, lean_formula_deg=np.nan, **NOWHERE)
    text = written(exporting.write_csv, tmp_path / "x.csv", block(0.25), empty_block, start_s=100.0)
    assert text == expected("ride.csv")


def test_racechrono_to_the_letter(tmp_path):
    """The axis z points forward. Speed and position are written only in rows where they are new."""
    empty_block = block(0.5, speed_mps=np.nan, **NOWHERE)
    assert written(write_racechrono, tmp_path / "x", block(0.25), empty_block) == expected("ride.racechrono.csv")


def test_vbo_to_the_letter(tmp_path):
    """A speed of 10.5 m/s is 37.8 km/h. The time of day starts again at midnight. Longitudes are in minutes, positive
    to the west."""
    moved = block(0.25, 61.5, 3661.75)
    moved.lon_deg[0] += 1e-5  # a move by 0.68 m to the east
    moved.lat_deg[2] = moved.lon_deg[2] = np.nan
    evening = EVENING_S + 6400.0 - 0.25  # the ride begins in the last second before midnight
    text = written(write_vbo, tmp_path / "x", block(0.0), moved, start_s=evening)
    assert text == expected("ride.vbo").replace("\n", "\r\n")


SQUARE = CalibrationFile(aligned=True, vehicle="car")  # the sensor's axes are left, up, forward like the vehicle's


def braking_left(n=200, step_s=0.01, start_s=0.0, speed_mps=()):
    """Simulate braking in a left turn, with a different reading on each axis."""
    force, rate = np.tile([0.2, 1.0, -0.4], (n, 1)), np.tile([5.0, 7.0, 9.0], (n, 1))
    return Log(start_s + np.linspace(0.0, (n - 1) * step_s, n), force, rate, np.asarray(speed_mps, dtype=float))


def table_of(path, form):
    """Return the rows of an exported file as lists of texts."""
    lines = path.read_text().split("\n")
    if form == "vbo":
        return [line.split(" ") for line in lines[lines.index("[data]") + 1 : -1]]
    first = 1 if form == "csv" else lines.index("") + 4
    return [line.split(",") for line in lines[first:-1]]


def test_a_left_turn_under_braking_has_the_signs_of_each_format(tmp_path):
    """The rates about left, up and forward have the gyro's sign. If the nose rises, the rate about left is negative."""
    last = {}
    for form in ("racechrono", "vbo", "csv"):
        export(open_ride(braking_left(), SQUARE), form, tmp_path / form)
        last[form] = table_of(tmp_path / form, form)[-1]
    row = dict(zip([name for name, *_ in RACECHRONO], last["racechrono"]))
    names = ("lateral_acc", "longitudinal_acc", "x_acc", "y_acc", "z_acc", *(f"{a}_rate_of_rotation" for a in "xyz"))
    assert [float(row[name]) for name in names] == pytest.approx([0.2, -0.4, 0.2, 1.0, -0.4, 5.0, 7.0, 9.0], abs=1e-3)
    assert row["lean_angle"] == ""  # a car has no lean to export
    # long accel is positive forward, lat accel and yaw are positive in a left turn, roll is positive to the right
    assert [float(cell) for cell in last["vbo"][7:]] == pytest.approx([-0.4, 0.2, 7.0, 9.0])
    row = dict(zip(exporting.COLUMNS, last["csv"]))
    assert [float(row[f"{name}_rate_dps"]) for name in ("pitch", "yaw", "roll")] == pytest.approx([-5.0, 7.0, 9.0])


def test_every_row_of_a_vbo_has_a_speed(tmp_path):
    """The log has a speed at 0.5 s and at 1.5 s. Between them the speed is interpolated."""
    speed = np.full(200, np.nan)
    speed[[50, 150]] = 10.0, 20.0
    ride = open_ride(braking_left(speed_mps=speed), SQUARE)
    assert export(ride, "vbo", tmp_path / "vbo") == 200
    kmh = [float(row[4]) for row in table_of(tmp_path / "vbo", "vbo")]
    assert kmh == pytest.approx(np.interp(np.arange(200), [50, 150], [36.0, 72.0]), abs=2e-3)
    export(ride, "racechrono", tmp_path / "racechrono")
    cells = [row[6] for row in table_of(tmp_path / "racechrono", "racechrono")]
    assert [(k, cell) for k, cell in enumerate(cells) if cell] == [(50, "10.000"), (150, "20.000")]


def test_parquet_has_the_same_columns_with_their_units(tmp_path):
    pytest.importorskip("pyarrow")
    from pyarrow.parquet import ParquetFile

    exporting.write_parquet(tmp_path / "x", iter([block(0.25), block(0.5, 0.75, speed_mps=np.nan)]), EVENING_S)
    file = ParquetFile(tmp_path / "x")
    units = "s deg deg g g g g deg/s deg/s deg/s m/s Cel g deg deg deg s".split()
    columns = {field.name: field.metadata[b"unit"].decode() for field in file.schema_arrow}
    assert columns == dict(zip(exporting.COLUMNS, units, strict=True)) and file.num_row_groups == 2
    assert [str(field.type) for field in file.schema_arrow] == ["double", *["float"] * 13, *["double"] * 3]
    assert file.schema_arrow.metadata[b"axes"] == b"left, up, forward; lean > 0 to the right"
    table = file.read()
    assert table["t_s"].to_pylist() == [EVENING_S + 0.25, EVENING_S + 0.5, EVENING_S + 0.75]
    assert np.isnan(table["speed_mps"].to_pylist()[1:]).all()
    for name in list(exporting.COLUMNS)[1:]:
        assert table[name][0].as_py() == pytest.approx(VALUES[name], rel=1e-6), name


def test_the_command_exports_every_sample(short_ride, tmp_path):
    """The lean is smoothed unless --live is given."""
    pandas = pytest.importorskip("pandas")
    for form, name, read, options in (
        ("parquet", "x.parquet", pandas.read_parquet, ["--live"]),
        ("csv", "x.csv.gz", pandas.read_csv, []),
    ):
        out = tmp_path / name
        assert command.works("export", short_ride, *options, "--to", form, "--out", out).out.startswith(
            f"written: {out}, "
        )
        exported = read(out)
        course = joined(open_ride(short_ride, smoothed=not options).read().parts())
        for column in "lean_deg", "lateral_g", "forward_g", "speed_mps":
            assert np.allclose(exported[column], getattr(course, column), atol=1e-3, equal_nan=True), column
        assert np.allclose(exported["t_s"], course.t_s, atol=1e-9) and exported["temp_c"].isna().all()
