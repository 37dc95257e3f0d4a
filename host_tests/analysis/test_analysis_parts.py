"""Tests the figures, words and charts of a report with small channels. The expected results were computed by hand."""

from dataclasses import fields, replace

import numpy as np
import pytest
from kickstand.lean.upright_trim import MAX_TRIM
from kickstand_tools import api
from kickstand_tools.analysis import overview as overviews, report, track
from kickstand_tools.analysis.alignment_quality import LeanCost, Quality, lean_cost, quality, yaw_cost_deg
from kickstand_tools.analysis.channels import Channels, downsampled, joined, rounded_to, spacing_s, thinned
from kickstand_tools.analysis.overview import Overview
from kickstand_tools.analysis.plot import charts, interactive, page, track_map
from kickstand_tools.analysis.ride import AbsurdReadings, Ride, _divergence_notice
from kickstand_tools.analysis.stops.brake_test import Stop
from kickstand_tools.analysis.summary import Peak, Summary, summary
from kickstand_tools.logs.reader import read_blocks


def made(n: int, step_s: float = 0.01, **columns) -> Channels:
    """Return n samples of an upright bike whose lean is trusted.

    columns: {name of a channel: another value, a number or shape (n)}.
    """
    usual = {"up_g": 1.0, "sure": 1.0, "speed_mps": np.nan, "lat_deg": np.nan, "lon_deg": np.nan, "utc_s": np.nan}
    usual |= {"temp_c": np.nan, "t_s": np.arange(n) * step_s} | columns
    return Channels(*(np.full(n, 0.0) + usual.get(field.name, 0.0) for field in fields(Channels)))


def seen(course: Channels, found: Quality | None = None, stops=(), riding_s=60.0, notices=(), **calibration):
    log = api.Log(np.array([0.0, 0.01]), np.tile([0.0, 1.0, 0.0], (2, 1)), np.zeros((2, 3)), name="trip/RIDE.csv")
    ride = Ride(log, api.CalibrationFile(aligned=True, **calibration))
    none = np.zeros(1)
    found = found or Quality(0.1, None, 1.0, 1.0, 30.0, none, none)
    return Overview(ride, summary(course), course, list(stops), found, riding_s, list(notices))


STOP = Stop(61.0, 63.5, 20.0, 30.04, 7.114, 8.125, 12.4, 0.24, 1.0, "log")


def test_the_lean_is_not_trusted_from_65_degrees():
    course = made(4, lean_deg=np.array([64.9, 65.0, -65.0, 10.0]), sure=np.array([1.0, 1.0, 1.0, 0.0]))
    assert course.trusted.tolist() == [True, False, False, False]


def test_forces_and_rates_are_along_left_up_forward():
    course = made(1, left_g=1.0, up_g=2.0, forward_g=3.0, pitch_rate_dps=4.0, yaw_rate_dps=5.0, roll_rate_dps=6.0)
    assert course.force_g.tolist() == [[1.0, 2.0, 3.0]] and course.rate_dps.tolist() == [[-4.0, 5.0, 6.0]]


def test_samples_are_averaged_over_each_stretch():
    """Each stretch of 0.02 s has two samples. A NaN does not count. The last position of a stretch is kept."""
    lean, lat = np.array([1.0, 3.0, np.nan, 5.0, np.nan, np.nan]), np.array([1.0, 2.0, 3.0, np.nan, np.nan, np.nan])
    course = made(6, lean_deg=lean, lat_deg=lat)
    found = joined(downsampled([course.part(slice(0, 3)), course.part(slice(3, 6))], 0.02))
    assert found.t_s == pytest.approx([0.005, 0.025, 0.045])
    assert found.lean_deg == pytest.approx([2.0, 5.0, np.nan], nan_ok=True)
    assert found.lat_deg == pytest.approx([2.0, 3.0, np.nan], nan_ok=True)
    assert thinned(course, 0.01) is course and len(thinned(course, 0.02).t_s) == 3
    assert rounded_to(np.array([0.014, 0.016]), 0.01) == pytest.approx([0.01, 0.02])
    assert spacing_s(course) == pytest.approx(0.01) and spacing_s(made(1)) == 1.0


