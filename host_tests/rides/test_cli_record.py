"""`kickstand record` from a fake board that streams. The log grows with the stream, and Ctrl-C or the board ends it."""

import base64
import contextlib
import functools
import gzip
import json
import os
import re
import resource
import signal
import types
from itertools import pairwise

import pytest
from kickstand_tools.deploy import board_console
from kickstand_tools.logs.reader import read_log
from kickstand_tools.rides import stream
from support import command, fake_board
from support.recordings import ride_writer
from support.watched_stderr import Watched, watched


class Clocks:
    """Replaces the module time. Only waiting takes time. While the computer sleeps, its monotonic clock stops."""

    waited_s = asleep_s = 0.0

    @classmethod
    def monotonic(cls):
        return cls.waited_s

    @classmethod
    def time(cls):
        return cls.waited_s + cls.asleep_s

    @classmethod
    def sleep(cls, seconds):
        cls.waited_s += seconds


class Stream(fake_board.Serial):
    """A serial port with the board's output.

    end: the event after this output: "ctrl-c" or another signal, "error", "unplug", "silence" or "asleep".
    last: the board's output after Ctrl-C.
    """

    def __init__(self, blocks, end, last=b""):
        super().__init__()
        self.last = last
        self.data = b"".join(_said(block) for block in blocks)
        self.end = end

    def inWaiting(self):
        if not self.data and self.end:
            end, self.end = self.end, None
            if end == "ctrl-c":
                signal.raise_signal(signal.SIGINT)
            elif isinstance(end, signal.Signals):
                signal.raise_signal(end)
            elif end == "error":
                self.data = b"\x04Traceback (most recent call last):\r\nValueError: bad pin\r\n\x04>"
            elif end == "asleep":
                Clocks.asleep_s += 300
            elif end == "unplug":
                raise OSError(5, "Input/output error")
        return len(self.data)

    def write(self, data):
        super().write(data)
        if data == b"\x03":
            self.data += self.last + b"\x04\x04>"


class Streaming(fake_board.FakeBoard):
    """A board whose app runs until the stream ends."""

    def exec_raw_no_follow(self, command):
        self.resets += "machine.reset()" in command


def _said(block):
    """Return one block as usb_stream prints it."""
    pieces = [block[at : at + 256] for at in range(0, len(block), 256)]
    return b"".join(base64.b64encode(piece) + b"\r\n" for piece in pieces) + b".\r\n"


@pytest.fixture
def streaming(tmp_path, monkeypatch):
    """Return streaming(blocks, end), which connects a board that streams these blocks. Only waiting takes time."""
    monkeypatch.setattr(Clocks, "waited_s", 0.0)
    monkeypatch.setattr(Clocks, "asleep_s", 0.0)

    def fit(blocks, end, last=b""):
        board = Streaming(tmp_path)
        board.serial = Stream(blocks, end, last)
        monkeypatch.setattr(board_console, "time", Clocks)
        return fake_board.plug_in(monkeypatch, board)

    return fit


def half_seconds(count):
    return ride_writer.blocks(count, length=lambda _: 512)


@pytest.fixture
def signals():
    """Restore the handlers after each test. With the default handlers a signal of a test would end pytest itself."""
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = [signal.signal(number, lambda *_: None) for number in numbers]
    yield
    for number, handler in zip(numbers, before):
        signal.signal(number, handler)


@pytest.mark.parametrize("before", [signal.default_int_handler, signal.SIG_IGN], ids=["shell", "background"])
@pytest.mark.usefixtures("signals")
def test_ctrl_c_ends_a_whole_log(before, streaming, tmp_path):
    """Ctrl-C also works if a shell has started the command with this signal ignored. When the command ends, the earlier
    handler is restored."""
    signal.signal(signal.SIGINT, before)
    data, turns = half_seconds(9)
    board = streaming(data[:-1], "ctrl-c", _said(data[-1]))
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert result.err == ""
    assert board.serial.written == b"\x03\x01"
    assert board.resets == 1
    log = read_log(tmp_path / "ride.csv")
    assert len(log.time_us) == len(turns)  # the log includes the board's output after Ctrl-C
    assert log.time_us[-1] == sum(dt for _, _, dt in turns) - turns[0][2]
    cal = json.loads((tmp_path / "ride.cal.json").read_text())
    assert cal["accel_slope"] == pytest.approx([1.01, 0.99, 1.0])
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(os.name == "nt", reason="signals are of Unix")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
@pytest.mark.usefixtures("signals")
def test_kill_and_a_closed_terminal_end_it_as_ctrl_c_does(name, streaming, tmp_path):
    data, turns = half_seconds(3)
    board = streaming(data, signal.Signals[name])
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert result.err == ""
    assert board.serial.written == b"\x03\x01"
    assert len(read_log(tmp_path / "ride.csv").time_us) == len(turns)
    assert sorted(command.snapshot(tmp_path)) == [str(tmp_path / name) for name in ("ride.cal.json", "ride.csv")]


