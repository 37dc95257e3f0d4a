"""The pictures of the pages: numbers, bars, marks and words are drawn at their places."""

import pytest
from panel import reading

DIGIT = 120  # bytes of a digit: 5 bands of 8 rows, with 24 columns


@pytest.fixture
def picture():
    """Return picture(page, recording, **meter): what the picture of a page draws, as a Canvas."""
    from kickstand.ui import glance

    class Canvas:
        """digits: {(x, y): digit} of the large number. calls: all other calls, in their order."""

        def __init__(self):
            self.digits, self.calls = {}, []

        def blit(self, glyph, x, y):
            pixels = [[glyph.pixel(i, j) for i in range(24)] for j in range(40)]
            for digit in range(10):
                bands = glance.DIGITS[DIGIT * digit : DIGIT * (digit + 1)]
                if all(pixels[j][i] == bands[24 * (j // 8) + i] >> j % 8 & 1 for j in range(40) for i in range(24)):
                    self.digits[x, y] = digit
                    return
            self.calls.append(("scale", x, y))
            self.scale = glyph

        def __getattr__(self, name):
            return lambda *arguments: self.calls.append((name, *arguments))

    def draw(page, recording=False, **values):
        meter = reading((0, 0, 4096, 0, 0, 0, 0))
        vars(meter).update(values)
        function, *arguments = getattr(glance, page)(meter, recording) if page != "unsure" else glance.unsure(**values)
        canvas = Canvas()
        function(canvas, *arguments)
        return canvas

    return draw


@pytest.mark.parametrize(
    ("left", "right", "digits"),
    [(7.4, 12.5, {(30, 8): 7, (74, 8): 1, (102, 8): 3}), (9.5, 0.0, {(2, 8): 1, (30, 8): 0, (74, 8): 0})],
)
def test_the_maxima_are_drawn_to_both_sides(picture, left, right, digits):
    canvas = picture("maxima", max_left_deg=left, max_right_deg=right)
    assert canvas.digits == digits
    assert canvas.calls == [("vline", 63, 8, 40, 1), ("text", "left  max  right", 0, 56, 1)]


@pytest.mark.parametrize(
    ("lean_deg", "digits", "columns", "side"),
    [
        (31.6, {(38, 16): 3, (66, 16): 2}, range(64, 97), ("text", "right", 88, 56, 1)),
        (9.5, {(38, 16): 1, (66, 16): 0}, range(64, 75), ("text", "right", 88, 56, 1)),
        (-9.5, {(38, 16): 1, (66, 16): 0}, range(64, 53, -1), ("text", "left", 0, 56, 1)),
        (-2.6, {(52, 16): 3}, range(64, 60, -1), ("text", "left", 0, 56, 1)),
        (0.3, {(52, 16): 0}, range(64, 65), None),
        (-75.0, {(38, 16): 7, (66, 16): 5}, range(64, 3, -1), ("text", "left", 0, 56, 1)),
    ],
)
def test_a_lean_is_drawn_as_number_arc_and_side(picture, lean_deg, digits, columns, side):
    """The arc has one column per degree, at most 60. The arc's upper edge is a circle of radius 100 that begins in row
    2. So at column 60 the edge is in row 102 - 80 = 22. The arrow has 24 columns. Its point is one pixel high, and its
    back is 29 pixels high."""
    canvas = picture("lean", recording=True, lean_deg=lean_deg)
    assert canvas.calls[0] == ("scale", 0, 0) and canvas.digits == digits
    edges = {0: 2, 15: 3, 30: 7, 60: 22}  # the scale is one row, and seven rows at every 30 degrees
    for x, row in edges.items():
        for column in (64 + x, 64 - x):
            lit = [y for y in range(32) if canvas.scale.pixel(column, y)]
            assert lit == list(range(row, row + (7 if x % 30 == 0 else 1)))
    lines = [call for call in canvas.calls if call[0] == "vline"]
    assert [line[1] for line in lines[: len(columns)]] == list(columns) and lines[0][2:] == (2, 7, 1)
    assert len(columns) < 61 or lines[60][2] == 22
    arrow = lines[len(columns) + 2 :]  # after the two sides of the degree sign
    point, base = (125, 102) if lean_deg > 0 else (2, 25)
    assert [line[1:] for line in (arrow[0], arrow[-1])] == [(point, 40, 1, 1), (base, 26, 29, 1)] if side else not arrow
    assert not side or len(arrow) == 24
    words = [call for call in canvas.calls if call[0] == "text"]
    assert words == [side] * (side is not None) + [("text", "REC", 48, 56, 1)]


@pytest.mark.parametrize(("reason", "spaces"), [("not sure yet", 2), ("a" * 16, 0), ("a" * 15, 1), ("a" * 13, 2)])
def test_an_unsure_lean_is_two_dashes_and_its_reason(picture, reason, spaces):
    assert picture("unsure", line1="Lean  --", line2=reason).calls == [
        ("fill_rect", 38, 18, 24, 8, 1), ("fill_rect", 66, 18, 24, 8, 1), ("tall", " " * spaces + reason, 5, True),
        ("hline", 0, 39, 128, 1), ("hline", 0, 56, 128, 1),
    ]  # fmt: skip
