"""Tests the output of each program in firmware/examples on MicroPython."""

import json
import re
from pathlib import Path

import pytest
from support import command
from support.mpy import BOARD_HEAP, run_mpy

SCRIPT = Path(__file__).resolve().with_name("example_run.py")
EXAMPLES = SCRIPT.parents[2] / "firmware" / "examples"
TURN_DEG = 35.0  # lean of the ride of example_run.py, in degrees


def run(flash, name, until, turn_to=()):
    """Return the program's output, and the display's two lines in each second. A user.py runs as the user's program."""
    printed, seen = run_all(flash, name, until, turn_to)
    return printed, seen["frames"]


def run_all(flash, name, until, turn_to=()):
    """Return the program's output, and the results of example_run.py. name: None for the user.py in flash."""
    program = name and str(EXAMPLES / name)
    if name and name.startswith("user_"):
        (flash / "user.py").write_bytes((EXAMPLES / name).read_bytes())
        program = None
    plan = json.dumps({"program": program, "until": until, "turn_to": turn_to})
    said = run_mpy(SCRIPT, heap=BOARD_HEAP, stdin=plan, directory=flash)
    printed, _, frames = said.rstrip("\n").rpartition("\n")
    return printed, json.loads(frames)


def numbers(line):
    return [float(number) for number in re.findall(r"[-+]?\d+\.\d+", line)]


def test_print_sensor(tmp_path):
    printed, _ = run(tmp_path, "print_sensor.py", 1.5)
    found, *lines = printed.split("\n")
    assert found == "Found an MPU6050"
    assert len([line for line in lines if line]) == 7  # the set-up takes 0.2 s, and then a line is printed every 0.2 s
    ax, ay, az, gx, gy, gz, temperature = numbers(lines[0])
    # The sensor is at rest and not calibrated
    assert (ax * ax + ay * ay + az * az) ** 0.5 == pytest.approx(1.0, abs=0.1)
    assert max(abs(gx), abs(gy), abs(gz)) < 25.0  # the rates are the gyro's bias
    assert temperature == pytest.approx(25.0, abs=0.1)


def test_show_text(tmp_path):
    _, frames = run(tmp_path, "show_text.py", 4.5)
    assert frames[-1] == ["Hello, rider!   ", "on for 3 s      "]


def test_print_lean(tmp_path):
    printed, _ = run(tmp_path, "print_lean.py", 12.0)
    lines = [line for line in printed.split("\n") if line.startswith("lean")]
    assert len(lines) > 100
    assert numbers(lines[0])[0] == pytest.approx(0.0, abs=1.0)
    assert numbers(lines[-1])[0] == pytest.approx(TURN_DEG, abs=3.0)
    assert max(numbers(line)[1] for line in lines) > 0.2  # the bike accelerates when it sets off


def test_user_page(tmp_path):
    """The usual pages come before the user's page, and after the user's page the first page comes again."""
    _, frames = run(tmp_path, "user_page.py", 12.0, turn_to=[(4, "own")])
    shown = re.fullmatch(r"Load     (\d\.\d\d) x", frames[-1][0].rstrip())
    assert shown and float(shown[1]) == pytest.approx(1.22, abs=0.05)  # the load is 1 / cos(35 degrees)
    assert re.fullmatch(r"Lean  3\d deg *", frames[-1][1])
    _, frames = run(tmp_path, "user_page.py", 10.0, turn_to=[(4, "own"), (8.5, "lean")])
    assert frames[-1][0].startswith("Lean")


def test_tried_it_is_turned_to_after_the_first_turn():
    said = command.works("try", EXAMPLES / "user_page.py").out
    loads = [float(load) for load in re.findall(r"\|Load +(\d\.\d\d) x", said)]
    assert max(loads) == pytest.approx(1.41, abs=0.08)  # the load is 1 / cos(45 degrees) in the ride's last turn


@pytest.mark.parametrize("engine", [[], ["--cpython"]], ids=["micropython", "cpython"])
@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("README.md", "A lean meter\n", "README.md, line 1: "),
        ("user.py", "import time\n\ndef page(app)\n    pass\n", "user.py, line 3: "),
        ("user.py", None, "user.py: No such file or directory: check the name and its directory"),
        (".", None, "Is a directory: give the name of a file"),
    ],
)
def test_try_refuses_what_is_no_program_before_the_ride(tmp_path, engine, name, text, words):
    if text:
        (tmp_path / name).write_text(text)
    said = command.refused(tmp_path, "try", tmp_path / name, *engine, words=words)
    assert text is None or said.endswith("cannot run this file: correct it, or give your program\n")


def test_try_refuses_what_only_cpython_can_run(tmp_path):
    (tmp_path / "user.py").write_text("match 3:\n    case 3:\n        pass\n")
    command.refused(tmp_path, "try", tmp_path / "user.py", words="user.py, line 1: ")


def test_user_light(tmp_path):
    """The bike leans by 35 degrees. The light stays off with its limit of 45 degrees, and turns on with a limit of 30
    degrees."""
    _, seen = run_all(tmp_path, "user_light.py", 12.0)
    assert not any(seen["lamp"])
    lower = (tmp_path / "user.py").read_text().replace("LIMIT_DEG = 45", "LIMIT_DEG = 30")
    (tmp_path / "user.py").write_text(lower)
    _, seen = run_all(tmp_path, None, 12.0)
    assert not any(seen["lamp"][:4]) and all(seen["lamp"][-3:])


def test_user_uart(tmp_path):
    _, seen = run_all(tmp_path, "user_uart.py", 12.0)
    lines = seen["sent"].splitlines()
    assert 100 <= len(lines) <= 121
    assert lines[0] == "?"
    assert float(lines[-1]) == pytest.approx(TURN_DEG, abs=3.0)


def test_user_battery(tmp_path):
    _, frames = run(tmp_path, "user_battery.py", 12.0, turn_to=[(4, "own")])
    assert frames[-1] == ["Battery  12.6 V ", "ok              "]


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_it_can_be_read_by_a_beginner(path):
    source = path.read_text(encoding="utf-8")
    assert len(source.split("\n")) <= 40
    command = "cp firmware/examples/{} :user.py" if path.name.startswith("user_") else "run firmware/examples/{}"
    assert "mpremote " + command.format(path.name) in source
