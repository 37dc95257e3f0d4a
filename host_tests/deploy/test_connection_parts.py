"""Tests how a board's port is found, opened, left and explained, and how long the computer waits for a board."""

import errno
from types import SimpleNamespace
from typing import Any

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import connection
from mpremote.transport import TransportError, TransportExecError


def words(call, *arguments) -> str:
    """Return the message of the InputError of this call."""
    with pytest.raises(InputError) as found:
        call(*arguments)
    return str(found.value)


# The port


@pytest.fixture
def plugged(monkeypatch):
    """Return a function that plugs in devices with these (name, vendor, product)."""

    def plug(*devices):
        ports = [SimpleNamespace(device=name, vid=vid, pid=pid) for name, vid, pid in devices]
        monkeypatch.setattr(connection.list_ports, "comports", lambda: ports)

    return plug


@pytest.mark.parametrize("vendor", [0x2E8A, 0x303A, 0xF055, 0x10C4, 0x1A86, 0x0403])
def test_the_only_board_is_found_by_its_vendor(plugged, vendor):
    plugged(("/dev/a", None, None), ("/dev/b", vendor, 5), ("/dev/c", vendor + 1, 5), ("/dev/d", 0x2E8A, 0x000C))
    assert connection.find_port() == "/dev/b"


def test_no_board_and_several_boards_are_refused(plugged):
    plugged(("/dev/d", 0x2E8A, 0x000C))
    assert words(connection.find_port).startswith("no board found: plug it in")
    plugged(("/dev/b", 0x0403, 1), ("/dev/a", 0x2E8A, 5))
    assert "several boards found: /dev/a (Raspberry Pi), /dev/b (FTDI)" in words(connection.find_port)


@pytest.mark.parametrize(
    ("error", "name", "said"),
    [
        (None, "P", "P could not be opened at first, but now it can"),
        (ValueError("odd"), "P", "P is not a port: odd"),
        (OSError(errno.EBUSY, ""), "P", "P is in use"),
        (OSError(errno.EAGAIN, ""), "P", "P is in use"),
        (OSError("PermissionError(13)"), "P", "P is in use"),
        (OSError(errno.EACCES, ""), "P", "no permission for P"),
        (OSError(errno.EPERM, ""), "P", "no permission for P"),
        (OSError(errno.ENOENT, ""), "P", "there is no port P"),
        (OSError("FileNotFoundError(2)"), "P", "there is no port P"),
        (OSError("connection refused"), "socket://x", "nothing listens at socket://x"),
        (OSError("connection refused"), "P", "P cannot be opened: connection refused"),
        (OSError("odd"), "socket://x", "socket://x cannot be opened: odd"),
    ],
)
def test_a_port_that_cannot_be_opened_is_explained(monkeypatch, error, name, said):
    given: list = []

    def opened(port, timeout, exclusive):
        given.append((port, timeout, exclusive))
        if error:
            raise error
        return SimpleNamespace(close=lambda: given.append("closed"))

    monkeypatch.setattr(connection.serial, "serial_for_url", opened)
    assert str(connection.why_closed(name)).startswith(said)
    assert given == [(name, 1, True)] + ["closed"] * (error is None)


@pytest.mark.parametrize(("name", "limit_s", "slower"), [("/dev/x", 10, 1), ("socket://x", 120, 12)])
def test_an_emulated_board_has_twelve_times_the_time(monkeypatch, name, limit_s, slower):
    given: list = []
    monkeypatch.setattr(connection.SerialTransport, "__init__", lambda self, *of, **more: given.append((*of, more)))
    assert connection._open_board(name).slower == slower
    assert given == [(name, {"timeout": limit_s})]


@pytest.mark.parametrize("error", [TransportError("x"), ValueError("x")])
def test_a_port_that_does_not_open_is_tried_again_for_the_reason(monkeypatch, error):
    def fails(self, *_of, **_more):
        raise error

    monkeypatch.setattr(connection.SerialTransport, "__init__", fails)
    monkeypatch.setattr(connection, "why_closed", lambda name: InputError(f"{name} why"))
    assert words(connection._open_board, "P") == "P why"


# The connection


class Board:
    """A board whose raw prompt fails some times. did: what was done."""

    def __init__(self, fails=0, output=b"", error=b""):
        self.device_name, self.fails, self.answer = "P", fails, (output, error)
        self.did: list[Any] = []

    def enter_raw_repl(self, timeout_overall):
        self.did.append(timeout_overall)
        self.fails -= 1
        if self.fails >= 0:
            raise TransportError("silent")

    def exec(self, code):
        self.did.append(code)
        return self.answer[0]

    def exec_raw(self, code, timeout):
        self.did.append((code, timeout))
        return self.answer

    def exec_raw_no_follow(self, code):
        self.did.append(code)

    def wait(self, seconds):
        self.did.append(seconds)

    def close(self):
        self.did.append("close")


