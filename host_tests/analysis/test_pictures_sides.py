"""Left is drawn on the left, braking below: in the picture and in the page, whose axes nobody else checks."""

from dataclasses import replace
from pathlib import Path

import analysis_rides
import numpy as np
import pytest
from kickstand_tools.analysis.alignment_quality import Quality
from kickstand_tools.analysis.overview import Overview, overview
from kickstand_tools.analysis.plot import charts, page, picture
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.simulation.scripted import script

pytest.importorskip("matplotlib")
pytest.importorskip("plotly")


@pytest.fixture(scope="module")
def seen(tmp_path_factory) -> Overview:
    """Left turns only, gentle acceleration and a hard stop; forward, so it is made up, is 10 degrees off."""
    ride = analysis_rides.write(
        tmp_path_factory.mktemp("ride"),
        [script.upright(4), script.accelerate(15, 12), script.turn(-35, 5), script.brake(0, 3), script.wait(4)],
    )
    forward = np.array([-0.5, -0.2, 0.1, 0.2])
    off = Quality(1.0, 2.0, 10.0, 1.0, 30.0, np.tan(np.radians(10.0)) * forward, forward)
    return replace(overview(open_ride(ride, None)), quality=off)


@pytest.fixture(scope="module")
def panels(seen, tmp_path_factory):
    """The axes of the picture by their titles."""
    from matplotlib.figure import Figure

    drawn = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda self, path, dpi: drawn.append(self))
        picture.draw(tmp_path_factory.mktemp("picture") / "ride.png", seen)
    return {axes.get_title(loc="left").partition(",")[0].partition(":")[0]: axes for axes in drawn[0].axes}


def seconds_at(x, y, seconds) -> dict[str, float]:
    """How long at an acceleration of over 0.3 g, by its direction in the drawing."""
    seconds = np.where(np.isnan(seconds), 0.0, seconds)
    sides = {"left": x < -0.3, "right": x > 0.3, "below": y < -0.3, "above": y > 0.3}
    return {name: float(np.sum(seconds[there])) for name, there in sides.items()}


def check(found: dict[str, float]) -> None:
    assert 4.0 < found["left"] < 8.0  # the turn: 0.7 g for 5 s, and its beginning and end
    assert 1.0 < found["below"] < 3.0  # the stop: 0.5 g for 3 s, and less at both ends
    assert found["right"] == found["above"] == 0.0


def test_g_against_g_in_the_picture(panels):
    (mesh,) = [item for item in panels["g against g"].collections if hasattr(item, "get_coordinates")]
    corners = mesh.get_coordinates()
    x, y = ((corners[1:, 1:, k] + corners[:-1, :-1, k]) / 2.0 for k in (0, 1))
    check(seconds_at(x, y, np.reshape(mesh.get_array().filled(0.0), x.shape)))


def test_g_against_g_in_the_page(seen):
    (drawn,) = [trace for trace in charts.figure(seen)["data"] if trace["type"] == "heatmap"]
    x, y = np.meshgrid(drawn["x"], drawn["y"])
    check(seconds_at(x, y, 10.0 ** np.array(drawn["z"], dtype=float)))


def test_the_straights_and_their_line(seen, panels):
    """Forces to the left on the left; the line of the yaw goes through them."""
    points, line = panels["Alignment"].lines[:2]
    assert points.get_xdata() == pytest.approx(-seen.quality.lateral_g)
    assert points.get_ydata() == pytest.approx(seen.quality.forward_g)
    slope = -np.tan(np.radians(10.0))
    assert line.get_xdata() == pytest.approx(slope * line.get_ydata())
    assert list(line.get_ydata()) == [-0.5, 0.5]
    below = [trace for trace in charts.figure(seen)["data"] if trace["type"].startswith("scatter")][-2:]
    assert below[0]["x"] == pytest.approx(-seen.quality.lateral_g, abs=1e-5)
    assert below[0]["y"] == pytest.approx(seen.quality.forward_g, abs=1e-5)
    assert below[1]["x"] == pytest.approx(slope * np.array(below[1]["y"]), abs=1e-5)
    assert list(below[1]["y"]) == [-0.5, 0.5]


def test_lean_to_the_left_is_below_and_on_the_left(seen, panels):
    lean = panels["Lean"]
    assert lean.texts[0].get_text().endswith("° left")
    assert lean.texts[0].xy[1] == pytest.approx(-seen.summary.left_deg.value)
    assert lean.texts[0].xy[1] < -30.0
    bars = panels["How long at which lean"].patches
    (turn,) = [bar for bar in bars if bar.get_height() == max(b.get_height() for b in bars if abs(b.get_x()) > 8.0)]
    assert turn.get_x() < -25.0
    figure = charts.figure(seen)
    by_name = {trace.get("name"): trace for trace in figure["data"]}
    assert min(by_name["lean"]["y"]) == pytest.approx(-seen.summary.left_deg.value, abs=0.2)
    shares = np.where(np.abs(by_name["share"]["x"]) > 8.0, by_name["share"]["y"], 0.0)
    assert by_name["share"]["x"][int(np.argmax(shares))] < -25.0
    (said,) = [note for note in figure["layout"]["annotations"] if note["text"].endswith("° left")]
    assert said["y"] == pytest.approx(-seen.summary.left_deg.value)


def test_in_a_narrow_window_the_charts_stand_below_each_other(seen):
    """In a wide one the last three beside each other; neither covers another."""
    for kind, last_row in (("layout", 3), ("narrow", 1)):
        drawn = charts.figure(seen)[kind]
        axes = [name.removeprefix("xaxis") for name in drawn if name.startswith("xaxis")]
        places = [(drawn[f"xaxis{k}"]["domain"], drawn[f"yaxis{k}"]["domain"]) for k in axes]
        lowest = min(y[0] for _, y in places)
        assert sum(y[0] == lowest for _, y in places) == last_row
        for k, (x, y) in enumerate(places):
            for other_x, other_y in places[:k]:
                assert x[0] >= other_x[1] or x[1] <= other_x[0] or y[1] <= other_y[0]


def test_the_name_of_a_ride_is_text_in_its_page(seen):
    named = replace(seen, ride=replace(seen.ride, log=Path("<b>&.csv")))
    html = page.page(named, "", "")
    assert "<title>&lt;b&gt;&amp;</title>" in html
    assert "<b>" not in html
