"""The output and the answers of a board, with pauses and lengths on both sides of each limit."""

import errno
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import board_console, connection
from kickstand_tools.deploy.connection import literal
from mpremote.transport import TransportError

# board_console.py


class Clock:
    """The monotonic clock and the wall clock. Each wait and each empty look at the port takes time. A sleep only moves
    the wall clock."""

    def __init__(self):
        self.now = self.wall = 100.0

    def wait(self, seconds):
        self.now += seconds
        self.wall += seconds


class Talker:
    """A board that sends its pieces one after another. A number is a pause in s. A text in quotes is a sleep."""

    def __init__(self, clock, *pieces):
        self.clock, self.written = clock, b""
        self.pieces: Any = list(pieces)
        self.serial = self

    def exec_raw_no_follow(self, code):
        self.code = code

    def inWaiting(self):
        while self.pieces and isinstance(self.pieces[0], tuple):
            self.clock.wall += self.pieces.pop(0)[0]
        if self.pieces and isinstance(self.pieces[0], float):
            if self.pieces[0] > 0.0:
                return 0
            self.pieces.pop(0)
        return len(self.pieces[0]) if self.pieces else 0

    def read(self, count):
        return self.pieces.pop(0)[:count]

    def write(self, data):
        self.written += data

    def wait(self, seconds):
        self.clock.wait(seconds)
        if self.pieces and isinstance(self.pieces[0], float):
            self.pieces[0] -= seconds


@pytest.fixture
def answers(monkeypatch):
    """Return a function that runs lines() with a board that prints these pieces.

    The function returns a list and the bytes that were sent to the board. The list has the program's lines. If lines()
    raised an error, the error's message is the last item.
    """
    clock = Clock()
    fake = SimpleNamespace(monotonic=lambda: clock.now, time=lambda: clock.wall)
    monkeypatch.setattr(board_console, "time", fake)

    def result(*pieces, silent_s=20.0, stopped=None, **more):
        board: Any = Talker(clock, *pieces)
        found: list = []
        try:
            for line in board_console.lines(board, "code", silent_s, stopped, **more):
                found.append(line)
        except board_console.BrokenOff as error:
            found.append(str(error))
        return found, board.written

    return result


def test_lines_of_a_program_end_with_its_prompt(answers):
    assert answers(b"a\r\nb", b"b\n\x04\x04>") == ([b"a", b"bb"], b"\x01")
    assert answers(b"a\n\x04Traceback\r\nOSError: 5\r\n\x04>") == ([b"a", "the board reports OSError: 5"], b"\x01")
    assert answers(b"\x04\x04>") == ([], b"\x01")


def test_a_silent_board_is_abandoned_after_its_time(answers):
    assert answers(b"a\n", 19.9, b"b\n\x04\x04>")[0] == [b"a", b"b"]
    assert answers(b"a\n", 20.1, b"b\n\x04\x04>")[0] == [b"a", "the board says nothing any more"]


def test_a_computer_that_slept_hears_5_s_of_silence(answers):
    awake = "the board stopped because this computer took nothing for 3 s: keep it awake"
    assert answers(b"a\n", (3.0,), 5.1, b"\x04\x04>")[0] == [b"a", awake]
    assert answers(b"a\n", (3.0,), 4.9, b"\x04\x04>")[0] == [b"a"]
    assert answers(b"a\n", (0.9,), 5.1, b"\x04\x04>")[0] == [b"a"]
    assert answers(b"a\n", (1.1,), 5.1, b"\x04\x04>")[0] == [b"a", awake.replace("3", "1")]
    assert answers((3.0,), 2.1, b"\x04\x04>", silent_s=2.0)[0] == ["the board says nothing any more"]


def test_a_stopped_program_may_print_for_10_s_more(answers):
    stopped = threading.Event()
    stopped.set()
    assert answers(9.9, b"a\n\x04KeyboardInterrupt\x04>", stopped=stopped) == ([b"a"], b"\x03\x01")
    assert answers(10.1, b"a\n\x04\x04>", stopped=stopped) == ([], b"\x03")


def test_an_endless_answer_is_abandoned(answers):
    endless = "the program on the board does not end"
    assert answers(b"a\n" * 5, b"\x04\x04>", most_bytes=13)[0] == [b"a"] * 5
    assert answers(b"a\n" * 5, b"\x04\x04>", most_bytes=12)[0] == [b"a"] * 5 + [endless]
    assert answers(b"x" * 60_000, b"x" * 40_000, b"\n\x04\x04>")[0] == [b"x" * 100_000]
    assert answers(b"x" * 60_000, b"x" * 40_001, b"y", b"\n\x04\x04>")[0] == [endless]


# connection.py


