"""The charts of a ride as data, and as the page and the picture draw them. Left is on the left, braking is below."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.analysis import charts, interactive, page
from kickstand_tools.analysis.charts import Chart, Charts
from kickstand_tools.calibration.mount import UpOff
from kickstand_tools.estimation.smooth import NotTheBikes
from small_rides import overview_of, samples

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
    assert [(note_text.y, note_text.text, note_text.side) for note_text in lean_chart.notes] == [(*note, side)]
    assert lean_chart.ticks == {float(k): f"0:{k:02}" for k in range(0, 60, 5)}
    assert chart("Lean", lean_deg=0.1 * lean).y_range == (-20.0, 20.0)


def test_a_doubtful_lean_has_a_line_below_it():
    doubt = chart("Lean", lean_deg=HELD, doubtful=np.where(HELD > 0.0, 0.5, 0.4))
    _, line = doubt.traces
    assert doubt.y_range == pytest.approx((-52.8, 48.0)) and np.nanmax(line.y) == pytest.approx(-50.4)
    assert np.count_nonzero(~np.isnan(line.y)) == 2999 and "yellow: less exact" in doubt.title
    assert "yellow" not in chart("Lean").title


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


def test_the_chart_of_g_against_g_counts_seconds():
    """For 30 s the bike has a force of 0.26 g to the right and brakes with 0.51 g. Then the bike is at rest."""
    g_chart = chart("g against", lateral_g=-0.26, forward_g=-0.51, resting=np.arange(6000) >= 3000)
    cells, *rings = g_chart.traces
    row, column = np.argwhere(cells.values)[0]
    assert cells.edges[row] < -0.51 < cells.edges[row + 1] and cells.edges[column] < 0.26 < cells.edges[column + 1]
    assert cells.values.sum() == pytest.approx(30.0) and np.diff(cells.edges) == pytest.approx(0.025)
    assert len(rings) == 1 and cells.edges[-1] == pytest.approx((21 + 2) * 0.025)


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


def drawn(*traces, **options):
    """Return the figure of a page with one chart of these traces, and an empty one below."""
    above = Chart("above", list(traces), 2.0, (0.0, 9.0), (-1.0, 1.0), **options)
    below = Chart("below", [], 3.0, (0.0, 1.0), (0.0, 1.0))
    return interactive.charts_figure(Charts("a  ·  1:00  ·  <b>  ·  c", [above], [below], []))


def test_the_picture_draws_the_same_charts(short_overview):
    """Its warnings are below them."""
    pytest.importorskip("matplotlib")
    figure = page.figure_of(replace(short_overview, notices=[NotTheBikes(80.0)]))
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


def test_a_page_has_its_warnings_if_asked_and_names_as_text():
    ride_overview = overview_of(samples(100), notices=[UpOff(30.0, False)])
    words = '<p class="warning">Warning: the calibration&#39;s up is 30'
    assert words not in page.page(ride_overview, "", "") and words in page.page(ride_overview, "", "", warnings=True)
    ride_overview.ride.log.name = "<b>&.csv"
    html = page.page(ride_overview, "LIBRARY", "ALLOWED")
    assert "<title>&lt;b&gt;&amp;</title>" in html and "<b>" not in html
    assert "LIBRARY" in html and "script-src ALLOWED " in html
