"""In the charts of a ride, left is on the left and braking is below. Labels do not overlap. The picture and the page
draw the same charts."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.analysis.alignment_quality import Quality
from kickstand_tools.analysis.overview import Overview, overview
from kickstand_tools.analysis.plot import interactive, page, picture
from kickstand_tools.analysis.plot.charts import Bars, CellMap, Dots, Line, charts, envelope, title
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.analysis.summary import Peak
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.checks.mount import UpOff
from kickstand_tools.estimation.smooth import NotTheBikes
from kickstand_tools.simulation.scripted import script
from support.recordings import analysis_rides

pytest.importorskip("matplotlib")
pytest.importorskip("plotly")


@pytest.fixture(scope="module")
def seen(tmp_path_factory) -> Overview:
    """Return a ride with gentle acceleration, one left turn and a hard stop. The calibration has a yaw error of 10
    degrees on purpose."""
    ride = analysis_rides.write(
        tmp_path_factory.mktemp("ride"),
        [script.upright(4), script.accelerate(15, 12), script.turn(-35, 5), script.brake(0, 3), script.wait(4)],
        speed_hz=1,
    )
    forward = np.array([-0.5, -0.2, 0.1, 0.2])
    off = Quality(1.0, 2.0, 10.0, 1.0, 30.0, np.tan(np.radians(10.0)) * forward, forward)
    return replace(overview(open_ride(ride, None)), quality=off)


@pytest.fixture(scope="module")
def panels(seen):
    """Return the axes of the picture by their titles."""
    return {axes.get_title(loc="left").partition(",")[0]: axes for axes in picture.figure_of(seen).axes}


@pytest.fixture(scope="module")
def drawn(seen):
    """Return the traces of the page by their names."""
    return {trace["name"]: trace for trace in interactive.figure(charts(seen))["data"] if "name" in trace}


def chart(seen, begins):
    made = charts(seen)
    (found,) = (one for one in (*made.over_time, *made.below) if one.title.startswith(begins))
    return found


def test_lean_to_the_left_is_below_and_on_the_left(seen, panels, drawn):
    most = seen.summary.left_deg
    (note,) = (note for note in chart(seen, "Lean").notes if "left" in note.text)
    assert (note.x, note.y, note.side) == (most.time_s, pytest.approx(-most.value), "below")
    assert -36.0 < min(drawn["left"]["y"]) < -30.0 and max(drawn["right"]["y"]) < 1.0
    assert panels["Lean"].texts[0].xy == (note.x, note.y)
    below, above = (fill.get_paths()[0].vertices[:, 1] for fill in panels["Lean"].collections)
    assert min(below) < -30.0 and max(above) < 1.0
    (shares,) = (trace for trace in chart(seen, "How long").traces if isinstance(trace, Bars))
    leaning = np.where(np.abs(shares.x) > 8.0, shares.y, 0.0)
    assert shares.x[int(np.argmax(leaning))] < -25.0


def test_chart_of_g_against_g_has_the_right_sides(seen, panels, drawn):
    """The left turn has 0.7 g for 5 s, plus its beginning and end. The stop has 0.5 g for 3 s. So the chart has points
    on the left and below, but none above or on the right."""
    (cells,) = (trace for trace in chart(seen, "g against").traces if isinstance(trace, CellMap))
    middle = (cells.edges[1:] + cells.edges[:-1]) / 2.0
    x, y = np.meshgrid(middle, middle)
    over = {"left": x < -0.3, "right": x > 0.3, "below": y < -0.3, "above": y > 0.3}
    seconds = {side: float(np.sum(cells.values[there])) for side, there in over.items()}
    assert 4.0 < seconds["left"] < 8.0 and 1.0 < seconds["below"] < 3.0
    assert seconds["right"] == seconds["above"] == 0.0
    (mesh,) = (item for item in panels["g against g"].collections if hasattr(item, "get_coordinates"))
    assert np.array_equal(mesh.get_coordinates()[0, :, 0], cells.edges)
    assert np.array_equal(mesh.get_coordinates()[:, 0, 1], cells.edges)
    assert np.array_equal(np.reshape(mesh.get_array().filled(0.0), x.shape), cells.values)
    logs = np.array(drawn["seconds, log10"]["z"], dtype=float)
    assert np.nan_to_num(10.0**logs) == pytest.approx(cells.values, abs=0.01)
    assert drawn["seconds, log10"]["x"] == drawn["seconds, log10"]["y"] == pytest.approx(middle)


def test_the_straights_and_their_line(seen, panels, drawn):
    """In the chart of the alignment, forces to the left are on the left. The line that shows the yaw error goes through
    the points."""
    _, dots, line = chart(seen, "Alignment").traces
    assert isinstance(dots, Dots) and isinstance(line, Line)
    assert dots.x == pytest.approx(-seen.quality.lateral_g)
    assert dots.y == pytest.approx(seen.quality.forward_g)
    assert list(line.y) == [-0.5, 0.5]
    assert line.x == pytest.approx(-np.tan(np.radians(10.0)) * line.y)
    assert np.array_equal(
        panels["Alignment: g on the straights"].lines[1].get_xydata(), np.column_stack((dots.x, dots.y))
    )
    assert drawn["straights"]["x"] == pytest.approx(dots.x, abs=1e-5)


@pytest.mark.parametrize(("car", "speed"), [(False, True), (True, False), (False, False)])
def test_charts_of_car_and_speed_are_drawn_only_if_present(seen, car, speed):
    made = replace(seen, ride=replace(seen.ride, calibration=CalibrationFile(vehicle="car" if car else "motorcycle")))
    made = replace(made, summary=replace(seen.summary, speed_mps=seen.summary.speed_mps if speed else Peak()))
    wanted = charts(made)
    first = ["Lean"] * (not car) + ["Speed"] * speed + ["Acceleration"]
    assert [one.title.partition(",")[0] for one in wanted.over_time] == first
    assert len(wanted.below) == 3 - car
    figure = interactive.figure(wanted)
    axes = {trace["name"]: trace["yaxis"] for trace in figure["data"] if "name" in trace}
    assert axes["forward"] == axes["to the left"] == ("y", "y2", "y3")[len(first) - 1]
    (stop,) = made.stops
    (shade,) = figure["layout"]["shapes"]
    assert (shade["x0"], shade["x1"]) == (stop.start_s, stop.stop_s)
    assert shade["xref"] == axes["forward"].replace("y", "x")
    assert f"{stop.mfdd_mps2:.1f}" in [note["text"] for note in figure["layout"]["annotations"]]
    if speed:
        (drawn,) = (trace for trace in figure["data"] if trace.get("name") == "speed")
        assert max(drawn["y"]) == pytest.approx(54.0, abs=0.5)  # the chart is in km/h
    assert picture.figure_of(made).get_size_inches()[1] == 5.5 + 2.5 * (not car) + 1.5 * speed


def test_charts_are_stacked_in_a_narrow_window(seen):
    """In a wide window the last three charts are side by side. In a narrow window the last three charts are below each
    other. They never overlap."""
    for kind, last_row in (("layout", 3), ("narrow", 1)):
        drawn = interactive.figure(charts(seen))[kind]
        axes = [name.removeprefix("xaxis") for name in drawn if name.startswith("xaxis")]
        places = [(drawn[f"xaxis{k}"]["domain"], drawn[f"yaxis{k}"]["domain"]) for k in axes]
        lowest = min(y[0] for _, y in places)
        assert sum(y[0] == lowest for _, y in places) == last_row
        for k, (x, y) in enumerate(places):
            for other_x, other_y in places[:k]:
                assert x[0] >= other_x[1] or x[1] <= other_x[0] or y[1] <= other_y[0]


def test_unknown_values_are_not_drawn(seen):
    """Uncertain values are not drawn. The alignment is not drawn if the calibration belongs to another mount."""
    made = replace(seen, notices=[UpOff(20.0, False)], summary=replace(seen.summary))
    made.summary.left_deg = made.summary.right_deg = made.summary.brake_g = made.summary.accel_g = Peak()
    assert title(made).endswith("lean as displayed -- left, -- right  ·  braking --, acceleration --")
    assert chart(made, "Lean").notes == []
    assert chart(made, "Alignment").left == "not judged"
    assert len(chart(made, "Alignment").traces) == len(chart(seen, "Alignment").traces) - 1


@pytest.mark.parametrize("most", [(1.0, 1.0), (0.0, 6.0), (12.0, 11.0), (60.0, 60.0)])
def test_labels_of_the_lean_histogram_do_not_overlap(seen, most):
    """The labels do not overlap however small the lean is."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    middle = np.arange(-69.5, 70.0)
    left, right = (Peak(value, 1.0) for value in most)
    seconds = np.where(np.abs(middle) <= 5.0, 8.0, 0.1)
    made = replace(seen, summary=replace(seen.summary, left_deg=left, right_deg=right, histogram_s=seconds))
    figure = Figure(figsize=(11, 3), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot(1, 3, 2)
    picture.draw_chart(axes, chart(made, "How long"))
    canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts if text.get_text()]
    assert len(boxes) == 3
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    inside = axes.get_window_extent()
    assert max(box.x1 for box in boxes) < inside.x1 + 15
    if max(most) > 6.0:  # the label of a smaller lean is near the axis, and may extend beyond the chart
        assert min(box.x0 for box in boxes) > inside.x0
    (corner,) = (text.get_window_extent() for text in axes.texts if "upright" in text.get_text())
    tops = [line.get_window_extent().y1 for line in axes.lines]
    assert len(tops) == 2 and max(tops) < corner.y0  # no line crosses the words "upright"