@pytest.mark.skipif(os.name == "nt", reason="signals are of Unix")
@pytest.mark.usefixtures("signals")
def test_under_nohup_a_closed_terminal_is_not_heard(streaming, tmp_path):
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    streaming(half_seconds(3)[0], signal.SIGHUP)
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert "the board says nothing any more" in result.err


@pytest.mark.parametrize(
    ("aligned", "still", "words"), [(True, True, "deg"), (True, False, "lean --"), (False, True, "not aligned")]
)
def test_the_lean_is_shown_live_once_it_is_known(aligned, still, words, streaming, tmp_path, monkeypatch):
    monkeypatch.setattr(ride_writer, "calibration", functools.partial(calibration, ride_writer.calibration(), aligned))
    if still:
        monkeypatch.setattr(ride_writer, "turns", at_rest)
    streaming(half_seconds(3)[0], "ctrl-c")
    shown = watched(monkeypatch, Watched(), "record", "--out", tmp_path / "ride.csv")
    assert words in shown
    assert ("deg" in shown) is (aligned and still)
    assert "readings/s" in shown


@pytest.mark.parametrize("aligned", [True, False])
def test_a_car_shows_g_and_no_lean(aligned, streaming, tmp_path, monkeypatch):
    """Replaying the log gives no lean, because its calibration says that the vehicle is a car."""
    monkeypatch.setattr(ride_writer, "calibration", functools.partial(calibration, ride_writer.calibration(), aligned))
    monkeypatch.setattr(ride_writer, "turns", braking_in_a_left_bend)
    board = streaming(half_seconds(3)[0], "ctrl-c")
    board.serial.data = b"vehicle car\r\n" + board.serial.data
    shown = watched(monkeypatch, Watched(), "record", "--out", tmp_path / "ride.csv")
    assert " deg" not in shown
    assert ("forward -0.20 g  left  0.30 g" in re.sub("\x1b\\[[0-9;]*m", "", shown)) is aligned
    assert ("not aligned" in shown) is not aligned
    assert json.loads((tmp_path / "ride.cal.json").read_text())["vehicle"] == "car"
    assert len(read_log(tmp_path / "ride.csv").time_us) > 100


def test_a_disturbed_vehicle_name_does_not_end_the_recording(streaming, tmp_path):
    board = streaming(half_seconds(3)[0], "ctrl-c")
    board.serial.data = b"vehicle \xff\r\n" + board.serial.data
    command.works("record", "--out", tmp_path / "ride.csv")
    assert len(read_log(tmp_path / "ride.csv").time_us) > 100


def at_rest(count, seed=0):
    """Yield passes of the loop as ride_writer.turns() does, for an upright bike at rest."""
    for i in range(count):
        yield [2 * mean for mean in (-40, 83, 4096, 0, i % 2, 98, 0)], 2, 10_000


def braking_in_a_left_bend(count, seed=0):
    """Yield passes of the loop as ride_writer.turns() does, for a car with forces of 0.2 g backward and 0.3 g to the
    left."""
    for _ in range(count):
        yield [2 * mean for mean in (-851, 1324, 4096, 0, 0, 98, 0)], 2, 10_000


def calibration(made, aligned, _trim_deg):
    made.aligned = aligned
    return made


def test_a_closed_terminal_loses_nothing(streaming, tmp_path, monkeypatch):
    data, turns = half_seconds(6)
    streaming(data, "ctrl-c")
    terminal = Watched()
    terminal.closed_after = 300
    with contextlib.suppress(OSError):  # OSError: the command cannot write its last output
        watched(monkeypatch, terminal, "record", "--out", tmp_path / "ride.csv")
    assert len(read_log(tmp_path / "ride.csv").time_us) == len(turns)


@pytest.mark.parametrize("name", ["ride.csv", "ride.cal.json"])
def test_an_earlier_recording_is_not_overwritten(name, streaming, tmp_path):
    board = streaming(half_seconds(3)[0], "ctrl-c")
    (tmp_path / name).write_text("yesterday")
    out = tmp_path / "ride.csv"
    command.refused(tmp_path, "record", "--out", out, words=f"{tmp_path / name} exists already: give --out another")
    assert not board.resets


def fails(board, error):
    """Make the board's next program fail with this error."""
    board.serial.data = b"\x04Traceback (most recent call last):\r\n" + error + b"\r\n\x04>"


