"""The charts of a ride as data, and as the page and the picture draw them. Left is on the left, braking is below."""

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kickstand_tools.analysis.plot import charts, interactive, page, picture
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
    Sides,
)
from kickstand_tools.checks.mount import UpOff
from kickstand_tools.estimation.smooth import NotTheBikes
from small_rides import STOP, overview_of, quality_of, samples

NAN = np.nan
HELD = np.where(np.arange(6000) > 3000, 40.0, 0.0)  # a lean to the right in the second half


def chart_of(ride_overview, title) -> Any:
    drawn = charts.charts(ride_overview)
    (chart,) = (chart for chart in (*drawn.over_time, *drawn.below) if chart.title.startswith(title))
    return chart


def chart(title, **columns) -> Any:
    return chart_of(overview_of(samples(6000, **columns)), title)


@pytest.mark.parametrize(
    ("lean", "side", "note"), [(HELD, "above", (40.0, "40° right")), (-HELD, "below", (-40.0, "40° left"))]
)
def test_the_lean_has_its_maxima_with_right_above(lean, side, note):
    lean_chart = chart("Lean", lean_deg=lean)
    assert lean_chart.y_range == pytest.approx((-48.0, 48.0)) and lean_chart.x_range == pytest.approx((0.0, 59.99))
    assert [(each.y, each.text, each.side) for each in lean_chart.notes] == [(*note, side)]
    assert lean_chart.ticks == {float(k): f"0:{k:02}" for k in range(0, 60, 5)}
    assert chart("Lean", lean_deg=0.1 * lean).y_range == (-20.0, 20.0)


def test_a_doubtful_lean_has_a_line_below_it():
    doubt = chart("Lean", lean_deg=HELD, doubtful=np.where(HELD > 0.0, 0.5, 0.4))
    _, line = doubt.traces
    assert doubt.y_range == pytest.approx((-52.8, 48.0)) and np.nanmax(line.y) == pytest.approx(-50.4)
    assert np.count_nonzero(~np.isnan(line.y)) == 2999 and "yellow: less exact" in doubt.title
    assert "yellow" not in chart("Lean").title


def test_the_charts_of_force_and_speed_have_a_margin():
    course = samples(6000, lateral_g=0.5, forward_g=-0.5, speed_mps=10.0)
    _, speed, force = charts.charts(overview_of(course, stops=[STOP])).over_time
    assert speed.y_range == pytest.approx((0.0, 37.8)) and speed.title == "Speed, km/h"
    assert force.y_range == pytest.approx((-0.55, 0.55)) and force.spans == [(61.0, 63.5, "7.1")]
    assert chart("Acceleration").y_range == (-0.01, 0.01)


@pytest.mark.parametrize(
    ("car", "speed", "titles"),
    [
        (False, True, ["Lean", "Speed", "Acceleration"]),
        (True, False, ["Acceleration"]),
        (False, False, ["Lean", "Acceleration"]),
    ],
)
def test_charts_of_lean_and_speed_are_drawn_only_if_present(car, speed, titles):
    course = samples(600, speed_mps=10.0 if speed else NAN)
    drawn = charts.charts(overview_of(course, vehicle="car" if car else "motorcycle"))
    assert [chart.title.partition(",")[0] for chart in drawn.over_time] == titles and len(drawn.below) == 3 - car