def test_doubtful_lean_and_warnings_are_drawn(seen, tmp_path):
    doubtful = ((seen.course.t_s > 5.0) & (seen.course.t_s < 9.0)).astype(float)
    made = replace(seen, course=replace(seen.course, doubtful=doubtful), notices=[NotTheBikes(80.0)])
    lean = chart(made, "Lean")
    assert "yellow: less exact" in lean.title and "yellow" not in chart(seen, "Lean").title
    _, line = lean.traces
    assert isinstance(line, Line)
    there = line.x[~np.isnan(line.y)]
    assert (there[0], there[-1]) == pytest.approx((5.0, 9.0), abs=0.1)
    assert lean.y_range[0] < np.nanmin(line.y) < -max(abs(note.y) for note in lean.notes)
    words = "Warning: in 80 % of the riding the accelerations are not those of a bike"
    assert picture.figure_of(made).get_supxlabel().startswith(words)
    assert picture.figure_of(seen).get_supxlabel() == ""
    page.draw(tmp_path / "ride.html", made)
    assert f'<p class="warning">{words}' in (tmp_path / "ride.html").read_text(encoding="utf-8")


def test_the_name_of_a_ride_is_text_in_its_page(seen):
    named = replace(seen, ride=replace(seen.ride, log=Path("<b>&.csv")))
    html = page.page(named, "", "")
    assert "<title>&lt;b&gt;&amp;</title>" in html
    assert "<b>" not in html


