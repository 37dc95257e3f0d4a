"""Tests which faults of a config.py are found, and which values are read from it."""

from types import SimpleNamespace

import pytest
from kickstand_tools.deploy import config_check, config_text


def test_faults_of_a_config_have_their_line(tmp_path):
    path = tmp_path / "config.py"
    assert config_check.in_words(path, (3, "why"), [(2, "A = 1")]) == config_check.Judged(
        f"{path}, line 3: why", [f"{path}, line 2: A = 1"]
    )
    assert config_check.in_words(path, (None, "why"), []).fault == f"{path}: why"
    assert config_check.in_words(path, None, []).fault is None
    assert (
        config_check._line_of("A", "A = 1\nB = 2\nA = 3\nprint(A)\n") == 3
        and config_check._line_of("C", "A = 1") is None
    )


def test_modules_that_a_board_lacks_are_named():
    import ast

    def missing(text):
        return config_check._missing_module(ast.parse(text))

    assert missing("import json, time\nfrom os import path\nimport mine\nfrom . import subprocess") is None
    assert missing("\nimport json, logging.handlers") == (2, "MicroPython has no module logging")
    assert missing("from datetime import date") == (1, "MicroPython has no module datetime")


def test_settings_behind_a_mark_differ_from_the_default(tmp_path, monkeypatch):
    monkeypatch.setattr(config_check, "default_settings", lambda: SimpleNamespace(A=1, B=None, C="x"))
    path = tmp_path / "config.py"
    path.write_text('# A = 2  # why\n# A = 1\n# B = 5\n# B = "p"\nA = 3\n# D = 4\n# C = x\n# A = 7  # (28; 9)\n')
    found = [(1, "A = 2"), (4, 'B = "p"')]
    assert config_check.unused(path, "esp32") == found
    assert config_check.unused(path, "rp2") == [*found, (8, "A = 7")]


@pytest.mark.parametrize(
    ("before", "wanted", "after"),
    [
        ("A = 1  # x\nB = 2\n", {"A": "5"}, "A = 5  # x\nB = 2\n"),
        ("A = (\n 1,\n)  # x\nB = 2\n", {"A": "5"}, "A = 5  # x\n\n\nB = 2\n"),
    ]
    + [
        ("A = 1\n", {"A": None}, "# A = 1\n"),
        ("A = 1\n", {"B": "2"}, "A = 1\nB = 2\n"),
        ("A = 1\n", {"B": None}, "A = 1\n"),
    ]
    + [
        ("# A = 1  # x\n# AB = 1\n", {"A": "7"}, "A = 7  # x\n# AB = 1\n"),
        ("A = 1\r\nB = 2", {"B": "3"}, "A = 1\nB = 3\n"),
    ]
    + [
        ("A = (\n 1,\n)\nB = 2\n", {"A": None, "B": "3"}, "# A = (\n#  1,\n# )\nB = 3\n"),
        ("A = 1\n", {"A": "1"}, "A = 1\n"),
    ],
)
def test_values_are_written_into_a_config(before, wanted, after):
    assert config_text.with_values(before, wanted) == after
