"""kickstand export: every file reads back by the rules of its format, with the ride in it."""

import csv
import json
import os
import re
from pathlib import Path
from typing import Any

import analysis_rides
import command
import numpy as np
import pytest

pandas = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")
WRITTEN_S = 1_700_000_000.7  # 22:13:20 UTC on 14/11/2023
FORMATS = ["csv", "vbo", "racechrono", "parquet"]


@pytest.fixture(scope="module")
def ride(tmp_path_factory) -> Path:
    made = analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=200, speed_hz=1)
    os.utime(made, (WRITTEN_S, WRITTEN_S))
    return made


@pytest.fixture(scope="module")
def shown(ride) -> np.ndarray:
    """What replay says of it."""
    out = ride.with_name("LEAN.csv")
    command.works("replay", ride, "--calibration", ride.with_name("RIDE.cal.json"), "--out", out)
    return analysis_rides.table(out)


def export(ride, form, tmp_path, suffix="") -> Path:
    out = tmp_path / f"out.{form}{suffix}"
    result = command.works("export", ride, "--live", "--to", form, "--out", out)
    assert result.out.startswith(f"written: {out}, ")
    return out


@pytest.mark.parametrize("form", ["csv", "parquet", "packed"])
def test_csv_and_parquet_have_every_sample(ride, shown, tmp_path, form):
    """Vectorised forces, rates and formula are those of the firmware's own replay."""
    if form == "parquet":
        got = pandas.read_parquet(export(ride, form, tmp_path))
    else:
        got = pandas.read_csv(export(ride, "csv", tmp_path, ".gz" if form == "packed" else ""))
    given = analysis_rides.table(ride)
    assert len(got) == len(given)
    assert np.allclose(got["t_s"], given["t_s"], atol=1e-9)
    for name in "lean_deg", "left_g", "up_g", "forward_g", "yaw_rate_dps", "roll_rate_dps":
        assert np.allclose(got[name], shown[name], atol=1e-3 if name.endswith("deg") else 2e-4), name
    steep = np.abs(shown["left_g"] ** 2 + shown["up_g"] ** 2 - 1.0) < 1e-4  # 32-bit floats move the square root
    assert np.allclose(got["lean_formula_deg"][~steep], shown["lean_formula_deg"][~steep], atol=0.02)
    lean = np.radians(shown["lean_deg"])
    s = shown["left_g"] * np.cos(lean) - shown["up_g"] * np.sin(lean)
    assert np.allclose(got["lateral_g"], s, atol=1e-4)
    assert np.array_equal(got["speed_mps"].notna(), ~np.isnan(given["speed_mps"]))
    assert got["temp_c"].isna().all()  # the log has none


def test_parquet_names_the_units(ride, tmp_path):
    from pyarrow.parquet import read_schema

    schema = read_schema(export(ride, "parquet", tmp_path))
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert units["t_s"] == "s"
    assert units["lean_deg"] == "deg"
    assert units["forward_g"] == "g"
    assert units["yaw_rate_dps"] == "deg/s"
    assert units["speed_mps"] == "m/s"


def read_vbo(path: Path) -> tuple[dict[str, list[str]], Any]:
    """By Racelogic's rules: lines end in CR LF, sections begin with [name], blank lines stand between them."""
    text = path.read_bytes().decode("utf-8")
    assert text.count("\n") == text.count("\r\n")
    sections, name = {"": []}, ""
    for line in text.split("\r\n"):
        if match := re.fullmatch(r"\[(.+)\]", line):
            name = match[1]
            sections[name] = []
        elif line:
            sections[name].append(line)
    names = sections["column names"][0].split(" ")
    rows = [line.split(" ") for line in sections["data"]]
    return sections, pandas.DataFrame(rows, columns=names)


