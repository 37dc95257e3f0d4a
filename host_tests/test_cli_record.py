"""kickstand record, from an imagined board that streams: a log as it comes, ended by Ctrl-C or by the board."""

import base64
import gzip
import json
import os
import signal
import types
from itertools import pairwise

import command
import fake_board
import pytest
import ride_writer
from kickstand_tools import deploy, record
from kickstand_tools.logs import read_log
from serial.tools import list_ports


class Stream(fake_board.Serial):
    """A serial port: what the board says, and what it does then. At the end: "ctrl-c", "error", "unplug", "silence"."""

    def __init__(self, blocks, end, last=b""):
        super().__init__()
        self.last = last
        self.data = b"".join(_said(block) for block in blocks)
        self.end = end

    def inWaiting(self):
        if not self.data and self.end:
            end, self.end = self.end, None
            if end == "ctrl-c":
                os.kill(os.getpid(), signal.SIGINT)
            elif end == "error":
                self.data = b"\x04Traceback (most recent call last):\r\nValueError: bad pin\r\n\x04>"
            elif end == "unplug":
                raise OSError(5, "Input/output error")
        return len(self.data)

    def write(self, data):
        super().write(data)
        if data == b"\x03":
            self.data += self.last + b"\x04\x04>"


class Streaming(fake_board.FakeBoard):
    """Its app runs until the stream ends."""

    def exec_raw_no_follow(self, command):
        self.resets += "machine.reset()" in command


def _said(block):
    """One block as ride_stream prints it."""
    pieces = [block[at : at + 256] for at in range(0, len(block), 256)]
    return b"".join(base64.b64encode(piece) + b"\r\n" for piece in pieces) + b".\r\n"


@pytest.fixture
def streaming(tmp_path, monkeypatch):
    """streaming(blocks, end): a board that streams them."""

    def fit(blocks, end, last=b""):
        board = Streaming(tmp_path)
        board.serial = Stream(blocks, end, last)
        pico = types.SimpleNamespace(device="/dev/ttyACM0", vid=0x2E8A, pid=0x0005)
        monkeypatch.setattr(list_ports, "comports", lambda: [pico])
        monkeypatch.setattr(deploy, "SerialTransport", lambda name, timeout: board)
        monkeypatch.setattr(deploy, "_RESTART_S", 0)
        monkeypatch.setattr(record, "_SILENT_S", 0.2)
        return board

    return fit


def half_seconds(count):
    return ride_writer.blocks(count, length=lambda _: 512)


def test_ctrl_c_ends_a_whole_log(streaming, tmp_path):
    data, turns = half_seconds(9)
    board = streaming(data[:-1], "ctrl-c", _said(data[-1]))
    result = command.works("record", "--out", tmp_path / "ride.csv")
    assert result.err == ""
    assert board.serial.written == b"\x03"
    assert board.resets == 1
    log = read_log(tmp_path / "ride.csv")
    assert len(log.time_us) == len(turns)  # what the board said after Ctrl-C is in it
    assert log.time_us[-1] == sum(dt for _, _, dt in turns) - turns[0][2]
    cal = json.loads((tmp_path / "ride.cal.json").read_text())
    assert cal["accel_slope"] == pytest.approx([1.01, 0.99, 1.0])
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ("error", "the board reports ValueError: bad pin"),
        ("unplug", "connection lost (Input/output error)"),
        ("silence", "the board says nothing any more"),
    ],
)
def test_what_came_until_the_stream_broke_off_is_kept(end, words, streaming, tmp_path):
    data, turns = half_seconds(3)
    streaming(data, end)
    result = command.works("record", "--out", tmp_path / "ride.csv.gz")
    assert result.err.startswith("warning: ")
    assert result.err.count("\n") == 1
    assert words in result.err
    assert len(gzip.decompress((tmp_path / "ride.csv.gz").read_bytes()).splitlines()) == len(turns) + 1


def test_a_block_that_came_over_damaged_leaves_a_gap(streaming, tmp_path):
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