@pytest.mark.parametrize(
    ("text", "shapes", "fits"),
    [
        (b"3", (int,), True),
        (b"-1", (int,), False),
        (b"0", (int,), True),
        (b"True", (int,), False),
        (b"None", (None,), True),
    ]
    + [(b"(1, 'a')", ((int, str),), True), (b"(1,)", ((int, str),), False), (b"[1, 'a']", ((int, str),), False)]
    + [(str(2**40 - 1).encode(), (int,), True), (str(2**40).encode(), (int,), False), (b"'a'", (int, str), True)]
    + [(b"\xff", (str,), False), (b"1 +", (int,), False)],
)
def test_only_answers_of_the_expected_shape_are_accepted(text, shapes, fits):
    if fits:
        assert repr(literal(text, *shapes)) == text.decode()
    else:
        with pytest.raises(InputError, match="makes no sense"):
            literal(text, *shapes)


def reader(monkeypatch, *pieces, slower=1):
    clock = Clock()
    monkeypatch.setattr(connection, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=clock.wait))
    board: Any = object.__new__(connection.ConnectedBoard)
    board.serial = Talker(clock, *pieces)
    board.wait, board.slower = board.serial.wait, slower
    board.serial.inWaiting = lambda real=board.serial.inWaiting: min(1, real())
    board.serial.read = lambda count: board.serial.pieces.pop(0)
    return board


def test_an_answer_is_read_until_its_end_or_a_pause(monkeypatch):
    seen: list = []
    board = reader(monkeypatch, b"a", 9.0, b"b", b">", b"x")
    assert board.read_until(1, b"b>", timeout=10, data_consumer=seen.append) == b"ab>" and seen == [b"a", b"b", b">"]
    assert board.heard == b"ab>"
    assert reader(monkeypatch, b"a", 10.1, b">").read_until(1, b">", timeout=10) == b"a"
    assert reader(monkeypatch, b"a", 6.0, b"b", 6.0, b">").read_until(1, b">", 10, timeout_overall=11) == b"ab"
    assert reader(monkeypatch, b"a", 15.0, b">", slower=2).read_until(1, b">", timeout=10) == b"a>"
    assert reader(monkeypatch, b"a", 15.0, b">").read_until(1, b">", timeout=None) == b"a>"
    monkeypatch.setattr(connection, "MOST_BYTES", 3)
    assert reader(monkeypatch, *[b"a"] * 2, b">").read_until(1, b">") == b"aa>"
    with pytest.raises(TransportError, match="does not end"):
        reader(monkeypatch, *[b"a"] * 4).read_until(1, b">")


def test_only_the_end_of_the_output_is_kept(monkeypatch):
    board = reader(monkeypatch, *[b"x"] * 10, b">")
    monkeypatch.setattr(connection, "_HEARD_BYTES", 4)
    board.read_until(1, b">")
    assert board.heard == b"xxx>"


@pytest.mark.parametrize(
    ("heard", "words"),
    [(b"", "no MicroPython answers on P: check that this is"), (b"\0\0>\n", "no MicroPython answers on P")]
    + [
        (b"tick\n\n", "P: the board prints 'tick': a program on it does not let go"),
        (b"x OSError: 84 Errno 84", "file system"),
    ]
    + [
        (b"Guru Meditation Error", "MicroPython on the board crashes"),
        (b"rst:0x10 (RTCWDT)", "a watchdog of the program"),
    ]
    + [(b"y" * 61, "the board prints '" + "y" * 60 + "': a program")],
)
def test_a_board_without_a_prompt_is_explained(heard, words):
    assert words in str(connection._why_silent("P", heard))


def test_errors_of_the_connection_have_their_sentence():
    def raised(error):
        board: Any = object.__new__(connection.ConnectedBoard)
        board.device_name, board.close, board.enter_raw_repl = "P", lambda: None, lambda **_: None
        with pytest.raises(InputError) as found, connection.connected(board):
            raise error
        return str(found.value)

    assert "the board at P is full" in raised(OSError(errno.ENOSPC, ""))
    for number in (errno.EILSEQ, 84, 52):
        assert "file system is damaged" in raised(OSError(number, ""))
    assert "P: connection lost (" in raised(OSError(errno.EIO, "x"))
    assert raised(OSError(errno.EACCES, "no", "file")).startswith("file: ")
    assert "the board stopped answering" in raised(TransportError("x"))


def test_the_last_line_of_a_traceback():
    assert connection.last_line("a\nb: c\n\n") == "b: c" and connection.last_line(" \n") == "an unknown error"
    assert connection.damaged("OSError: [Errno 5] EIO") and not connection.damaged("OSError: [Errno 2] ENOENT")
    for reason, words in (
        ("no module named 'kickstand'", "is not on the board"),
        ("ImportError: kickstand.x", "of another v"),
    ):
        with pytest.raises(InputError, match=words):
            connection.refuse_unfit_firmware(reason, "P")
    connection.refuse_unfit_firmware("ImportError: numpy", "P")
