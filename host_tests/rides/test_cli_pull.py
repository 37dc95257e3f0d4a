"""`kickstand pull` from a fake board. Rides become logs, damage is reported, and no unverified ride is deleted."""

import binascii
import errno
import json
import os
import types
import zlib
from pathlib import Path

import numpy as np
import pytest
from kickstand import __version__
from kickstand.rides import ride_paths
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy.board_console import BrokenOff
from kickstand_tools.logs.reader import read_log
from kickstand_tools.rides import pull
from support import command, fake_board
from support.recordings import ride_writer


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return a board with the firmware and without rides."""
    (tmp_path / "flash").mkdir()
    (tmp_path / "out").mkdir()
    board = fake_board.plug_in(monkeypatch, fake_board.FakeBoard(tmp_path / "flash"))
    monkeypatch.setattr(ride_paths, "directory", lambda _settings: "rides")
    monkeypatch.setattr(ride_paths, "os", board.modules["os"])
    settings = types.SimpleNamespace(VEHICLE="motorcycle")
    board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: settings))
    board.modules["kickstand.rides"] = types.SimpleNamespace(ride_paths=ride_paths)
    return board


def put(board, name, blocks):
    path = board.root / "rides" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"".join(blocks))


def left(board):
    """Return all paths in the board's directory of rides."""
    return sorted(path.relative_to(board.root / "rides").as_posix() for path in board.root.glob("rides/**/*"))


def logs(tmp_path):
    return sorted(tmp_path.glob("out/*.csv.gz"))


