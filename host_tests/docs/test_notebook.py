"""The notebook of the tools runs from the first cell to the last. The notebook finds the lean of the ride that it
simulates."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "tools" / "examples" / "first_ride.ipynb"


def cells(kind):
    contents = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in contents if cell["cell_type"] == kind]


@pytest.mark.long
def test_the_notebook_runs_and_finds_the_lean(monkeypatch, tmp_path, capsys):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    names: dict = {}
    for number, cell in enumerate(cells("code")):
        exec(compile(cell, f"cell {number}", "exec"), names)
    output = capsys.readouterr().out
    assert "samples per second" in output and "phyphox" in output
    live, smoothed = (float(rms) for rms in re.findall(r"^\w+: (.*?) degrees rms", output, re.M))
    assert smoothed < 0.4 and live < 0.8
    assert len(pyplot.figure(1).axes) == 2
    pyplot.close("all")
    total, true_deg = names["total"], names["true_deg"]
    assert abs(total.right_deg.value - np.max(true_deg)) < 1.5 and abs(total.left_deg.value + np.min(true_deg)) < 1.5
    assert names["lean_csv"].stat().st_size > 5e5


def test_notebook_explains_each_step_and_keeps_no_output():
    """The notebook is stored without output, because readers run it themselves."""
    contents = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    assert contents[0]["cell_type"] == "markdown" and len(cells("markdown")) >= len(cells("code")) - 1
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in contents)
