"""The parts of an installation and of a check of a board, with small inputs and results computed by hand."""

import errno
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import (
    board_console,
    board_files,
    bytecode,
    check,
    check_limits,
    config_check,
    config_text,
    connection,
    flash,
    others,
    update,
)  # fmt: skip
from kickstand_tools.deploy.board_files import BoardFiles, fingerprint
from kickstand_tools.deploy.check_limits import BAD, GOOD, LOOK, SKIPPED, Finding
from kickstand_tools.deploy.connection import literal
from kickstand_tools.deploy.firmware_files import unfinished
from mpremote.transport import TransportError

# board_console.py


class Clock:
    """Both clocks. Each wait and each empty look at the port takes its time; a sleep only moves the second clock."""

    def __init__(self):
        self.now = self.wall = 100.0

    def wait(self, seconds):
        self.now += seconds
        self.wall += seconds


class Talker:
    """A board that sends its pieces one after another. A number is a pause in s, a text in quotes a sleep."""

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
def told(monkeypatch):
    """Return a function that returns the lines, or the reason of an end, and the bytes sent to the board."""
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


def test_lines_of_a_program_end_with_its_prompt(told):
    assert told(b"a\r\nb", b"b\n\x04\x04>") == ([b"a", b"bb"], b"\x01")
    assert told(b"a\n\x04Traceback\r\nOSError: 5\r\n\x04>") == ([b"a", "the board reports OSError: 5"], b"\x01")
    assert told(b"\x04\x04>") == ([], b"\x01")


def test_a_silent_board_is_abandoned_after_its_time(told):
    assert told(b"a\n", 19.9, b"b\n\x04\x04>")[0] == [b"a", b"b"]
    assert told(b"a\n", 20.1, b"b\n\x04\x04>")[0] == [b"a", "the board says nothing any more"]


def test_a_computer_that_slept_hears_5_s_of_silence(told):
    awake = "the board stopped because this computer took nothing for 3 s: keep it awake"
    assert told(b"a\n", (3.0,), 5.1, b"\x04\x04>")[0] == [b"a", awake]
    assert told(b"a\n", (3.0,), 4.9, b"\x04\x04>")[0] == [b"a"]
    assert told(b"a\n", (0.9,), 5.1, b"\x04\x04>")[0] == [b"a"]
    assert told((3.0,), 2.1, b"\x04\x04>", silent_s=2.0)[0] == ["the board says nothing any more"]


def test_a_stopped_program_may_print_for_10_s_more(told):
    stopped = threading.Event()
    stopped.set()
    assert told(9.9, b"a\n\x04KeyboardInterrupt\x04>", stopped=stopped) == ([b"a"], b"\x03\x01")
    assert told(10.1, b"a\n\x04\x04>", stopped=stopped) == ([], b"\x03")


def test_an_endless_answer_is_abandoned(told):
    endless = "the program on the board does not end"
    assert told(b"a\n" * 5, b"\x04\x04>", most_bytes=13)[0] == [b"a"] * 5
    assert told(b"a\n" * 5, b"\x04\x04>", most_bytes=12)[0] == [b"a"] * 5 + [endless]
    assert told(b"x" * 60_000, b"x" * 40_000, b"\n\x04\x04>")[0] == [b"x" * 100_000]
    assert told(b"x" * 60_000, b"x" * 40_001, b"y", b"\n\x04\x04>")[0] == [endless]


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


# board_files.py, bytecode.py


def test_a_survey_of_a_board_is_parsed():
    rows = ["('/main.py', 3, b'x')", "('/kickstand', None, None)", "/rides", "(4096, 100)"]

    def surveyed(lines):
        return board_files.survey(SimpleNamespace(exec=lambda code: "\n".join(lines).encode()))  # type: ignore[arg-type]

    found = surveyed(rows)
    assert found == BoardFiles({"/main.py": (3, b"x")}, frozenset({"/kickstand"}), 4096, 100, True)
    assert not surveyed(rows[:2] + rows[3:]).has_rides
    assert fingerprint(b"abc")[0] == 3 and fingerprint(b"abc")[1].hex().startswith("ba7816bf")


def test_machine_code_is_named_by_bits_10_to_13():
    assert [bytecode.architecture(mpy) for mpy in (0x1306, 0x2B06, 1 << 10, 12 << 10)] == [
        "armv6m", "xtensawin", "x86", "rv64imc",
    ]  # fmt: skip
    for mpy in (0, 13 << 10, 0x3FF):
        with pytest.raises(bytecode.CannotCompile):
            bytecode.architecture(mpy)