def test_the_chart_of_shares_is_cut_above_small_leans():
    """The bike is upright for 90 % of the time, and leans by 30 degrees for 10 %. The chart ends at 1.5 times 10 %."""
    shares = chart("How long", lean_deg=np.where(np.arange(6000) >= 5400, 30.5, 0.5))
    bars, line = shares.traces
    assert shares.y_range == pytest.approx((0.0, 15.0), abs=0.02) and shares.right == "90 % upright"
    assert bars.y[[70, 100]] == pytest.approx([90.0, 10.0], abs=0.02) and bars.width == 1.0 and bars.x[70] == 0.5
    assert line.x.tolist() == [30.5, 30.5] and line.y == pytest.approx([0.0, 0.82 * 15.0], abs=0.02)
    assert shares.notes[0].side == "above" and shares.x_range == pytest.approx((-36.6, 36.6))
    assert shares.ticks == {-20.0: "20", 0.0: "0", 20.0: "20"}
    even = chart("How long", lean_deg=np.where(np.arange(6000) >= 3000, 30.5, 0.5))
    assert even.right == "" and even.y_range[1] == pytest.approx(52.5, abs=0.05)
    left = chart("How long", lean_deg=np.where(np.arange(6000) >= 3000, -4.5, 0.5)).notes[0]
    assert (left.side, left.x) == ("left", -4.5)


def test_the_chart_of_g_against_g_counts_seconds():
    """For 30 s the bike has a force of 0.26 g to the right and brakes with 0.51 g. Then the bike is at rest."""
    g_chart = chart("g against", lateral_g=-0.26, forward_g=-0.51, resting=np.arange(6000) >= 3000)
    cells, *rings = g_chart.traces
    row, column = np.argwhere(cells.values)[0]
    assert cells.edges[row] < -0.51 < cells.edges[row + 1] and cells.edges[column] < 0.26 < cells.edges[column + 1]
    assert cells.values.sum() == pytest.approx(30.0) and np.diff(cells.edges) == pytest.approx(0.025)
    assert len(rings) == 1 and cells.edges[-1] == pytest.approx((21 + 2) * 0.025)


def test_the_alignment_chart_has_the_line_of_the_yaw():
    """Forces to the left are on the left. The line that shows the yaw error goes through the points."""
    ride_overview = overview_of(samples(600), quality_of(1.0, None, 45.0, 1.01, [0.3, -0.2], [0.8, -0.6]))
    alignment = chart_of(ride_overview, "Alignment")
    guide, dots, line = alignment.traces
    assert alignment.x_range == pytest.approx((-0.88, 0.88)) and guide.y == pytest.approx([-0.88, 0.88])
    assert dots.x.tolist() == [-0.3, 0.2] and line.x == pytest.approx([0.8, -0.8]) and line.y.tolist() == [-0.8, 0.8]
    assert alignment.left == "roll +1.0°\nyaw +45.0°\nat rest\n1.010 g"
    unjudged = chart_of(replace(ride_overview, notices=[UpOff(20.0, False)]), "Alignment")
    assert unjudged.left == "not judged" and len(unjudged.traces) == 2
    empty = chart_of(overview_of(samples(600), quality_of()), "Alignment")
    assert empty.left == "not enough straight riding" and empty.x_range == (-0.5, 0.5) and len(empty.traces) == 2


@pytest.mark.parametrize(
    ("columns", "how", "words"),
    [
        ({"shown_g": -0.25}, {}, "lean as displayed -- left, 40° right  ·  braking 0.25 g, acceleration --"),
        ({"sure": 0.0}, {"smoothed": True}, "smoothed lean -- left, -- right  ·  braking --, acceleration --"),
        ({"shown_g": 0.25}, {"vehicle": "car"}, "braking --, acceleration 0.25 g"),
    ],
)
def test_the_title_names_the_maxima(columns, how, words):
    title = charts.title(overview_of(samples(6000, lean_deg=HELD, **columns), **how))
    assert title == f"RIDE  ·  1:00  ·  {words}"


def test_an_envelope_keeps_peaks_and_breaks_the_line_in_gaps():
    time, values = np.array([0.0, 1.0, 4.0, 5.0]), np.array([1.0, 2.0, 3.0, 4.0])
    x, y = charts.envelope(time, values, 10, gap_s=2.0)
    assert x.tolist() == [0.0, 1.0, 2.5, 4.0, 5.0] and np.isnan(y[2]) and y[:2].tolist() == [1.0, 2.0]
    assert len(charts.envelope(time, values, 10, gap_s=3.0)[0]) == 4
    few = charts.envelope(np.arange(8.0), np.array([0.0, 9.0, 1.0, -9.0, 2.0, 2.0, 5.0, 1.0]), 4)
    assert few[0].tolist() == [1.0, 3.0, 6.0, 7.0]  # of each four values the smallest and the largest
    time = np.arange(100_003.0)
    values = np.sin(time / 50.0)
    values[[17, 55_555, 100_002]], values[30:40] = (9.0, -8.0, 7.0), np.nan
    x, y = charts.envelope(time, values, 2000)
    assert 1000 < len(x) <= 2002 and np.all(np.diff(x) > 0) and {9.0, -8.0, 7.0} <= set(y)


