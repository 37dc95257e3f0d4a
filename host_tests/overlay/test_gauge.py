"""The gauge's pictures: sides, sizes, transparency, words, numbers, and unknown values.

The places of the words are design, so a word is searched for in the whole picture.
"""

import math

import numpy as np
import pytest
from kickstand_tools.overlay.gauge import ACCENT, DIM, WHITE, Gauge, arrow, text as drawn_text

NAN = math.nan
HEIGHT = 480  # height of a video in pixels
SIZES = 27.0, 24.0, 8.0, 7.5, 7.0, 6.5  # heights of the gauge's texts in percent of its height
VALUES = {"lean_deg": 0.0, "forward_g": 0.0, "left_g": 0.0, "speed_mps": 20.0, "left_deg": 0.0, "right_deg": 0.0}


@pytest.fixture(scope="module")
def gauge() -> Gauge:
    return Gauge(HEIGHT)


def drawn(gauge, **values) -> np.ndarray:
    return np.asarray(gauge.picture(**(VALUES | values)), dtype=int)


def amber(gauge, **values) -> np.ndarray:
    """Return True for each pixel in the colour of the lean, shape (height, width)."""
    return np.abs(drawn(gauge, **values)[..., :3] - ACCENT[:3]).max(axis=2) < 12


def dial_sides(gauge, found) -> list[int]:
    """Count the pixels above the dial's ends, on the left and on the right of its middle."""
    middle = round(0.6 * gauge.height)
    dial = found[: round(0.62 * gauge.height), : 2 * middle]
    return [int(dial[:, :middle].sum()), int(dial[:, middle:].sum())]