def test_a_compiled_module_has_the_boards_format():
    def made(second, third, mpy=0x1306):
        return bytecode.compiled({"/a/b.py": Path("x")}, mpy, lambda source, kind: bytes([77, second, third, 31]))

    assert made(6, 0x13) == {"/a/b.mpy": bytes([77, 6, 0x13, 31])} and made(6, 0)
    for second, third in ((5, 0x13), (6, 0x12)):
        with pytest.raises(bytecode.CannotCompile, match="another format"):
            made(second, third)
    assert made(6, 0x13, 0x5306)  # bits 14 and above are no part of it


# check.py


def test_the_last_line_of_a_check_counts_its_faults():
    made = [Finding("a", GOOD, "x"), Finding("b", LOOK, "y"), Finding("c", SKIPPED, "z"), Finding("d", BAD, "w")]
    assert check.verdict(made) == "2 of 3 are not as they should be: b, d"
    assert check.verdict([made[0], made[2]]) == "all 1 are as they should be"
    assert [one.what for one in check.Checked("P", made).faults] == ["b", "d"]
    assert check.line(made[1]) == "look " + "b" + " " * 28 + "y"


class Answers:
    """A board that gives these values to the functions of check_guest.py, and records the calls."""

    def __init__(self, **values):
        self.values = {
            "board": ("1", "n", "1.2", "s", ""), "button": (False, True, True, 100, 2, 3), "flash": ((9, 8), 0, 99, ""),
            "sensor": ("MPU6050", 0x68, 0x68, 0x68, "", 0), "i2c": (9, 0, 0, 90),
            "fifo": ("", 1024, 300, 700, 700, True, 1),
            "self_test": ((0, 0, 0, 0), (0.0,) * 6, (0.0,) * 6), "clock": (1200, 6_000_000, 200, 0, 0),
            "noise": (600, (0.0, 0.0, 4096.0, 0.0, 0.0, 0.0, 0.0), (4.0,) * 7, (500,) * 7, 4096, 65.5, 25.0, 0),
            "display": (0x27, False, 20, 20, ""), "speed": ("", "", 0.0), "loop": (9000, 30, 0, 0, 1, "", 99, 50_000),
        } | values  # fmt: skip
        self.calls: list[str] = []

    def __call__(self, code):
        call = code.rpartition("print(repr(")[2].partition("))\n")[0]
        if "settings.DLPF" in code:
            return "3\n"
        name = call.partition("(")[0]
        if name not in self.values:
            return ""
        self.calls.append(call)
        if isinstance(self.values[name], Exception):
            raise self.values[name]
        return f"noise\n{self.values[name]!r}\n"


def test_a_check_measures_in_its_order():
    board, said = Answers(), []
    found = check.measured(board, said.append)
    assert board.calls == [
        "board(parts)", "button(parts, 30000)", "sensor(parts)", "i2c(parts, 10000)", "flash(parts)", "fifo(parts, 1)",
        "self_test(parts)", "noise(parts, 3)", "clock(parts, 6)", "display(parts, 20)", "speed(parts)",
        "loop(parts, 15)",
    ]  # fmt: skip
    words = {one.what: one.words for one in found}
    assert "(limit 365, when the FIFO is full)" in words["flash"] and len(said) == len(found) + 1
    assert "Press the push button once, within 30 s" in said[2]


def called(**values):
    board = Answers(**values)
    found = check.measured(board, lambda text: None)
    return [call.partition("(")[0] for call in board.calls], board.calls, {one.what: one for one in found}


def test_a_check_leaves_out_what_cannot_be_measured():
    names = called(sensor=("", 0, 0, 0, "no sensor", 0))[0]
    assert names == ["board", "button", "sensor", "flash", "display", "speed", "loop"]
    names, _, found = called(sensor=("MPU6500", 0x70, 0x68, 0x68, "", 0))
    assert "self_test" not in names and found["self-test"].verdict == SKIPPED and "noise" in names
    assert "noise" not in called(fifo=("stands still", 0, 300, 0, 0, True, 1))[0]
    assert "fifo(parts, 0)" in called(flash=((9, 150), 0, 99, ""))[1]
    assert "fifo(parts, 1)" in called(flash=((9, 149), 0, 99, ""))[1]
    assert "fifo(parts, 0)" in called(flash=((9,), 0, 99, "full"))[1]
    _, _, found = called(clock=check.GuestFailed("OSError: 5"), loop=(151_000, 1, 0, 0, 1, "", 9, 50_000))
    assert found["sample clock"] == Finding("sample clock", BAD, "broken off by OSError: 5")
    assert found["longest turn"].verdict == BAD  # half of the 300 ms of the FIFO
    assert called(loop=(149_000, 1, 0, 0, 1, "", 9, 50_000))[2]["longest turn"].verdict == LOOK