def drawn(*traces, **options):
    """Return the figure of a page with one chart of these traces, and an empty one below."""
    above = Chart("above", list(traces), 2.0, (0.0, 9.0), (-1.0, 1.0), **options)
    below = Chart("below", [], 3.0, (0.0, 1.0), (0.0, 1.0))
    return interactive.figure(Charts("a  ·  1:00  ·  <b>  ·  c", [above], [below], []))


def test_a_page_draws_lines_and_areas_without_gaps():
    x, y = np.array([0.0, 1.0, 2.0]), np.array([1.0, NAN, 3.0])
    plain, dotted = drawn(Line(x, y, "red", "speed"), Line(x, y, "blue", dotted=True, width=2.0))["data"]
    assert (plain["x"], plain["y"], plain["name"], plain["line"]["color"]) == ([0.0, 2.0], [1.0, 3.0], "speed", "red")
    assert "name" not in dotted and dotted["line"]["width"] == 2.0 * plain["line"]["width"]
    assert (plain["line"]["dash"], dotted["line"]["dash"], plain["xaxis"], plain["yaxis"]) == ("solid", "dot", "x", "y")
    x, y = np.array([0.0, 1.0, 2.0, 5.0, 6.0]), np.array([-1.0, -2.0, 3.0, 4.0, 0.0])
    left, right = drawn(Sides(x, y, 2.0))["data"]
    assert (left["name"], right["name"]) == ("left", "right")
    assert (left["line"]["color"], right["line"]["color"]) == (LEFT_COLOUR, RIGHT_COLOUR)
    assert left["x"] == [0.0, 1.0, 2.0, 2.0, 3.5, 5.0] and left["y"] == [-1.0, -2.0, 0.0, 0.0, None, 0.0]
    assert right["x"] == [1.0, 2.0, 2.0, 3.5, 5.0, 5.0, 6.0] and right["y"] == [0.0, 3.0, 0.0, None, 0.0, 4.0, 0.0]
    zeros, _ = drawn(Sides(np.arange(8.0), np.array([0, 0, 0, -1, 0, 0, 0, -2.0]), 9.0))["data"]
    assert zeros["x"] == [2.0, 3.0, 4.0, 6.0, 7.0] and zeros["y"] == [0.0, -1.0, 0.0, 0.0, -2.0]