def test_an_envelope_keeps_every_peak():
    time = np.arange(100_003.0)
    values = np.sin(time / 50.0)
    values[[17, 55_555, 100_002]] = 9.0, -8.0, 7.0
    values[30:40] = np.nan
    x, y = envelope(time, values, 2000)
    assert 1000 < len(x) <= 2002
    assert np.all(np.diff(x) > 0)
    assert {9.0, -8.0, 7.0} <= set(y)
    assert np.array_equal(envelope(time[:100], values[:100], 2000)[1], values[:100][~np.isnan(values[:100])])


@pytest.mark.parametrize("points", [10_000, 500])
def test_line_is_broken_in_a_gap(points):
    """Readings are missing from 40 to 60 s, and the lean is hidden from 70 to 75 s."""
    time = np.concatenate((np.arange(0.0, 40.0, 0.02), np.arange(60.0, 100.0, 0.02)))
    values = np.where((time > 70.0) & (time < 75.0), np.nan, 5.0)
    x, y = envelope(time, values, points, 1.0)
    assert x[np.isnan(y)] == pytest.approx([50.0, 72.5], abs=0.05)
    assert np.all(np.diff(x) > 0.0)
    assert not np.any(np.isnan(envelope(time, values, points)[1]))


# the matrix of CSS's hue-rotate(180deg)
HUE_180 = np.array([[-0.574, 1.43, 0.144], [0.426, 0.43, 0.144], [0.426, 1.43, -0.856]])


def luminance(rgb):
    """Return the relative luminance of a colour as defined in WCAG 2. rgb: its three parts, each from 0 to 1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_rarest_g_is_visible_on_white_and_on_dark_paper(seen):
    """The rarest value has the first colour of the scale. The first colour must also be visible in dark mode, where the
    page inverts the charts."""
    (cells,) = [trace for trace in interactive.figure(charts(seen))["data"] if trace["type"] == "heatmap"]
    logs = np.array([[np.nan if value is None else value for value in row] for row in cells["z"]])
    assert cells["zmin"] == pytest.approx(np.nanmin(logs), abs=0.001)
    rgb = np.array([int(cells["colorscale"][0][1][k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    inverted = np.clip(HUE_180 @ (0.9 - 0.8 * rgb), 0.0, 1.0)
    dark = luminance(np.array([0x1A, 0x1D, 0x24]) / 255.0)
    assert 1.05 / (luminance(rgb) + 0.05) > 2.5
    assert (luminance(inverted) + 0.05) / (dark + 0.05) > 2.5