def test_a_peak_keeps_the_first_of_the_largest_values():
    peak = Peak()
    peak.add(np.array([1.0, 2.0, 3.0]), np.array([-1.0, -2.0, np.nan]))
    assert (peak.value, peak.time_s) == (0.0, None)
    peak.add(np.array([4.0, 5.0, 6.0]), np.array([2.0, np.nan, 2.0]))
    peak.add(np.array([7.0]), np.array([2.0]))
    assert (peak.value, peak.time_s) == (2.0, 4.0)
    peak.add(np.zeros(0), np.zeros(0))
    peak.add(np.array([8.0]), np.array([np.nan]))
    assert peak.value == 2.0


def test_a_maximum_of_the_lean_must_be_held():
    """A lean of 40 degrees lasts for one sample and does not count. Leans of 35 degrees to the right and 30 degrees to
    the left last for a second and count."""
    lean = np.zeros(1000)
    lean[100], lean[200:301], lean[500:601] = 40.0, 35.0, -30.0
    total = summary(made(1000, lean_deg=lean))
    assert (total.right_deg.value, total.left_deg.value) == (35.0, 30.0)
    assert total.right_deg.time_s == pytest.approx(2.0) and total.left_deg.time_s == pytest.approx(5.0)
    parts = Summary()
    course = made(1000, lean_deg=lean)
    for begin in range(0, 1000, 50):  # a lean may continue over several blocks
        parts.add(course.part(slice(begin, begin + 50)))
    assert (parts.right_deg.value, parts.left_deg.value) == (35.0, 30.0)
    assert (parts.samples, parts.duration_s) == (1000, pytest.approx(9.99))


def test_a_summary_by_hand():
    """The ride takes 10 s. The bike leans by 30 degrees from 2 to 4 s, and by 40 degrees from 4 to 5 s. From 6 to 7 s
    the lean is uncertain. From 8 s on the bike is at rest."""
    t_s, lean, sure, rest = np.arange(1000) / 100.0, np.zeros(1000), np.ones(1000), np.zeros(1000)
    lean[200:400], lean[400:500], lean[600:700], sure[600:700], rest[800:] = 30.0, 40.0, 60.0, 0.0, 1.0
    shown = np.where(t_s < 1.0, 0.3, np.where(t_s < 2.0, -0.6, np.where(sure > 0.0, 0.0, 2.0)))
    total = summary(made(1000, lean_deg=lean, sure=sure, resting=rest, shown_g=shown, speed_mps=t_s))
    assert (total.accel_g.value, total.brake_g.value, total.brake_g.time_s) == (0.3, 0.6, 1.0)
    assert total.beyond_s == pytest.approx({30.0: 3.0, 40.0: 1.0})
    assert total.not_sure_s == pytest.approx(1.0)
    assert total.riding_s == pytest.approx(8.0, abs=0.011)
    assert float(np.sum(total.histogram_s)) == pytest.approx(7.0, abs=0.011)
    # the bins are one degree wide and begin at -70 degrees
    assert total.histogram_s[[100, 110]] == pytest.approx([2.0, 1.0])
    assert (total.speed_mps.value, total.speed_mps.time_s) == (9.99, 9.99)
    assert (total.missing_s, total.frozen_s) == (0.0, 0.0)


def test_time_without_readings_is_missing():
    t_s = np.arange(500) / 100.0
    t_s[250:] += 3.0
    total = summary(made(500, t_s=t_s + 7.0))
    assert total.missing_s == pytest.approx(3.01) and total.duration_s == pytest.approx(7.99)
    assert total.riding_s == pytest.approx(4.98)
    assert summary(made(100, step_s=0.5)).missing_s == 0.0  # two samples per second are no gaps