def test_an_answer_that_is_no_measurement_is_refused():
    with pytest.raises(InputError, match="the board's answer to i2c makes no sense"):
        called(i2c=(1, 2))
    with pytest.raises(InputError, match="the board's answer to speed makes no sense"):
        called(speed="x")
    assert (check.TRANSFERS, check.TEXTS, check.PRESS_S, check_limits.NOISE_TIMES) == (10_000, 20, 30, 3.0)


# config_check.py, config_text.py


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


# flash.py, update.py, others.py


def files(*paths, folders=("/kickstand",), block=4096, free=100, rides=False, **sizes):
    there = {path: fingerprint(path.encode()) for path in paths}
    return BoardFiles(there | sizes, frozenset(folders), block, free, rides)


def test_a_plan_replaces_what_differs():
    wanted = {"/kickstand/a.py": b"/kickstand/a.py", "/kickstand/b/c.py": b"new", "/config.py": b"c", "/main.py": b"m"}
    there = files("/kickstand/a.py", "/kickstand/old.py", "/kickstand/a.mpy", "/main.py", "/config.py", "/user.py",
                  folders=("/kickstand", "/kickstand/x", "/kickstand/x/y"))  # fmt: skip
    made = update.plan(wanted, there, False)
    assert made.remove == ["/main.py", "/kickstand/old.py", "/kickstand/a.mpy"]
    assert made.remove_folders == ["/kickstand/x/y", "/kickstand/x"] and made.make_folders == ["/kickstand/b"]
    assert list(made.copy) == ["/kickstand/b/c.py", "/main.py"] and made.obsolete == ["/kickstand/old.py"]
    assert made.keep == ["/kickstand/a.py", "/config.py"] and made.config_differs
    replaced = update.plan(wanted, there, True)
    assert "/config.py" in replaced.copy and "/config.py" not in replaced.remove and not replaced.config_differs
    same = update.plan({"/main.py": b"/main.py"}, files("/main.py", folders=()), False)
    assert (same.copy, same.remove, same.keep) == ({}, [], ["/main.py"])
    assert (
        "/main.new" in update.plan({"/main.py": b"/main.py"}, files("/main.py", "/main.new", folders=()), False).remove
    )


def test_the_blocks_of_a_file_have_pointers():
    """The second block begins with one pointer, the third with two, so three blocks of 4096 hold 12276 bytes."""
    for size, most in ((0, 1), (4096, 1), (4097, 2), (8188, 2), (8189, 3), (12_276, 3), (12_277, 4)):
        assert update.most_blocks(size, 4096) == most
    assert [update.least_blocks(size, 4096) for size in (512, 513, 5000)] == [0, 1, 2]


def test_the_room_for_an_update_by_hand():
    """Three files need 1, 2 and 1 blocks. A removed file frees 2. One folder more takes 2, and 4 must stay free."""
    copy = {"/a": b"x", "/b": bytes(5000), "/main.py": b"m"}
    made = update.Update(["/old"], [], ["/new"], copy, [], [], False)
    there = BoardFiles({"/old": (5000, b"")}, frozenset(), 4096, 8, False)
    assert update.needed_blocks(made, there) == 1 + 2 + 1 - 2 + 2 + 4
    update.refuse_without_room(made, there)
    with pytest.raises(InputError, match="32 kB needed, 28 kB free"):
        update.refuse_without_room(made, BoardFiles(there.files, there.folders, 4096, 7, False))
    much = update.Update(["/old", "/old"], ["/p", "/q"], [], {"/a": b"x"}, [], [], False)
    assert update.needed_blocks(much, there) == 4
    assert update.needed_blocks(update.Update(["/old"], [], [], {}, [], [], False), there) == 0


def test_files_in_the_way_of_a_module_are_named():
    for path in ("/kickstand/a/x.txt", "/kickstand"):
        with pytest.raises(InputError, match=f"{path[1:]} on the board is in the way"):
            update._refuse_in_the_way({"/kickstand/a.py": b""}, {"/kickstand"}, {path})
    update._refuse_in_the_way({"/kickstand/a.py": b""}, {"/kickstand"}, {"/kickstand/b/x.txt", "/a"})