def test_vbo_by_racelogics_rules(ride, shown, tmp_path):
    sections, data = read_vbo(export(ride, "vbo", tmp_path))
    assert re.fullmatch(r"File created on \d\d/\d\d/\d{4} at \d\d:\d\d:\d\d", sections[""][0])
    standard = ["satellites", "time", "latitude", "longitude", "velocity kmh", "heading", "height"]
    assert sections["header"][:7] == standard
    assert len(sections["header"]) == len(data.columns)
    assert len(sections["channel units"]) == len(data.columns) - 9  # of those that are not standard
    assert set(data["sats"]) == {"000"}
    assert data["time"].str.fullmatch(r"\d{6}\.\d\d").all()
    clock = data["time"].astype(float)
    seconds = clock // 10000 * 3600 + clock // 100 % 100 * 60 + clock % 100
    assert np.allclose(np.diff(seconds), 0.01)
    values = data.astype(float)
    pairs = np.reshape(shown["forward_g"][: 2 * len(data)], (-1, 2)).mean(axis=1)
    assert np.allclose(values["longacc"], pairs, atol=6e-4)
    assert np.allclose(values["lean-angle"], shown["lean_deg"].reshape(-1, 2).mean(axis=1), atol=1e-3)
    given = analysis_rides.table(ride)
    there = ~np.isnan(given["speed_mps"])
    speed = np.interp(seconds - seconds[0], given["t_s"][there], given["speed_mps"][there])
    assert np.max(np.abs(values["velocity"] / 3.6 - speed)) < 0.03
    right = values["lean-angle"] > 35.0
    assert right.any()
    assert (values["latacc"][right] < -0.5).all()  # > 0 is to the left


def test_vbo_makes_nothing_up(tmp_path):
    """What the log has not, has no column; but velocity, which has to be there, has a comment."""
    bare = analysis_rides.short(tmp_path)
    full = tmp_path / "full.csv"
    header, *rows = bare.read_text().split("\n")[:-1]
    full.write_text("\n".join([header + ",temp_c,speed_mps", *[row + ",21.5,12.0" for row in rows]]) + "\n")
    car = tmp_path / "car.json"
    car.write_text(json.dumps(analysis_rides.CALIBRATION | {"vehicle": "car"}))
    without = "no speed in the log"
    for log, more, missing in (
        (bare, (), {"temperature", without}),
        (full, ("--calibration", tmp_path / "RIDE.cal.json"), set()),
        (full, ("--calibration", car), {"lean-angle"}),
    ):
        command.works("export", log, *more, "--to", "vbo", "--out", tmp_path / "out.vbo")
        sections, data = read_vbo(tmp_path / "out.vbo")
        there = {"lean-angle", "yaw-rate", "roll-rate", "temperature"} - missing
        assert set(sections["header"][9:]) == set(data.columns[9:]) == there
        assert len(sections["channel units"]) == len(there)
        assert not data.isna().any().any()  # as many cells as columns
        assert any(line.startswith(without) for line in sections["comments"]) is (without in missing)
        assert set(data["velocity"].astype(float)) == {0.0 if without in missing else 43.2}
        assert ("lean-angle" in there) is any("lean-angle" in line for line in sections["comments"])


@pytest.mark.parametrize("form", ["csv", "racechrono", "parquet"])
def test_a_car_has_no_lean_as_in_replay(ride, tmp_path, form):
    car, out = tmp_path / "car.json", tmp_path / "out"
    car.write_text(json.dumps(analysis_rides.CALIBRATION | {"vehicle": "car"}))
    command.works("export", ride, "--calibration", car, "--to", form, "--out", out)
    if form == "racechrono":
        got = pandas.read_csv(out, skiprows=out.read_text().split("\n").index("") + 1)[2:]
        assert got["lean_angle"].isna().all()
        return
    got = pandas.read_csv(out) if form == "csv" else pandas.read_parquet(out)
    assert got[["lean_deg", "lean_formula_deg"]].isna().all().all()
    assert got[["left_g", "up_g", "forward_g", "lateral_g"]].notna().all().all()


def test_racechrono_csv_v3(ride, shown, tmp_path):
    path = export(ride, "racechrono", tmp_path)
    lines = path.read_text().split("\n")
    assert lines[0].startswith("This file is created using RaceChrono")
    assert lines[1] == "Format,3"
    blank = lines.index("")
    names, units, sources = list(csv.reader(lines[blank + 1 : blank + 4]))
    assert names[0] == "timestamp"
    assert len(names) == len(units) == len(sources)
    unit = dict(zip(names, units))
    assert unit["timestamp"] == "unix time"
    assert unit["lean_angle"] == "deg"
    assert unit["longitudinal_acc"] == "G"
    assert unit["speed"] == "m/s"
    data = pandas.read_csv(path, skiprows=blank + 1)[2:].astype(float)
    assert np.all(np.diff(data["elapsed_time"]) > 0)
    assert data["elapsed_time"].diff().median() == pytest.approx(0.01)
    assert np.allclose(data["lean_angle"], shown["lean_deg"].reshape(-1, 2).mean(axis=1), atol=0.006)
    assert data["speed"].notna().sum() == 1 + int(analysis_rides.table(ride)["t_s"][-1])
    assert (data["lateral_acc"][data["lean_angle"] > 35.0] < -0.5).all()  # > 0 in a left turn