def test_the_alignment_of_a_straight_ride_by_hand():
    """The bike always leans by 2 degrees to the right. It brakes and accelerates by 0.2 g. A tenth of this force is
    along left."""
    n, push = 10_000, 0.2 * np.where(np.arange(10_000) // 100 % 2, 1.0, -1.0)
    tilt = np.tan(np.radians(2.0))
    standing = (np.arange(n) < 500) | (np.arange(n) >= n - 500)
    push = np.where(standing, 0.0, push)
    course = made(n, left_g=tilt + 0.1 * push, up_g=1.0, forward_g=push + np.where(standing, 0.0, 0.05))
    found = quality(course, standing)
    assert found.roll_deg == pytest.approx(2.0, abs=0.01)
    assert found.yaw_deg == pytest.approx(np.degrees(np.arctan(0.1)), abs=0.01)
    assert found.pitch_deg == pytest.approx(np.degrees(np.arcsin(0.05)), abs=0.01)
    assert found.gravity_g == pytest.approx(np.hypot(1.0, tilt))
    assert found.straight_s == pytest.approx(90.0) and len(found.forward_g) == 180


def test_what_a_ride_must_have_to_show_its_alignment():
    def of(seconds=100.0, yaw_dps=0.0, push_g=0.2, stands=True):
        n = round(seconds * 100)
        standing = np.zeros(n, dtype=bool)
        if stands:
            standing[[*range(100), *range(n - 100, n)]] = True
        push = np.where(np.arange(n) // 100 % 2, push_g, -push_g)
        return quality(made(n, forward_g=push, yaw_rate_dps=yaw_dps), standing)

    assert of(yaw_dps=1.9).roll_deg is not None and of(yaw_dps=2.1).roll_deg is None
    # 2 s of this time are standstill
    assert of(seconds=12.6).roll_deg is not None and of(seconds=11.4).roll_deg is None
    assert of(push_g=0.06).yaw_deg is not None and of(push_g=0.04).yaw_deg is None
    assert of(seconds=63.0).pitch_deg is not None and of(seconds=61.0).pitch_deg is None
    assert of(stands=False).pitch_deg is None and of(stands=False).gravity_g is None


def test_the_cost_of_an_angle_in_degrees_of_lean():
    """A yaw error costs 3 degrees times its sine, and a pitch error 5 degrees times its sine. A roll error costs the
    part that the trim does not correct."""
    assert yaw_cost_deg(-30.0) == pytest.approx(1.5)
    none = np.zeros(1)
    cost = lean_cost(Quality(-9.0, -30.0, 30.0, 1.0, 30.0, none, none))
    trim = float(np.degrees(MAX_TRIM))
    assert (cost.roll_deg, cost.pitch_deg, cost.yaw_deg) == pytest.approx((9.0 - trim, 2.5, 1.5))
    assert lean_cost(Quality(None, None, None, 1.0, 0.0, none, none)) == LeanCost(None, None, None)


def test_a_vehicle_has_moved_if_it_turned_pushed_or_had_a_speed():
    n = 4000

    def moved(**columns) -> bool:
        return overviews._has_moved(made(n, **columns))

    bump = (np.arange(n) > 2000) & (np.arange(n) < 2500)
    assert moved(yaw_rate_dps=3.1 * bump) and not moved(yaw_rate_dps=2.9 * bump)
    assert moved(forward_g=-0.052 * bump) and not moved(forward_g=0.048 * bump)
    # constant values come from the slope of the ground and the gyro's bias
    assert not moved(forward_g=0.3, yaw_rate_dps=9.0)
    assert moved(speed_mps=1.1) and not moved(speed_mps=0.9, yaw_rate_dps=50.0 * bump)
    assert not overviews._has_moved(made(100, yaw_rate_dps=np.arange(100.0)))
    assert overviews._changes(np.array([1.0, 2.0, 8.0])) == 6.0
    still = np.arange(n) < 1000
    assert overviews._riding_s(made(n), still) == 0.0
    assert overviews._riding_s(made(n), still, whole=False) == pytest.approx(30.0)


def test_positions_are_interpolated_except_in_gaps():
    found = track.LogTrack(np.array([0.0, 4.0, 10.0]), np.array([1.0, 3.0, 4.0]), np.array([179.0, -179.0, -178.0]))
    lat, lon = found.at(np.array([-1.0, 0.0, 1.0, 4.0, 7.0, 10.0, 11.0]))
    assert lat == pytest.approx([np.nan, 1.0, 1.5, 3.0, np.nan, 4.0, np.nan], nan_ok=True)
    assert lon == pytest.approx([np.nan, 179.0, 179.5, -179.0, np.nan, -178.0, np.nan], nan_ok=True)
    five = track.LogTrack(np.array([0.0, 5.0]), np.zeros(2), np.zeros(2))
    assert not np.isnan(five.at(np.array([2.0]))[0][0])
    part = track.track(made(3, lat_deg=np.array([1.0, np.nan, 2.0]), lon_deg=np.array([3.0, 4.0, np.nan])))
    assert part.lat_deg.tolist() == [1.0] and part.lon_deg.tolist() == [3.0]


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


def test_absurd_readings_are_those_of_the_second_before():
    t_s = np.arange(300) / 100.0
    force, rates = np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3))
    force[50, 0], rates[60, 0] = 99.0, 9999.0  # at 0.5 and 0.6 s, too early to be named for 2.5 s
    force[160, 2], rates[250, 1] = -30.0, -5000.0
    (block,) = read_blocks(api.Log(t_s, force, rates))
    notice = _divergence_notice(block, 250)
    assert isinstance(notice, AbsurdReadings)
    assert (notice.at_s, notice.rate_dps, notice.force_g) == pytest.approx((2.5, 5000.0, 30.0))


