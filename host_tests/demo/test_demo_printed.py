"""Tests what the demo prints, the checks of a user's program, the keys of a real terminal, and the bike steered by
hand. A short program takes the place of the device."""

import itertools
import json
import os
import sys
import time

import pytest
from kickstand_tools.common import unix_port
from kickstand_tools.common.errors import InputError
from kickstand_tools.demo import keyboard, user_program
from kickstand_tools.demo.demo import DeviceStopped, demo
from kickstand_tools.demo.device_process import DeviceProcess
from kickstand_tools.demo.hand_bike import HandBike
from kickstand_tools.demo.score import Score, State
from kickstand_tools.demo.screen import bike, lcd_lines, lean_text, oled_lines

STATE: State = {
    "t_s": 1.0,
    "of_s": 60.0,
    "lcd": ["Lean  27° left", ""],
    "lean_deg": -30.04,
    "speed_mps": 15.0,
    "phase": "held turn",
    "pressed": False,
}


def printed(monkeypatch, capsys, messages, **given):
    """Return the lines that the demo prints for these messages of its device."""
    lines = [one if isinstance(one, str) else json.dumps(one) for one in messages]
    program = "print('''" + "\n".join(lines) + "''')"
    monkeypatch.setattr(unix_port, "available", lambda: True)
    monkeypatch.setattr(unix_port, "command", lambda *_: [sys.executable, "-X", "utf8", "-c", program])
    try:
        demo(**given)
    finally:
        lines = capsys.readouterr().out.splitlines()
    return lines


def at(t_s, *lcd, **changed):
    return {**STATE, "t_s": t_s, "lcd": list(lcd), **changed}


def heads(lines):
    return [line for line in lines if " s  " in line]


def test_a_frame_is_printed_when_the_display_has_changed(monkeypatch, capsys):
    """Changes of the same page are printed at most every 0.25 s. Another page is printed at once."""
    frames = [
        at(1.0, "Lean  27° left", ""),
        at(1.05, "Lean  27° left", ""),
        at(1.2, "Lean  28° left", ""),
        at(1.25, "Lean  29° left", "x"),
        at(1.3, "Max   29°", ""),
        at(1.35, "?", ""),  # a picture of an OLED that is not complete yet
        at(1.4, "Lean  30° left", ""),
        {"ended": "off"},
    ]
    lines = printed(monkeypatch, capsys, frames)
    assert [head.split()[0] for head in heads(lines)] == ["1.00", "1.25", "1.30", "1.40"]
    assert lines[:5] == [
        "  1.00 s  held turn, true lean 30.0° left",
        "+----------------+",
        "|Lean  27° left  |",
        "|                |",
        "+----------------+",
    ]
    assert any("│ held turn 1 │" in line for line in lines)  # the score is printed at the end


def test_an_oled_is_printed_as_its_pixels(monkeypatch, capsys):
    lines = printed(monkeypatch, capsys, [at(1.0, "Lean", "", pixels="ff" * 1024), {"ended": "off"}])
    assert lines[1:18] == [*["\u28ff" * 64] * 16, "The lean was not shown yet."]


def test_the_console_is_printed_only_for_a_users_program(monkeypatch, capsys, tmp_path):
    user = tmp_path / "my.py"
    user.write_text("print('from my code')\n")
    monkeypatch.setattr(user_program, "check", lambda *_: None)
    messages = ["from my code", at(1.0, "Lean", ""), {"ended": "off"}]
    assert printed(monkeypatch, capsys, messages, user=user)[0] == "from my code"
    assert "from my code" not in printed(monkeypatch, capsys, messages)


def test_a_device_that_ends_otherwise_is_an_error(monkeypatch, capsys):
    for messages in (["oh", {"ended": "returned"}], ["oh"]):
        with pytest.raises(DeviceStopped, match="oh"):
            printed(monkeypatch, capsys, messages)
    printed(monkeypatch, capsys, ["oh", {"ended": "off"}])


