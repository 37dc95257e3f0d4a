"""kickstand demo as a user meets it: printed, in a terminal, by hand; and the pieces it is made of."""

import contextlib
import itertools
import os
import re
import subprocess
import sys
import time

import pytest
from kickstand_tools import unix_port
from kickstand_tools.demo import demo
from kickstand_tools.demo_score import Score, shown_lean
from kickstand_tools.demo_screen import WIDTH, bike, lcd_lines, lean_text, screen
from kickstand_tools.errors import InputError
from kickstand_tools.keyboard import split
from rich.console import Console

ENGINES = [
    "cpython",
    pytest.param(
        "micropython",
        marks=pytest.mark.skipif(
            not unix_port.available(), reason="no MicroPython unix port for this system"
        ),
    ),
]
STATE = {
    "t_s": 23.4,
    "of_s": 60.0,
    "lcd": ["Lean  27° left  ", "   ████████     "],
    "lean_deg": -30.04,
    "speed_mps": 15.0,
    "phase": "held turn",
    "pressed": False,
}


def command(engine, hand=False):
    """Command line of the demo."""
    return [
        sys.executable,
        "-c",
        f"from kickstand_tools.demo import demo; demo({hand}, {engine == 'cpython'})",
    ]


@pytest.fixture(scope="module", params=ENGINES)
def printed(request):
    """Output of the demo where it is no terminal, and how long it took."""
    began = time.monotonic()
    done = subprocess.run(
        command(request.param),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        env=os.environ | {"PYTHONIOENCODING": "utf-8"},
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    return done.stdout, time.monotonic() - began


def frames(text):
    """[(time, phase, true lean, line 1, line 2), ...]"""
    head, edge, line = (
        r"^ *([\d.]+) s  ([\w ]+), true lean ([\d.]+)° ?(left|right|)",
        r"\+-{16}\+",
        r"\|(.{16})\|",
    )
    found = re.findall("\n".join([head, edge, line, line, edge]), text, re.MULTILINE)
    signs = {"left": -1.0, "": 1.0, "right": 1.0}
    return [(float(t), phase, signs[side] * float(lean), x, y) for t, phase, lean, side, x, y in found]


def test_printed_it_stops_by_itself_within_a_minute(printed):
    assert printed[1] < 60.0


def test_printed_the_rider_is_led_through_both_poses(printed):
    said = [(phase, f"{first} {second}") for _, phase, _, first, second in frames(printed[0])]
    order = []
    for text, during in (
        ("On stand: press", "kickstand"),
        ("Now upright", "kickstand"),
        ("Aligned!", "upright"),
    ):
        order.append(next(i for i, (_, lcd) in enumerate(said) if text in lcd))
        assert said[order[-1]][0] == during
    assert order == sorted(order)
    tilt = re.search(r"Aligned! +([\d.]+)°", printed[0])
    assert tilt and float(tilt[1]) == pytest.approx(12.0, abs=1.0)


def test_printed_the_lcd_follows_the_true_lean(printed):
    held = [(true, shown_lean([x, y])) for _, phase, true, x, y in frames(printed[0]) if phase == "held turn"]
    assert {true > 0 for true, _ in held} == {True, False}
    for true, shown in held:
        assert shown == pytest.approx(true, abs=4.0)


def test_printed_every_frame_is_a_change(printed):
    shown = [frame[3:] for frame in frames(printed[0])]
    assert len(shown) > 80
    assert all(a != b for a, b in itertools.pairwise(shown))


def test_printed_it_ends_with_shown_against_true(printed):
    table = printed[0].split("shown on the LCD against true")[1]
    rows = re.findall(
        r"│ held turn \d +│ +(\d+) │ +(-?[\d.]+) │ +(-?[\d.]+) │ +([\d.]+) │ +([-+][\d.]+) │", table
    )
    assert [round(float(row[1])) for row in rows] == [-30, 38, -45]
    for count, true, shown, rms, worst in rows:
        assert int(count) > 50
        assert float(shown) == pytest.approx(float(true), abs=3.0)
        assert float(rms) <= abs(float(worst))
    assert re.search(r"│ all +│ +\d{3,} │", table)


@pytest.mark.skipif(not unix_port.available(), reason="no MicroPython for this system")
def test_both_engines_show_the_same():
    here, there = (
        subprocess.run(
            command(engine), stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", timeout=120
        )
        for engine in ("cpython", "micropython")
    )
    assert frames(here.stdout) and here.stdout == there.stdout


def test_by_hand_needs_a_terminal():
    with pytest.raises(InputError, match="terminal"):
        demo(hand=True)


def test_where_there_is_no_micropython_it_says_so_and_runs(monkeypatch, capfd):
    monkeypatch.setattr(unix_port, "available", lambda: False)
    demo()
    first, *_ = capfd.readouterr().out.splitlines()
    assert "No MicroPython" in first and "CPython" in first


def test_a_device_that_stops_early_is_an_error(monkeypatch, capfd):
    monkeypatch.setattr(unix_port, "available", lambda: True)
    monkeypatch.setattr(
        unix_port, "command", lambda *_: [sys.executable, "-c", "print('no sensor in the shop')"]
    )
    with pytest.raises(SystemExit) as ended:
        demo()
    assert ended.value.code == 1
    assert "no sensor in the shop" in capfd.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_in_a_terminal_by_hand():
    """Presses, raises the bike, presses, rides off and leans left, all with keys; the LCD follows."""
    import pty

    master, slave = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "80", "LINES": "24"}
    process = subprocess.Popen(
        command("cpython", hand=True), stdin=slave, stdout=slave, stderr=slave, env=environment
    )
    os.close(slave)
    os.set_blocking(master, False)
    seen = ""

    def wait_for(text):
        nonlocal seen
        began = time.monotonic()
        while text not in seen:
            assert time.monotonic() - began < 30.0, f"{text!r} never came: {seen[-3000:]}"
            time.sleep(0.05)
            with contextlib.suppress(BlockingIOError):
                seen += os.read(master, 1 << 20).decode(errors="replace")
        seen = ""

    def press(keys):
        os.write(master, keys.encode())

    try:
        wait_for("On stand: press")
        press("b")
        wait_for("Now upright")
        press("u")
        time.sleep(2.0)
        press("b")
        wait_for("Aligned!")
        press("aaa\x1b[D\x1b[D")
        wait_for("20° left")
        press("q")
        wait_for("against true")
        assert process.wait(10.0) == 0
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        os.close(master)


