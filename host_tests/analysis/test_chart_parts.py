"""Tests the charts and the map of small rides. The results were computed by hand."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.analysis.alignment_quality import Quality
from kickstand_tools.analysis.plot import charts, interactive, page, track_map
from support.small_rides import STOP, made, seen


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
    """For 30 s the bike has a force of 0.26 g to the right and brakes with 0.51 g. Then the bike is at rest."""
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
    assert few[0].tolist() == [1.0, 3.0, 6.0, 7.0]  # of each four values the smallest and the largest are kept


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
    """The world is 40 030 km wide at the equator, and half as wide at 60 degrees north. In the Mercator projection, 60
    degrees north is 1.3170 radii from the equator."""
    none = np.zeros(1)
    found = page.tiles_at(track_map.MapPoints(none, none, none, none, none, 60.0, 90.0))
    assert found["world_m"] == pytest.approx(40_030_174.0 / 2.0, rel=1e-3)
    assert found["west_m"] == pytest.approx(0.75 * found["world_m"])
    assert found["north_m"] == pytest.approx(found["world_m"] / (2 * np.pi) * (np.pi - 1.3170), rel=1e-4)