def test_rides_become_logs_with_their_calibration(board, tmp_path):
    first, turns = ride_writer.blocks(20, ride=3, trim_deg=1.25)
    put(board, "000/03/00000.rid", first[:16])
    put(board, "000/03/00001.rid", first[16:])
    put(board, "000/04/00000.rid", ride_writer.blocks(1, ride=4, speed=True)[0])
    result = command.works("pull", "--out", tmp_path / "out")
    assert result.err == ""
    assert result.out.count("written: ") == 2
    assert board.resets == 1
    one, other = logs(tmp_path)
    assert one.name.startswith("ride-00003-")
    log = read_log(one)
    assert log.time_us.tolist() == list(np.cumsum([dt for _, _, dt in turns]) - turns[0][2])
    counts = np.array([np.array(sums) / n for sums, n, _ in turns])
    readings = np.array(log.readings)
    assert np.abs(readings[:, :3] * 4096 - counts[:, :3]).max() < 1e-3
    assert np.abs(readings[:, 4:] * 65.5 - counts[:, 3:]).max() < 1e-3
    assert readings[0, 3] == 31.25
    assert [v for v in read_log(other).speed_mps if v == v][:3] == [0, 1, 2]
    cal = json.loads((tmp_path / "out" / one.name.replace(".csv.gz", ".cal.json")).read_text())
    assert cal["vehicle_from_sensor"] == [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    assert cal["accel_offset_g"] == pytest.approx([0.01, -0.02, 0.03])
    assert (cal["trim_deg"], cal["firmware"], cal["who_am_i"], cal["sample_hz"]) == (1.25, __version__, "0x68", 200)
    assert len(list(board.root.glob("rides/*/*/*"))) == 3  # the command has deleted nothing


@pytest.mark.parametrize(
    ("vehicle", "by_drive", "said"), [("car", True, "car"), ("car", False, None), ("motorcycle", True, None)]
)
def test_the_log_of_a_car_says_that_it_is_a_car(vehicle, by_drive, said, board, tmp_path, monkeypatch):
    """The log of a car shows no lean. A ride that was aligned by two poses counts as a motorcycle's, because it was
    recorded before the board was used in the car."""
    made = ride_writer.calibration()
    made.by_drive = by_drive
    monkeypatch.setattr(ride_writer, "calibration", lambda _trim_deg: made)
    board.modules["kickstand"].settings.load().VEHICLE = vehicle
    put(board, "000/03/00000.rid", ride_writer.blocks(1, ride=3)[0])
    command.works("pull", "--out", tmp_path / "out")
    (path,) = tmp_path.glob("out/*.cal.json")
    assert json.loads(path.read_text()).get("vehicle") == said


def test_another_ride_with_the_same_number_gets_its_own_file(board, tmp_path):
    for trim in (0.0, 0.5):
        put(board, "000/01/00000.rid", ride_writer.blocks(1, trim_deg=trim)[0])
        for _ in range(2):
            command.works("pull", "--out", tmp_path / "out", "--delete")
            put(board, "000/01/00000.rid", ride_writer.blocks(1, trim_deg=trim)[0])
    assert len(logs(tmp_path)) == 2


def test_only_completely_pulled_rides_are_deleted(board, tmp_path):
    """A ride that ended with a power cut counts as complete."""
    data = {ride: ride_writer.blocks(4, ride=ride)[0] for ride in range(1, 5)}
    put(board, "000/01/00000.rid", data[1])
    put(board, "000/02/00000.rid", [data[2][0], data[2][1][:1000] + b"?" + data[2][1][1001:], *data[2][2:]])
    put(board, "000/03/00000.rid", [*data[3][:3], data[3][3][:700]])
    put(board, "000/04/00000.rid", [b"something else altogether"])
    put(board, "000/notes.txt", [b"the rider's own"])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert left(board) == ["000", "000/02", "000/02/00000.rid", "000/04", "000/04/00000.rid", "000/notes.txt"]
    assert "ride 2, part 0: damaged at byte 4096: left out" in result.err
    assert "ride 2: 1 blocks are missing: the log has a gap there" in result.err
    assert "ride 2: not deleted" in result.err
    assert "ride 3, part 0: the last block is cut short" in result.err
    assert "ride 4: nothing in it can be read" in result.err
    assert "ride 4: not deleted" in result.err
    assert [path.name[:10] for path in logs(tmp_path)] == ["ride-00001", "ride-00002", "ride-00003"]
    log = read_log(logs(tmp_path)[1])
    assert max(np.diff(log.time_us)) > 1_000_000


def test_emptied_directories_are_removed_unless_in_use(board, tmp_path):
    for ride in (99, 100, 200):
        put(board, f"{ride // 100:03}/{ride % 100:02}/00000.rid", ride_writer.blocks(1, ride=ride)[0])
    for stray in ("002/00/notes.txt", "00007-0000.ride", "000/5/00000.rid"):
        put(board, stray, [b"the rider's own"])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert result.err == ""
    assert result.out.count("deleted from the board: ride ") == 3
    assert left(board) == ["000", "000/5", "000/5/00000.rid", "00007-0000.ride", "002", "002/00", "002/00/notes.txt"]


def test_a_ride_without_its_beginning_is_pulled(board, tmp_path):
    put(board, "000/01/00003.rid", ride_writer.blocks(2, sequence=48, time_us=300_000_000)[0])
    result = command.works("pull", "--out", tmp_path / "out")
    assert "ride 1: its beginning had to make room" in result.err
    assert 0.0 <= read_log(logs(tmp_path)[0]).start_s < 1.0


def test_readings_that_are_missing_in_a_ride_are_reported(board, tmp_path, monkeypatch):
    turns = ride_writer.turns

    def with_gaps(count, seed=0):
        for i, (sums, n, dt_us) in enumerate(turns(count, seed)):
            yield sums, n, dt_us + (400_000 if i in (50, 90) else 9_000 if i == 70 else 0)

    monkeypatch.setattr(ride_writer, "turns", with_gaps)
    put(board, "000/01/00000.rid", ride_writer.blocks(1)[0])
    result = command.works("pull", "--out", tmp_path)
    assert "ride 1: readings are missing 2 times, 0.8 s in all: the sensor was set up again, or" in result.err
    assert result.err.count("\n") == 1


def test_a_board_without_rides_or_without_the_recorder(board, tmp_path):
    assert "no rides on the board" in command.works("pull", "--out", tmp_path / "out").out
    del board.modules["kickstand.rides"]  # remove a package that release 0.2.0 did not have
    words = "kickstand flash brings it up to date"
    command.refused(tmp_path, "pull", "--out", tmp_path / "out", words=words)
    command.refused(tmp_path, "pull", "--out", tmp_path / "out" / "a" / "b", words="make it first")


class Altered:
    """A file of the board that ends early."""

    def __init__(self, file, count):
        self.file, self.left = file, count

    def read(self, count=-1):
        piece = self.file.read(min(count, self.left))
        self.left -= len(piece)
        return piece

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()


def ends_early(board, count):
    """Make the reading of a ride end after `count` bytes, as with a damaged FAT chain."""
    opened = board._open
    board._globals["__builtins__"]["open"] = lambda path, mode="r": (
        Altered(opened(path, mode), count) if mode == "rb" else opened(path, mode)
    )


def on_the_cable(board, change, times=99):
    """Change the bytes of a ride on the cable.

    change(bytes): returns the changed bytes. times: number of transfers that are changed.
    """
    send, left = board.exec_raw_no_follow, [times]

    def sends(script):
        before = board.serial.data
        send(script)
        content, end, rest = board.serial.data[len(before) :].partition(b"\x04")
        if len(content) > 5000 and left[0]:
            left[0] -= 1
            content = change(content)
        board.serial.data = before + content + end + rest

    board.exec_raw_no_follow = sends


@pytest.mark.parametrize(
    "trouble",
    [
        lambda board: ends_early(board, 2 * 4096),
        lambda board: ends_early(board, 2 * 4096 + 1000),
        lambda board: on_the_cable(board, lambda content: b"\n".join([*content.split(b"\n")[:-2], b""])),
        lambda board: on_the_cable(board, lambda content: content[:5000] + content[5001:]),
        lambda board: on_the_cable(board, lambda content: content[: len(content) // 2] + b"\n"),
        lambda board: on_the_cable(board, lambda content: content.replace(b"A", b"B", 1)),
    ],
)
def test_an_incompletely_pulled_ride_stays_on_the_board(trouble, board, tmp_path):
    put(board, "000/03/00000.rid", ride_writer.blocks(4, ride=3)[0])
    trouble(board)
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert "try another cable" in result.err
    assert "ride 3: not deleted" in result.err
    assert left(board)[-1] == "000/03/00000.rid"


def test_a_transfer_that_was_disturbed_once_is_repeated(board, tmp_path):
    put(board, "000/03/00000.rid", ride_writer.blocks(4, ride=3)[0])
    on_the_cable(board, lambda content: content[:5000] + content[5001:], times=1)
    assert command.works("pull", "--out", tmp_path / "out", "--delete").err == ""
    assert left(board) == []


def test_a_pulled_log_is_not_replaced_by_a_shorter_one(board, tmp_path):
    blocks, _ = ride_writer.blocks(4, ride=3)
    put(board, "000/03/00000.rid", blocks)
    command.works("pull", "--out", tmp_path / "out")
    (log,) = logs(tmp_path)
    before = log.read_bytes()
    put(board, "000/03/00000.rid", blocks[:2])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert "has more of this ride" in result.err
    assert log.read_bytes() == before
    assert [path.name for path in logs(tmp_path)] == [log.name.replace(".csv", "-2.csv"), log.name]
    assert left(board)


def test_a_log_is_on_the_disk_before_the_ride_is_deleted(board, tmp_path, monkeypatch):
    put(board, "000/03/00000.rid", ride_writer.blocks(4, ride=3)[0])
    events = []
    flush, remove = os.fsync, board.fs_rmfile
    monkeypatch.setattr(
        os, "fsync", lambda number: events.append(os.readlink(f"/proc/self/fd/{number}")) or flush(number)
    )
    monkeypatch.setattr(board, "fs_rmfile", lambda path: events.append("removed") or remove(path))
    command.works("pull", "--out", tmp_path / "out", "--delete")
    assert [Path(event).suffix for event in events] == [".gz", "", ".json", "", ""]
    assert events[-1] == "removed"


def test_a_folder_that_cannot_be_made_is_named(board, tmp_path, monkeypatch):
    put(board, "000/03/00000.rid", ride_writer.blocks(4, ride=3)[0])

    def refuses(path, *_rest, **_more):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(os, "mkdir", refuses)
    said = command.refused(tmp_path, "pull", "--out", tmp_path / "new", "--delete", words="give --out another place")
    assert str(tmp_path / "new") in said
    assert "connection" not in said


def copied(monkeypatch, printed, size=6, end=None):
    """Return the result of _read() and the sizes that it reports as progress.

    printed: the lines that the board prints at each attempt.
    size: size of the file.
    """
    part, came, tries = pull._Part(3, 1, size, "rides/3.rid"), [], []

    def lines(transport, program, silent_s, most_bytes):
        tries.append(most_bytes)
        yield from printed[min(len(tries), len(printed)) - 1]
        if end:
            raise BrokenOff(end)

    monkeypatch.setattr(pull, "lines", lines)
    result = pull._read(None, part, "ride 3, part 1", lambda what, count: came.append((what, count)))  # type: ignore
    return *result, came, len(tries)


def sent(content, announced=None):
    """Return the lines that a board prints for a file: three bytes per line, then the size and the check sum.

    announced: content whose size and check sum are printed instead.
    """
    of = content if announced is None else announced
    pieces = [binascii.b2a_base64(content[at : at + 3]).strip() for at in range(0, len(content), 3)]
    return [*pieces, str((len(of), zlib.crc32(of))).encode()]


def test_a_file_comes_in_parts_and_is_compared_with_its_sum(monkeypatch):
    content, whole, came, tries = copied(monkeypatch, [sent(b"abcdef")])
    assert (content, whole, tries) == (b"abcdef", True, 1)
    assert came == [("pulling ride 3, part 1", count) for count in (0, 3, 3)]


@pytest.mark.parametrize(
    ("first", "kept"),
    [
        (sent(b"abc", b"abcdef"), b"abc"),  # only half of the file arrives
        (sent(b"abcdef", b"abcdeg"), b"abcdef"),  # one byte is wrong
        ([b"?", *sent(b"abcdef")[1:]], b"def"),  # one line is not base64
        (sent(b"abcdef")[:-1], b"abcdef"),  # the check sum is missing
    ],
)
def test_a_file_that_is_not_whole_is_copied_again(monkeypatch, first, kept):
    content, whole, came, tries = copied(monkeypatch, [first, sent(b"abcdef")])
    assert (content, whole, tries) == (b"abcdef", True, 2)
    assert sum(count for _, count in came) == len(kept)  # progress counts no byte twice
    content, whole, _, tries = copied(monkeypatch, [first])
    assert (content, whole, tries) == (kept, False, pull._TRIES)


def test_a_lost_connection_names_the_file(monkeypatch):
    with pytest.raises(InputError, match=r"rides/3.rid did not arrive completely \(it has gone\): try again"):
        copied(monkeypatch, [sent(b"abcdef")[:1]], end="it has gone")
