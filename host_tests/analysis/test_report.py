"""The words and figures of a report, computed by hand, and the commands `report` and `plot`."""

import io
import json
import re
import struct
from dataclasses import replace

import numpy as np
import pytest
from kickstand_sim.simulation.scripted import script
from kickstand_tools.analysis import page, report
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.calibration.mount import ForwardExchanged, UpOff
from rich.console import Console
from small_rides import STOP, overview_of, samples
from support import command
from support.recordings import analysis_rides

EXCHANGED = ForwardExchanged(False, "left", 0.0)


def rows_of(ride_overview):
    return {name: (value, time) for name, value, time in report.words(ride_overview).ride}


def test_the_rows_of_a_report():
    lean = np.where(np.arange(12_000) > 6000, -42.0, 0.0)
    course = samples(12_000, lean_deg=lean, speed_mps=20.0, shown_g=np.where(lean < 0.0, -0.517, 0.25))
    rows = {
        "Duration": ("2:00", "riding 1:00"), "Lean": ("as the display showed it", ""),
        "Max left": ("42°", "at 1:00"), "Max right": ("--", ""), "Over 30°": ("60.0 s", ""), "Over 40°": ("60.0 s", ""),
        "Max braking": ("0.52 g", "at 1:00"), "Max acceleration": ("0.25 g", "at 0:00"),
        "Max speed": ("72 km/h", "at 0:00"),
    }  # fmt: skip
    assert rows_of(overview_of(course)) == rows
    names = {"Duration", "Max braking", "Max acceleration", "Max speed"}
    assert rows_of(overview_of(course, vehicle="car")) == {name: rows[name] for name in names}
    assert rows_of(overview_of(course, smoothed=True))["Lean"] == ("best estimate", "from the whole ride")
    unsure = rows_of(overview_of(samples(1000, sure=0.0)))
    assert all(unsure[name][0] == "--" for name in ("Max left", "Over 30°", "Over 40°", "Max braking"))


@pytest.mark.parametrize(
    ("times_s", "rows"),
    [
        ((1.0, 2.5, 0.1), {"Lean not sure": "0:01", "No readings": "2.4 s", "Readings frozen": "0.1 s"}),
        ((65.4, 0.0, 0.0), {"Lean not sure": "1:05"}),
        ((0.9, 0.05, 0.0), {}),
    ],
)
def test_uncertain_and_missing_time_is_reported(times_s, rows):
    ride_overview = overview_of(samples(1000))
    ride_overview.summary.not_sure_s, ride_overview.summary.missing_s, ride_overview.summary.frozen_s = times_s
    words = {name: value for name, (value, _) in rows_of(ride_overview).items()}
    assert {name: words[name] for name in ("Lean not sure", "No readings", "Readings frozen") if name in words} == rows
    assert report.as_data(ride_overview)["lean_unsure_s"] == times_s[0]


@pytest.mark.parametrize(
    ("riding_s", "words"),
    [
        (10.0, ""),
        (9.9, "0:30 of log, 10 s of it riding: too little for a report."),
        (1.0, "0:30 of log, 1 s of it riding: too little for a report."),
        (0.9, "0:30 of log, all of it standing: too little for a report."),
    ],
)
def test_a_short_ride_is_too_little_for_a_report(riding_s, words):
    assert report.words(overview_of(samples(3000), riding_s=riding_s)).too_little == words


def test_the_row_of_a_stop():
    def row(**changed):
        return report.words(overview_of(samples(100), stops=[replace(STOP, **changed)])).stops[0]

    assert row() == ("1:01", "72.0", "2.50", "30.0", "7.11", "8.12", "12", "0.2 left")
    other = row(side_m=-0.24, speed_from="integrated")
    assert (other[1], other[-1]) == ("72.0*", "0.2 right")


SLOW = samples(1000, speed_mps=5.0)


def test_contradictions_hide_figures():
    data = report.as_data(overview_of(samples(1000), notices=[EXCHANGED]))
    assert set(data["lean_cost"].values()) == {None} and data["alignment"]["roll_deg"] == 0.1
    assert data["remark"] == EXCHANGED.line() and [remark["code"] for remark in data["remarks"]] == [
        "forward-exchanged"
    ]
    data = report.as_data(overview_of(samples(1000), notices=[UpOff(30.0, False)]))
    assert set(data["alignment"].values()) == set(data["lean_cost"].values()) == {None}


