"""The pictures of the pages: numbers, bars, marks and words are drawn at their places."""

from types import SimpleNamespace

import pytest
from kickstand_tools.simulated_board.simulator import Board


@pytest.fixture
def glance():
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0), display="ssd1306"):
        from kickstand.ui import glance

        yield glance


class Canvas:
    """Records what is drawn.

    digits: {place: digit} of the large number.
    calls: all other calls, in their order.
    """

    def __init__(self, glance):
        self._glyphs = glance._GLYPHS
        self.digits, self.calls = {}, []

    def blit(self, picture, x, y):
        if picture in self._glyphs:
            self.digits[x, y] = self._glyphs.index(picture)
        else:
            self.calls.append(("scale", x, y))

    def __getattr__(self, name):
        return lambda *arguments: self.calls.append((name, *arguments))


def drawn(glance, page, recording=False, **meter):
    canvas = Canvas(glance)
    function, *values = page(SimpleNamespace(**meter), recording)
    function(canvas, *values)
    return canvas


@pytest.mark.parametrize(
    ("left", "right", "digits"),
    [
        (7.4, 12.5, {(30, 8): 7, (74, 8): 1, (102, 8): 3}),
        (9.5, 0.0, {(2, 8): 1, (30, 8): 0, (74, 8): 0}),
    ],
)
def test_the_maxima_are_drawn_to_both_sides(glance, left, right, digits):
    canvas = drawn(glance, glance.maxima, max_left_deg=left, max_right_deg=right)
    assert canvas.digits == digits
    assert canvas.calls == [("vline", 63, 8, 40, 1), ("text", "left  max  right", 0, 56, 1)]


@pytest.mark.parametrize(
    ("forward_g", "digits", "word", "bar"),
    [
        # The bar begins at column 64 and has 60 columns per g.
        (0.55, (0, 5, 5), "accel", (64, 49, 33, 6, 1)),
        (-0.97, (0, 9, 7), "brake", (6, 49, 58, 6, 1)),
        (1.5, (1, 5, 0), "accel", (64, 49, 63, 6, 1)),
        (-1.5, (1, 5, 0), "brake", (1, 49, 63, 6, 1)),
        (0.0, (0, 0, 0), "accel", (64, 49, 0, 6, 1)),
    ],
)
def test_an_acceleration_is_drawn_as_number_and_bar(glance, forward_g, digits, word, bar):
    """Three marks show 0 g and the two peaks. The peak of 0.4 g is 24 columns to the right, and the peak of 1.2 g is at
    the left edge."""
    meter = {"smooth_force": [0.0, 1.0, forward_g], "max_accel_g": 0.4, "max_brake_g": 1.2}
    canvas = drawn(glance, glance.acceleration, **meter)
    assert canvas.digits == dict(zip([(0, 8), (34, 8), (62, 8)], digits))
    point, said, unit, line, length, *marks, peaks = canvas.calls
    assert (point, said, unit) == (("fill_rect", 25, 42, 6, 6, 1), ("text", word, 88, 8, 1), ("text", "g", 94, 40, 1))
    assert (line, length) == (("hline", 0, 51, 128, 1), ("fill_rect", *bar))
    assert marks == [("vline", x, 49, 6, 1) for x in (64, 88, 1)]
    assert peaks[0] == "text" and peaks[2:] == (0, 56, 1) and "0.40" in peaks[1] and "1.20" in peaks[1]


@pytest.mark.parametrize(
    ("lean_deg", "digits", "columns", "side"),
    [
        (31.6, {(38, 16): 3, (66, 16): 2}, range(64, 97), ("text", "right", 88, 56, 1)),
        (-2.6, {(52, 16): 3}, range(64, 60, -1), ("text", "left", 0, 56, 1)),
        (0.3, {(52, 16): 0}, range(64, 65), None),
        (-75.0, {(38, 16): 7, (66, 16): 5}, range(64, 3, -1), ("text", "left", 0, 56, 1)),
    ],
)
def test_a_lean_is_drawn_as_number_arc_and_side(glance, lean_deg, digits, columns, side):
    """The arc has one column per degree, at most 60. The arc's upper edge is a circle of radius 100 that begins in row
    2. So at column 60 the edge is in row 102 - 80 = 22."""
    canvas = drawn(glance, glance.lean, lean_deg=lean_deg)
    assert canvas.calls[0] == ("scale", 0, 0)
    assert canvas.digits == digits
    arc = [call for call in canvas.calls if call[0] == "vline" and call[3:] == (7, 1) and call[2] < 23]
    assert [call[1] for call in arc[: len(columns)]] == list(columns)
    assert arc[0][2] == 2
    if abs(lean_deg) > 60.0:
        assert arc[60][2] == 22
    assert [call for call in canvas.calls if call[0] == "text"] == ([side] if side else [])


def test_the_arrow_points_to_the_side_and_rec_is_below(glance):
    """The arrow has 24 columns. The arrow's point is one pixel high, and its back is 29 pixels high."""
    canvas = drawn(glance, glance.lean, recording=True, lean_deg=20.0)
    arrow = [call for call in canvas.calls if call[0] == "vline" and call[1] > 101]
    assert (len(arrow), arrow[0], arrow[-1]) == (24, ("vline", 125, 40, 1, 1), ("vline", 102, 26, 29, 1))
    assert canvas.calls[-1] == ("text", "REC", 48, 56, 1)
    left = drawn(glance, glance.lean, lean_deg=-20.0)
    arrow = [call for call in left.calls if call[0] == "vline" and call[1] < 26]
    assert (len(arrow), arrow[0], arrow[-1]) == (24, ("vline", 2, 40, 1, 1), ("vline", 25, 26, 29, 1))


def test_an_unsure_lean_is_two_dashes_and_its_reason(glance):
    canvas = Canvas(glance)
    function, reason = glance.unsure("Lean  --", "not sure yet")
    function(canvas, reason)
    assert canvas.calls[:2] == [("fill_rect", 38, 18, 24, 8, 1), ("fill_rect", 66, 18, 24, 8, 1)]
    assert canvas.calls[2] == ("tall", "  not sure yet", 5, True)
    assert canvas.calls[3:] == [("hline", 0, 39, 128, 1), ("hline", 0, 56, 128, 1)]