def test_a_page_draws_bars_dots_and_cells():
    """Cells are drawn by their logarithm."""
    edges = np.array([-0.05, 0.0, 0.05])
    bars, dots, cells, empty = drawn(
        Bars(np.array([-1.5, -0.5, 0.5]), np.array([1.0, 2.0, 3.00049]), 1.0, "share"),
        Dots(np.array([0.123456789]), np.array([-0.5]), "green", "straights"),
        CellMap(edges, np.array([[0.0, 10.0], [0.1, 1.0]]), "seconds"),
        CellMap(edges, np.zeros((2, 2)), "seconds"),
    )["data"]
    assert bars["marker"]["color"] == [LEFT_COLOUR, LEFT_COLOUR, RIGHT_COLOUR] and bars["width"] == 1.0
    assert bars["y"] == [1.0, 2.0, 3.0] and (bars["name"], dots["name"]) == ("share", "straights")
    assert (dots["x"], dots["y"]) == ([0.12346], [-0.5])
    assert cells["z"] == [[None, 1.0], [-1.0, 0.0]] and (cells["zmin"], cells["zmax"]) == (-1.0, 1.0)
    assert cells["x"] == cells["y"] == [-0.025, 0.025] and cells["name"] == "seconds, log10"
    assert "zmin" not in empty and empty["z"] == [[None, None]] * 2
    assert interactive.plain(np.array([1.23456, NAN])) == [1.235, None]
    assert interactive.plain(np.array([1.26]), 1) == [1.3]


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
    layout = figure["layout"]
    assert [layout["shapes"][0][name] for name in ("x0", "x1", "y0", "y1")] == [2.0, 4.0, 0, 1]
    axis = layout["xaxis"]
    assert (axis["tickvals"], axis["ticktext"]) == ([0.0, 5.0, 9.0], ["0:00", "0:05", "0:09"])
    assert figure["narrow"]["xaxis"]["tickvals"] == [0.0, 9.0]
    assert (axis["range"], layout["yaxis"]["range"]) == ((0.0, 9.0), (-1.0, 1.0))
    assert (axis["title"]["text"], layout["yaxis"]["title"]["text"]) == ("x", "y")
    assert layout["title"]["text"] == "a  ·  1:00<br>&lt;b&gt;  ·  c"
    assert figure["narrow"]["title"]["text"] == "a<br>1:00<br>&lt;b&gt;<br>c"


def test_lines_are_named_only_if_there_are_several():
    x = np.array([0.0, 1.0])
    speed, force = Line(x, x, "red", "speed"), Line(x, x, "blue", "force")
    names = "<span style='color:red'>speed</span>, <span style='color:blue'>force</span>"
    assert texts(drawn(speed))[0][0] == "above" and texts(drawn(speed, force))[0][0] == f"above: {names}"
    assert texts(drawn(speed, force), "narrow")[0][0] == f"above:<br>{names}"


def test_charts_never_overlap_in_a_window():
    """In a wide window the last charts are side by side. In a narrow window they are below each other."""
    figure = interactive.figure(charts.charts(overview_of(samples(6000, speed_mps=9.0))), linked=True)
    for kind, last_row in (("layout", 3), ("narrow", 1)):
        axes = [name.removeprefix("xaxis") for name in figure[kind] if name.startswith("xaxis")]
        places = [(figure[kind][f"xaxis{k}"]["domain"], figure[kind][f"yaxis{k}"]["domain"]) for k in axes]
        lowest = min(y[0] for _, y in places)
        assert len(places) == 6 and sum(y[0] == pytest.approx(lowest) for _, y in places) == last_row
        for (x, y), (other_x, other_y) in itertools.combinations(places, 2):
            assert x[0] >= other_x[1] or x[1] <= other_x[0] or y[1] <= other_y[0] or y[0] >= other_y[1]
    layout = figure["layout"]
    assert layout["height"] == 215 + 129 + 215 + 258 + 3 * 62 + 180  # 86 pixels per inch, with gaps and margins
    assert layout["xaxis2"]["matches"] == "x" and "matches" not in layout["xaxis"]
    assert layout["hovermode"] == "x" and layout["xaxis"]["hoverformat"] == ".1f"
    assert layout["yaxis4"]["scaleanchor"] == "x4" and "scaleanchor" not in layout["yaxis"]
    plain = charts.charts(overview_of(samples(6000)))
    assert interactive.time_axes(plain) == ["x", "x2"] and "hovermode" not in interactive.figure(plain)["layout"]


