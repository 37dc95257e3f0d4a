"""The pixels of the gauge: the side of the lean, the maxima, unknown values, transparency. Also tests the values that
the gauge gets."""

import math

import numpy as np
import pytest

pytest.importorskip("PIL")

from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.parts import ACCENT
from kickstand_tools.overlay.shown import Shown

NAN = math.nan
KNOWN = {"forward_g": 0.0, "left_g": 0.0, "speed_mps": 20.0, "left_deg": 0.0, "right_deg": 0.0}


@pytest.fixture(scope="module")
def gauge() -> Gauge:
    return Gauge(720)


def amber(gauge: Gauge, **values: float) -> np.ndarray:
    """Return True for each pixel in the colour of the lean, shape (height, width)."""
    picture = np.asarray(gauge.picture(**(KNOWN | values)), dtype=int)
    return np.abs(picture[..., :3] - ACCENT[:3]).max(axis=2) < 12


def on_dial(gauge: Gauge, found: np.ndarray) -> tuple[int, int]:
    """Count the pixels of the dial above its ends. Return (number left of the middle, number right of it)."""
    middle, end = round(0.6 * gauge.height), round(0.62 * gauge.height)
    return int(found[:end, :middle].sum()), int(found[:end, middle : round(1.15 * gauge.height)].sum())


@pytest.mark.parametrize("lean", [3.0, 20.0, 45.0, 60.0, 80.0])
def test_lean_fills_its_side_of_the_dial(gauge, lean):
    left, right = on_dial(gauge, amber(gauge, lean_deg=lean))
    other = on_dial(gauge, amber(gauge, lean_deg=-lean))
    assert left < 20 < right
    assert other[1] < 20 < other[0]
    whole = on_dial(gauge, amber(gauge, lean_deg=60.0))[1]
    assert right == pytest.approx(whole * min(lean, 60.0) / 60.0, rel=0.1, abs=40)


def test_the_bike_leans_to_that_side(gauge):
    """The rider's head is on the side of the lean. The test finds the head by the white pixels between the tyre and the
    dial."""
    rows, middle = slice(round(0.25 * gauge.height), round(0.5 * gauge.height)), round(0.6 * gauge.height)
    for lean in (-35.0, 35.0):
        picture, still = (np.asarray(gauge.picture(**(KNOWN | {"lean_deg": d})), dtype=int) for d in (lean, math.nan))
        changed = np.abs(picture - still).max(axis=2) > 100
        changed &= picture[..., :3].min(axis=2) > 240
        columns = np.argwhere(changed[rows])[:, 1]
        assert len(columns) > 200
        assert np.sign(columns.mean() - middle) == np.sign(lean)


def test_name_of_the_side_is_lit(gauge):
    below = slice(round(0.75 * gauge.height), None)
    for lean, side in ((-25.0, 0), (25.0, 1)):
        found = amber(gauge, lean_deg=lean)[below, : round(1.2 * gauge.height)]
        halves = np.array_split(found, 2, axis=1)
        assert halves[side].sum() > 100
        assert halves[1 - side].sum() == 0


def test_unknown_values_are_not_drawn(gauge):
    unknown = gauge.picture(NAN, NAN, NAN, NAN, 0.0, 0.0)
    assert not amber(gauge, lean_deg=NAN, forward_g=NAN, left_g=NAN, speed_mps=NAN).any()
    zero = gauge.picture(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert np.any(np.asarray(unknown) != np.asarray(zero))
    assert np.array_equal(np.asarray(unknown), np.asarray(gauge.picture(NAN, NAN, 0.5, NAN, 0.0, 0.0)))


def test_spot_moves_in_the_direction_of_the_acceleration(gauge):
    """The dot moves up when the bike speeds up, down when it brakes, and to the left in a left turn."""
    side = round(1.2 * gauge.height)

    def spot(**forces: float) -> np.ndarray:
        return np.argwhere(amber(gauge, lean_deg=0.0, **forces)[:, side:]).mean(axis=0)

    (down, along), (braked, _), (_, left), (far, _) = (
        spot(),
        spot(forward_g=-0.8),
        spot(left_g=0.8),
        spot(forward_g=-7.0),
    )
    assert braked > down + 20
    assert left < along - 20
    assert far == pytest.approx(spot(forward_g=-1.2)[0], abs=1)
    assert spot(forward_g=0.5)[0] < down - 10


def test_maxima_have_their_marks(gauge):
    plain, marked = (
        np.asarray(gauge.picture(0.0, 0.0, 0.0, 20.0, *maxima), dtype=int) for maxima in ((0.0, 0.0), (0.0, 44.0))
    )
    changed = np.argwhere(np.abs(plain - marked).max(axis=2) > 100)
    assert len(changed) > 20
    assert np.all(changed[:, 1] > 0.6 * gauge.height)


@pytest.mark.parametrize("height, pixels", [(240, 108), (480, 216), (720, 216), (1080, 324), (2160, 648)])
def test_gauge_scales_with_the_video_and_has_clear_corners(height, pixels):
    gauge = Gauge(height, has_speed=height != 480, mph=True)
    picture = np.asarray(gauge.picture(30.0, -0.2, 0.5, 20.0, 12.0, 31.0))
    assert picture.shape == (gauge.height, gauge.width, 4)
    assert gauge.height == pixels
    assert gauge.width % 2 == gauge.height % 2 == 0
    assert picture[0, 0, 3] == picture[-1, -1, 3] == 0
    assert 50 < picture[gauge.height // 2, 2, 3] < 200  # the panel is partly transparent
    assert picture[..., 3].max() == 255


def test_values_are_interpolated_but_not_across_gaps():
    t_s = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    none = np.full(5, NAN)
    speed = np.array([10.0, NAN, NAN, 12.0, NAN])
    lean = np.array([0.0, 10.0, NAN, 20.0, 30.0])
    seen = Shown(t_s, lean, none, none, speed, np.zeros(5), np.array([0.0, 10.0, 10.0, 20.0, 30.0]))
    at = seen.at(np.array([-1.0, 0.05, 0.15, 0.6, 1.05, 5.0]))
    assert np.allclose(at.lean_deg, [NAN, 5.0, NAN, NAN, 25.0, NAN], equal_nan=True)
    assert at.speed_mps[1] == pytest.approx(10.1)
    assert np.isnan(at.speed_mps[[0, 5]]).all()
    # The largest lean to the right so far, at each sample
    assert at.right_deg.tolist() == [0.0, 0.0, 10.0, 10.0, 20.0, 30.0]