class Written:
    """A board that keeps what is written, and loses a byte of some files."""

    def __init__(self, loses=0):
        self.files: dict[str, bytes] = {}
        self.did: list[str] = []
        self.loses = loses

    def exec(self, code):
        self.did.append(code.partition("\n")[2])

    def fs_writefile(self, path, data, chunk_size, progress_callback):
        progress_callback(len(data) // 2, 0)
        progress_callback(len(data), 0)
        self.files[path] = data[:-1] if self.loses > 0 else data
        self.loses -= 1

    def __getattr__(self, name):
        return lambda path: self.did.append(f"{name[3:]} {path}")


def test_an_update_is_carried_out_in_its_order(monkeypatch):
    board: Any = Written(loses=1)
    monkeypatch.setattr(flash, "survey", lambda of: BoardFiles(
        {path: fingerprint(data) for path, data in of.files.items()}, frozenset(), 1, 1, False))  # fmt: skip
    made = update.Update(
        ["/r"], ["/f"], ["/n"], {"/a.py": b"1234", "/main.py": b"12"}, ["/r"], ["/k"], True, {"/x": "/y"}
    )
    seen: list = []
    found = flash.install(board, made, lambda *of: seen.append(of))
    assert board.did == [
        "os.rename('/x', '/y')",
        "rmfile /r",
        "rmdir /f",
        "mkdir /n",
        "os.rename('/main.new', '/main.py')",
    ]
    assert board.files == {"/a.py": b"1234", "/main.new": b"12"}
    assert seen[:4] == [
        ("copying a.py", 2, 6),
        ("copying a.py", 4, 6),
        ("copying main.py", 5, 6),
        ("copying main.py", 6, 6),
    ]
    assert seen[4:] == [("copying a.py", 6, 6)] * 2  # the file that lost a byte is sent again
    assert (found.copied, found.copied_bytes, found.kept, found.removed) == (["/a.py", "/main.py"], 6, ["/k"], ["/r"])
    board = Written(loses=99)
    with pytest.raises(InputError, match=rf"a.py reads back differently, {flash._TRIES} times"):
        flash.install(board, made)
    assert [unfinished(path) for path in ("/main.py", "/config.py", "/a.py")] == ["/main.new", "/config.new", "/a.py"]


def found_others(texts, folders=(), fault=None, replace_config=False):
    there = others.Contents(files(*texts, folders=folders), {path: text.encode() for path, text in texts.items()})
    return others.find(there, lambda path: config_check.Judged(fault and f"{path}: {fault}", []), replace_config)


OURS = "SIDE = 'left'\nRECORD = True\nDISPLAY = 1\n"


def test_files_of_another_project_are_renamed():
    assert found_others({"/main.py": "print(1)"}).moves == {"/main.py": "/main-before-kickstand.py"}
    there = {"/main.py": "print(1)", "/boot.py": "x = 1", "/config.py": "y = 2", "/main-before-kickstand.py": ""}
    assert found_others(there).moves == {
        "/main.py": "/main-before-kickstand-2.py", "/boot.py": "/boot-before-kickstand.py",
        "/config.py": "/config-before-kickstand.py",
    }  # fmt: skip
    assert not found_others({"/boot.py": "'text'\n# comment"}).moves
    assert not found_others({"/boot.py": "x = 1"}, folders=("/kickstand",)).moves
    assert found_others({"/boot.py": "x ="}).moves


def test_a_config_belongs_to_the_project_that_it_sets():
    kept = found_others({"/config.py": OURS})
    assert not kept.moves and kept.config == OURS.encode() and not kept.mended
    assert found_others({"/config.py": "\ufeff" + OURS}).mended
    with pytest.raises(InputError, match=r"config\.py on the board: wrong"):
        found_others({"/config.py": OURS}, fault="wrong")
    assert found_others({"/config.py": "DISPLAY = 1\nSIDE = 2\n"}, fault="wrong").moves  # two settings are too few
    assert not found_others({"/config.py": "DISPLAY = 1\nSIDE = 2\n"}).moves
    assert found_others({"/config.py": "x = 1"}, ("/kickstand",), "wrong").moves
    assert not found_others({"/config.py": "x = 1"}, ("/kickstand",)).moves
    with pytest.raises(InputError):
        found_others({"/config.py": "SIDE = 1"}, ("/kickstand",), "wrong")
    replaced = found_others({"/config.py": "SIDE = 1"}, ("/kickstand",), "wrong", True)
    assert replaced.config == b"SIDE = 1" and not replaced.moves
    assert not found_others({"/config.py": "# nothing"}).moves
