"""A board, a checkout and a serial port for the tests of `flash`, `status` and `check`."""

import functools
import time
from pathlib import Path

import pytest
import serial
from kickstand_tools.deploy import config_file
from serial_port import SerialPort
from support import fake_board

_judge = config_file.judge


@functools.cache
def _judged(path: Path, _content: bytes, port: str, machine: str) -> config_file.Judged:
    return _judge(path, port, machine)


@pytest.fixture(autouse=True)
def judged_once(monkeypatch):
    """Check the same config.py for the same board only once, because each check starts a process."""
    monkeypatch.setattr(config_file, "judge", lambda path, *board: _judged(path, path.read_bytes(), *board))


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return the only connected board. It contains only MicroPython's own boot.py."""
    (tmp_path / "flash").mkdir()
    (tmp_path / "flash" / "boot.py").write_text("# boot\n")
    return fake_board.plug_in(monkeypatch, fake_board.FakeBoard(tmp_path / "flash"))


@pytest.fixture
def config(tmp_path, monkeypatch):
    """Return the config.py of a checkout in the current folder."""
    firmware = tmp_path / "checkout" / "firmware"
    (firmware / "kickstand").mkdir(parents=True)
    (firmware / "config.py").write_text('SIDE = "right"\n')
    monkeypatch.chdir(tmp_path / "checkout")
    return firmware / "config.py"


@pytest.fixture
def port(monkeypatch):
    """Return the serial port that any name opens. Only waiting takes time."""
    serial_port = SerialPort()
    monkeypatch.setattr(serial, "serial_for_url", serial_port.open)
    for name in ("sleep", "monotonic", "time"):
        monkeypatch.setattr(time, name, getattr(serial_port, name))
    return serial_port
