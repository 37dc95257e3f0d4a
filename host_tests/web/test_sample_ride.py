"""The sample ride of the page Rides, and its drawing."""

import re

import numpy as np
import pytest
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.logs.reader import read_log
from kickstand_tools.simulation.ride import SimulatedRide
from kickstand_tools.web import sample_ride


def test_the_sample_ride_is_a_log_with_an_aligned_calibration(tmp_path, monkeypatch):
    """The ride of the page is longer. The log of the ride has the means of two readings each, as a recording of a board
    has."""
    monkeypatch.setattr(sample_ride, "SECONDS", 20.0)
    sample_ride._ride.cache_clear()
    made = sample_ride._ride()
    for name, content in sample_ride.sample_ride.__wrapped__().items():
        (tmp_path / name).write_bytes(content)
    sample_ride._ride.cache_clear()
    log = read_log(tmp_path / sample_ride.LOG)
    assert log.t_s[-1] == pytest.approx(20.0, abs=0.1)
    assert len(log.t_s) == len(made.time) // 2
    assert log.accel_g[5] == pytest.approx(made.readings[10:12, :3].mean(axis=0), abs=1e-4)
    assert log.gyro_dps[5] == pytest.approx(made.readings[10:12, -3:].mean(axis=0), abs=0.01)
    assert sum(speed == speed for speed in log.speed_mps) >= 15
    calibration = read_calibration(tmp_path / sample_ride.CALIBRATION)
    assert calibration.aligned and calibration.six_done


def points(svg, name):
    """Return the points of each path of this class, as arrays of x and y (down). name: the attribute `class`."""
    found = re.findall(rf'<path d="M([^"]*)" class="{name}"', svg)
    return [np.array([pair.split() for pair in path.split("L")], dtype=float) for path in found]


@pytest.fixture
def drawn(monkeypatch):
    """Draw a ride of 40 s, 10 m/s, whose lean is 20 degrees left, upright, and then 40 degrees right."""
    lean_deg = np.repeat([-20.0, 0.0, 40.0], [1000, 1000, 2000])
    yaw_rate_dps = np.repeat([9.0, 0.0, -9.0], [1000, 1000, 2000])
    truth = {"lean_deg": lean_deg, "yaw_rate_dps": yaw_rate_dps, "speed_mps": np.full(4000, 10.0)}
    ride = object.__new__(SimulatedRide)
    for field, value in {"rate_hz": 100.0, "time": np.arange(4000) / 100.0, "truth": truth}.items():
        object.__setattr__(ride, field, value)
    monkeypatch.setattr(sample_ride, "_ride", lambda: ride)
    return str(sample_ride.preview())


def test_the_lean_to_the_right_is_drawn_above_the_middle(drawn):
    """Twice the lean is twice as high. Each side has its own area, in the order of time."""
    ((left_end, right_end),) = points(drawn, "zero")
    middle = left_end[1]
    assert right_end[1] == middle and right_end[0] > left_end[0] == 0.0
    (left,), (right,) = points(drawn, "left"), points(drawn, "right")
    assert len(left) == len(right) == 80 + 2  # one point per half second, and both ends of the middle line
    assert (left[:, 1] >= middle).all() and (right[:, 1] <= middle).all()
    heights = middle - right[1:-1, 1], left[1:-1, 1] - middle
    assert heights[0] == pytest.approx(np.repeat([0.0, heights[0].max()], [40, 40]))
    assert heights[1] == pytest.approx(np.repeat([heights[0].max() / 2.0, 0.0], [20, 60]))
    assert 0.0 < heights[0].max() < middle


def test_the_names_of_the_sides_are_at_the_largest_lean(drawn):
    ((_, end),) = points(drawn, "zero")
    found = {side: float(x) for x, side in re.findall(r'<text x="([^"]*)"[^>]*>(left|right)<', drawn)}
    assert found == {"left": 0.0, "right": pytest.approx(end[0] * 40 / 79, abs=0.01)}
    places = {side: float(y) for y, side in re.findall(r'<text [^>]*y="([^"]*)"[^>]*>(left|right)<', drawn)}
    assert places["right"] < end[1] < places["left"]


def test_the_road_is_coloured_by_the_side_of_the_lean(drawn):
    (road,) = points(drawn, "road")
    left, right = points(drawn, "road left"), points(drawn, "road right")
    assert len(road) == 80 and (len(left), len(right)) == (19, 40)  # a piece of the path lasts half a second
    assert all(len(piece) == 2 for piece in left + right)
    assert np.array([piece[0] for piece in left]) == pytest.approx(road[:19])
    assert np.array([piece[1] for piece in right]) == pytest.approx(road[40:])


def test_the_road_has_north_above_and_one_scale(drawn):
    """The ride begins to the east and turns left, which is to the north. Each piece is 5 m long."""
    (road,) = points(drawn, "road")
    steps = np.diff(road, axis=0)
    assert steps[0][0] > 0.0 > steps[0][1]  # in the drawing y points down
    lengths = np.hypot(*steps.T)
    assert lengths == pytest.approx(np.full(79, lengths.mean()), rel=0.02)
    width, height = (float(size) for size in re.findall(r'viewBox="0 0 (\S+) (\S+)"', drawn)[0])
    ((_, end),) = points(drawn, "zero")
    assert road[:, 0].min() > 0.0 and road[:, 0].max() < width == end[0]
    assert road[:, 1].min() > 2.0 * end[1] and road[:, 1].max() < height  # the map is below the chart
