"""The demo's picture, its score, its keys, and the check of a user's program."""

import os
from typing import Any

import pytest
from kickstand_sim.demo import demo
from kickstand_sim.demo.score import Score, State, table
from kickstand_sim.demo.screen import bike, oled_lines, screen
from kickstand_tools.common import installation
from kickstand_tools.common.messages import InputError
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


def lines_of(printed) -> list[str]:
    with open(os.devnull, "w") as nowhere:
        console = Console(width=100, record=True, file=nowhere)
        console.print(printed)
    return console.export_text().splitlines()


def drawn(paused=False, **changed: Any) -> list[str]:
    state: Any = STATE | changed
    return lines_of(screen(state, "a title", "the keys", paused))


def value(lines, name):
    """Return the text after a name, up to the picture of the bike."""
    line = next(line for line in lines if f" {name} " in line)
    return line.partition(f" {name} ")[2].partition("│")[0].partition("╰")[0].strip()


@pytest.mark.parametrize(
    ("changed", "values"),
    [
        ({}, ["30.0° left", "27° left", "+3.0°", "54 km/h", "held turn", "○"]),
        ({"lcd": ["Max left", ""], "lean_deg": 2.0, "speed_mps": 1.0}, ["2.0° right", "-", "-", "4 km/h"]),
        (
            {"pressed": True, "pixels": "ff" * 1024},
            ["30.0° left", "27° left", "+3.0°", "54 km/h", "held turn", "● pressed"],
        ),
    ],
)
def test_the_picture_has_true_and_shown_lean(changed, values):
    lines = drawn(**changed)
    names = "true lean", "shown lean", "error", "speed", "bike", "button"
    assert [value(lines, name) for name in names[: len(values)]] == values
    assert any("from behind" in line for line in lines) is ("pixels" not in changed)
    assert sum("\u28ff" * 64 in line for line in lines) == (16 if "pixels" in changed else 0)


@pytest.mark.parametrize(
    ("paused", "of_s", "end"), [(False, 60.0, "23.4 of 60 s"), (False, None, "23.4 s"), (True, 60.0, "paused")]
)
def test_the_picture_fits_eighty_columns_with_title_and_time(paused, of_s, end):
    """Without an end of the ride, there is no progress bar. The bike stands on the picture's last row, the ground."""
    for lean_deg in (-50.0, 0.0, 50.0):
        lines = drawn(paused, of_s=of_s, lean_deg=lean_deg)
        assert lines[0].startswith("a title") and lines[0].rstrip().endswith(end) and lines[-1].startswith("the keys")
        assert len(lines) == len(drawn()) - (of_s is None) and max(len(line.rstrip()) for line in lines) <= 80
        assert " " not in bike(lean_deg, None).plain.split("\n")[-1]


def test_each_pixel_of_an_oled_has_its_dot():
    """A braille character has two columns of four dots."""
    dots = {(0, 0): 0x01, (0, 1): 0x02, (0, 2): 0x04, (1, 0): 0x08, (1, 2): 0x20, (0, 3): 0x40, (1, 3): 0x80}
    for (x, y), dot in dots.items():
        pixels = bytearray(1024)
        pixels[(128 * (4 * 7 + y) + 2 * 5 + x) // 8] = 0x80 >> (2 * 5 + x) % 8
        lines = oled_lines(pixels.hex())
        assert ord(lines[7][5]) == 0x2800 + dot and "".join(lines).count("\u2800") == 64 * 16 - 1


def scored(*states):
    score = Score()
    for phase, lean_deg, displayed in states:
        score.add({**STATE, "phase": phase, "lean_deg": lean_deg, "lcd": [displayed, ""]})
    return score.figures()


def test_the_score_compares_each_turn_by_hand():
    """Only a shown lean counts. A turn is held again after another phase."""
    figures = scored(
        ("kickstand", 0.0, "Not aligned"),
        ("held turn", -30.0, "Lean  28° left"),
        ("held turn", -30.0, "Lean  33° left"),
        ("straight", 0.0, "Lean   1° right"),
        ("held turn", 20.0, "Lean  20° right"),
    )
    rows = [line.strip("│").split("│") for line in lines_of(table(figures)) if line.startswith("│")]
    assert [[cell.strip() for cell in row] for row in rows] == [
        ["held turn 1", "2", "-30.0", "-30.5", "2.5", "-3.0"],
        ["held turn 2", "1", "20.0", "20.0", "0.0", "+0.0"],
        ["straight on", "1", "0.0", "1.0", "1.0", "+1.0"],
        ["all", "4", "-10.0", "-10.0", "1.9", "-3.0"],
    ]
    assert lines_of(table(scored())) == ["The lean was not shown yet."]


@pytest.mark.parametrize("engine", ["CPython", "MicroPython"])
@pytest.mark.parametrize("program", [b"x = 1\ny = (\n", b"x = 1\0\n", b"def page(app)\n    pass\n"])
def test_a_users_program_is_checked_before_the_ride(engine, program, tmp_path):
    if engine == "MicroPython" and not installation.has_micropython():
        pytest.skip("no MicroPython for this system")
    path = tmp_path / "my.py"
    path.write_text("def page(meter):\n    return 'a', 'b'\n")
    demo.check_program(path, engine)
    path.write_bytes(program)
    with pytest.raises(InputError, match=rf"my\.py.*: {engine} cannot run this file: correct it"):
        demo.check_program(path, engine)
