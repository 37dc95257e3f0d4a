"""`kickstand pull` from a fake board. Rides become logs, damage is reported, and no unverified ride is deleted."""

import errno
import gzip
import json
import os
from pathlib import Path

import numpy as np
import pytest
from kickstand import __version__
from kickstand_tools.logs.reader import read_log
from kickstand_tools.rides.pull import pull
from ride_boards import RideBoard
from support import command
from support.recordings import ride_writer


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return a board with the firmware and without rides."""
    (tmp_path / "out").mkdir()
    return RideBoard(tmp_path / "flash").plug_in(monkeypatch)


def small(count, ride=3, **more):
    return ride_writer.blocks(count, ride=ride, length=lambda _: 1024, **more)[0]


def logs(tmp_path):
    return sorted(tmp_path.glob("out/*.csv.gz"))


def test_rides_become_logs_with_their_calibration(board, tmp_path):
    blocks, turns = ride_writer.blocks(5, ride=3, trim_deg=1.25)
    board.put("000/03/00000.rid", blocks[:3])
    board.put("000/03/00001.rid", blocks[3:])
    board.put("000/04/00000.rid", small(1, ride=4, speed=True))
    result = command.works("pull", "--out", tmp_path / "out")
    first, second = logs(tmp_path)
    assert first.name.startswith("ride-00003-") and result.err == "" and board.resets == 1
    seconds = sum(dt_us for *_, dt_us in turns) / 1e6
    assert result.out.splitlines()[0] == f"written: {first}, {seconds / 60:.1f} min, {len(turns)} readings"
    log = read_log(first)
    assert log.time_us.tolist() == list(np.cumsum([dt_us for _, _, dt_us in turns]) - turns[0][2])
    counts = np.array([np.array(sums) / n for sums, n, _ in turns])
    readings = np.array(log.readings)
    assert np.abs(readings[:, :3] * 4096 - counts[:, :3]).max() < 1e-3
    assert np.abs(readings[:, 4:] * 65.5 - counts[:, 3:]).max() < 1e-3
    assert readings[0, 3] == 31.25 and read_log(second).speed_mps[0] == 0.0
    cal = json.loads((tmp_path / "out" / first.name.replace(".csv.gz", ".cal.json")).read_text())
    assert cal["vehicle_from_sensor"] == [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    assert cal["accel_offset_g"] == pytest.approx([0.01, -0.02, 0.03])
    assert (cal["trim_deg"], cal["firmware"], cal["who_am_i"], cal["sample_hz"]) == (1.25, __version__, "0x68", 200)
    assert len(list(board.root.glob("rides/*/*/*"))) == 3  # the command has deleted nothing


@pytest.mark.parametrize(
    ("vehicle", "by_drive", "stored"), [("car", True, "car"), ("car", False, None), ("motorcycle", True, None)]
)
def test_log_of_a_car_says_that_it_is_a_car(vehicle, by_drive, stored, board, tmp_path, monkeypatch):
    """A ride that was aligned by two poses counts as a motorcycle's, because it was recorded before the board was used
    in the car."""
    calibration = ride_writer.calibration()
    calibration.by_drive = by_drive
    monkeypatch.setattr(ride_writer, "calibration", lambda _trim_deg: calibration)
    board.settings.VEHICLE = vehicle
    board.put("000/03/00000.rid", small(1))
    command.works("pull", "--out", tmp_path / "out")
    (path,) = tmp_path.glob("out/*.cal.json")
    assert json.loads(path.read_text()).get("vehicle") == stored


def test_another_ride_with_the_same_number_gets_its_own_file(board, tmp_path):
    for trim in (0.0, 0.0, 0.5):
        board.put("000/01/00000.rid", small(1, trim_deg=trim))
        command.works("pull", "--out", tmp_path / "out", "--delete")
    assert len(logs(tmp_path)) == 2


def test_only_completely_pulled_rides_are_deleted(board, tmp_path):
    """A ride that ended with a power cut counts as complete."""
    data = {ride: small(4, ride=ride) for ride in range(1, 6)}
    board.put("000/01/00000.rid", data[1])
    board.put("000/02/00000.rid", [data[2][0], data[2][1][:500] + b"?" + data[2][1][501:], *data[2][2:]])
    board.put("000/03/00000.rid", [*data[3][:3], data[3][3][:700]])
    board.put("000/04/00000.rid", [b"something else altogether"])
    board.put("000/05/00000.rid", [*data[5][:1], data[5][1][:700]])
    board.put("000/05/00001.rid", data[5][2:])
    board.put("000/notes.txt", [b"the rider's own"])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    left = [path for path in board.paths() if path.endswith((".rid", ".txt"))]
    assert left == ["000/02/00000.rid", "000/04/00000.rid", "000/05/00000.rid", "000/05/00001.rid", "000/notes.txt"]
    kept = "not deleted from the board, because it was not fetched completely"
    assert result.err.splitlines() == [
        "warning: ride 2, part 0: damaged at byte 1024: left out",
        "warning: ride 2: 1 blocks are missing: the log has a gap there",
        f"warning: ride 2: {kept}",
        "warning: ride 3, part 0: the last block is cut short, as by a power cut: left out",
        "warning: ride 4, part 0: not of a ride at byte 0: left out",
        "warning: ride 4: nothing in it can be read",
        f"warning: ride 4: {kept}",
        "warning: ride 5, part 0: cut short: left out",
        "warning: ride 5: 1 blocks are missing: the log has a gap there",
        f"warning: ride 5: {kept}",
    ]
    assert [path.name[:10] for path in logs(tmp_path)] == [f"ride-0000{ride}" for ride in (1, 2, 3, 5)]
    assert max(np.diff(read_log(logs(tmp_path)[1]).time_us)) > 500_000


def test_emptied_directories_are_removed_unless_in_use(board, tmp_path):
    for ride in (99, 100, 200):
        board.put(f"{ride // 100:03}/{ride % 100:02}/00000.rid", small(1, ride=ride))
    for stray in ("002/00/notes.txt", "00007-0000.ride", "000/5/00000.rid"):
        board.put(stray, [b"the rider's own"])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert result.err == "" and result.out.count("deleted from the board: ride ") == 3
    assert board.paths() == ["000", "000/5", "000/5/00000.rid", "00007-0000.ride", "002", "002/00", "002/00/notes.txt"]


def test_what_a_ride_lacks_is_reported(board, tmp_path, monkeypatch):
    turns = ride_writer.turns

    def with_gaps(count, seed=0):
        for i, (sums, n, dt_us) in enumerate(turns(count, seed)):
            yield sums, n, dt_us + (400_000 if i in (20, 30) else 9_000 if i == 25 else 0)

    monkeypatch.setattr(ride_writer, "turns", with_gaps)
    board.put("000/01/00003.rid", small(2, sequence=48, time_us=300_000_000))
    gaps, beginning = command.works("pull", "--out", tmp_path / "out").err.splitlines()
    assert gaps.startswith("warning: ride 1: readings are missing 2 times, 0.8 s in all: the sensor was set up again")
    assert beginning == "warning: ride 1: its beginning had to make room for later blocks"
    assert 0.0 <= read_log(logs(tmp_path)[0]).start_s < 1.0


def test_board_without_rides_or_without_the_recorder(board, tmp_path):
    assert "no rides on the board at" in command.works("pull", "--out", tmp_path / "out").out
    del board.modules["kickstand.rides"]  # remove a package that release 0.2.0 did not have
    command.refused(tmp_path, "pull", "--out", tmp_path / "out", words="kickstand flash brings it up to date")
    command.refused(tmp_path, "pull", "--out", tmp_path / "out" / "a" / "b", words="make it first")


# Faults of the cable and of the flash


class EndsEarly:
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


def ends_early(count):
    """Let the reading of a ride end after `count` bytes, as with a damaged FAT chain."""

    def plant(board):
        builtin = vars(board)["_globals"]["__builtins__"]
        opened = builtin["open"]
        builtin["open"] = lambda path, mode="r": EndsEarly(opened(path, mode), count) if mode == "rb" else opened(path)

    return plant


def on_the_cable(change, times=99):
    """Change the lines of a ride on the cable. change(lines): returns the changed lines. times: number of transfers."""

    def plant(board):
        send, transfers = board.exec_raw_no_follow, iter(range(times))

        def sends(script):
            board.serial.data = b""
            send(script)
            content, end, rest = board.serial.data.partition(b"\x04")
            if len(content) > 4000 and next(transfers, None) is not None:
                content = b"".join(change(content.splitlines(keepends=True)))
            board.serial.data = content + end + rest

        board.exec_raw_no_follow = sends

    return plant


SHORT, WRONG = "only %d of its 4096 bytes arrived: try another cable", "some bytes arrived with errors: try another"


@pytest.mark.parametrize(
    ("plant", "words"),
    [
        (ends_early(2048), SHORT % 2048),
        (ends_early(3000), SHORT % 3000),
        (on_the_cable(lambda lines: lines[:-1]), WRONG),  # the check sum is missing
        (on_the_cable(lambda lines: [lines[0], lines[1][1:], *lines[2:]]), SHORT % (4096 - 1536)),
        (on_the_cable(lambda lines: [lines[0], lines[-1]]), SHORT % 1536),
        (on_the_cable(lambda lines: [lines[0].replace(b"A", b"B", 1), *lines[1:]]), WRONG),
    ],
)
def test_incompletely_pulled_ride_stays_on_the_board(plant, words, board, tmp_path):
    board.put("000/03/00000.rid", small(4))
    plant(board)
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert f"warning: ride 3, part 0: {words}" in result.err
    assert "ride 3: not deleted" in result.err and board.paths()[-1] == "000/03/00000.rid"


def test_transfer_that_was_disturbed_once_is_repeated(board, tmp_path):
    board.put("000/03/00000.rid", small(4))
    on_the_cable(lambda lines: [lines[0], lines[1][1:], *lines[2:]], times=1)(board)
    assert command.works("pull", "--out", tmp_path / "out", "--delete").err == ""
    assert board.paths() == [] and len(logs(tmp_path)) == 1


def test_ride_that_grows_meanwhile_is_complete(board, tmp_path):
    """The board lists the ride, then records another block, then sends the file."""
    blocks = small(5)
    board.put("000/03/00000.rid", blocks[:4])
    send = board.exec_raw_no_follow

    def sends(script):
        if "b2a_base64" in script:
            board.put("000/03/00000.rid", blocks)
        send(script)

    board.exec_raw_no_follow = sends
    turns = ride_writer.blocks(5, ride=3, length=lambda _: 1024)[1]
    assert command.works("pull", "--out", tmp_path / "out").err == ""
    assert len(read_log(logs(tmp_path)[0]).t_s) == len(turns)


def test_progress_counts_each_byte_once(board, tmp_path):
    board.put("000/03/00000.rid", small(4))
    on_the_cable(lambda lines: [lines[0].replace(b"A", b"B", 1), *lines[1:]], times=1)(board)
    steps: list = []
    result = pull(None, tmp_path / "out", progress=lambda *step: steps.append(step))
    assert [done for _, done, _ in steps] == [0, 1536, 3072, 4096]
    assert {(what, total) for what, _, total in steps} == {("pulling ride 3, part 0", 4096)} and result.rides[0].whole


# The files on this computer


@pytest.mark.parametrize("earlier", ["whole", "damaged"])
def test_pulled_log_is_not_replaced_by_a_shorter_one(earlier, board, tmp_path):
    blocks = small(4)
    board.put("000/03/00000.rid", blocks)
    command.works("pull", "--out", tmp_path / "out")
    (log,) = logs(tmp_path)
    content = log.read_bytes() if earlier == "whole" else b"no gzip"
    log.write_bytes(content)
    board.put("000/03/00000.rid", blocks[:2])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    if earlier == "damaged":
        assert result.err == "" and len(gzip.decompress(log.read_bytes())) > 1000
        return
    readings = len(gzip.decompress(content).splitlines()) - 1
    assert f"{log} has more of this ride, {readings} readings, and stays as it is" in result.err and board.paths()
    second = log.with_name(log.name.replace(".csv", "-2.csv"))
    assert log.read_bytes() == content and logs(tmp_path) == [second, log]
    command.works("pull", "--out", tmp_path / "out")
    assert second.with_name(log.name.replace(".csv", "-3.csv")).exists()


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")
def test_log_is_on_the_disk_before_the_ride_is_deleted(board, tmp_path, monkeypatch):
    board.put("000/03/00000.rid", small(4))
    events = []
    flush, remove = os.fsync, board.fs_rmfile
    monkeypatch.setattr(os, "fsync", lambda fd: events.append(os.readlink(f"/proc/self/fd/{fd}")) or flush(fd))
    board.fs_rmfile = lambda path: events.append("removed") or remove(path)
    command.works("pull", "--out", tmp_path / "out", "--delete")
    assert [Path(event).suffix for event in events] == [".gz", "", ".json", "", ""] and events[-1] == "removed"


def test_folder_that_cannot_be_made_is_named(board, tmp_path, monkeypatch):
    board.put("000/03/00000.rid", small(4))

    def refuses(path, *_rest, **_more):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(os, "mkdir", refuses)
    refusal = command.refused(tmp_path, "pull", "--out", tmp_path / "new", words="give --out another place")
    assert str(tmp_path / "new") in refusal and "connection" not in refusal


def test_link_in_the_directory_is_not_followed(board, tmp_path):
    board.put("000/03/00000.rid", small(2))
    command.works("pull", "--out", tmp_path / "out")
    (log,) = logs(tmp_path)
    log.unlink()
    log.symlink_to(tmp_path / "elsewhere.csv.gz")
    result = command.run("pull", "--out", tmp_path / "out")
    assert result.status == 2 and "is a link to" in result.err and not (tmp_path / "elsewhere.csv.gz").exists()