def connect(board, error=None):
    with connection.connected(board) as (_, name):
        board.did.append(name)
        if error:
            raise error


def test_a_starting_board_gets_a_second_chance():
    for fails, did in ((0, [3, "P", "close"]), (1, [3, 10, "P", "close"])):
        board: Any = Board(fails)
        connect(board)
        assert board.did == did
    board = Board(2)
    assert words(connect, board).startswith("no MicroPython answers on P")
    assert board.did == [3, 10, "close"]
    board = Board(2)
    board.heard = b"tick"
    assert "the board prints 'tick'" in words(connect, board)


def test_a_port_is_named_or_found(monkeypatch):
    board: Any = Board()
    monkeypatch.setattr(connection, "find_port", lambda: "found")
    monkeypatch.setattr(connection, "_open_board", lambda name: board.did.append(f"open {name}") or board)
    for port in (None, "named"):
        with connection.connected(port) as (transport, name):
            assert transport is board and name == (port or "found")
    assert board.did == ["open found", 3, "close", "open named", 3, "close"]


def test_errors_on_the_board_have_their_sentence():
    def failed(text):
        board: Any = Board()
        return words(connect, board, TransportExecError(0, text))

    assert failed("Traceback\r\nOSError: [Errno 5] EIO\r\n").startswith(
        "P: the board's file system is damaged (OSError"
    )
    assert failed("Traceback\r\nValueError: x\r\n") == "P: the board reports ValueError: x: try again"


def test_a_port_that_has_disappeared_is_closed_without_an_error():
    def gone():
        raise OSError

    board: Any = Board()
    board.close = gone
    connect(board)
    assert board.did == [3, "P"]


def test_a_restart_waits_for_the_port():
    board: Any = Board()
    connection.restart(board)
    assert board.did == ["import time, machine\ntime.sleep_ms(100)\nmachine.reset()", 2]


def test_an_expression_is_printed_and_read():
    board: Any = Board(output=b"(1, 'a')\r\n")
    assert connection.ask(board, "x", (int, str)) == (1, "a") and board.did == ["print(repr(x))"]


def test_only_micropython_is_described():
    board: Any = Board(output=b"('micropython', '1.24.1', 'Pico')")
    assert connection.describe(board, "P") == "Pico, MicroPython 1.24.1" and ".version[:3]" in board.did[0]
    board = Board(output=b"('circuitpython', '9', 'Pico')")
    assert words(connection.describe, board, "P").startswith("P runs circuitpython: put MicroPython")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (b"x\r\nOSError: [Errno 5] EIO", "P: the board's file system is damaged (OSError: [Errno 5] EIO)"),
        (b"x\r\nCardError: card: [Errno 5] EIO", "P: card: [Errno 5] EIO"),
        (b"x\r\nSettingsError: wrong: DLPF", "P: wrong: DLPF"),
        (b"ImportError: no module named 'kickstand'", "Kickstand is not on the board at P"),
        (b"ImportError: no module named 'kickstand.x'", "the firmware on the board at P is of another version"),
        (b"ValueError: x", "the board at P cannot give its status (ValueError: x)"),
    ],
)
def test_a_program_that_fails_is_explained(error, said):
    board: Any = Board(error=error)
    assert words(connection.printed, board, "P", "code", "its status").startswith(said)
    assert board.did == [("code", 60)]


def test_a_status_is_printed_and_the_board_restarts(monkeypatch):
    monkeypatch.setattr(connection, "describe", lambda transport, name: None)
    for wirings, call in ((False, "kickstand.status()"), (True, "kickstand.status(True)")):
        board: Any = Board(output=b"a\r\nb\r\n\r\n")
        assert connection.status(board, wirings) == "a\nb"
        assert board.did[1] == (f"import kickstand\n{call}", 60) and board.did[-2:] == [2, "close"]
    board = Board(error=b"ValueError: x")
    words(connection.status, board)
    assert board.did[-2:] == [2, "close"]


def test_a_lost_connection_has_other_words_on_a_page():
    lost = connection.ConnectionLost("P", "x")
    assert lost.line().startswith("P: connection lost (x): plug the board in")
    assert lost.line(page=True).startswith("connection lost: plug the board in")


def test_limits_of_an_answer():
    assert (connection.MOST_BYTES, connection._HEARD_BYTES) == (1_000_000, 3000)


def test_an_emulators_terminal_is_read_without_waiting_bytes():
    board: Any = object.__new__(connection.ConnectedBoard)
    pieces = [b"a", b">"]
    board.serial = SimpleNamespace(inWaiting=lambda: 0, read=lambda count: pieces.pop(0))
    board.is_pty = True
    assert board.read_until(1, b">") == b"a>"
    slept: list = []
    board.is_pty, board.wait = False, slept.append
    assert board.read_until(1, b">", timeout=0) == b"" and slept == []
