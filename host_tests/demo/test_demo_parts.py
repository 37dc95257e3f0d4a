"""Tests parts of `kickstand demo`: the picture, the lean that is read from the LCD, the score and the keys."""

import os

import pytest
from kickstand_tools.demo.keyboard import split
from kickstand_tools.demo.score import Score, State, table
from kickstand_tools.demo.screen import bike, screen
from kickstand_tools.simulated_board.lcd import shown_lean
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


@pytest.mark.parametrize("lean_deg", [-50.0, -12.3, 0.0, 7.0, 50.0])
@pytest.mark.parametrize("of_s", [60.0, None])
def test_the_picture_keeps_within_eighty_columns(lean_deg, of_s):
    console = Console(width=100, record=True, file=open(os.devnull, "w"))
    state: State = {**STATE, "lean_deg": lean_deg, "phase": "accelerate", "of_s": of_s}
    title = "Kickstand on an emulated Pico, socket://127.0.0.1:65535"
    console.print(screen(state, title, "b button", False))
    lines = console.export_text().splitlines()
    assert 15 <= len(lines) <= 20
    assert max(len(line.rstrip()) for line in lines) <= 80
    assert any("┃ Lean  27° left   ┃" in line for line in lines)
    assert not any("…" in line for line in lines)


def test_the_bike_leans_to_the_side_of_the_truth():
    def middle(lean_deg):
        top = next(row for row in bike(lean_deg, None).plain.splitlines() if row.strip())
        return sum(i for i, c in enumerate(top) if c != " ") / sum(c != " " for c in top) - 18.5

    assert middle(-30.0) < -5.0 and abs(middle(0.0)) < 1.0 and middle(30.0) > 5.0
    assert middle(-30.0) == pytest.approx(-middle(30.0), abs=1.0)


def test_lean_is_read_off_the_lcd():
    assert shown_lean(["Lean  27° left  ", ""]) == -27.0
    assert shown_lean(["Lean   3° right ", ""]) == 3.0
    assert shown_lean(["Lean   0°       ", ""]) == 0.0
    assert shown_lean(["Max left   27°  ", ""]) is None


def test_keys():
    assert split("bB\x1b[D\x1b[Cq") == ["b", "B", "left", "right", "q"]
    assert split("\x1b[A\x1bODd") == ["left", "d"]
    assert split("\xe0K\xe0Ma") == ["left", "right", "a"]


def test_the_score_counts_what_was_shown():
    score = Score()
    for lean_deg, lcd, phase in (
        (0.0, "Not aligned", "kickstand"),
        (-30.0, "Lean  28° left", "held turn"),
        (-30.0, "Lean  33° left", "held turn"),
        (0.0, "Lean   1° right", "straight"),
        (20.0, "Lean  20° right", "held turn"),
    ):
        score.add({**STATE, "lean_deg": lean_deg, "lcd": [lcd, ""], "phase": phase})
    console = Console(width=100, record=True, file=open(os.devnull, "w"))
    console.print(table(score.figures()))
    rows = [line.strip("│").split("│") for line in console.export_text().splitlines() if line.startswith("│")]
    values = {name.strip(): [cell.strip() for cell in cells] for name, *cells in rows}
    assert values["held turn 1"] == ["2", "-30.0", "-30.5", "2.5", "-3.0"]
    assert values["held turn 2"] == ["1", "20.0", "20.0", "0.0", "+0.0"]
    assert values["straight on"] == ["1", "0.0", "1.0", "1.0", "+1.0"]
    assert values["all"] == ["4", "-10.0", "-10.0", "1.9", "-3.0"]
