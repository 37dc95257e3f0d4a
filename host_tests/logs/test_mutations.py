"""Commands read 1,000 logs that are broken in many ways. Each command gives a result or a message of one line. The file
that it writes is complete or does not exist."""

import io
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.analysis import report
from kickstand_tools.analysis.export.export import export
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.plot.charts import charts
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.calibration.drive import fit_drive
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.poses import read_pose
from kickstand_tools.common.errors import InputError
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.imports.importing import import_recording, write_imported
from kickstand_tools.logs.csv_lines import cut_log
from kickstand_tools.replay.replay import replay_to_csv
from kickstand_tools.simulation.scripted import script
from rich.console import Console
from support import command
from support.recordings import broken_logs

COUNT = 1000
CALIBRATION = CalibrationFile(aligned=True)


def _report(log: Path, out: Path) -> None:
    seen = overview(open_ride(log, CALIBRATION))
    json.dumps(report.as_data(seen), allow_nan=False)
    Console(file=io.StringIO(), width=80).print(report.page(seen))
    charts(seen)


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
def bases(tmp_path_factory) -> list[bytes]:
    """Return the texts of three logs of two seconds: a ride with speed and temperature, a log with only the seven usual
    columns, and a pose."""
    chance = np.random.default_rng(12)
    parts = [script.upright(0.5), script.accelerate(8, 0.6), script.turn(-25, 0.6), script.brake(0, 0.5)]
    ride = script.Ride(parts, 0.02)
    lines, plain = [command.HEADER + ",speed_mps,temp_c"], [command.HEADER]
    for n in range(110):
        t_s = n / 50.0
        values = np.array(ride.motion(t_s)) + chance.normal(scale=0.003, size=6)
        row = f"{t_s:.4f}," + ",".join(f"{value:.5f}" for value in values)
        plain.append(row)
        lines.append(row + (f",{ride.truth(t_s)[1]:.2f},25.1" if n % 10 == 0 else ",,"))
    pose = command.still(tmp_path_factory.mktemp("pose") / "POSE.csv", (0.1, 0.9, 0.4), seconds=2.5)
    return [("\n".join(lines) + "\n").encode(), ("\n".join(plain) + "\n").encode(), pose.read_bytes()]


def test_mutated_log_gives_a_result_or_one_line(bases, tmp_path):
    results, lines = 0, set()
    use_of = list(USES)
    for number in range(COUNT):
        name, content, ways = broken_logs.broken(bases, number)
        log, out = tmp_path / name, tmp_path / "OUT"
        log.write_bytes(content)
        uses = [use_of[(number // len(broken_logs.WAYS) + k) % len(use_of)] for k in (0, 3)]
        for use in uses:
            where = f"number {number} ({ways}) in {use}"
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    USES[use](log, out)
            except InputError as refused:
                text = str(refused)
                assert "\n" not in text.replace(str(log), ""), where
                assert "unexpected" not in text, where
                assert not out.exists(), where
                lines.add(text.partition(":")[2][:12])
            except Exception as error:
                pytest.fail(f"{where}: {type(error).__name__}: {error}")
            else:
                results += 1
                if out.exists():
                    assert out.read_bytes().endswith(b"\n"), where
                    out.unlink()
        assert [path.name for path in tmp_path.iterdir()] == [name], f"number {number}: {ways}"
        log.unlink()
    assert 0.2 * COUNT < results < 1.8 * COUNT  # results and refusals are both frequent
    assert len(lines) > 20
