"""The sample ride of the page Rides, and its drawing."""

import re

import numpy as np
import pytest
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.logs.reader import read_log
from kickstand_tools.web import sample_ride


def points(svg, name):
    """Return the points of each path of this class, as arrays of x and y (down). name: the attribute `class`."""
    found = re.findall(rf'<path d="M([^"]*)" class="{name}"', svg)
    return [np.array([pair.split() for pair in path.split("L")], dtype=float) for path in found]


@pytest.fixture(scope="module")
def drawing() -> str:
    return str(sample_ride.preview())


@pytest.fixture(scope="module")
def middle(drawing) -> float:
    """Return the height of the line of the upright bike."""
    ((begin, end),) = points(drawing, "zero")
    assert begin[1] == end[1] and begin[0] == 0.0 < end[0]
    return float(end[1])


def test_the_sample_ride_is_a_log_with_an_aligned_calibration(tmp_path):
    for name, content in sample_ride.sample_ride().items():
        (tmp_path / name).write_bytes(content)
    log = read_log(tmp_path / sample_ride.LOG)
    assert log.t_s[-1] == pytest.approx(sample_ride.SECONDS, abs=1.0)
    assert np.median(np.diff(log.t_s)) == pytest.approx(0.01)  # each row has the mean of two readings
    assert np.isfinite(log.speed_mps).sum() > 0.9 * sample_ride.SECONDS
    calibration = read_calibration(tmp_path / sample_ride.CALIBRATION)
    assert calibration.aligned and calibration.six_done


def test_the_lean_to_the_right_is_drawn_above_the_middle(drawing, middle):
    """There is one point per half second, and the two ends of the middle line. A side's name is at its largest lean."""
    (left,), (right,) = points(drawing, "left"), points(drawing, "right")
    assert len(left) == len(right) == 2 * sample_ride.SECONDS + 2
    assert (left[:, 1] >= middle).all() and (right[:, 1] <= middle).all()
    assert not ((left[:, 1] > middle) & (right[:, 1] < middle)).any()
    names = {side: float(x) for x, side in re.findall(r'<text x="([^"]*)"[^>]*>(left|right)<', drawing)}
    assert names == {
        "left": pytest.approx(left[np.argmax(left[:, 1]), 0], abs=0.01),
        "right": pytest.approx(right[np.argmin(right[:, 1]), 0], abs=0.01),
    }
    heights = {side: float(y) for y, side in re.findall(r'<text [^>]*y="([^"]*)"[^>]*>(left|right)<', drawing)}
    assert heights["right"] < middle < heights["left"]


def test_the_road_turns_to_the_side_of_its_colour(drawing):
    """A bike that leans left turns left. In the drawing, x points to the east and y to the south."""
    (road,) = points(drawing, "road")
    steps = np.diff(road, axis=0)
    across = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    turns = {tuple(road[k + 1]): turn for k, turn in enumerate(across)}
    for side, sign in (("left", -1.0), ("right", 1.0)):
        pieces = points(drawing, f"road {side}")
        at_pieces = [turn for piece in pieces if (turn := turns.get(tuple(piece[0])))]  # 0 while it stands
        assert len(pieces) > 20 and np.mean(np.sign(at_pieces) == sign) > 0.9


def test_the_map_is_below_the_chart_and_within_the_drawing(drawing, middle):
    (road,) = points(drawing, "road")
    width, height = (float(size) for size in re.findall(r'viewBox="0 0 (\S+) (\S+)"', drawing)[0])
    assert road[:, 0].min() > 0.0 and road[:, 0].max() < width
    assert road[:, 1].min() > 2.0 * middle and road[:, 1].max() < height