def terminal(ride_overview):
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(report.page(ride_overview))
    return console.export_text().splitlines()


def test_a_report_on_a_terminal_has_its_parts_in_order():
    lines = terminal(overview_of(samples(1000), stops=[STOP]))
    assert lines[0].strip() == "RIDE.csv" and lines[1].split()[:2] == ["Duration", "0:10"]
    order = [next(k for k, text in enumerate(lines) if text.startswith(word)) for word in ("Dur", "Alignment", "Stops")]
    assert order == sorted(order) and "MFDD: mean deceleration" in " ".join(lines[-4:])
    row = next(text for text in lines if text.split()[:1] == ["1:01"])
    assert row.split() == ["1:01", "72.0", "2.50", "30.0", "7.11", "8.12", "12", "0.2", "left"]
    short = terminal(overview_of(SLOW, riding_s=3.0))
    assert short[1].strip() == "0:10 of log, 3 s of it riding: too little for a report."
    assert "MFDD" not in "".join(short) and short[-1].strip() == "No stop from over 10 km/h found."


def test_the_command_reports_a_ride(short_ride, monkeypatch):
    data = json.loads(command.works("report", short_ride, "--json").out)
    assert data["vehicle"] == "motorcycle" and data["duration_s"] == pytest.approx(33.99, abs=0.02)
    assert data["max_left_deg"]["value"] == pytest.approx(30.0, abs=2.5) and 9.0 < data["max_left_deg"]["time_s"] < 16.0
    assert data["max_right_deg"]["value"] == pytest.approx(42.0, abs=2.5)
    assert 3.5 < data["beyond_40_deg_s"] < 5.5 < data["beyond_30_deg_s"] and data["max_brake_g"]["value"] > 0.7
    (stop,) = data["stops"]
    assert stop["speed_from"] == "log" and stop["initial_speed_mps"] == pytest.approx(15.0, abs=0.3)
    assert stop["distance_m"] == pytest.approx(21.0, abs=1.5) and abs(stop["side_m"]) < 0.2
    assert data["alignment"]["gravity_g"] == pytest.approx(1.0, abs=0.002) and abs(data["alignment"]["roll_deg"]) < 0.5
    monkeypatch.setenv("COLUMNS", "80")
    text = command.works("report", short_ride, "--live").out
    for words in "as the display showed it", "Max left", "Over 40°", "Max braking", "MFDD", "km/h", "Alignment":
        assert words in text
    assert max(len(line) for line in text.split("\n")) <= 80


def test_without_a_speed_stops_are_marked(tmp_path):
    text = command.works("report", analysis_rides.short(tmp_path, rate_hz=50)).out
    assert re.search(r" 5\d\.\d\* ", text) and "* no speed in the log: integrated" in text
    ride = analysis_rides.write(tmp_path, [script.upright(4), script.accelerate(15, 5), script.straight(20)], 50)
    assert "Stops: not known, the log has no speed." in command.works("report", ride).out


def test_picture_and_page_are_complete(short_ride, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("plotly")
    out = tmp_path / "new" / "pictures"
    command.works("plot", short_ride, "--live", "--out", out)
    png = (out / "RIDE.png").read_bytes()
    assert png[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">2I", png[16:24]) == (1100, 950)
    html = (out / "RIDE.html").read_text()
    assert "Plotly.newPlot" in html and not re.search(r"<(script|link)[^>]*(src|href)=", html)  # loads no other file
    assert sorted(path.name for path in out.iterdir()) == ["RIDE.html", "RIDE.png"]


def test_the_shortest_log_is_reported_and_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("plotly")
    log = command.still(tmp_path / "log.csv", (0, 1, 0), seconds=0.02)
    ride_overview = overview(open_ride(log, analysis_rides.calibration(tmp_path / "log.cal.json")))
    assert "all of it standing" in report.words(ride_overview).too_little
    page.draw_picture(tmp_path / "x.png", ride_overview)


def test_an_interrupted_plot_leaves_no_empty_directory(short_ride, tmp_path, monkeypatch):
    def ctrl_c(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(page, "draw_picture", ctrl_c)
    assert command.run("plot", short_ride, "--live", "--out", tmp_path / "pictures").status == 130
    assert not (tmp_path / "pictures").exists()