def test_the_device_steered_by_commands():
    """The device sends a state every 50 ms of its time. The device executes each command, and pauses."""
    with DeviceProcess("cpython", "hand", 20.0) as device:
        states, new = [], []

        def until(condition):
            while True:
                while new:
                    states.append(new.pop(0))
                    assert states[-1]["t_s"] < 100.0
                    if condition(states[-1]):
                        return states[-1]
                new.extend(device.ticks(10.0))

        assert until(lambda state: "On stand: press" in " ".join(state["lcd"]))["phase"] == "kickstand"
        device.send("upright")
        assert until(lambda state: state["phase"] == "upright")["speed_mps"] == 0.0
        device.send("short")
        until(lambda state: state["pressed"])
        until(lambda state: not state["pressed"])
        device.send("pause")
        while new := device.ticks(0.3):
            states.extend(new)
        new = []
        device.send("pause")
        until(lambda state: True)
        device.send("quit")
        states.extend(new)
        while not device.ended:
            states.extend(device.ticks(10.0))
    assert not device.failed
    assert [round(20 * state["t_s"]) for state in states[:40]] == list(range(1, 41))
    assert {state["of_s"] for state in states} == {None}
    pressed = [state["t_s"] for state in states if state["pressed"]]
    assert pressed[-1] - pressed[0] < 0.3


def test_the_scripted_rider_aligns_a_board_with_12_6_volts(tmp_path):
    """The user's program measures the battery through a divider of 11. The rider also turns to the page of the
    program."""
    user = tmp_path / "my.py"
    user.write_text(
        "import machine\nprint('battery', round(machine.ADC(26).read_u16() * 3.3 / 65535 * 11, 1))\n"
        "def page(meter):\n    return 'My own page', ''\n"
    )
    shown, last_s = set(), 0.0
    with DeviceProcess("cpython", "script", 0.0, user=user) as device:
        while last_s < 33.0 and not device.ended:
            for state in device.ticks(10.0):
                last_s = state["t_s"]
                shown.add(" ".join(state["lcd"]))
        device.send("quit")
    assert any("Aligned!" in text for text in shown) and any("My own page" in text for text in shown)
    assert "battery 12.6" in device.console


def test_the_picture_of_the_other_side_is_mirrored():
    """A letter of braille is mirrored by exchanging its two columns of dots."""
    swapped = {0x01: 0x08, 0x02: 0x10, 0x04: 0x20, 0x40: 0x80}
    swapped |= {other: one for one, other in swapped.items()}

    def mirrored(text):
        dots = [ord(c) - 0x2800 if c != " " else 0 for c in reversed(text)]
        return [sum(swapped[bit] for bit in swapped if bit & d) for d in dots]

    left, right = (bike(lean, None).plain.split("\n") for lean in (-20.0, 20.0))
    assert len(left) == len(right)
    for one, other in zip(left, right, strict=True):
        assert mirrored(one) == [ord(c) - 0x2800 if c != " " else 0 for c in other]


@pytest.mark.parametrize("engine", ["CPython", "MicroPython"])
def test_a_users_program_is_checked_before_the_ride(engine, tmp_path):
    if engine == "MicroPython" and not unix_port.available():
        pytest.skip("no MicroPython for this system")
    user = tmp_path / "my.py"
    user.write_text("def page(meter):\n    return 'a', 'b'\n")
    user_program.check(user, engine)
    user.write_text("x = 1\ny = (\n")
    with pytest.raises(InputError, match=rf"my\.py, line [23]: .*: {engine} cannot run this file: correct it"):
        user_program.check(user, engine)
    user.write_bytes(b"x = 1\0\n")
    with pytest.raises(InputError, match=f"{engine} cannot run this file"):
        user_program.check(user, engine)
    with pytest.raises(OSError):
        user_program.check(tmp_path / "none.py", engine)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_keys_of_a_terminal_come_without_enter(monkeypatch):
    ours, theirs = os.openpty()
    with open(theirs) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        import termios

        before = termios.tcgetattr(terminal)
        with keyboard.keyboard() as keys:
            os.write(ours, b"b\x1b[Ca")
            assert keys(5.0) == ["b", "right", "a"]
            begun_s = time.monotonic()
            assert keys(0.05) == []
            assert time.monotonic() - begun_s >= 0.04
            assert not termios.tcgetattr(terminal)[3] & termios.ICANON
        assert termios.tcgetattr(terminal) == before
    os.close(ours)


def test_special_keys_are_dropped_and_no_others():
    assert keyboard.split("\x1b[A1\xe0H2\0;3\x1bOB4\x1b") == ["1", "2", "3", "4", "\x1b"]
    assert keyboard.split("\x1bOC\xe0K\x1b[D") == ["right", "left", "left"]


