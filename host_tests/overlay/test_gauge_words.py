"""Tests the words, numbers and directions of the gauge. The places and sizes of the words are design and are not
tested."""

import math

import pytest

pytest.importorskip("PIL")
from kickstand_tools.overlay import parts
from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.parts import ACCENT, DIM, WHITE

NAN = math.nan


@pytest.fixture
def shown(monkeypatch):
    """Return a function that draws a picture. The function returns {text: colour} and the directions of the arrows,
    True for right."""
    texts, arrows = {}, []
    text, arrow = parts.text, parts.arrow

    def note_text(words, height, colour):
        texts[words] = colour
        return text(words, height, colour)

    def note_arrow(size, right, colour):
        arrows.append(right)
        return arrow(size, right, colour)

    monkeypatch.setattr(parts, "text", note_text)
    monkeypatch.setattr(parts, "arrow", note_arrow)

    def draw(*values, **options):
        texts.clear()
        arrows.clear()
        Gauge(300, **options).picture(*values)
        return dict(texts), list(arrows)

    return draw


def test_words_and_numbers_of_a_right_lean(shown):
    texts, arrows = shown(31.4, 0.25, -0.5, 20.0, 12.4, 44.6)
    assert set(texts) == {
        "60", "30", "km/h", "31", "°", "LEFT", "RIGHT", "max 12°", "max 45°", "72", "ACCEL 0.25 g", "RIGHT 0.50 g",
    }  # fmt: skip
    assert (texts["LEFT"], texts["RIGHT"], texts["31"]) == (DIM, ACCENT, WHITE) and arrows == [True]


def test_words_and_numbers_of_a_left_lean(shown):
    texts, arrows = shown(-5.0, -2.4, 0.0, 44.704, 0.0, 0.51, mph=True)
    assert {"mph", "5", "100", "max --", "max 1°", "BRAKE 2.40 g", "SIDE 0.00 g"} <= set(texts)
    assert (texts["LEFT"], texts["RIGHT"]) == (ACCENT, DIM) and arrows == [False]


@pytest.mark.parametrize(
    ("left_g", "words"), [(0.006, "LEFT 0.01 g"), (-0.006, "RIGHT 0.01 g"), (0.004, "SIDE 0.00 g"), (NAN, "-- g")]
)
def test_force_to_a_side_has_its_word(shown, left_g, words):
    assert words in shown(0.5, 0.0, left_g, 20.0, 0.5, 0.0)[0]


def test_small_and_unknown_leans_have_no_side(shown):
    for lean in (0.5, NAN):
        texts, arrows = shown(lean, 0.0, 0.0, 20.0, 0.0, 0.0)
        assert texts["LEFT"] == texts["RIGHT"] == DIM and not arrows
        assert ("--" in texts) == math.isnan(lean)


def test_without_a_speed_there_is_no_number_for_it(shown):
    assert set(shown(0.0, 0.0, 0.0, 20.0, 0.0, 0.0, has_speed=False)[0]).isdisjoint({"72", "km/h"})
