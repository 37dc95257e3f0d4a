"""Each program in firmware/examples on MicroPython, and `kickstand try`."""

import json
import re
from pathlib import Path

import pytest
from support import command
from support.mpy import BOARD_HEAP, run_mpy

SCRIPT = Path(__file__).resolve().with_name("example_run.py")
EXAMPLES = SCRIPT.parents[2] / "firmware" / "examples"
TURN_DEG = 35.0  # lean of the ride of example_run.py


def run(flash, name, until, turn_to=(), **changed):
    """Return the program's output, and the results of example_run.py. A user_*.py runs as the user's program.

    changed: {name of a constant: its new value}.
    """
    source = (EXAMPLES / name).read_text(encoding="utf-8")
    for constant, value in changed.items():
        source, count = re.subn(rf"(?m)^{constant} = \S+", f"{constant} = {value}", source)
        assert count == 1
    (flash / "user.py").write_text(source, encoding="utf-8")
    program = None if name.startswith("user_") else "user.py"
    plan = json.dumps({"program": program, "until": until, "turn_to": turn_to})
    printed, _, results = run_mpy(SCRIPT, heap=BOARD_HEAP, stdin=plan, directory=flash).rstrip("\n").rpartition("\n")
    return printed, json.loads(results)


def numbers(line):
    return [float(number) for number in re.findall(r"[-+]?\d+\.\d+", line)]


def test_print_sensor(tmp_path):
    """The sensor is at rest and not calibrated. The set-up takes 0.2 s, and then a line is printed every 0.2 s."""
    header, *lines = run(tmp_path, "print_sensor.py", 1.5)[0].strip().split("\n")
    assert header == "Found an MPU6050" and len(lines) == 7
    ax, ay, az, *rates, temperature = numbers(lines[0])
    assert (ax * ax + ay * ay + az * az) ** 0.5 == pytest.approx(1.0, abs=0.1)
    assert max(map(abs, rates)) < 25.0 and temperature == pytest.approx(25.0, abs=0.1)


def test_show_text(tmp_path):
    assert run(tmp_path, "show_text.py", 4.5)[1]["frames"][-1] == ["Hello, rider!   ", "on for 3 s      "]


def test_print_lean(tmp_path):
    lines = [line for line in run(tmp_path, "print_lean.py", 10.0)[0].split("\n") if line.startswith("lean")]
    assert len(lines) > 80
    assert numbers(lines[0])[0] == pytest.approx(0.0, abs=1.0)
    assert numbers(lines[-1])[0] == pytest.approx(TURN_DEG, abs=3.0)
    assert max(numbers(line)[1] for line in lines) > 0.2  # the bike accelerates when it sets off


def test_user_page_is_the_last_page(tmp_path):
    """The load in the turn is 1 / cos(35 degrees)."""
    frames = run(tmp_path, "user_page.py", 12.0, turn_to=[(4, "own"), (10.5, "lean")])[1]["frames"]
    page = re.fullmatch(r"Load     (\d\.\d\d) x *", frames[9][0])
    assert page and float(page[1]) == pytest.approx(1.22, abs=0.05) and re.fullmatch(r"Lean  3\d deg *", frames[9][1])
    assert frames[-1][0].startswith("Lean")


@pytest.mark.parametrize(("limit_deg", "lit"), [(45, False), (30, True)])
def test_user_light_turns_on_at_its_limit(tmp_path, limit_deg, lit):
    lamp = run(tmp_path, "user_light.py", 10.0, LIMIT_DEG=limit_deg)[1]["lamp"]
    assert not any(lamp[:4]) and bool(lamp[-1]) is lit


def test_user_uart_sends_ten_lines_per_second(tmp_path):
    lines = run(tmp_path, "user_uart.py", 10.0)[1]["sent"].splitlines()
    assert 80 <= len(lines) <= 101
    assert lines[0] == "?" and float(lines[-1]) == pytest.approx(TURN_DEG, abs=3.0)


def test_try_turns_to_the_users_page_and_prints_its_console(tmp_path):
    (tmp_path / "my.py").write_text("print('on the console')\n" + (EXAMPLES / "user_battery.py").read_text())
    printed = command.works("try", tmp_path / "my.py").out
    assert "on the console" in printed.splitlines() and "|Battery  12.6 V |\n|ok              |" in printed
    (tmp_path / "my.py").write_text("import time\n\ndef page(app)\n    pass\n")
    refusal = command.refused(tmp_path, "try", tmp_path / "my.py", words="my.py, line 3: ")
    assert refusal.endswith("cannot run this file: correct it, or give your program\n")
    command.refused(tmp_path, "try", tmp_path, words="Is a directory: give the name of a file")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_it_can_be_read_by_a_beginner(path):
    source = path.read_text(encoding="utf-8")
    assert len(source.split("\n")) <= 40
    words = "cp firmware/examples/{} :user.py" if path.name.startswith("user_") else "run firmware/examples/{}"
    assert "mpremote " + words.format(path.name) in source
