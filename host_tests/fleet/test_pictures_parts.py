"""Panels and pictures of the fleet: which values they show, in which order and on which scale. No test pins places."""

import re

import numpy as np
import pytest
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import failed
from kickstand_fleet.show import page, plot
from kickstand_fleet.show.panel import Panel


def panel(across=(0.0, 10.0), along=(0.0, 4.0)):
    return Panel(5.0, 7.0, 300.0, 200.0, across, along, "a title", "across", "along")


def dots(svg):
    """Return the places of the dots as an array of x and y (down)."""
    return np.array(re.findall(r"M([\d.]+) ([\d.]+)h0", str(svg)), dtype=float)


def words(svg):
    return re.findall(r"<text[^>]*>([^<]*)</text>", str(svg))


def test_dots_are_on_linear_scales_within_the_panel():
    made = panel()
    made.dots([(0.0, 0.0), (5.0, 1.0), (10.0, 4.0)], "red")
    ((x0, y0), (x1, y1), (x2, y2)) = dots(made.svg())
    assert 5.0 < x0 < x1 < x2 < 305.0 and 207.0 > y0 > y1 > y2 > 7.0
    assert (x1 - x0) / (x2 - x0) == pytest.approx(0.5, abs=0.001)
    assert (y0 - y1) / (y0 - y2) == pytest.approx(0.25, abs=0.001)


def test_an_axis_without_length_shows_its_value():
    made = panel((3.0, 3.0), (0.0, 0.0))
    made.dots([(3.0, 0.0)], "red")
    assert len(dots(made.svg())) == 1 and words(made.svg())[3] == "3"


def test_nothing_is_drawn_without_values():
    made = panel()
    made.dots([], "red")
    made.line([(1.0, 1.0)], "blue")
    assert "red" not in made.svg() and "blue" not in made.svg()
    made.line([(1.0, 1.0), (2.0, 2.0)], "blue")
    assert made.svg().count("blue") == 1


def test_bars_are_as_high_as_their_values():
    made = panel((0.0, 3.0), (0.0, 4.0))
    made.bars([0.0, 1.0, 2.0, 3.0], [1.0, 0.0, 4.0], "green")
    made.dots([(0.0, 0.0), (1.0, 4.0)], "red")
    found = re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)" fill="green"', made.svg())
    (x0, y0, wide, low), (x2, y2, also_wide, high) = np.array(found, dtype=float)  # a value of 0 has no bar
    (left, bottom), (right, top) = dots(made.svg())
    assert high == pytest.approx(4.0 * low, abs=0.05) == pytest.approx(bottom - top, abs=0.1)
    assert y2 + high == pytest.approx(y0 + low, abs=0.05) == pytest.approx(bottom, abs=0.1)
    assert wide == pytest.approx(also_wide, abs=0.05) and 0.5 * (right - left) < wide < right - left
    assert x2 - x0 == pytest.approx(2.0 * (right - left), abs=0.2) and x0 > left


def test_the_axes_have_round_numbers_and_their_words():
    made = panel()
    assert words(made.svg()) == ["a title", "across", "along", "0", "5", "10", "0", "1", "2", "3", "4"]
    made.words = "day {:g}".format
    assert words(made.svg())[3:6] == ["day 0", "day 5", "day 10"]


def result(kind="car", tests=(), **changed):
    """Return the result of an aligned vehicle. tests: (Universal Time or None, deceleration) of each brake test."""
    found = failed(Period("bus 12", "front", kind, ()), "x", "")
    found.alignment |= {"quality_deg": 0.46, "attitude_deg": 1.24, "events_used": 31, "stops": 7, "speed_lag_s": 0.34}
    found.alignment |= changed
    found.brake_tests = [{"utc_s": utc_s, "mfdd_mps2": mfdd} for utc_s, mfdd in tests]
    found.picture = [[0.1, 0.11, 0.2, 0.21], [-0.3, -0.29, 0.0, 0.02]]
    return found