def contains(picture, part) -> bool:
    """Return True if a part is somewhere in the picture. A neighbour may cover a little of its edge."""
    part = np.asarray(part, dtype=int)
    opaque = np.argwhere(part[..., 3] == 255)
    opaque = opaque[:: max(1, len(opaque) // 80)]
    picture, colours = (values[..., :3] @ [1, 256, 65536] for values in (picture, part))
    height, width = (size - largest for size, largest in zip(picture.shape, opaque.max(axis=0)))
    equal = np.zeros((height, width), dtype=int)
    for row, column in opaque:
        equal += picture[row : row + height, column : column + width] == colours[row, column]
    return bool(equal.max() > 0.93 * len(opaque))


def says(picture, words, colour=WHITE) -> bool:
    """Return True if the picture contains these words in one of the gauge's sizes."""
    unit = Gauge(HEIGHT).height / 100.0
    return any(contains(picture, drawn_text(words, round(size * unit, 1), colour)) for size in SIZES)


@pytest.mark.parametrize("lean", [3.0, 20.0, 45.0, 60.0, 80.0])
def test_lean_fills_its_side_of_the_dial(gauge, lean):
    left, right = dial_sides(gauge, amber(gauge, lean_deg=lean))
    assert left <= 3 < right and dial_sides(gauge, amber(gauge, lean_deg=-lean)) == pytest.approx([right, left], abs=40)
    full = dial_sides(gauge, amber(gauge, lean_deg=60.0))[1]
    assert right == pytest.approx(full * min(lean, 60.0) / 60.0, rel=0.1, abs=40)


def test_the_bike_leans_to_that_side_up_to_75_degrees(gauge):
    """The rider's head is on the side of the lean: white pixels between the tyre and the dial."""
    rows, middle = slice(round(0.25 * gauge.height), round(0.5 * gauge.height)), round(0.6 * gauge.height)

    def bike(lean_deg):
        changed = np.abs(drawn(gauge, lean_deg=lean_deg) - drawn(gauge, lean_deg=NAN)).max(axis=2) > 100
        return np.argwhere((changed & (drawn(gauge, lean_deg=lean_deg)[..., :3].min(axis=2) > 240))[rows])

    for lean in (-35.0, 35.0):
        assert np.sign(bike(lean)[:, 1].mean() - middle) == np.sign(lean)
    assert np.array_equal(bike(75.0), bike(90.0)) and not np.array_equal(bike(75.0), bike(60.0))


def test_spot_moves_as_a_passenger_feels_the_forces(gauge):
    """The spot is up when the bike accelerates, and left for a force to the left. It stays within 1.2 g."""
    side = round(1.2 * gauge.height)

    def spot(forward_g=0.0, left_g=0.0):
        return np.argwhere(amber(gauge, forward_g=forward_g, left_g=left_g)[:, side:]).mean(axis=0)

    at_rest, g = spot(), (spot(forward_g=-0.6) - spot())[0] / 0.6
    assert g > 8.0  # one g in pixels
    for forward_g, left_g, seen_g in [
        (0.6, 0.0, (0.6, 0.0)),
        (0.0, 0.6, (0.0, 0.6)),
        (0.0, -0.6, (0.0, -0.6)),
        (-5.0, 0.0, (-1.2, 0.0)),
        (3.0, -4.0, (0.72, -0.96)),
    ]:
        assert spot(forward_g, left_g) - at_rest == pytest.approx(-g * np.array(seen_g), abs=1.7), (forward_g, left_g)
    for unknown in ({"forward_g": NAN}, {"left_g": NAN}):
        assert not amber(gauge, **unknown)[:, side:].any()


@pytest.mark.parametrize(
    ("values", "white", "amber_words", "grey"),
    [
        (
            {"lean_deg": 31.4, "forward_g": 0.25, "left_g": -0.5, "left_deg": 12.4, "right_deg": 44.6},
            ["60", "30", "km/h", "31", "max 12°", "max 45°", "72", "ACCEL 0.25 g", "RIGHT 0.50 g"],
            ["RIGHT"],
            ["LEFT"],
        ),
        (
            {"lean_deg": -5.0, "forward_g": -0.9, "left_deg": 0.51},
            ["5", "max --", "max 1°", "BRAKE 0.90 g", "SIDE 0.00 g"],
            ["LEFT"],
            ["RIGHT"],
        ),
        ({"lean_deg": 0.5, "left_g": 0.006, "right_deg": 0.5}, ["max --", "LEFT 0.01 g"], [], ["LEFT", "RIGHT"]),
        ({"left_g": 0.004}, ["SIDE 0.00 g"], [], ["LEFT", "RIGHT"]),
        ({"lean_deg": NAN, "left_g": NAN, "speed_mps": NAN}, ["--", "-- g"], [], ["LEFT", "RIGHT"]),
    ],
)
def test_words_and_numbers(gauge, values, white, amber_words, grey):
    picture = drawn(gauge, **values)
    for words, colour in ((white, WHITE), (amber_words, ACCENT), (grey, DIM)):
        assert [text for text in words if not says(picture, text, colour)] == []
    assert not any(says(picture, text, ACCENT) for text in {"LEFT", "RIGHT"} - set(amber_words))
    unit = gauge.height / 100.0
    arrows = [side for side in (False, True) if contains(picture, arrow(8.0 * unit, side, ACCENT))]
    assert arrows == [side == "RIGHT" for side in amber_words]


def test_speed_has_its_unit_and_may_be_missing():
    in_miles = drawn(Gauge(HEIGHT, mph=True), speed_mps=44.704)
    assert says(in_miles, "100") and says(in_miles, "mph") and not says(in_miles, "km/h")
    without = drawn(Gauge(HEIGHT, has_speed=False), speed_mps=20.0)
    assert not says(without, "72") and not says(without, "km/h")


def test_the_scale_has_30_and_60_on_both_sides(gauge):
    picture, middle = drawn(gauge, lean_deg=NAN), round(0.6 * gauge.height)
    for half in (picture[:, :middle], picture[:, middle : 2 * middle]):
        assert says(half, "30") and says(half, "60")


def test_maxima_have_a_mark_on_their_side(gauge):
    middle = 0.6 * gauge.height
    for side, name in ((-1, "left_deg"), (1, "right_deg")):
        changed = np.argwhere(np.abs(drawn(gauge) - drawn(gauge, **{name: 44.0})).max(axis=2) > 100)
        on_dial = changed[changed[:, 0] < 0.5 * gauge.height]
        assert len(on_dial) > 5 and (np.sign(on_dial[:, 1] - middle) == side).all()


@pytest.mark.parametrize(
    ("video_height", "height"), [(200, 90), (240, 108), (480, 216), (600, 216), (720, 216), (1080, 324)]
)
def test_gauge_scales_with_the_video_and_has_clear_corners(video_height, height):
    """It has 30 % of the video's height, but is at least 216 pixels high while that is at most 45 %."""
    gauge = Gauge(video_height, mph=True)
    picture = drawn(gauge, lean_deg=30.0)
    assert (gauge.height, *picture.shape) == (height, height, gauge.width, 4) and gauge.width % 2 == height % 2 == 0
    assert picture[0, 0, 3] == picture[-1, -1, 3] == 0 and picture[..., 3].max() == 255
    assert 50 < picture[gauge.height // 2, 2, 3] < 200  # the panel is partly transparent