def luminance(rgb):
    """Return the relative luminance of a colour as defined in WCAG 2. rgb: its three parts, each from 0 to 1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_the_rarest_g_is_visible_on_white_and_on_dark_paper():
    """In dark mode the page inverts the charts by CSS: invert(0.8) hue-rotate(180deg)."""
    hue_180 = np.array([[-0.574, 1.43, 0.144], [0.426, 0.43, 0.144], [0.426, 1.43, -0.856]])
    (cells,) = drawn(CellMap(np.array([0.0, 1.0, 2.0]), np.eye(2), "seconds"))["data"]
    rgb = np.array([int(cells["colorscale"][0][1][k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    inverted = np.clip(hue_180 @ (0.9 - 0.8 * rgb), 0.0, 1.0)
    assert 1.05 / (luminance(rgb) + 0.05) > 2.5
    assert (luminance(inverted) + 0.05) / (luminance(np.array([0x1A, 0x1D, 0x24]) / 255.0) + 0.05) > 2.5


def test_the_picture_draws_the_same_charts(short_overview):
    """Its warnings are below them."""
    pytest.importorskip("matplotlib")
    figure = picture.figure_of(replace(short_overview, notices=[NotTheBikes(80.0)]))
    panels = {axes.get_title(loc="left").partition(",")[0]: axes for axes in figure.axes}
    left, right = short_overview.summary.left_deg, short_overview.summary.right_deg
    assert [text.xy for text in panels["Lean"].texts if hasattr(text, "xy")] == [
        (left.time_s, -left.value),
        (right.time_s, right.value),
    ]
    below, above = (fill.get_paths()[0].vertices[:, 1] for fill in panels["Lean"].collections)
    assert min(below) < -25.0 and max(above) > 35.0
    cells = chart_of(short_overview, "g against").traces[0]
    (mesh,) = (item for item in panels["g against g"].collections if hasattr(item, "get_coordinates"))
    assert np.array_equal(mesh.get_coordinates()[0, :, 0], cells.edges)
    assert np.array_equal(np.reshape(mesh.get_array().filled(0.0), cells.values.shape), cells.values)
    dots = chart_of(short_overview, "Alignment").traces[1]
    assert np.array_equal(
        panels["Alignment: g on the straights"].lines[1].get_xydata(), np.column_stack((dots.x, dots.y))
    )
    words = "Warning: in 80 % of the riding the accelerations are not those of a bike"
    assert figure.get_supxlabel().startswith(words)


@pytest.mark.parametrize("most", [(1.0, 1.0), (0.0, 6.0), (12.0, 11.0), (60.0, 60.0)])
def test_labels_of_the_lean_histogram_do_not_overlap(most):
    pytest.importorskip("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    ride_overview = overview_of(samples(600))
    (ride_overview.summary.left_deg.value, ride_overview.summary.right_deg.value) = most
    ride_overview.summary.left_deg.time_s = ride_overview.summary.right_deg.time_s = 1.0
    ride_overview.summary.histogram_s[:] = np.where(np.abs(np.arange(-69.5, 70.0)) <= 5.0, 8.0, 0.1)
    figure = Figure(figsize=(11, 3), layout="constrained")
    canvas, axes = FigureCanvasAgg(figure), figure.add_subplot(1, 3, 2)
    picture.draw_chart(axes, chart_of(ride_overview, "How long"))
    canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts if text.get_text()]
    assert len(boxes) == 3 and not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    inside = axes.get_window_extent()
    assert max(box.x1 for box in boxes) < inside.x1 + 15 and (
        max(most) <= 6.0 or min(box.x0 for box in boxes) > inside.x0
    )
    (corner,) = (text.get_window_extent() for text in axes.texts if "upright" in text.get_text())
    tops = [line.get_window_extent().y1 for line in axes.lines]
    assert len(tops) == 2 and max(tops) < corner.y0  # no line crosses the words "upright"


def test_a_page_has_its_warnings_if_asked_and_names_as_text():
    ride_overview = overview_of(samples(100), notices=[UpOff(30.0, False)])
    words = '<p class="warning">Warning: the calibration&#39;s up is 30'
    assert words not in page.page(ride_overview, "", "") and words in page.page(ride_overview, "", "", warnings=True)
    html = page.page(
        replace(ride_overview, ride=replace(ride_overview.ride, log=Path("<b>&.csv"))), "LIBRARY", "ALLOWED"
    )
    assert "<title>&lt;b&gt;&amp;</title>" in html and "<b>" not in html
    assert "LIBRARY" in html and "script-src ALLOWED " in html
