"""Tests the times, leans, speed and button in the picture of the demo, and the states that the device sends."""

import os
from types import SimpleNamespace
from typing import Any

import pytest
from kickstand_tools.demo.device import seen
from kickstand_tools.demo.score import Score, State, table
from kickstand_tools.demo.screen import bike, screen
from rich.console import Console

STATE: State = {
    "t_s": 23.4,
    "of_s": 60.0,
    "lcd": ["Lean  27° left  ", "   ████████     "],
    "lean_deg": -30.04,
    "speed_mps": 15.0,
    "phase": "held turn",
    "pressed": False,
}


def drawn(paused=False, **changed: Any):
    """Return the lines of the picture."""
    console = Console(width=100, record=True, file=open(os.devnull, "w"))
    state: Any = {**STATE, **changed}
    console.print(screen(state, "a title", "the keys", paused))
    return console.export_text().splitlines()


def value(lines, name):
    """Return the text after a name, up to the picture of the bike."""
    line = next(line for line in lines if f" {name} " in line)
    return line.partition(f" {name} ")[2].partition("│")[0].partition("╰")[0].strip()


def test_the_picture_has_true_and_shown_lean():
    lines = drawn()
    assert value(lines, "true lean") == "30.0° left" and value(lines, "shown lean") == "27° left"
    assert value(lines, "error") == "+3.0°"  # the shown lean minus the true lean
    assert value(lines, "speed") == "54 km/h" and value(lines, "bike") == "held turn"
    other = drawn(lcd=["Max left", ""], lean_deg=2.0, speed_mps=1.0)
    assert (value(other, "true lean"), value(other, "shown lean"), value(other, "error")) == ("2.0° right", "-", "-")
    assert value(other, "speed") == "4 km/h"


@pytest.mark.parametrize(("pressed", "text"), [(True, "● pressed"), (False, "○")])
def test_the_picture_has_the_button(pressed, text):
    assert value(drawn(pressed=pressed), "button") == text


@pytest.mark.parametrize(
    ("paused", "of_s", "end"), [(False, 60.0, "23.4 of 60 s"), (False, None, "23.4 s"), (True, 60.0, "paused")]
)
def test_the_first_line_has_the_title_and_the_time(paused, of_s, end):
    lines = drawn(paused, of_s=of_s)
    assert lines[0].startswith("a title") and lines[0].rstrip().endswith(end)
    assert lines[-1].startswith("the keys")
    assert len(lines) == len(drawn()) - (of_s is None)  # without an end of the ride, the picture has no progress bar


def test_the_picture_of_an_oled_has_its_pixels_and_no_bike():
    lines = drawn(pixels="ff" * 1024)
    assert sum("\u28ff" * 64 in line for line in lines) == 16
    assert not any("from behind" in line for line in lines) and value(lines, "speed") == "54 km/h"
    assert any("from behind" in line for line in drawn())


def columns(picture, style):
    """Return the columns of a style in each row of the drawing of the bike."""
    found, row, column = [], [], 0
    for text, part in ((segment.text, str(segment.style)) for segment in picture.render(Console(width=80))):
        for character in text:
            if character == "\n":
                found.append(row)
                row, column = [], 0
                continue
            if part == style and character != " ":
                row.append(column)
            column += 1
    return [*found, row]


@pytest.mark.parametrize(("shown_deg", "side"), [(-30.0, -1), (30.0, 1)])
def test_a_dashed_line_shows_the_shown_lean(shown_deg, side):
    """The bike is upright. The line begins at the bike's wheel and ends at the side of the lean."""
    rows = columns(bike(0.0, shown_deg), "yellow")
    upper = [column - 18.5 for row in rows[:5] for column in row]
    assert upper and all(column * side > 3.0 for column in upper)
    assert columns(bike(0.0, None), "yellow") == [[]] * len(rows)


def test_a_state_of_the_device_has_rounded_numbers():
    board = SimpleNamespace(
        clock=SimpleNamespace(now_us=1_234_567),
        lcd=SimpleNamespace(text=lambda: ["a", "b"]),
        button=SimpleNamespace(closed=True),
    )
    moving = SimpleNamespace(truth=lambda t_s: (10.0 * t_s, 2.0 * t_s, 0.0, "roll"))
    assert seen(board, moving, 60.0) == {
        "t_s": 1.235,
        "of_s": 60.0,
        "lcd": ["a", "b"],
        "lean_deg": 12.35,
        "speed_mps": 2.47,
        "phase": "roll",
        "pressed": True,
    }
    assert seen(board, moving)["of_s"] is None


def test_each_held_turn_is_counted_once():
    score = Score()
    for phase, lean_deg in (("held turn", -30.0), ("held turn", -30.0), ("roll", -10.0), ("held turn", 20.0)):
        score.add({**STATE, "phase": phase, "lean_deg": lean_deg})
    figures = score.figures()
    assert list(figures) == ["held turn 1", "held turn 2", "rolling in and out", "all"]
    assert [part.samples for part in figures.values()] == [2, 1, 1, 4]
    assert figures["held turn 2"].worst == -47.0 and figures["all"].rms_error == pytest.approx(
        ((3.0**2 + 3.0**2 + 17.0**2 + 47.0**2) / 4.0) ** 0.5
    )


def test_a_line_separates_the_whole_ride_from_its_parts():
    score = Score()
    for phase in ("held turn", "roll"):
        score.add({**STATE, "phase": phase})
    console = Console(width=100, record=True, file=open(os.devnull, "w"))
    console.print(table(score.figures()))
    lines = console.export_text().splitlines()
    starts = [
        line.lstrip("│ ").split("  ")[0] if line.startswith("│") else line[0] for line in lines if line[:1] in "│├"
    ]
    assert [start.split(" │")[0].strip() for start in starts[-4:]] == ["held turn 1", "rolling in and out", "├", "all"]
