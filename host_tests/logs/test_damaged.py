"""Logs and calibrations that are damaged in many ways give a result or a message of one line. A file that a command
writes is complete or does not exist."""

import io
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from kickstand_sim.simulation.scripted import script
from kickstand_tools.analysis import report
from kickstand_tools.analysis.charts import charts
from kickstand_tools.analysis.export import export
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.calibration.drive import fit_drive
from kickstand_tools.calibration.file import CalibrationFile, read_calibration
from kickstand_tools.calibration.poses import read_pose
from kickstand_tools.common.messages import InputError
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.imports.importing import import_recording, write_imported
from kickstand_tools.logs.reader import cut_log
from kickstand_tools.replay.replay import replay_to_csv
from rich.console import Console
from support import command
from support.recordings import broken_logs

CALIBRATION = CalibrationFile(aligned=True)


def _report(log: Path, out: Path) -> None:
    result = overview(open_ride(log, CALIBRATION))
    json.dumps(report.as_data(result), allow_nan=False)
    Console(file=io.StringIO(), width=80).print(report.page(result))
    charts(result)


def _export(form: str):
    return lambda log, out: export(open_ride(log, CALIBRATION), form, out)


# Each use of a log is a function of the log and of the file to write. Add new commands that read logs here.
USES = {
    "replay": lambda log, out: replay_to_csv(log, CALIBRATION, "cpython", out),
    "report and plot": _report,
    "export csv": _export("csv"),
    "export vbo": _export("vbo"),
    "export racechrono": _export("racechrono"),
    "export gpx": _export("gpx"),
    "cut": lambda log, out: cut_log(log, out, 0.3, -0.2),
    "pose": lambda log, out: read_pose(log),
    "drive": lambda log, out: fit_drive([log], CALIBRATION, "motorcycle"),
    "ride": lambda log, out: fit_ride(log),
    "import": lambda log, out: write_imported(out, import_recording(log)),
}


@pytest.fixture(scope="module")
def logs(tmp_path_factory) -> list[bytes]:
    """Return the texts of three logs of two seconds: a ride with speed and temperature, the same ride with only the
    seven usual columns, and a pose."""
    random = np.random.default_rng(12)
    parts = [script.upright(0.5), script.accelerate(8, 0.6), script.turn(-25, 0.6), script.brake(0, 0.5)]
    ride = script.Ride(parts, 0.02)
    lines, plain = [command.HEADER + ",speed_mps,temp_c"], [command.HEADER]
    for n in range(110):
        t_s = n / 50.0
        values = np.array(ride.motion(t_s)) + random.normal(scale=0.003, size=6)
        row = f"{t_s:.4f}," + ",".join(f"{value:.5f}" for value in values)
        plain.append(row)
        lines.append(row + (f",{ride.truth(t_s)[1]:.2f},25.1" if n % 10 == 0 else ",,"))
    pose = command.still(tmp_path_factory.mktemp("pose") / "POSE.csv", (0.1, 0.9, 0.4), seconds=2.5)
    return [("\n".join(lines) + "\n").encode(), ("\n".join(plain) + "\n").encode(), pose.read_bytes()]


@pytest.mark.parametrize("numbers", [range(230), pytest.param(range(230, 1500), marks=pytest.mark.long)])
def test_a_damaged_log_gives_a_result_or_one_line(logs, tmp_path, numbers):
    results, refusals, names = 0, set(), list(USES)
    for number in numbers:
        name, content, ways = broken_logs.broken(logs, number)
        log, out = tmp_path / name, tmp_path / "OUT"
        log.write_bytes(content)
        use = names[(number // len(broken_logs.WAYS) + number) % len(names)]
        label = f"number {number} ({ways}) in {use}"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                USES[use](log, out)
        except InputError as refusal:
            line = str(refusal)
            assert "\n" not in line.replace(str(log), "") and "unexpected" not in line and not out.exists(), label
            refusals.add(line.partition(":")[2][:12])
        except Exception as error:
            pytest.fail(f"{label}: {type(error).__name__}: {error}")
        else:
            results += 1
            if out.exists():
                assert out.read_bytes().endswith(b"\n"), label
                out.unlink()
        assert [path.name for path in tmp_path.iterdir()] == [name], label
        log.unlink()
    assert 0.1 * len(numbers) < results < 0.9 * len(numbers)  # results and refusals are both frequent
    assert len(refusals) > 20


def test_a_damaged_calibration_is_read_or_refused(tmp_path):
    content = command.write_cal(tmp_path / "CAL.json").read_bytes()
    values = (None, True, "x", -1, 1e308, [], {}, [[]], [None] * 3, ["1"] * 3, [1e400] * 3, [10**400] * 3)
    wrong = [json.dumps(json.loads(content) | {key: value}) for key in json.loads(content) for value in values]
    results = set()
    for broken in [broken_logs.broken([content], k)[1] for k in range(150)] + [text.encode() for text in wrong]:
        (tmp_path / "CAL.json").write_bytes(broken)
        try:
            read_calibration(tmp_path / "CAL.json")
            results.add("read")
        except InputError as refusal:
            results.add("refused")
            assert "\n" not in str(refusal) and len(str(refusal)) < 400
    assert results == {"read", "refused"}
