"""The numbers, digits and reasons in the pictures of an OLED."""

from types import SimpleNamespace

import pytest
from kickstand_tools.simulated_board.simulator import Board


@pytest.fixture(autouse=True)
def _board():
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0), display="ssd1306"):
        yield


def test_a_lean_is_rounded_away_from_zero():
    from kickstand.ui import glance

    for deg, number, side, column in ((9.5, 10, "right", 10), (-9.5, 10, "left", -10), (9.49, 9, "right", 9)):
        found = glance.lean(SimpleNamespace(lean_deg=deg), False)
        assert found[1:4] == (number, side, column)


def test_the_band_of_a_reason_is_centred():
    from kickstand.ui import glance

    for reason, spaces in (("a" * 16, 0), ("a" * 15, 1), ("a" * 14, 1), ("a" * 13, 2)):
        seen: list = []
        canvas = SimpleNamespace(
            fill_rect=lambda *_: None, hline=lambda *_: None, tall=lambda *given, seen=seen: seen.append(given)
        )
        glance._unsure(canvas, reason)
        assert seen == [(" " * spaces + reason, 5, True)]


def test_each_digit_has_its_own_120_bytes():
    """Each glyph has bands of 8 rows. The digit 1 has a column of 40 rows or less, and the digit 8 is symmetric."""
    from kickstand.ui import glance

    assert len(glance._GLYPHS) == 10 and len(glance.DIGITS) == 1200
    for digit, glyph in enumerate(glance._GLYPHS):
        bands = glance.DIGITS[120 * digit : 120 * (digit + 1)]
        for x, y in ((0, 0), (12, 3), (5, 20), (20, 30), (12, 39), (23, 17)):
            assert glyph.pixel(x, y) == bands[24 * (y // 8) + x] >> y % 8 & 1
