"""Tests the output of `kickstand report` and `kickstand plot` for a ride, and their refusals."""

import io
import json
import re
import struct

import pytest
from kickstand_tools.analysis import report
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.plot import plot
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.analysis.summary import Peak
from kickstand_tools.simulation.scripted import script
from rich.console import Console
from support import command
from support.recordings import analysis_rides

pytest.importorskip("matplotlib")
pytest.importorskip("plotly")


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), speed_hz=1)


def printed(seen):
    """Return the lines of the report in a terminal of 80 columns."""
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(report.page(seen))
    return console.export_text().split("\n")


def test_a_report_has_the_ride_in_figures(ride):
    data = json.loads(command.works("report", ride, "--json").out)
    assert data["vehicle"] == "motorcycle"
    assert data["duration_s"] == pytest.approx(33.99, abs=0.02)
    assert data["max_left_deg"]["value"] == pytest.approx(30.0, abs=2.5)
    assert data["max_right_deg"]["value"] == pytest.approx(42.0, abs=2.5)
    assert 9.0 < data["max_left_deg"]["time_s"] < 16.0
    assert 18.0 < data["max_right_deg"]["time_s"] < 25.0
    assert 3.5 < data["beyond_40_deg_s"] < 5.5
    assert data["beyond_30_deg_s"] > data["beyond_40_deg_s"]
    assert data["max_brake_g"]["value"] > 0.7
    (stop,) = data["stops"]
    assert stop["speed_from"] == "log"
    assert stop["initial_speed_mps"] == pytest.approx(15.0, abs=0.3)
    assert stop["distance_m"] == pytest.approx(21.0, abs=1.5)  # the start of a stop has no exact definition
    assert abs(stop["side_m"]) < 0.2
    assert data["alignment"]["gravity_g"] == pytest.approx(1.0, abs=0.002)
    assert abs(data["alignment"]["roll_deg"]) < 0.5


