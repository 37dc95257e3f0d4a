"""Tests the words and figures of a report of small rides. The results were computed by hand."""

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.analysis import report
from kickstand_tools.analysis.alignment_quality import Quality
from kickstand_tools.analysis.channels import Channels
from kickstand_tools.checks.mount import ForwardExchanged, UpOff
from kickstand_tools.estimation.smooth import PoseOff
from rich.console import Console
from support.small_rides import STOP, made, seen


def rows_of(course: Channels, **more) -> dict[str, tuple[str, str]]:
    return {name: (value, at) for name, value, at in report.words(seen(course, **more)).ride}


def test_the_rows_of_a_report():
    lean = np.where(np.arange(12_000) > 6000, -42.0, 0.0)
    course = made(12_000, lean_deg=lean, speed_mps=20.0, shown_g=np.where(lean < 0.0, -0.517, 0.25))
    assert rows_of(course) == {
        "Duration": ("2:00", "riding 1:00"), "Lean": ("as the display showed it", ""),
        "Max left": ("42°", "at 1:00"), "Max right": ("--", ""), "Over 30°": ("60.0 s", ""), "Over 40°": ("60.0 s", ""),
        "Max braking": ("0.52 g", "at 1:00"), "Max acceleration": ("0.25 g", "at 0:00"),
        "Max speed": ("72 km/h", "at 0:00"),
    }  # fmt: skip
    assert rows_of(made(1000))["Over 30°"][0] == "--"
    assert "Max left" not in rows_of(course, vehicle="car")
    one = seen(course)
    one.summary.not_sure_s, one.summary.missing_s, one.summary.frozen_s = 1.0, 2.5, 0.1
    said = {name: value for name, value, _ in report.words(one).ride}
    assert (said["Lean not sure"], said["No readings"], said["Readings frozen"]) == ("0:01", "2.4 s", "0.1 s")
    one.summary.not_sure_s, one.summary.missing_s, one.summary.frozen_s = 0.9, 0.05, 0.0
    assert {"Lean not sure", "No readings", "Readings frozen"}.isdisjoint(name for name, *_ in report.words(one).ride)


def test_a_short_ride_is_too_little_for_a_report():
    def too_little(riding_s):
        return report.words(seen(made(3000), riding_s=riding_s)).too_little

    assert too_little(10.0) == ""
    assert too_little(9.9) == "0:30 of log, 10 s of it riding: too little for a report."
    assert too_little(1.0) == "0:30 of log, 1 s of it riding: too little for a report."
    assert too_little(0.9) == "0:30 of log, all of it standing: too little for a report."


def test_the_row_of_a_stop():
    row = ("1:01", "72.0", "2.50", "30.0", "7.11", "8.12", "12", "0.2 left")
    assert report._stops([STOP]) == [row]
    other = report._stops([replace(STOP, side_m=-0.24, speed_from="integrated")])[0]
    assert (other[1], other[-1]) == ("72.0*", "0.2 right")
    assert report.words(seen(made(100), stops=[STOP])).remark == ""
    integrated = seen(made(100), stops=[replace(STOP, speed_from="integrated")])
    assert report.words(integrated).remark == "* no speed in the log: integrated from the acceleration"


def test_the_reason_for_no_stops():
    assert report.words(seen(made(100))).remark == "Stops: not known, the log has no speed."
    assert report.words(seen(made(100), riding_s=10.0)).remark == "No stop from over 10 km/h found."
    assert report.words(seen(made(100, speed_mps=5.0))).remark == "No stop from over 10 km/h found."


def alignment(
    roll: float | None = 0.1, pitch: float | None = None, yaw: float | None = 1.0, gravity: float | None = 1.0, **more
) -> str:
    found = Quality(roll, pitch, yaw, gravity, 30.0, np.zeros(1), np.zeros(1))
    return report.words(seen(made(100), found, **more)).alignment


