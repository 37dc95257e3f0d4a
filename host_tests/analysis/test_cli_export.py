"""`kickstand export` writes every sample and refuses unusable input. test_export_formats.py tests the content of each
format."""

from pathlib import Path

import numpy as np
import pytest
from support import command
from support.recordings import analysis_rides

pandas = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def ride(tmp_path_factory) -> Path:
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=200, speed_hz=1)


@pytest.fixture(scope="module")
def shown(ride) -> np.ndarray:
    """Return the table that `kickstand replay` writes for the ride."""
    out = ride.with_name("LEAN.csv")
    command.works("replay", ride, "--calibration", ride.with_name("RIDE.cal.json"), "--out", out)
    return analysis_rides.table(out)


def export(ride, form, out, *more) -> Path:
    result = command.works("export", ride, *more, "--to", form, "--out", out)
    assert result.out.startswith(f"written: {out}, ")
    return out


@pytest.mark.parametrize("form", ["parquet", "csv.gz"])
def test_csv_and_parquet_have_every_sample(ride, shown, tmp_path, form):
    """`export` computes forces, rates and formula with numpy. These values equal the firmware's values in `replay`."""
    read = pandas.read_parquet if form == "parquet" else pandas.read_csv
    got = read(export(ride, form.partition(".")[0], tmp_path / f"out.{form}", "--live"))
    given = analysis_rides.table(ride)
    assert len(got) == len(given)
    assert np.allclose(got["t_s"], given["t_s"], atol=1e-9)
    for name in "lean_deg", "lean_sigma_deg", "left_g", "up_g", "forward_g", "yaw_rate_dps", "roll_rate_dps":
        near = 1e-3 if name.endswith("deg") else 2e-4
        assert np.allclose(got[name], shown[name], atol=near, equal_nan=True), name
    # near 1 g the rounding of 32-bit floats changes the formula's square root
    steep = np.abs(shown["left_g"] ** 2 + shown["up_g"] ** 2 - 1.0) < 1e-4
    assert np.allclose(got["lean_formula_deg"][~steep], shown["lean_formula_deg"][~steep], atol=0.02)
    lean = np.radians(shown["lean_deg"])
    s = shown["left_g"] * np.cos(lean) - shown["up_g"] * np.sin(lean)
    assert np.allclose(got["lateral_g"], s, atol=1e-4)
    assert np.array_equal(got["speed_mps"].notna(), ~np.isnan(given["speed_mps"]))
    assert got["temp_c"].isna().all()


def test_a_car_has_no_lean_as_in_replay(ride, tmp_path):
    car = analysis_rides.calibration(tmp_path / "other.json", vehicle="car")
    got = pandas.read_csv(export(ride, "csv", tmp_path / "out", "--calibration", car))
    assert got[["lean_deg", "lean_formula_deg"]].isna().all().all()
    assert got[["left_g", "up_g", "forward_g", "lateral_g"]].notna().all().all()
    vbo = export(ride, "vbo", tmp_path / "out", "--calibration", car).read_text()
    assert "acc" in vbo and "lean" not in vbo.partition("[data]")[0].partition("[header]")[2].partition("[comments]")[0]


def test_ride_that_cannot_be_exported_is_refused(ride, tmp_path, monkeypatch):
    """Export is refused if the ride has no calibration beside it, if the calibration is not aligned, or if pyarrow is
    missing."""
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