def lean_chart(**columns):
    return charts.charts(seen(made(6000, **columns))).over_time[0]


def test_the_lean_axis_reaches_over_its_maxima():
    held = np.where(np.arange(6000) > 3000, 40.0, 0.0)
    chart = lean_chart(lean_deg=held)
    assert chart.y_range == pytest.approx((-48.0, 48.0)) and chart.x_range == pytest.approx((0.0, 59.99))
    assert [(note.y, note.text, note.side) for note in chart.notes] == [(40.0, "40° right", "above")]
    assert lean_chart(lean_deg=0.1 * held).y_range == (-20.0, 20.0)
    doubt = lean_chart(lean_deg=held, doubtful=np.where(held > 0.0, 0.5, 0.4))
    assert doubt.y_range == pytest.approx((-52.8, 48.0))
    line = doubt.traces[1]
    assert isinstance(line, charts.Line) and np.nanmax(line.y) == pytest.approx(-50.4)
    assert np.count_nonzero(~np.isnan(line.y)) == 2999
    assert chart.ticks == {float(k): f"0:{k:02}" for k in range(0, 60, 5)}


def test_the_charts_of_force_and_speed_have_a_margin():
    course = made(6000, lateral_g=0.5, forward_g=-0.5, speed_mps=10.0)
    _, speed, force = charts.charts(seen(course, stops=[STOP])).over_time
    assert speed.y_range == pytest.approx((0.0, 37.8)) and speed.title == "Speed, km/h"
    assert force.y_range == pytest.approx((-0.55, 0.55))
    assert force.spans == [(61.0, 63.5, "7.1")]
    flat = charts.charts(seen(made(6000))).over_time[-1]
    assert flat.y_range == (-0.01, 0.01)


def test_the_chart_of_shares_is_cut_above_small_leans():
    """The bike is upright for 90 % of the time, and leans by 30 degrees for 10 %. The chart ends at 1.5 times 10 %."""
    lean = np.where(np.arange(6000) >= 5400, 30.5, 0.5)
    chart = charts.charts(seen(made(6000, lean_deg=lean))).below[1]
    assert chart.y_range == pytest.approx((0.0, 15.0), abs=0.02) and chart.right == "90 % upright"
    bars, line = chart.traces
    assert isinstance(bars, charts.Bars) and isinstance(line, charts.Line)
    assert bars.y[[70, 100]] == pytest.approx([90.0, 10.0], abs=0.02) and bars.width == 1.0 and bars.x[70] == 0.5
    assert line.x.tolist() == [30.5, 30.5] and line.y == pytest.approx([0.0, 0.82 * 15.0], abs=0.02)
    assert chart.notes[0].side == "above" and chart.x_range == pytest.approx((-36.6, 36.6))
    assert chart.ticks == {-20.0: "20", 0.0: "0", 20.0: "20"}
    even = charts.charts(seen(made(6000, lean_deg=np.where(np.arange(6000) >= 3000, 30.5, 0.5)))).below[1]
    assert even.right == "" and even.y_range[1] == pytest.approx(52.5, abs=0.05)


