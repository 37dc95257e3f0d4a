"""Tests `kickstand demo` as a user runs it: with its output in a file, in a terminal, and with --hand."""

import functools
import itertools
import os
import re
import subprocess
import sys
import time

import pytest
from kickstand_tools.common import unix_port
from kickstand_tools.demo.demo import DeviceStopped, demo
from kickstand_tools.demo.device_process import DeviceProcess
from kickstand_tools.simulated_board.lcd import shown_lean
from support.command import run
from support.terminal import Terminal

HUNG_S = 300  # only a hanging process takes this long, even on a busy machine


def demo_command(engine, hand=False):
    """Return a command line that starts the demo. With --hand the ride runs six times as fast as usual."""
    code = f"from kickstand_tools.demo import demo; demo.HAND_SPEED = 6.0; demo.demo({hand}, {engine == 'cpython'})"
    return [sys.executable, "-c", code]


@functools.cache
def printed_by(engine):
    """Return the output of the demo when standard output is not a terminal."""
    done = subprocess.run(
        demo_command(engine),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        env=os.environ | {"PYTHONIOENCODING": "utf-8"},
        timeout=HUNG_S,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    return done.stdout


@pytest.fixture(scope="module")
def printed():
    """Return the printed output. test_both_engines_show_the_same tests that it does not depend on the engine."""
    return printed_by("cpython")


def frames(text):
    """Return a tuple for each frame in the text: time, phase, true lean, and the two lines of the LCD."""
    head = r"^ *([\d.]+) s  ([\w ]+), true lean ([\d.]+)° ?(left|right|)"
    edge, line = r"\+-{16}\+", r"\|(.{16})\|"
    found = re.findall("\n".join([head, edge, line, line, edge]), text, re.MULTILINE)
    signs = {"left": -1.0, "": 1.0, "right": 1.0}
    return [(float(t), phase, signs[side] * float(lean), x, y) for t, phase, lean, side, x, y in found]


def test_printed_the_rider_is_led_through_both_poses(printed):
    said = [(phase, f"{first} {second}") for _, phase, _, first, second in frames(printed)]
    order = []
    for text, during in (("On stand: press", "kickstand"), ("Now upright", "kickstand"), ("Aligned!", "upright")):
        order.append(next(i for i, (_, lcd) in enumerate(said) if text in lcd))
        assert said[order[-1]][0] == during
    assert order == sorted(order)
    tilt = re.search(r"Aligned! +([\d.]+)°", printed)
    assert tilt and float(tilt[1]) == pytest.approx(12.0, abs=1.0)


def test_printed_the_lcd_follows_the_true_lean(printed):
    held = [(true, shown_lean([x, y])) for _, phase, true, x, y in frames(printed) if phase == "held turn"]
    assert {true > 0 for true, _ in held} == {True, False}
    for true, shown in held:
        assert shown == pytest.approx(true, abs=4.0)


def test_printed_it_ends_with_shown_against_true(printed):
    table = printed.split("shown on the LCD, and true")[1]
    rows = re.findall(r"│ held turn \d +│ +(\d+) │ +(-?[\d.]+) │ +(-?[\d.]+) │ +([\d.]+) │ +([-+][\d.]+) │", table)
    assert [round(float(row[1])) for row in rows] == [-30, 38, -45]
    for count, true, shown, rms, worst in rows:
        assert int(count) > 50
        assert float(shown) == pytest.approx(float(true), abs=3.0)
        assert float(rms) <= abs(float(worst))
    assert re.search(r"│ all +│ +\d{3,} │", table)


@pytest.mark.skipif(not unix_port.available(), reason="no MicroPython for this system")
def test_both_engines_show_the_same():
    here, there = (printed_by(engine) for engine in ("cpython", "micropython"))
    assert frames(here) and here == there


def test_by_hand_needs_a_terminal():
    done = subprocess.run(
        demo_command("cpython", hand=True), stdin=subprocess.DEVNULL, capture_output=True, timeout=HUNG_S
    )
    assert done.returncode != 0 and b"InputError" in done.stderr and b"in a terminal" in done.stderr


@pytest.mark.parametrize(("engine", "how"), [("cpython", "quit"), ("micropython", "closed")])
def test_the_device_ends_when_it_is_sent_quit_or_left_alone(engine, how):
    with DeviceProcess(engine, "hand", 1.0) as device:
        if how == "quit":
            device.send("quit")
        else:
            device.hang_up()
        began = time.monotonic()
        while not device.ended:
            device.ticks(0.1)
            assert time.monotonic() - began < HUNG_S
    assert not device.failed


def test_where_there_is_no_micropython_it_says_so_and_runs(monkeypatch, capfd):
    monkeypatch.setattr(unix_port, "available", lambda: False)
    demo()
    first, *_ = capfd.readouterr().out.splitlines()
    assert "No MicroPython" in first and "CPython" in first


def test_a_device_that_stops_early_is_an_error(monkeypatch):
    monkeypatch.setattr(unix_port, "available", lambda: True)
    monkeypatch.setattr(unix_port, "command", lambda *_: [sys.executable, "-c", "print('no sensor in the shop')"])
    with pytest.raises(DeviceStopped, match="no sensor in the shop"):
        demo()
    failed = run("demo")
    assert failed.status == 1
    assert "no sensor in the shop" in failed.err


CLOCK = r"(\d+\.\d) s\s"  # the time of the ride in the corner of the picture


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_in_a_terminal_by_hand():
    """The test uses the keys to press the button, raise the bike, ride off and lean left. The LCD follows."""
    with Terminal(demo_command("cpython", hand=True)) as at:
        at.wait_for("On stand: press")
        at.press("b")
        at.wait_for("Now upright")
        at.press("u")
        upright_s = float(at.wait_for(CLOCK)[1]) + 2.0
        while float(at.wait_for(CLOCK)[1]) < upright_s:
            pass
        at.press("b")
        at.wait_for("Aligned!")
        at.press("aaa\x1b[D\x1b[D")
        at.wait_for("20° left")
        at.press("q")
        at.wait_for("and true")
        assert at.end() == 0


def test_printed_every_frame_is_a_change(printed):
    shown = [frame[3:] for frame in frames(printed)]
    assert len(shown) > 80
    assert all(a != b for a, b in itertools.pairwise(shown))