@pytest.mark.parametrize("arguments", [["record", "--out", "ride.csv"], ["pull"], ["status"]])
def test_a_board_without_the_firmware_is_reported_alike(arguments, streaming, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    board = streaming([], None)
    fails(board, b"ImportError: no module named 'kickstand'")
    words = "kickstand: Kickstand is not on the board at /dev/ttyACM0: install it with kickstand flash\n"
    assert command.refused(tmp_path, *arguments) == words


@pytest.mark.parametrize("arguments", [["record", "--out", "ride.csv"], ["pull"]])
def test_a_board_with_an_older_version_must_be_updated(arguments, streaming, tmp_path, monkeypatch):
    """The board has version 0.2.0, whose modules are all in one folder."""
    monkeypatch.chdir(tmp_path)
    board = streaming([], None)
    board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: None))
    fails(board, b"ImportError: no module named 'kickstand.rides'")
    words = "of another version or not whole (no module named 'kickstand.rides'): kickstand flash brings it up to date"
    command.refused(tmp_path, *arguments, words=words)


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ("error", "the board reports ValueError: bad pin"),
        ("unplug", "connection lost (Input/output error)"),
        ("silence", "the board says nothing any more"),
    ],
)
def test_the_data_before_a_broken_stream_are_kept(end, words, streaming, tmp_path):
    data, turns = half_seconds(3)
    streaming(data, end)
    result = command.works("record", "--out", tmp_path / "ride.csv.gz")
    assert result.err.startswith("warning: ")
    assert result.err.count("\n") == 1
    assert words in result.err
    assert len(gzip.decompress((tmp_path / "ride.csv.gz").read_bytes()).splitlines()) == len(turns) + 1


def test_a_computer_that_slept_is_reported(streaming, tmp_path, monkeypatch):
    """While the computer slept, the board stopped streaming. The command notices quickly that the board has stopped.
    The command waits longer for a board whose sensor is off."""
    monkeypatch.setattr(board_console, "_AWAY_SILENT_S", 0.1)
    data, turns = half_seconds(3)
    streaming(data, "asleep")
    monkeypatch.setattr(stream, "_SILENT_S", 60.0)
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert "this computer took nothing for 300 s: keep it awake: the log up to there is kept" in result.err
    assert result.err.count("\n") == 1
    assert len(read_log(tmp_path / "ride.csv").time_us) == len(turns)


def test_after_a_new_alignment_the_log_ends_and_the_board_stops(streaming, tmp_path):
    data, turns = half_seconds(3)
    board = streaming([*data, *ride_writer.blocks(2, trim_deg=1.0, length=lambda _: 512)[0]], "silence", b"")
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert result.err == "warning: the board's calibration has changed: the log ends here\n"
    assert board.serial.written == b"\x03\x01"
    assert len(read_log(tmp_path / "ride.csv").time_us) == len(turns)
    assert json.loads((tmp_path / "ride.cal.json").read_text())["trim_deg"] == 0.0


def test_a_damaged_block_leaves_a_gap(streaming, tmp_path):
    data, _ = half_seconds(6)
    data[3] = data[3][:200] + b"!" + data[3][201:]
    streaming(data, "ctrl-c")
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert "did not arrive: the log has gaps" in result.err
    times = read_log(tmp_path / "ride.csv").time_us
    assert max(b - a for a, b in pairwise(times)) > 2e5


def test_nothing_recorded_writes_nothing(streaming, tmp_path):
    streaming([], "silence")
    command.refused(tmp_path, "record", "--out", tmp_path / "a.csv", words="nothing was recorded")
    command.refused(tmp_path, "record", "--out", tmp_path / "a.txt", words="ends in .csv or .csv.gz")


@pytest.mark.parametrize("name", ["ride.csv", "ride.csv.gz"])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_full_disk_keeps_what_was_recorded(name, share, streaming, tmp_path, monkeypatch):
    data, turns = half_seconds(12)
    streaming(data, "ctrl-c")
    (tmp_path / "whole").mkdir()
    command.works("record", "--out", tmp_path / "whole" / name)
    most = round(share * (tmp_path / "whole" / name).stat().st_size)
    streaming(data, "ctrl-c")
    handler, limits = signal.signal(signal.SIGXFSZ, signal.SIG_IGN), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, limits[1]))
    try:
        result = command.works("record", "--out", tmp_path / name)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert "writing the log failed (File too large): the log up to there is kept" in result.err
    kept = len(read_log(tmp_path / name).time_us)
    assert (share - 0.2) * len(turns) < kept < len(turns)
    assert f", {kept} readings" in result.out
    assert (tmp_path / "ride.cal.json").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["ride.cal.json", name, "whole"])