def test_the_chart_of_g_against_g_counts_seconds():
    """For 30 s the bike has a force of 0.26 g to the right and brakes with 0.51 g. Then it is at rest."""
    course = made(6000, lateral_g=-0.26, forward_g=-0.51, resting=np.arange(6000) >= 3000)
    cells, *rings = charts.charts(seen(course)).below[0].traces
    assert isinstance(cells, charts.CellMap)
    row, column = np.argwhere(cells.values)[0]
    assert cells.edges[row] < -0.51 < cells.edges[row + 1] and cells.edges[column] < 0.26 < cells.edges[column + 1]
    assert cells.values.sum() == pytest.approx(30.0)
    assert np.diff(cells.edges) == pytest.approx(np.full(len(cells.edges) - 1, 0.025)) and len(rings) == 1
    assert cells.edges[-1] == pytest.approx((21 + 2) * 0.025)


def test_the_alignment_chart_has_the_line_of_the_yaw():
    found = Quality(1.0, None, 45.0, 1.01, 30.0, np.array([0.3, -0.2]), np.array([0.8, -0.6]))
    chart = charts.charts(seen(made(600), found)).below[-1]
    guide, dots, line = chart.traces
    assert isinstance(guide, charts.Line) and isinstance(dots, charts.Dots) and isinstance(line, charts.Line)
    assert chart.x_range == pytest.approx((-0.88, 0.88)) and guide.y == pytest.approx([-0.88, 0.88])
    assert dots.x.tolist() == [-0.3, 0.2] and line.x == pytest.approx([0.8, -0.8]) and line.y.tolist() == [-0.8, 0.8]
    assert chart.left == "roll +1.0°\nyaw +45.0°\nat rest\n1.010 g"
    nothing = Quality(None, None, None, None, 0.0, np.zeros(0), np.zeros(0))
    empty = charts.charts(seen(made(600), nothing)).below[-1]
    assert empty.left == "not enough straight riding" and empty.x_range == (-0.5, 0.5) and len(empty.traces) == 2


def test_the_title_names_the_maxima():
    lean = np.where(np.arange(6000) > 3000, 40.0, 0.0)
    said = charts.title(seen(made(6000, lean_deg=lean, shown_g=-0.25)))
    assert said == "RIDE  ·  1:00  ·  lean as displayed -- left, 40° right  ·  braking 0.25 g, acceleration --"


def test_an_envelope_breaks_the_line_in_the_middle_of_a_gap():
    time, values = np.array([0.0, 1.0, 4.0, 5.0]), np.array([1.0, 2.0, 3.0, 4.0])
    x, y = charts.envelope(time, values, 10, gap_s=2.0)
    assert x.tolist() == [0.0, 1.0, 2.5, 4.0, 5.0] and y[:2].tolist() == [1.0, 2.0] and np.isnan(y[2])
    assert len(charts.envelope(time, values, 10, gap_s=3.0)[0]) == 4
    few = charts.envelope(np.arange(8.0), np.array([0.0, 9.0, 1.0, -9.0, 2.0, 2.0, 5.0, 1.0]), 4)
    assert few[0].tolist() == [1.0, 3.0, 6.0, 7.0]  # the smallest and the largest of each four values


def test_numbers_of_a_page_are_rounded_and_nan_is_none():
    assert interactive.plain(np.array([1.23456, np.nan])) == [1.235, None]
    assert interactive.plain(np.array([1.26]), 1) == [1.3]


def test_a_filled_line_keeps_the_ends_of_its_zeros():
    drawn = interactive._filled("left", np.arange(8.0), np.array([0, 0, 0, -1, 0, 0, 0, -2.0]), "red")
    assert drawn["x"] == [2.0, 3.0, 4.0, 6.0, 7.0] and drawn["y"] == [0.0, -1.0, 0.0, 0.0, -2.0]