def test_the_alignment_in_words():
    good = "Alignment: good. It seems off by roll +0.1°, yaw +1.0°, which costs less than 0.25° of lean."
    assert alignment() == good + " At rest the force is 1.000 g: right, 0.02 g from 1 are allowed."
    assert alignment(gravity=None) == good
    assert "At rest the force is 1.021 g and not 1: kickstand calibrate six" in alignment(gravity=1.021)
    assert ": right, 0.02 g" in alignment(gravity=0.981) and "and not 1" in alignment(gravity=0.979)
    assert alignment(yaw=4.7).startswith("Alignment: good") and not alignment(yaw=4.9).startswith("Alignment: good")
    assert "Yaw usually costs about 0.3° of lean; calibrate ride takes it out." in alignment(yaw=4.9)
    assert "Pitch usually costs about 0.3° of lean" in alignment(pitch=-3.0)
    assert "costs" not in alignment(yaw=None, gravity=None)
    assert alignment(roll=None, yaw=None).startswith("Alignment: not enough straight riding to know how far it is off.")
    assert alignment(vehicle="car", gravity=None) == "Alignment: it seems off by roll +0.1°, yaw +1.0°."
    assert "pitch -0.2°" in alignment(pitch=-0.2)


def test_the_figures_of_a_report_are_rounded():
    lean = np.where(np.arange(1000) > 500, 33.33333, 0.0)
    one = seen(made(1000, lean_deg=lean, speed_mps=12.34567), stops=[STOP], riding_s=5.55)
    one.summary.missing_s, one.summary.frozen_s = 1.0, 0.3
    data = report.as_data(one)
    assert (data["ride"], data["vehicle"], data["lean"]) == ("trip/RIDE.csv", "motorcycle", "live")
    assert (data["duration_s"], data["samples"]) == (9.99, 1000)
    assert (data["missing_s"], data["frozen_s"]) == (0.7, 0.3)
    assert data["max_right_deg"] == {"value": 33.3333, "time_s": 5.01} and data["max_left_deg"] is None
    assert data["max_speed_mps"] == {"value": 12.3457, "time_s": 0.0}
    assert data["beyond_30_deg_s"] == 4.99 and data["beyond_40_deg_s"] == 0.0
    assert data["stops"][0]["distance_m"] == 30.04 and data["stops"][0]["duration_s"] == 2.5
    assert data["alignment"] == {
        "roll_deg": 0.1, "pitch_deg": None, "yaw_deg": 1.0, "gravity_g": 1.0, "straight_s": 30.0,
    }  # fmt: skip
    assert data["lean_cost"] == {"roll_deg": 0.0, "pitch_deg": None, "yaw_deg": 0.05}
    car = report.as_data(seen(made(100), vehicle="car"))
    assert "lean" not in car and "max_left_deg" not in car and "lean_cost" not in car


def terminal(one, width=200) -> str:
    """Return the text of a report on a terminal."""
    console = Console(width=width, file=io.StringIO(), force_terminal=False)
    console.print(report.page(one))
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_a_report_on_a_terminal_has_its_parts_in_order():
    said = terminal(seen(made(1000), stops=[STOP])).splitlines()
    assert said[0].strip() == "RIDE.csv" and said[1].split()[:2] == ["Duration", "0:10"]
    places = [
        next(k for k, text in enumerate(said) if text.startswith(word)) for word in ("Duration", "Align", "Stops")
    ]
    assert places == sorted(places)
    (row,) = [text.split() for text in said if text.split()[:1] == ["1:01"]]
    assert row == ["1:01", "72.0", "2.50", "30.0", "7.11", "8.12", "12", "0.2", "left"]
    assert said[-1].startswith("MFDD: mean deceleration") or "MFDD: mean" in " ".join(said[-3:])


def test_a_report_without_stops_says_so_and_a_short_one_too():
    said = terminal(seen(made(1000, speed_mps=5.0), riding_s=3.0))
    assert "MFDD" not in said and said.rstrip().endswith("No stop from over 10 km/h found.")
    assert said.splitlines()[1].strip() == "0:10 of log, 3 s of it riding: too little for a report."


EXCHANGED = ForwardExchanged(False, "left", 0.0)


def test_an_exchanged_forward_has_neither_stops_nor_costs():
    one = seen(made(1000), notices=[EXCHANGED])
    assert report.words(one).remark == "Stops: not known, see the warning."
    data = report.as_data(one)
    assert data["lean_cost"] == {"roll_deg": None, "pitch_deg": None, "yaw_deg": None}
    assert data["alignment"]["roll_deg"] == 0.1 and data["remark"] == EXCHANGED.line()
    assert [remark["code"] for remark in data["remarks"]] == ["forward-exchanged"]
    assert report.as_data(seen(made(1000)))["remark"] == ""


