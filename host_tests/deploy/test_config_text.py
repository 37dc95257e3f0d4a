"""The form for config.py finds the settings and changes them. The rest of the file stays unchanged."""

import re

import pytest
from hypothesis import given, strategies
from kickstand_tools.common import installation
from kickstand_tools.common.messages import InputError
from kickstand_tools.deploy import config_file

OWN = '''"""Mine."""
SIDE = "right"   # as it stands
LCD_ADDRESSES = (
    0x27,
    0x3F,
)
# RECORD = False
BUTTON_PIN = 14  # é
'''


def settings_of(text):
    space = {}
    exec(text, space)
    return {name: value for name, value in space.items() if name.isupper()}


def test_each_setting_can_be_set_and_unset():
    text = (installation.PACKAGE.parent / "config.py").read_text()
    names = re.findall(r"(?m)^# ([A-Z_0-9]+) = ", text)
    assert len(names) > 30 and config_file.values(text) == {}
    full = config_file.with_values(text, {name: f"({i}, 'x')" for i, name in enumerate(names)})
    assert settings_of(full) == {name: (i, "x") for i, name in enumerate(names)}
    assert full.count("\n") == text.count("\n")  # each setting stays on its line of the file
    assert '# or "right"\n' in full
    assert settings_of(config_file.with_values(full, dict.fromkeys(names))) == {}


def test_values_are_read_as_they_are_written():
    assert config_file.values(OWN) == {
        "SIDE": '"right"', "LCD_ADDRESSES": "(\n    0x27,\n    0x3F,\n)", "BUTTON_PIN": "14"
    }  # fmt: skip
    assert config_file.lines("a\r\nb\rc\n\n") == ["a", "b", "c", ""]


@given(strategies.recursive(strategies.integers() | strategies.booleans() | strategies.none() | strategies.text(
    strategies.characters(codec="ascii")), lambda inner: strategies.tuples(inner, inner), max_leaves=4))  # fmt: skip
def test_every_value_is_read_back(value):
    text = config_file.with_values(OWN, {"LCD_ADDRESSES": repr(value), "RECORD": "True"})
    assert settings_of(text) == {"SIDE": "right", "LCD_ADDRESSES": value, "RECORD": True, "BUTTON_PIN": 14}


@pytest.mark.parametrize("value", ["left", "1 + x", "__import__('os')", "3\nx = 4", "(1,\n2)", "", "'left"])
def test_only_a_value_is_written(value):
    with pytest.raises(InputError, match=r"is not a value|must be on one line"):
        config_file.with_values(OWN, {"SIDE": value})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import machine\n", "line 1 is not a setting"),
        ("SIDE = 'left'\nif True:\n    SIDE = 'right'\n", "line 2 is not a setting"),
        ("SIDE = \n", "cannot be read"),
        ("A = B = 3\n", "line 1 is not a setting"),
        ("A, B = 1, 2\n", "line 1 is not a setting"),
        ("A = 1; B = 2\n", "line 1 is not a setting"),
        ("A.b = 1\n", "line 1 is not a setting"),
        ('A = 1\n"""mine"""\n', "line 2 is not a setting"),
        ("# mine\nSIDE = __import__('os').name\n", "line 2 computes SIDE"),
        ("SIDE = 'left'\nDLPF = 4\nSIDE = 'right'\n", "line 3 sets SIDE again"),
    ],
)
def test_config_with_more_than_settings_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        config_file.with_values(text, {"RECORD": "True"})