@pytest.mark.parametrize("lean_deg", [-50.0, -12.3, 0.0, 7.0, 50.0])
@pytest.mark.parametrize("by_hand", [False, True])
def test_the_picture_keeps_within_eighty_columns(lean_deg, by_hand):
    console = Console(width=80, record=True, file=open(os.devnull, "w"))
    state = STATE | {"lean_deg": lean_deg, "phase": "accelerate"}
    console.print(screen(state, "MicroPython", "b button", False, by_hand))
    lines = console.export_text().splitlines()
    assert 15 <= len(lines) <= 20
    assert max(len(line) for line in lines) <= WIDTH
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


def test_lean_in_words():
    assert [lean_text(x) for x in (-12.34, 0.04, -0.04, 5.0)] == ["12.3° left", "0.0°", "0.0°", "5.0° right"]
    assert lean_text(-0.4, digits=0) == "0°"


def test_the_frame_of_the_lcd():
    edge, empty = "+----------------+", "|                |"
    assert lcd_lines(["Lean", ""]) == [edge, "|Lean            |", empty, edge]


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
        score.add({"lean_deg": lean_deg, "lcd": [lcd, ""], "phase": phase})
    console = Console(width=100, record=True, file=open(os.devnull, "w"))
    console.print(score.table())
    rows = [line.strip("│").split("│") for line in console.export_text().splitlines() if line.startswith("│")]
    values = {name.strip(): [cell.strip() for cell in cells] for name, *cells in rows}
    assert values["held turn 1"] == ["2", "-30.0", "-30.5", "2.5", "-3.0"]
    assert values["held turn 2"] == ["1", "20.0", "20.0", "0.0", "+0.0"]
    assert values["straight on"] == ["1", "0.0", "1.0", "1.0", "+1.0"]
    assert values["all"] == ["4", "-10.0", "-10.0", "1.9", "-3.0"]