def test_the_page_of_charts_fits_its_window():
    """The charts have heights of 2.5, 2.5 and 3 inches, and an inch has 86 pixels. The two gaps have 62 pixels, and the
    margins 100 and 80."""
    figure = interactive.figure(charts.charts(seen(made(6000))), linked=True)
    layout, narrow = figure["layout"], figure["narrow"]
    assert layout["height"] == 215 + 215 + 258 + 2 * 62 + 180
    assert narrow["height"] == 215 + 215 + 3 * 258 + 4 * 96 + 220
    assert layout["yaxis"]["domain"] == pytest.approx([1.0 - 215 / 812, 1.0])
    assert layout["yaxis2"]["domain"] == pytest.approx([1.0 - (2 * 215 + 62) / 812, 1.0 - (215 + 62) / 812])
    assert layout["yaxis3"]["domain"] == pytest.approx([0.0, 258 / 812])
    wide = (1.0 - 2 * 0.085) / 3.0
    assert layout["xaxis3"]["domain"] == pytest.approx([0.0, wide])
    assert layout["xaxis4"]["domain"] == pytest.approx([wide + 0.085, 2 * wide + 0.085])
    assert layout["xaxis5"]["domain"] == pytest.approx([1.0 - wide, 1.0])
    assert layout["xaxis2"]["matches"] == "x" and "matches" not in layout["xaxis"]
    assert layout["hovermode"] == "x" and layout["xaxis"]["hoverformat"] == ".1f"
    assert len(narrow["xaxis"]["tickvals"]) == -(-len(layout["xaxis"]["tickvals"]) // 2)
    assert narrow["xaxis4"]["tickvals"] == layout["xaxis4"]["tickvals"]
    assert layout["yaxis3"]["scaleanchor"] == "x3" and "scaleanchor" not in layout["yaxis"]
    assert interactive.time_axes(charts.charts(seen(made(6000)))) == ["x", "x2"]
    assert "hovermode" not in interactive.figure(charts.charts(seen(made(6000))))["layout"]


def test_a_track_is_in_metres_from_its_middle():
    """At 60 degrees north, 0.01 degrees of longitude are 556 m, and 0.01 degrees of latitude are 1112 m. The points are
    at least 0.2 s apart."""
    course = made(1001, lat_deg=60.0 + np.arange(1001) * 1e-5, lon_deg=8.0 + np.arange(1001) * 1e-5, speed_mps=10.0)
    one = seen(course)
    points = track_map.map_points(one)
    assert points is not None
    assert len(points.t_s) == 51 and points.t_s[:2] == pytest.approx([0.0, 0.2])
    assert (points.lat_deg, points.lon_deg) == pytest.approx((60.005, 8.0))
    assert points.east_m[[0, -1]] == pytest.approx([0.0, 555.9], abs=0.5)
    assert points.north_m[[0, -1]] == pytest.approx([-556.0, 556.0], abs=0.5)
    assert np.allclose(points.speed_kmh, 36.0)
    assert track_map.shape(points) == 0.6
    flat = replace(points, north_m=points.north_m / 1112.0 * 370.0)
    assert track_map.shape(flat) == pytest.approx(1.5, abs=0.01)
    assert track_map.shape(replace(points, north_m=0.0 * points.north_m)) == 2.2
    marks = track_map.figure(points, one)["data"][1]["marker"]
    assert (marks["cmin"], marks["cmax"]) == (-30.0, 30.0)
    assert track_map.map_points(seen(made(10))) is None


def test_points_of_a_map_that_hardly_move_are_left_out():
    east, north = (
        np.array([0.0, 0.3, 0.4, np.nan, np.nan, 0.4, 5.0]),
        np.array([0.0, 0.1, 0.2, np.nan, np.nan, 0.2, 5.0]),
    )
    assert track_map._moved(east, north).tolist() == [0, 2, 3, 5, 6]


def test_the_tiles_are_placed_by_mercator():
    """The world is 40 030 km wide at the equator, and half as wide at 60 degrees north. In the Mercator projection this
    latitude is 1.3170 radii from the equator."""
    none = np.zeros(1)
    found = page.tiles_at(track_map.MapPoints(none, none, none, none, none, 60.0, 90.0))
    assert found["world_m"] == pytest.approx(40_030_174.0 / 2.0, rel=1e-3)
    assert found["west_m"] == pytest.approx(0.75 * found["world_m"])
    assert found["north_m"] == pytest.approx(found["world_m"] / (2 * np.pi) * (np.pi - 1.3170), rel=1e-4)