def test_unknown_figures_are_not_reported(ride, tmp_path):
    up_is_back = analysis_rides.calibration(
        tmp_path / "changed.json", vehicle_from_sensor=[[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    )
    seen = overview(open_ride(ride, up_is_back))
    assert [notice.code for notice in seen.notices] == ["up-off"]
    total = seen.summary
    # no maxima, as if no lean and no force was certain enough
    total.left_deg = total.right_deg = total.brake_g = total.accel_g = Peak()
    rows = {name: value for name, value, _ in report.words(seen).ride}
    names = "Max left", "Max right", "Over 30°", "Over 40°", "Max braking", "Max acceleration"
    assert [rows[name] for name in names] == ["--"] * 6


def test_time_without_readings_is_reported(ride, tmp_path):
    assert json.loads(command.works("report", ride, "--live", "--json").out)["missing_s"] == 0.0
    assert "No readings" not in command.works("report", ride).out
    header, *rows = ride.read_text().splitlines()
    log = tmp_path / "gap.csv"
    log.write_text("\n".join([header, *rows[:1200], *rows[1240:]]) + "\n")
    given = (log, "--calibration", analysis_rides.calibration(tmp_path / "changed.json"), "--live")
    step_s = float(rows[1].split(",")[0]) - float(rows[0].split(",")[0])
    data = json.loads(command.works("report", *given, "--json").out)
    assert data["missing_s"] == pytest.approx(41 * step_s, abs=0.06)
    assert "No readings" in command.works("report", *given).out


def test_page_shows_the_same_report(ride, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said = command.works("report", ride).out
    for words in "Max left", "Max right", "Over 40°", "Max braking", "MFDD", "km/h", "Alignment":
        assert words in said
    assert "integrated" not in said
    assert max(len(line) for line in said.split("\n")) <= 80
    assert re.search(r"^ *0:\d\d +5\d\.\d +2\.\d\d +2\d\.\d( +\d+\.\d\d){2} +\d+ +0\.\d (left|right) *$", said, re.M)


@pytest.mark.parametrize(("unsure_s", "line"), [(0.9, ""), (1.0, "0:01"), (65.4, "1:05")])
def test_uncertain_time_is_reported_from_one_second(ride, unsure_s, line):
    """The page shows the uncertain time from one second on; the JSON always contains it."""
    seen = overview(open_ride(ride, None))
    seen.summary.not_sure_s = unsure_s
    said = [row.split()[3:] for row in printed(seen) if row.startswith("Lean not sure")]
    assert said == ([[line]] if line else [])
    assert report.as_data(seen)["lean_unsure_s"] == unsure_s


def test_without_a_speed_stops_are_marked(tmp_path):
    said = command.works("report", analysis_rides.short(tmp_path)).out
    assert re.search(r" 5\d\.\d\* ", said)
    assert "* no speed in the log: integrated" in said


def test_report_without_a_speed_may_know_no_stops(tmp_path):
    moving = [script.upright(4), script.accelerate(15, 5), script.straight(20)]
    for speed_hz, words in ((0, "Stops: not known, the log has no speed."), (1, "No stop from over 10 km/h found.")):
        ride = analysis_rides.write(tmp_path, moving, speed_hz=speed_hz)
        assert words in command.works("report", ride).out


def turned_round(directory, **changed):
    """Write a CAL.json with forward and left reversed."""
    matrix = [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    return analysis_rides.calibration(
        directory / "changed.json", vehicle_from_sensor=matrix, kickstand_side="left", **changed
    )


def test_a_kickstand_on_the_other_side_is_noticed(ride, tmp_path):
    cal = turned_round(tmp_path)
    line = "forward and backward are exchanged: calibrate two --side right?"
    said = command.works("report", ride, "--calibration", cal, "--live")
    assert line in said.err
    assert "do all accelerations have the opposite sign?" in said.err
    assert "Stops: not known" in said.out
    assert "MFDD" not in said.out  # with reversed axes the stops have no correct MFDD
    data = report.as_data(overview(open_ride(ride, cal)))
    assert data["remark"].startswith(line)
    assert data["stops"] == []
    assert line in command.works("plot", ride, "--calibration", cal, "--out", tmp_path / "pictures").err
    car = turned_round(tmp_path, vehicle="car")
    said = command.works("report", ride, "--calibration", car, "--live")
    assert "exchanged: calibrate drive again?" in said.err
    assert "Max left" not in said.out and "Max braking" in said.out  # the report of a car shows no lean


def test_stop_shown_only_by_the_speed_is_reported(ride, tmp_path):
    """The calibration's "forward" points sideways, so it is neither right nor reversed."""
    cal = analysis_rides.calibration(tmp_path / "changed.json", vehicle_from_sensor=[[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    said = command.works("report", ride, "--calibration", cal, "--live").out
    assert "No stop" not in said
    assert "The speed falls to a stop, the force says otherwise" in " ".join(said.split())


def test_picture_and_page_are_complete(ride, tmp_path):
    out = tmp_path / "new" / "pictures"
    command.works("plot", ride, "--out", out)
    png = (out / "RIDE.png").read_bytes()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">2I", png[16:24]) == (1100, 950)
    html = (out / "RIDE.html").read_text()
    assert "Plotly.newPlot" in html
    assert not re.search(r"<(script|link)[^>]*(src|href)=", html)  # the page loads no other file
    assert sorted(path.name for path in out.iterdir()) == ["RIDE.html", "RIDE.png"]


@pytest.mark.parametrize("samples", [2, 30])
def test_shortest_logs_are_reported(tmp_path, samples):
    log = command.still(tmp_path / "log.csv", (0, 1, 0), seconds=samples / 100)
    analysis_rides.calibration(tmp_path / "log.cal.json")
    command.works("report", log)
    command.works("plot", log, "--out", tmp_path / "pictures")


def test_plot_needs_a_directory_and_libraries(ride, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    command.refused(tmp_path, "plot", ride, "--out", tmp_path / "file", words="is a file")
    with monkeypatch.context() as patch:
        patch.setattr(plot, "find_spec", lambda name: None)
        command.refused(tmp_path, "plot", ride, "--out", tmp_path / "x", words="pictures need matplotlib and plotly")
    command.refused(tmp_path, "plot", ride, "--out", tmp_path / "ride.html", words="give the directory")


def test_interrupted_plot_leaves_no_empty_directory(ride, tmp_path, monkeypatch):
    def ctrl_c(path, seen):
        raise KeyboardInterrupt

    monkeypatch.setattr(plot.picture, "draw", ctrl_c)
    assert command.run("plot", ride, "--out", tmp_path / "pictures").status == 130
    assert not (tmp_path / "pictures").exists()
