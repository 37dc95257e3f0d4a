"""`kickstand demo` as a user runs them: printed to a file, in a terminal, and by hand."""

import itertools
import re
import sys

import pytest
from kickstand_sim.demo.demo import demo
from kickstand_sim.demo.device_process import DeviceProcess
from kickstand_sim.simulated_board.lcd import shown_lean
from kickstand_tools.common import installation
from kickstand_tools.common.messages import InputError
from support import command
from support.terminal import Terminal

no_micropython = pytest.mark.skipif(not installation.has_micropython(), reason="no MicroPython for this system")


@pytest.fixture(scope="module")
def printed() -> str:
    return command.works("demo").out


def frames(text):
    """Return a tuple for each printed frame: time, phase, true lean, and the two lines of the LCD."""
    head = r"^ *([\d.]+) s  ([\w ]+), true lean ([\d.]+)° ?(left|right|)"
    edge, line = r"\+-{16}\+", r"\|(.{16})\|"
    matches = re.findall("\n".join([head, edge, line, line, edge]), text, re.MULTILINE)
    signs = {"left": -1.0, "": 1.0, "right": 1.0}
    return [(float(t), phase, signs[side] * float(lean), x, y) for t, phase, lean, side, x, y in matches]


def test_the_rider_aligns_the_board_in_two_poses(printed):
    texts = [(phase, f"{first} {second}") for _, phase, _, first, second in frames(printed)]
    order = []
    for text, during in (("On stand: press", "kickstand"), ("Now upright", "kickstand"), ("Aligned!", "upright")):
        order.append(next(k for k, (_, lcd) in enumerate(texts) if text in lcd))
        assert texts[order[-1]][0] == during
    assert order == sorted(order)
    tilt = re.search(r"Aligned! +([\d.]+)°", printed)
    assert tilt and float(tilt[1]) == pytest.approx(12.0, abs=1.0)
    assert all(frame[3:] != other[3:] for frame, other in itertools.pairwise(frames(printed)))


def test_the_display_follows_the_true_lean(printed):
    displayed = [(true, shown_lean(lcd)) for _, phase, true, *lcd in frames(printed) if phase == "held turn"]
    assert {true > 0 for true, _ in displayed} == {True, False}
    assert all(lean == pytest.approx(true, abs=4.0) for true, lean in displayed)


def test_the_end_compares_shown_and_true_lean(printed):
    table = printed.split("shown on the LCD, and true")[1]
    rows = re.findall(r"│ held turn \d +│ +(\d+) │ +(-?[\d.]+) │ +(-?[\d.]+) │ +([\d.]+) │ +([-+][\d.]+) │", table)
    assert [round(float(row[1])) for row in rows] == [-30, 38, -45]
    for count, true, displayed, rms, worst in rows:
        assert int(count) > 50 and float(displayed) == pytest.approx(float(true), abs=3.0)
        assert float(rms) <= abs(float(worst))
    assert re.search(r"│ all +│ +\d{3,} │", table)


@pytest.mark.long
@no_micropython
@pytest.mark.parametrize("display", ["lcd", "ssd1306"])
def test_both_engines_show_the_same(display):
    micropython = command.works("demo", "--display", display)
    assert micropython.out.count(" s  ") > 80
    assert command.works("demo", "--cpython", "--display", display).out == micropython.out


def test_by_hand_needs_a_terminal():
    with pytest.raises(InputError, match="run kickstand demo --hand in a terminal"):
        demo(hand=True)


def test_without_micropython_it_says_so(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(installation, "has_micropython", lambda: False)
    (tmp_path / "my.py").write_text("x = (\n")
    with pytest.raises(InputError, match="CPython cannot run this file"):
        demo(user=tmp_path / "my.py")
    assert capsys.readouterr().out == (
        "No MicroPython package for this system: the same firmware runs on CPython instead.\n"
    )


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_in_a_terminal_by_hand():
    """The keys press the button, raise the bike, set it off and lean it left. The ride is six times as fast."""
    code = "from kickstand_sim.demo import demo; demo.HAND_SPEED = 6.0; demo.demo(True, True)"
    clock = r"(\d+\.\d) s\s"
    with Terminal([sys.executable, "-c", code]) as terminal:
        terminal.wait_for("On stand: press")
        terminal.press("b")
        terminal.wait_for("Now upright")
        terminal.press("u")
        upright_s = float(terminal.wait_for(clock)[1]) + 2.0
        while float(terminal.wait_for(clock)[1]) < upright_s:
            pass
        terminal.press("b")
        terminal.wait_for("Aligned!")
        terminal.press("aaa\x1b[D\x1b[D")
        terminal.wait_for("20° left")
        terminal.press("q")
        terminal.wait_for("and true")
        assert terminal.end() == 0


# A short program takes the place of the device


def test_the_device_obeys_its_commands():
    """It sends a state every 50 ms of its time, which a second pause continues."""
    with DeviceProcess("cpython", "hand", 20.0) as process:
        states: list = []

        def each():
            """Yield all states as they come."""
            while not process.ended:
                for state in process.ticks(10.0):
                    assert state["t_s"] < 100.0
                    states.append(state)
                    yield state

        coming = each()

        def until(condition):
            return next(state for state in coming if condition(state))

        until(lambda state: "On stand: press" in " ".join(state["lcd"]))
        process.send("upright")
        assert until(lambda state: state["phase"] == "upright")["speed_mps"] == 0.0
        process.send("short")
        until(lambda state: state["pressed"])
        until(lambda state: not state["pressed"])
        process.send("pause")
        process.send("pause")
        resumed_s = states[-1]["t_s"] + 1.0
        until(lambda state: state["t_s"] > resumed_s)
        process.send("quit")
        for _ in coming:
            pass
    assert not process.failed
    assert [round(20 * state["t_s"]) for state in states] == list(range(1, len(states) + 1))
    assert {state["of_s"] for state in states} == {None}
