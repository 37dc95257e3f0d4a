"""kickstand export: every sample is in the file, and what is refused. The rest: test_export_formats.py."""

from pathlib import Path

import analysis_rides
import command
import numpy as np
import pytest

pandas = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def ride(tmp_path_factory) -> Path:
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=200, speed_hz=1)


@pytest.fixture(scope="module")
def shown(ride) -> np.ndarray:
    """What replay says of it."""
    out = ride.with_name("LEAN.csv")
    command.works("replay", ride, "--calibration", ride.with_name("RIDE.cal.json"), "--out", out)
    return analysis_rides.table(out)


def export(ride, form, out, *more) -> Path:
    result = command.works("export", ride, *more, "--to", form, "--out", out)
    assert result.out.startswith(f"written: {out}, ")
    return out


def read(path: Path, form: str):
    """The table in a file of this format."""
    if form == "parquet":
        return pandas.read_parquet(path)
    if form == "racechrono":
        return pandas.read_csv(path, skiprows=path.read_text().split("\n").index("") + 1)[2:].astype(float)
    if form == "vbo":
        lines = path.read_text().split("\n")
        names = lines[lines.index("[column names]") + 1].split()
        rows = [line.split() for line in lines[lines.index("[data]") + 1 : -1]]
        return pandas.DataFrame(rows, columns=names).astype(float)
    return pandas.read_csv(path)


@pytest.mark.parametrize("form", ["csv", "parquet", "csv.gz"])
def test_csv_and_parquet_have_every_sample(ride, shown, tmp_path, form):
    """Vectorised forces, rates and formula are those of the firmware's own replay."""
    got = read(export(ride, form.partition(".")[0], tmp_path / f"out.{form}", "--live"), form)
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


def test_a_clock_that_jitters_costs_no_rows_or_they_are_counted(tmp_path):
    """A phone's: RaceChrono's times have milliseconds, VBO's hundredths."""
    ride = analysis_rides.short(tmp_path)
    header, *rows = ride.read_text().splitlines()
    t_s = np.round(np.arange(len(rows)) / 100.0 + np.random.default_rng(1).uniform(0.0, 0.009, len(rows)), 3)
    t_s -= t_s[0]
    ride.write_text("\n".join([header, *(f"{t:.3f},{row.partition(',')[2]}" for t, row in zip(t_s, rows))]) + "\n")
    assert len(read(export(ride, "racechrono", tmp_path / "r", "--live"), "racechrono")) == len(rows)
    result = command.works("export", ride, "--to", "vbo", "--out", tmp_path / "v", "--live")
    count = len(read(tmp_path / "v", "vbo"))
    assert count < len(rows)
    said = f"holds times to 0.01 s: {len(rows)} samples became {count} rows, those with the same time their mean"
    assert said in result.err


@pytest.mark.parametrize("form", ["csv", "racechrono", "parquet", "vbo"])
def test_a_car_has_no_lean_as_in_replay(ride, tmp_path, form):
    car = analysis_rides.calibration(tmp_path / "other.json", vehicle="car")
    got = read(export(ride, form, tmp_path / "out", "--calibration", car), form)
    lean = [name for name in got if name in ("lean_deg", "lean_formula_deg", "lean_angle", "lean-angle")]
    assert len(lean) == {"racechrono": 1, "vbo": 0}.get(form, 2)
    assert got[lean].isna().all().all()
    assert got[[name for name in got if name.endswith(("_g", "acc"))]].notna().all().all()


@pytest.mark.parametrize("form", ["csv", "vbo", "racechrono", "parquet"])
def test_a_damaged_ride_leaves_nothing_behind(ride, tmp_path, form):
    cut = tmp_path / "cut.csv"
    lines = ride.read_text().splitlines()
    lines[-3] = lines[-3][: lines[-3].rindex(",") - 4]  # the last one of all would be left out
    lines[-3] = lines[-3].rpartition(",")[0]
    cut.write_text("\n".join(lines) + "\n")
    (tmp_path / "cut.cal.json").write_bytes(ride.with_name("RIDE.cal.json").read_bytes())
    command.refused(tmp_path, "export", cut, "--to", form, "--out", tmp_path / "out", words="is the line cut?")


def test_what_cannot_be_exported_is_refused(ride, tmp_path, monkeypatch):
    """Without a calibration beside it, or with one that is not aligned; without pyarrow."""
    alone = tmp_path / "alone.csv"
    alone.write_bytes(ride.read_bytes())
    empty = tmp_path / "empty.csv"
    empty.write_text(command.HEADER + "\n")
    flat = analysis_rides.calibration(tmp_path / "other.json", aligned=False)
    out = ("--out", tmp_path / "out")
    for arguments, words in (
        ((alone, "--to", "csv"), "no calibration alone.cal.json beside it: give one with --calibration, or make it"),
        ((alone, "--to", "csv"), f"kickstand calibrate ride {alone} --out {tmp_path / 'alone.cal.json'}"),
        ((empty, "--to", "csv"), "is empty: there are no readings below the names of its columns"),
        ((tmp_path / "none.csv", "--to", "csv"), "there is no such file"),
        ((ride, "--calibration", flat, "--to", "csv"), "is not aligned"),
    ):
        command.refused(tmp_path, "export", *arguments, *out, words=words)
    monkeypatch.setattr("kickstand_tools.analysis.export.export.find_spec", lambda name: None)
    command.refused(tmp_path, "export", ride, "--to", "parquet", *out, words="Parquet needs pyarrow")
    monkeypatch.undo()
    export(alone, "csv", tmp_path / "out", "--calibration", ride.with_name("RIDE.cal.json"))