def test_the_picture_of_a_vehicle_says_how_well_it_is_known():
    said = words(plot.draw(result()))
    assert said[:2] == [
        "bus 12, mount front",
        "forward known to 0.5°, the whole alignment to 1.2°, 31 events, 7 stops, speed 0.3 s late",
    ]
    assert words(plot.draw(result(message="a reason", mount="")))[:2] == ["bus 12", "a reason"]


@pytest.mark.parametrize(
    ("kind", "left"), [("car", ((0.2, 0.21), (0.0, 0.02))), ("motorcycle", ((0.1, 0.21), (-0.3, 0.02)))]
)
def test_measured_forces_are_over_the_expected_ones(kind, left):
    """The two scales of a panel are equal, so the dots of a good alignment are on the diagonal. A motorcycle has no
    force to the left, so this force is shown over the change of speed."""
    found = dots(plot.draw(result(kind)))
    assert len(found) == 4
    for (one, other), ((x0, y0), (x1, y1)) in zip((found[:2], found[2:]), (((0.1, 0.11), (-0.3, -0.29)), left)):
        across, down = other - one
        assert across / (x1 - x0) * (y1 - y0) == pytest.approx(-down, rel=0.1, abs=1.0)
        assert np.sign([across, down]).tolist() == [np.sign(x1 - x0), -np.sign(y1 - y0)]


def test_brake_tests_are_over_time_or_in_their_order():
    dated = plot.draw(result(tests=[(1.79e9, 3.0), (1.79e9 + 10 * 86_400.0, 6.0)]))
    assert "2 brake tests" in words(dated) and "day" in words(dated)
    days = [word for word in words(dated) if word.startswith("2026-")]
    assert len(days) >= 2 and days == sorted(days) and days[0] >= "2026-09-20" and days[-1] <= "2026-10-02"
    (first_x, first_y), (second_x, second_y) = dots(dated)[4:]
    assert first_x < second_x and second_y < first_y
    undated = plot.draw(result(tests=[(None, 3.0), (1.79e9, 6.0), (None, 5.0)]))
    assert "3 brake tests" in words(undated) and "test" in words(undated) and {"1", "2", "3"} <= set(words(undated))
    places = dots(undated)[4:]
    assert np.diff(places[:, 0]) == pytest.approx([places[1][0] - places[0][0]] * 2, abs=0.15)
    assert "0 brake tests" in words(plot.draw(result()))


@pytest.mark.parametrize(("mfdd", "top"), [(1.0, 3.0), (8.0, 8.0)])
def test_the_scale_of_decelerations_begins_at_0_and_has_at_least_3_mps2(mfdd, top):
    said = words(plot.draw(result(tests=[(None, mfdd)])))
    numbers = [float(word) for word in said[said.index("MFDD, m/s²") + 1 :] if re.fullmatch(r"[\d.]+", word)]
    assert max(numbers[2:]) == pytest.approx(top, abs=0.5) and 0.0 in numbers


def test_the_file_of_a_picture_has_the_names_of_vehicle_and_mount():
    name = plot.file_name("bus 12", "front")
    assert name.startswith("bus%2012%20front-") and name.endswith(".svg")
    assert plot.file_name("bus 12", "") != plot.file_name("bus", "12") != plot.file_name("bus 12", "front")


def test_small_bars_show_decelerations_up_to_8_mps2():
    heights = [float(height) for height in re.findall(r"v-([\d.]+)", page._spark([0.1, 4.0, 8.0, 12.0]))]
    assert heights == pytest.approx([1.0, 9.6, 19.2, 19.2])
    places = [float(place) for place in re.findall(r"M([\d.]+) 20", page._spark([5.0] * 50))]
    assert len(places) == 50 and places == sorted(places) and places[-1] < 100.0


def test_a_histogram_counts_every_value():
    """Values above the scale are in the last bar."""
    svg = page._histogram([0.1, 0.2, 0.3, 1.1, 9.0], 2.0, 2, "t", 200.0, "m", "n", "green")
    heights = [float(height) for height in re.findall(r'height="([\d.]+)" fill="green"', svg)]
    assert len(heights) == 2 and heights[0] / heights[1] == pytest.approx(1.5, abs=0.01)
    assert "median 0.30" in page._quality([0.1, 0.3, 0.5]) and page._quality([]) == ""
