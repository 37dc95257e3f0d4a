"""`kickstand record` from a fake board that streams. The log grows with the stream, and Ctrl-C or the board ends it."""

import gzip
import json
import os
import re
import signal

import pytest
from kickstand_tools.logs.reader import read_log
from kickstand_tools.rides.stream import record
from ride_boards import Clocks, Stream, Streaming as Streaming, half_seconds, plug_in
from support import command
from support.watched_stderr import Watched, watched
from support.web.raw_prompt import streamed

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals are of Unix")
CTRL_C = signal.SIGINT


@pytest.fixture
def stream(tmp_path, monkeypatch):
    """Return stream(blocks, end, ...), which connects a board that streams these blocks, and `first` before them."""

    def connect(blocks, end=None, last=b"", first=b""):
        return plug_in(monkeypatch, tmp_path, Stream(blocks, end, last, first))

    return connect


@pytest.fixture
def signals():
    """Restore the handlers. With the default handlers a signal of a test would end pytest itself."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    handlers = [signal.signal(number, lambda *_: None) for number in numbers]
    yield
    for number, handler in zip(numbers, handlers):
        signal.signal(number, handler)


def readings(path):
    return len(read_log(path).time_us)


@pytest.mark.parametrize("handler", [signal.default_int_handler, signal.SIG_IGN], ids=["shell", "background"])
@pytest.mark.usefixtures("signals")
def test_ctrl_c_ends_a_complete_log(handler, stream, tmp_path):
    """Ctrl-C also works if a shell has started the command with this signal ignored. When the command ends, the earlier
    handler is restored."""
    signal.signal(signal.SIGINT, handler)
    data, turns = half_seconds(9)
    board = stream(data[:-1], CTRL_C, streamed(data[-1]))
    result = command.works("record", "--out", tmp_path / "ride.csv")
    seconds = (sum(dt for _, _, dt in turns)) / 1e6
    assert result.err == "" and result.out == (
        "recording from /dev/ttyACM0: press Ctrl-C to stop\n"
        f"written: {tmp_path / 'ride.csv'}, {seconds:.1f} s, {len(turns)} readings, and ride.cal.json\n"
    )
    assert (board.serial.written, board.resets) == (b"\x03\x01", 1)
    log = read_log(tmp_path / "ride.csv")
    assert len(log.time_us) == len(turns)  # the log includes the board's output after Ctrl-C
    assert log.time_us[-1] == sum(dt for _, _, dt in turns) - turns[0][2]
    cal = json.loads((tmp_path / "ride.cal.json").read_text())
    assert cal["accel_slope"] == pytest.approx([1.01, 0.99, 1.0])
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
@pytest.mark.usefixtures("signals")
def test_kill_and_a_closed_terminal_end_it_as_ctrl_c_does(number, stream, tmp_path):
    data, turns = half_seconds(3)
    board = stream(data, number)
    assert command.works("record", "--out", tmp_path / "ride.csv").err == ""
    assert board.serial.written == b"\x03\x01" and readings(tmp_path / "ride.csv") == len(turns)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ride.cal.json", "ride.csv"]


# The line that shows the ride


def steady(*means):
    """Return ride_writer.turns() for a bike with these mean counts."""

    def turns(count, seed=0):
        for i in range(count):
            yield [2 * mean for mean in means[:4]] + [2 * (i % 2)] + [2 * mean for mean in means[4:]], 2, 10_000

    return turns


UPRIGHT = steady(-40, 83, 4096, 0, 98, 0)
BRAKING_LEFT = steady(-851, 1324, 4096, 0, 98, 0)  # 0.2 g backward and 0.3 g to the left


@pytest.mark.parametrize(
    ("vehicle", "aligned", "turns", "words", "absent"),
    [
        (b"", True, UPRIGHT, r"lean +[+-]0\.\d deg  forward", "not aligned"),
        (b"", False, UPRIGHT, "not aligned", "deg"),
        (b"vehicle car\r\n", True, BRAKING_LEFT, r"forward -0\.20 g  left  0\.30 g", " deg"),
        (b"vehicle car\r\n", False, BRAKING_LEFT, "not aligned", " deg"),
        (b"vehicle \xff\r\n", True, UPRIGHT, r"lean +[+-]0\.\d deg", "not aligned"),  # a disturbed byte
    ],
)
def test_lean_or_force_is_shown_live(vehicle, aligned, turns, words, absent, stream, tmp_path, monkeypatch):
    stream(half_seconds(3, aligned=aligned, passes=turns)[0], CTRL_C, first=vehicle)
    line = re.sub("\x1b\\[[0-9;?]*[a-zA-Z]", "", watched(monkeypatch, Watched(), "record", "--out", tmp_path / "r.csv"))
    assert re.search(words, line) and absent not in line and "readings/s" in line
    car = json.loads((tmp_path / "r.cal.json").read_text()).get("vehicle")
    assert car == ("car" if b"car" in vehicle else None) and readings(tmp_path / "r.csv") > 100


@pytest.mark.parametrize(("aligned", "brake_g"), [(True, 0.2), (False, 0.0)])
def test_a_live_reading_has_the_maxima_of_an_aligned_board(aligned, brake_g, stream, tmp_path):
    stream(half_seconds(9, aligned=aligned, passes=BRAKING_LEFT)[0], CTRL_C, first=b"vehicle car\r\n")
    live = []
    record(None, tmp_path / "r.csv", live=live.append)
    assert (live[-1].max_accel_g, live[-1].max_brake_g) == pytest.approx((0.0, brake_g), abs=0.01)


# The end of a stream


@pytest.mark.parametrize(
    ("end", "words"),
    [
        (
            b"\x04Traceback (most recent call last):\r\nValueError: bad pin\r\n\x04>",
            "the board reports ValueError: bad",
        ),
        (b"\x04\x04>", "the board stopped on its own"),
        (OSError(5, "Input/output error"), "connection lost (Input/output error)"),
        (None, "the board says nothing any more"),
        (300.0, "the board stopped because this computer took nothing for 300 s: keep it awake"),
    ],
)
def test_data_before_a_broken_stream_are_kept(end, words, stream, tmp_path):
    data, turns = half_seconds(3)
    stream(data, end)
    result = command.works("record", "--out", tmp_path / "ride.csv.gz")
    assert result.err.startswith(f"warning: /dev/ttyACM0: {words}") and result.err.count("\n") == 1
    assert result.err.endswith(": the log up to there is kept\n")
    assert len(gzip.decompress((tmp_path / "ride.csv.gz").read_bytes()).splitlines()) == len(turns) + 1
    assert (Clocks.now_s > 10) is (end is None)  # after a sleep, the end is noticed in 5 s


# Refusals


@pytest.mark.parametrize("name", ["ride.csv", "ride.cal.json"])
def test_earlier_recording_is_not_overwritten(name, stream, tmp_path):
    board = stream(half_seconds(3)[0], CTRL_C)
    (tmp_path / name).write_text("yesterday")
    words = f"{tmp_path / name} exists already: give --out another"
    command.refused(tmp_path, "record", "--out", tmp_path / "ride.csv", words=words)
    assert not board.resets


def test_nothing_recorded_writes_nothing(stream, tmp_path):
    stream([])
    command.refused(tmp_path, "record", "--out", tmp_path / "a.csv", words="nothing was recorded")
    command.refused(tmp_path, "record", "--out", tmp_path / "a.txt", words="ends in .csv or .csv.gz")


@pytest.mark.parametrize("arguments", [["record", "--out", "ride.csv"], ["pull"], ["status"]])
def test_board_without_the_firmware_is_reported_alike(arguments, stream, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stream([], b"\x04Traceback (most recent call last):\r\nImportError: no module named 'kickstand'\r\n\x04>")
    words = "Kickstand is not on the board at /dev/ttyACM0: install it with kickstand flash"
    command.refused(tmp_path, *arguments, words=words)
