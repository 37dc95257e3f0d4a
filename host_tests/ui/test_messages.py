"""Every code of the firmware has words for the display and for a terminal, and no words are unused."""

import ast
import functools
import re

from kickstand import console, errors
from kickstand.errors import Notice, Refusal, SettingsError
from kickstand.ui import messages
from kickstand_tools.common import installation
from panel import pages

CLASSES = {name for name in vars(errors) if name[0].isupper()}
# Codes that the firmware passes as a variable, so codes() does not find them.
INDIRECT = {"other-side", "mount-moved", "incomplete", "no-memory", "out-of-memory", "out-of-room"}
INDIRECT |= {"sensor-lost", "sensor-frozen", "sensor-silent", "sensor-reset", "flash-fault", "card-fault", "usb-fault"}
# Codes for which the display shows the setting's name
OTHER_SETTINGS = {
    "not-allowed",
    "card-pins",
    "one-i2c",
    "no-such-pin",
    "i2c-pins",
    "uart-pins",
    "aliasing",
}
CONSOLE_ONLY = {"wrong-code"}  # codes that are reported during imports, before a display exists
# Values for the words of each code. Some are long numbers and long names.
VALUES = {"dead-axis": ("x", 0.1), "odd-axis": ("x", 0.1, 1.0), "side-tilted": ("+x", 25.0, 20.0)}
VALUES |= {"not-one-g": ("kickstand", 1.23), "mount-moved": ("between-stops", 12.0), "few-events": (4, 5, 12)}
VALUES |= {"uncertain": (180.0, 12), "unknown-chip": (0x12,), "speed-unit": (99.9,)}
VALUES |= dict.fromkeys(("dead-gyro", "noisy-gyro", "stuck-accel", "gyro-reversed", "gyro-scale"), ("x", 100.0))
VALUES |= {"unproved-gyro": ("x",), "gyro-tilt": (60.0, -180.0), "gps-other": ("PUBX",), "aligned": (9.9,)}
VALUES |= {"no-pins": ("SENSOR_SDA", "SENSOR_SDA, SENSOR_SCL", "a board"), "no-sensor": (28, 29)}
VALUES |= {"no-chip": (0xFF, 0x68), "not-kept": (0x68,), "other-chip": ("ICM-42688-V", 0x68), "bus-errors": (0x68,)}
VALUES |= {"other-device": ("barometer", 0x76), "wire-low": ("SDA", 28), "no-pull-up": ("SCL", 28)}
VALUES |= {"sensor-fifo": ("stands still",), "axis-ill": ("Accel", "xyz", "stuck"), "clips": ("Accel",)}
VALUES |= {"speed-late": (2.5,)}


@functools.cache
def codes():
    """Return {code: name of its class in errors.py} of all codes that the firmware's source contains."""
    classes = {}
    for path in installation.PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CLASSES:
                code = node.args[0] if node.args else None
                if isinstance(code, ast.Constant):
                    classes.setdefault(code.value, node.func.id)
    return classes


def worded(table):
    """Return the codes of a table of words. Assert that each code occurs once."""
    rows = [line.split("|")[0] for line in table.split("\n") if line]
    assert len(set(rows)) == len(rows)
    return set(rows)


def test_each_code_has_words_for_the_display_and_settings_are_named():
    assert worded(messages._LINES) == set(codes()) - OTHER_SETTINGS - CONSOLE_ONLY | INDIRECT
    for code in OTHER_SETTINGS:
        assert messages.lines(SettingsError(code, "LCD_SDA", 1, 2, 3, 4)) == ("config.py: wrong", "LCD_SDA")
    assert messages.lines(Notice("aligned", 1.26)) == ("Aligned by drive", "error about 1.3\xdf")


def test_words_fit_into_sixteen_characters():
    for code in worded(messages._LINES):
        lines = messages.lines(Refusal(code, *VALUES.get(code, (99.94, 60.0, 1.0, 1.0))))
        assert len(lines) == 2 and max(map(len, lines)) <= 16, code
    assert all(len(words) <= 16 for words in pages.NO_LEAN.values())


def test_a_refusal_of_the_board_has_a_console_sentence():
    sentences = worded(console._SENTENCES)
    assert sentences <= set(codes()) | INDIRECT
    for code, kind in codes().items():
        if code in sentences and kind != "Notice":
            values = VALUES.get(code, ("NAME", 2.0, 3.0, 4.0, 5.0, 6.0) if kind == "SettingsError" else (1.0, 2.0, 3.0))
            assert "{" not in console.sentence(Refusal(code, *values))
        assert code in sentences or kind not in ("SettingsError", "SickSensor")


def test_the_limits_of_user_code_are_said_as_they_are():
    source = (installation.PACKAGE / "user_code.py").read_text(encoding="utf-8")
    limits = dict(re.findall(r"^_([A-Z_]+) = const\((\d+)", source, re.MULTILINE))
    words = "over {TOO_SLOW_MS} ms, or {MOST_SLOW} times over {SLOW_MS} ms in a row".format(**limits)
    assert words in console.sentence(Refusal("user-slow", "page", 60))


def test_no_mathematics_knows_the_display():
    """Only ui/ and the driver use the display's degree sign and its width of sixteen columns."""
    for path in installation.PACKAGE.rglob("*.py"):
        if path.parent.name not in ("ui", "board"):
            assert "\\xdf" not in path.read_text(encoding="utf-8"), path
