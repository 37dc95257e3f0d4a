"""Tests the values that a ride's page draws, with lines, areas, bars and maps of a few points."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.analysis.plot import charts, interactive, page, track_map
from kickstand_tools.analysis.plot.charts import (
    LEFT_COLOUR,
    RIGHT_COLOUR,
    Bars,
    CellMap,
    Chart,
    Charts,
    Dots,
    Line,
    Note,
)
from support.small_rides import STOP, made, seen

pytest.importorskip("plotly")
NAN = math.nan


def drawn(*traces, **chart):
    """Return the figure of a page with one chart of these traces, and an empty one below."""
    above = Chart("above", list(traces), 2.0, (0.0, 9.0), (-1.0, 1.0), **chart)
    below = Chart("below", [], 3.0, (0.0, 1.0), (0.0, 1.0))
    return interactive.figure(Charts("a  ·  1:00  ·  <b>  ·  c", [above], [below], []))


def test_a_line_without_a_name_has_no_words():
    x, y = np.array([0.0, 1.0, 2.0]), np.array([1.0, NAN, 3.0])
    plain, dotted = drawn(Line(x, y, "red", "speed"), Line(x, y, "blue", dotted=True, width=2.0))["data"]
    assert (plain["x"], plain["y"], plain["name"], plain["line"]["color"]) == ([0.0, 2.0], [1.0, 3.0], "speed", "red")
    assert "name" not in dotted and dotted["line"]["width"] == 2.0 * plain["line"]["width"]
    assert (plain["line"]["dash"], dotted["line"]["dash"]) == ("solid", "dot")
    assert (plain["xaxis"], plain["yaxis"]) == ("x", "y")


def test_a_lean_is_filled_to_each_side_and_not_in_a_gap():
    x, y = np.array([0.0, 1.0, 2.0, 5.0, 6.0]), np.array([-1.0, -2.0, 3.0, 4.0, 0.0])
    left, right = drawn(charts.Sides(x, y, 2.0))["data"]
    assert (left["name"], right["name"]) == ("left", "right")
    assert (left["line"]["color"], right["line"]["color"]) == (LEFT_COLOUR, RIGHT_COLOUR)
    assert left["x"] == [0.0, 1.0, 2.0, 2.0, 3.5, 5.0] and left["y"] == [-1.0, -2.0, 0.0, 0.0, None, 0.0]
    assert right["x"] == [1.0, 2.0, 2.0, 3.5, 5.0, 5.0, 6.0] and right["y"] == [0.0, 3.0, 0.0, None, 0.0, 4.0, 0.0]


def test_bars_and_dots_have_their_values():
    bars, dots = drawn(
        Bars(np.array([-1.5, -0.5, 0.5]), np.array([1.0, 2.0, 3.00049]), 1.0, "share"),
        Dots(np.array([0.123456789]), np.array([-0.5]), "green", "straights"),
    )["data"]
    assert bars["marker"]["color"] == [LEFT_COLOUR, LEFT_COLOUR, RIGHT_COLOUR] and bars["width"] == 1.0
    assert bars["y"] == [1.0, 2.0, 3.0] and (bars["name"], dots["name"]) == ("share", "straights")
    assert (dots["x"], dots["y"]) == ([0.12346], [-0.5])


def test_cells_are_drawn_by_their_logarithm():
    edges = np.array([-0.05, 0.0, 0.05])
    (cells,) = drawn(CellMap(edges, np.array([[0.0, 10.0], [0.1, 1.0]]), "seconds"))["data"]
    assert cells["z"] == [[None, 1.0], [-1.0, 0.0]] and (cells["zmin"], cells["zmax"]) == (-1.0, 1.0)
    assert cells["x"] == cells["y"] == [-0.025, 0.025] and cells["name"] == "seconds, log10"
    (empty,) = drawn(CellMap(edges, np.zeros((2, 2)), "seconds"))["data"]
    assert "zmin" not in empty and empty["z"] == [[None, None]] * 2


def texts(figure, kind="layout"):
    return [(note["text"], note["x"], note["y"]) for note in figure[kind]["annotations"]]


def test_the_words_of_a_chart_are_at_their_places():
    figure = drawn(
        notes=[Note(3.0, 0.5, "30°", "left"), Note(4.0, 0.6, "", "right")], spans=[(2.0, 4.0, "7.1")], left="a\nb",
        right="c", x_title="x", y_title="y", ticks={0.0: "0:00", 5.0: "0:05", 9.0: "0:09"},
    )  # fmt: skip
    assert texts(figure) == [
        ("above", 0.0, 1.0), ("a<br>b", 0.0, 1.0), ("c", 1.0, 1.0), ("30°", 3.0, 0.5), ("7.1", 3.0, 1.0),
        ("below", 0.0, 1.0),
    ]  # fmt: skip
    (shade,) = figure["layout"]["shapes"]
    assert (shade["x0"], shade["x1"], shade["y0"], shade["y1"]) == (2.0, 4.0, 0, 1)
    axis = figure["layout"]["xaxis"]
    assert (axis["tickvals"], axis["ticktext"]) == ([0.0, 5.0, 9.0], ["0:00", "0:05", "0:09"])
    assert figure["narrow"]["xaxis"]["tickvals"] == [0.0, 9.0]
    assert (axis["range"], figure["layout"]["yaxis"]["range"]) == ((0.0, 9.0), (-1.0, 1.0))
    assert (axis["title"]["text"], figure["layout"]["yaxis"]["title"]["text"]) == ("x", "y")


def test_lines_are_named_only_if_there_are_several():
    x = np.array([0.0, 1.0])
    one, two = Line(x, x, "red", "speed"), Line(x, x, "blue", "force")
    assert texts(drawn(one))[0][0] == "above"
    both = "<span style='color:red'>speed</span>, <span style='color:blue'>force</span>"
    assert texts(drawn(one, two))[0][0] == f"above: {both}"
    assert texts(drawn(one, two), "narrow")[0][0] == f"above:<br>{both}"


def test_the_title_of_a_page_is_text_in_two_lines():
    figure = drawn()
    assert figure["layout"]["title"]["text"] == "a  ·  1:00<br>&lt;b&gt;  ·  c"
    assert figure["narrow"]["title"]["text"] == "a<br>1:00<br>&lt;b&gt;<br>c"


def track(n=301, **columns):
    places = {"lat_deg": 10.0 + np.arange(n) * 1e-5, "lon_deg": 8.0} | columns
    return seen(made(n, step_s=1.0, **places))


def test_a_map_has_a_point_each_fifth_of_a_second_up_to_20000(monkeypatch):
    one = track(11)
    assert len(track_map._times(track_map.track(one.course), 10.0)) == 51
    assert track_map._times(track_map.track(one.course), 5.0)[[0, -1]].tolist() == [0.0, 5.0]
    monkeypatch.setattr(track_map, "POINTS", 20)
    assert len(track_map._times(track_map.track(one.course), 10.0)) == 21


@pytest.mark.parametrize(("vehicle", "lean"), [("motorcycle", True), ("car", False)])
def test_the_points_of_a_map_have_time_lean_and_speed(vehicle, lean):
    one = track(lean_deg=np.arange(301) / 10.0, speed_mps=10.0)
    one.ride.calibration.vehicle = vehicle
    points = track_map.map_points(one)
    assert points is not None
    line, dots = track_map.figure(points, one)["data"]
    assert line["customdata"][0] == [0.0, 0.0, 36.0] and line["customdata"][-1][0] == pytest.approx(300.0, abs=1.0)
    assert len(line["x"]) == len(dots["x"]) == len(dots["customdata"])
    assert dots["customdata"] == [row[0] for row in line["customdata"]]
    assert dots["customdata"] == pytest.approx(points.t_s, abs=0.051) and dots["customdata"][1] % 1.0 != 0.0
    if lean:
        assert dots["marker"]["color"][-1] == pytest.approx(30.0, abs=0.1)
        assert dots["marker"]["colorbar"]["ticktext"] == ["30", "0", "30"]
    else:
        assert isinstance(dots["marker"]["color"], str) and "colorbar" not in dots["marker"]


def test_a_lean_that_is_not_trusted_has_no_dot_on_the_map():
    one = track(sure=np.where(np.arange(301) < 150, 0.0, 1.0))
    points = track_map.map_points(one)
    assert points is not None
    line, dots = track_map.figure(points, one)["data"]
    assert line["customdata"][0][1] is None and line["customdata"][-1][1] == 0.0
    assert min(dots["customdata"]) == pytest.approx(150.0, abs=1.0) and len(dots["x"]) < len(line["x"])


def test_a_map_ends_before_the_poles():
    one = track(lat_deg=np.linspace(84.0, 89.0, 301))
    points = track_map.map_points(one)
    assert points is not None and points.lat_deg == 85.0 and np.nanmax(points.north_m) == pytest.approx(0.0)


def test_a_page_has_its_map_and_warnings_if_asked(monkeypatch):
    given: list = []
    monkeypatch.setattr(page, "filled", lambda path, **values: given.append(values) or "")
    one = track()
    page.page(one, "LIBRARY", "ALLOWED")
    page.page(one, "LIBRARY", "ALLOWED", tiles=True, warnings=True)
    page.page(seen(made(100), stops=[STOP]), "LIBRARY", "ALLOWED")
    plain, streets, without = given
    assert plain["map"]["tiles"] is None and streets["map"]["tiles"]["most"] == 19 and without["map"] is None
    assert plain["map"]["axes"] == ["x", "x2"] and plain["map"]["shape"] == 0.6
    assert page.TILES_HOST not in plain["policy"] and page.TILES_HOST in streets["policy"]
    assert "hovermode" in plain["charts"]["layout"] and "hovermode" not in without["charts"]["layout"]
    assert plain["title"] == "RIDE" and "script-src ALLOWED " in plain["policy"]


def test_warnings_are_shown_above_the_charts_only_if_asked(monkeypatch):
    given: list = []
    monkeypatch.setattr(page, "filled", lambda path, **values: given.append(values["warnings"]) or "")
    from kickstand_tools.checks.mount import UpOff

    one = replace(seen(made(100)), notices=[UpOff(30.0, False)])
    page.page(one, "", "")
    page.page(one, "", "", warnings=True)
    assert given[0] == [] and len(given[1]) == 1 and given[1][0].startswith("Warning: the calibration's up is 30")