def test_a_lean_of_zero_has_no_side():
    assert [lean_text(lean) for lean in (-12.34, 0.04, -0.04, 7.0)] == ["12.3° left", "0.0°", "0.0°", "7.0° right"]
    assert [lean_text(lean, 0) for lean in (-12.34, 0.6, 0.4)] == ["12° left", "1° right", "0°"]
    assert lcd_lines(["a", "0123456789abcdef"])[1:3] == ["|a               |", "|0123456789abcdef|"]


def test_each_pixel_of_an_oled_has_its_dot():
    """A braille character has two columns of four dots."""
    dots = {(0, 0): 0x01, (0, 1): 0x02, (0, 2): 0x04, (1, 0): 0x08, (1, 2): 0x20, (0, 3): 0x40, (1, 3): 0x80}
    for (x, y), dot in dots.items():
        for column, row in ((0, 0), (63, 15), (5, 7)):
            pixels = bytearray(1024)
            px, py = 2 * column + x, 4 * row + y
            pixels[(128 * py + px) // 8] = 0x80 >> px % 8
            lines = oled_lines(pixels.hex())
            assert ord(lines[row][column]) == 0x2800 + dot
            assert "".join(lines).count("\u2800") == 64 * 16 - 1


@pytest.mark.parametrize(
    ("phase", "part"),
    [
        *[(phase, "standing") for phase in ("kickstand", "upright", "moving", "wait")],
        *[(phase, "rolling in and out") for phase in ("roll in", "roll out", "roll")],
        *[(phase, "straight on") for phase in ("straight", "accelerate", "brake")],
    ],
)
def test_each_phase_belongs_to_a_part_of_the_score(phase, part):
    score = Score()
    assert score.figures() == {}
    score.add({**STATE, "phase": phase, "lean_deg": -25.0})
    assert list(score.figures()) == [part, "all"]
    assert score.figures()[part] == (1, -25.0, -27.0, 2.0, -2.0)


def test_the_bike_by_hand_names_what_it_does():
    bike = HandBike(vibration_g=0.0)
    seen = []

    def ride(from_s, to_s):
        for k in range(round(20 * from_s), round(20 * to_s)):
            _, speed, _, phase = bike.truth(k / 20)
            if not seen or seen[-1][0] != phase:
                seen.append((phase, round(speed)))

    ride(0, 2)
    bike.stand("upright")
    ride(2, 5)
    bike.ride(20.0)
    ride(5, 18)
    bike.lean_to(25.0)
    ride(18, 24)
    bike.lean_to(0.0)
    ride(24, 28)
    bike.stand("upright")
    ride(28, 40)
    order = [phase for phase, _ in seen]
    assert order[:4] == ["kickstand", "moving", "upright", "accelerate"]
    assert [order.index(phase) for phase in ("straight", "roll", "held turn", "brake")] == sorted(
        order.index(phase) for phase in ("straight", "roll", "held turn", "brake")
    )
    assert order[-1] == "upright"
    assert dict(seen)["held turn"] == 20
    assert next(speed for phase, speed in seen if phase == "straight") == 19


def test_the_bike_by_hand_keeps_its_limits():
    """The bike leans at most 50 degrees, speeds up by at most 3 m/s2, and brakes with at most 5 m/s2."""
    for wish, lean in ((80.0, 50.0), (-80.0, -50.0)):
        bike = HandBike(vibration_g=0.0)
        bike.ride(15.0)
        bike.lean_to(wish)
        speeds = [bike.truth(k / 10)[1] for k in range(120)]
        assert max(b - a for a, b in itertools.pairwise(speeds)) == pytest.approx(0.3)
        assert bike.truth(15.0)[0] == pytest.approx(lean, abs=0.6)
        bike.stand("kickstand")
        speeds = [bike.truth(15 + k / 10)[1] for k in range(80)]
        assert min(b - a for a, b in itertools.pairwise(speeds)) == pytest.approx(-0.5)
        assert speeds[-1] == 0.0


def test_each_key_leans_the_bike_five_degrees():
    bike = HandBike(vibration_g=0.0)
    bike.command("upright")
    for name in ("right", "right", "right", "left"):  # the first command only sets the bike off
        bike.command(name)
    assert bike.truth(12.0)[0] == pytest.approx(5.0, abs=0.6)