@pytest.mark.parametrize("form", ["vbo", "racechrono"])
def test_a_log_without_a_clock_ends_when_it_was_written(ride, tmp_path, form):
    """34 s before: none is dated 1970."""
    out = export(ride, form, tmp_path)
    if form == "vbo":
        sections, data = read_vbo(out)
        assert sections[""][0] == "File created on 14/11/2023 at 22:12:46"
        assert data["time"][0] == "221246.00"
        assert data["time"].is_unique
    else:
        lines = out.read_text().split("\n")
        assert "Created,14/11/2023,22:12" in lines[: lines.index("")]
        assert float(lines[lines.index("") + 4].split(",")[0]) == pytest.approx(1_699_999_966.0, abs=0.01)


@pytest.mark.parametrize("form", FORMATS)
def test_a_log_with_a_clock_keeps_it(tmp_path, form):
    t0 = 1_700_000_000.0  # 22:13:20 UTC
    rows = [f"{t0 + k / 50:.6f},0.0,1.0,0.1,0,0,0" for k in range(200)]
    ride = tmp_path / "ride.csv"
    ride.write_text("\n".join([command.HEADER, *rows]) + "\n")
    (tmp_path / "ride.cal.json").write_text(json.dumps(analysis_rides.CALIBRATION))
    out = export(ride, form, tmp_path)
    if form == "vbo":
        sections, data = read_vbo(out)
        assert sections[""][0] == "File created on 14/11/2023 at 22:13:20"
        assert list(data["time"][:2]) == ["221320.00", "221320.02"]
    elif form == "parquet":
        assert pandas.read_parquet(out)["t_s"][1] == pytest.approx(t0 + 0.02, abs=1e-6)
    else:
        assert f"{t0 + 0.02:.3f}" in out.read_text()


@pytest.mark.parametrize("form", FORMATS)
def test_a_damaged_ride_leaves_nothing_behind(ride, tmp_path, form):
    cut = tmp_path / "cut.csv"
    lines = ride.read_text().splitlines()
    lines[-3] = lines[-3][: lines[-3].rindex(",") - 4]  # the last one of all would be left out
    lines[-3] = lines[-3].rpartition(",")[0]
    cut.write_text("\n".join(lines) + "\n")
    (tmp_path / "cut.cal.json").write_bytes(ride.with_name("RIDE.cal.json").read_bytes())
    command.refused(tmp_path, "export", cut, "--to", form, "--out", tmp_path / "out", words="is the line cut?")


def test_the_calibration_is_found_or_asked_for(ride, tmp_path):
    alone = tmp_path / "alone.csv"
    alone.write_bytes(ride.read_bytes())
    arguments = ("export", alone, "--to", "csv", "--out", tmp_path / "out.csv")
    command.refused(tmp_path, *arguments, words="no calibration alone.cal.json beside it: give one with --calibration")
    command.works(*arguments, "--calibration", ride.with_name("RIDE.cal.json"))
    command.refused(
        *(tmp_path, "export", tmp_path / "none.csv", "--to", "csv", "--out", tmp_path / "x.csv"),
        words="there is no such file",
    )


def test_what_is_not_aligned_is_refused(ride, tmp_path):
    flat = tmp_path / "flat.json"
    flat.write_text(json.dumps(analysis_rides.CALIBRATION | {"aligned": False}))
    command.refused(
        *(tmp_path, "export", ride, "--calibration", flat, "--to", "csv", "--out", tmp_path / "x.csv"),
        words="is not aligned",
    )


def test_without_pyarrow_parquet_is_refused(ride, tmp_path, monkeypatch):
    from kickstand_tools.analysis.export import export_parquet

    monkeypatch.setattr(export_parquet, "find_spec", lambda name: None)
    command.refused(
        *(tmp_path, "export", ride, "--to", "parquet", "--out", tmp_path / "x"), words="Parquet needs pyarrow"
    )
