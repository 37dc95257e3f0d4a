"""The form for config.py finds the settings and changes them. The rest of the file stays unchanged."""

import ast
import re

import pytest
from kickstand_tools.common import firmware_path
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import config_text

OWN = '''"""Mine."""
SIDE = "right"   # as it stands
PINS = 3
LCD_ADDRESSES = (
    0x27,
    0x3F,
)
# RECORD = False
BUTTON_PIN = 14  # é
'''


def settings_of(text):
    made = {}
    exec(text, made)
    return {name: value for name, value in made.items() if name.isupper()}


def test_each_setting_can_be_set_and_unset():
    text = (firmware_path.PACKAGE.parent / "config.py").read_text()
    names = re.findall(r"(?m)^# ([A-Z_0-9]+) = ", text)
    assert len(names) > 30 and config_text.values(text) == {}
    whole = config_text.with_values(text, {name: f"({i}, 'x')" for i, name in enumerate(names)})
    assert settings_of(whole) == {name: (i, "x") for i, name in enumerate(names)}
    assert whole.count("\n") == text.count("\n")  # each setting stays on its line of the file
    assert '# or "right"\n' in whole
    assert settings_of(config_text.with_values(whole, dict.fromkeys(names))) == {}


def test_riders_settings_are_kept():
    assert config_text.values(OWN)["SIDE"] == '"right"'
    changed = config_text.with_values(OWN, {"BUTTON_PIN": "2", "LCD_ADDRESSES": "(0x27,)"})
    changed = config_text.with_values(changed, {"RECORD": "True", "DLPF": "4"})
    wanted = {"SIDE": "right", "PINS": 3, "LCD_ADDRESSES": (0x27,), "BUTTON_PIN": 2, "RECORD": True, "DLPF": 4}
    assert settings_of(changed) == wanted
    assert 'SIDE = "right"   # as it stands\n' in changed
    assert "BUTTON_PIN = 2  # é\n" in changed
    assert settings_of(config_text.with_values(OWN, {"LCD_ADDRESSES": None, "SIDE": None})) == {
        "PINS": 3,
        "BUTTON_PIN": 14,
    }
    assert config_text.with_values(OWN, {"SIDE": '"right"', "RECORD": None}) == OWN


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import machine\n", "line 1 is not a setting"),
        ("SIDE = 'left'\nif True:\n    SIDE = 'right'\n", "line 2 is not a setting"),
        ("SIDE = \n", "cannot be read"),
        ("A = B = 3\n", "line 1 is not a setting"),
        ("# mine\nSIDE = __import__('os').name\n", "line 2 computes SIDE"),
        ("SIDE = right\n", "line 1 computes SIDE"),
        ("print('x')\nSIDE = 'left'\n", "line 1 is not a setting"),
        ("SIDE = 'left'\nDLPF = 4\nSIDE = 'right'\n", "line 3 sets SIDE again"),
    ],
)
def test_config_with_more_than_settings_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        config_text.with_values(text, {"RECORD": "True"})


def test_config_that_is_not_text_is_refused():
    assert config_text.decoded("# é\n".encode()) == "# é\n"
    with pytest.raises(InputError, match="not text in UTF-8"):
        config_text.decoded("# é\n".encode("latin-1"))


@pytest.mark.parametrize("mark", ["\f", "\v", "\x85", "\u2028"])
def test_lines_are_counted_as_python_counts_them(mark):
    text = f"# one{mark}two\nSIDE = 'left'\nDLPF = 4\n"
    assert config_text.with_values(text, {"SIDE": "'right'"}) == text.replace("left", "right")
    assert config_text.with_values(text.replace("\n", "\r\n"), {"DLPF": None}) == text.replace("DLPF", "# DLPF")


@pytest.mark.parametrize("value", ["left", "1 + x", "__import__('os')", "3\nx = 4", "", "'left"])
def test_only_a_value_is_written(value):
    with pytest.raises(InputError):
        config_text.with_values(OWN, {"SIDE": value})


def test_every_value_is_read_back():
    for value in ('"left"', "0x68", "400_000", "(0x27, 0x3F)", "None", "True", "0.5"):
        assert settings_of(config_text.with_values("", {"X": value})) == {"X": ast.literal_eval(value)}