def test_a_contradicted_calibration_is_not_judged():
    one = seen(made(1000), notices=[UpOff(30.0, False)])
    assert report.words(one).alignment == "Alignment: not judged, see the warning."
    data = report.as_data(one)
    assert set(data["alignment"].values()) == set(data["lean_cost"].values()) == {None}


@pytest.mark.parametrize(
    ("roll_deg", "speed", "notices", "car", "end"),
    [
        (4.1, 20.0, [], False, ": was it held upright?"),
        (-4.1, 20.0, [], False, ": was it held upright?"),
        (4.1, np.nan, [], False, ": were the poses swapped?"),
        (-4.1, 20.0, [EXCHANGED], False, ": were the poses swapped?"),
        (4.1, 20.0, [], True, "."),
        (3.9, 20.0, [EXCHANGED], False, "."),
    ],
)
def test_a_large_roll_asks_for_its_reason(roll_deg, speed, notices, car, end):
    """A pose on the kickstand is more than 4 degrees from upright."""
    found = Quality(roll_deg, None, 9.0, None, 30.0, np.zeros(1), np.zeros(1))
    more: Any = {"vehicle": "car"} if car else {}
    said = report.words(seen(made(1000, speed_mps=speed), found, notices=notices, **more)).alignment
    assert said.startswith(f"Alignment: it seems off by roll {roll_deg:+.1f}°, yaw +9.0°{end}")
    assert ("Yaw usually costs about 0.5° of lean" in said) is (not car and not notices)


@pytest.mark.parametrize(
    ("speed", "words"), [(20.0, "calibrate ride or drive takes it out"), (np.nan, "calibrate ride")]
)
def test_the_remedy_of_a_yaw_needs_a_speed_for_a_drive(speed, words):
    found = Quality(0.0, None, 9.0, None, 30.0, np.zeros(1), np.zeros(1))
    said = report.words(seen(made(1000, speed_mps=speed), found)).alignment
    assert f"; {words}" in said


@pytest.mark.parametrize(
    ("found", "good"),
    [
        (Quality(3.9, None, 0.0, None, 30.0, np.zeros(1), np.zeros(1)), False),
        (Quality(3.4, None, 4.0, None, 30.0, np.zeros(1), np.zeros(1)), True),
        (Quality(0.0, 1.0, 2.0, None, 30.0, np.zeros(1), np.zeros(1)), True),
        (Quality(0.0, 2.0, 2.0, None, 30.0, np.zeros(1), np.zeros(1)), False),
        (Quality(None, 0.0, 0.0, None, 30.0, np.zeros(1), np.zeros(1)), False),
        (Quality(0.0, None, None, None, 30.0, np.zeros(1), np.zeros(1)), False),
    ],
)
def test_an_alignment_is_good_if_all_costs_together_are_small(found, good):
    """A roll costs the part over 3.5 degrees, and a yaw or pitch of 2 degrees 0.10 or 0.17 degrees."""
    said = report.words(seen(made(1000), found)).alignment
    assert said.startswith("Alignment: good. ") is good
    off = report.words(seen(made(1000), found, notices=[PoseOff(2.0)])).alignment
    assert not off.startswith("Alignment: good")


@pytest.mark.parametrize(
    ("speed", "riding_s", "stops", "remark"),
    [
        (np.nan, 10.1, False, "Stops: not known, the log has no speed."),
        (np.nan, 10.0, True, "The speed falls to a stop, the force says otherwise: is the calibration this ride's?"),
        (20.0, 60.0, True, "The speed falls to a stop, the force says otherwise: is the calibration this ride's?"),
        (20.0, 60.0, False, "No stop from over 10 km/h found."),
    ],
)
def test_why_a_report_has_no_stops(monkeypatch, speed, riding_s, stops, remark):
    monkeypatch.setattr(report, "stops_by_speed", lambda course: stops)
    assert report.words(seen(made(1000, speed_mps=speed), riding_s=riding_s)).remark == remark


def test_a_smoothed_ride_says_so():
    one = seen(made(1000))
    one.ride.smoothed = True
    assert report.as_data(one)["lean"] == "smoothed"
    assert ("Lean", "best estimate", "from the whole ride") in report.words(one).ride
