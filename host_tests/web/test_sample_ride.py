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


def test_the_sample_ride_is_a_log_with_an_aligned_calibration(tmp_path):
    for name, content in sample_ride.sample_ride().items():
        (tmp_path / name).write_bytes(content)
    log = read_log(tmp_path / sample_ride.LOG)
    assert log.t_s[-1] == pytest.approx(sample_ride.SECONDS, abs=1.0)
    assert np.median(np.diff(log.t_s)) == pytest.approx(0.01)  # each row has the mean of two readings
    assert np.isfinite(log.speed_mps).sum() > 0.9 * sample_ride.SECONDS
    calibration = read_calibration(tmp_path / sample_ride.CALIBRATION)
    assert calibration.aligned and calibration.six_done


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
