"""`kickstand pull` from a fake board. Rides become logs, damage is reported, and no unverified ride is deleted."""

import gzip
import json
import os
from pathlib import Path

import numpy as np
import pytest
from kickstand import __version__
from kickstand_tools.logs.reader import read_log
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
    paths = [path for path in board.paths() if path.endswith((".rid", ".txt"))]
    assert paths == ["000/02/00000.rid", "000/04/00000.rid", "000/05/00000.rid", "000/05/00001.rid", "000/notes.txt"]
    warning = "not deleted from the board, because it was not fetched completely"
    assert result.err.splitlines() == [
        "warning: ride 2, part 0: damaged at byte 1024: left out",
        "warning: ride 2: 1 blocks are missing: the log has a gap there",
        f"warning: ride 2: {warning}",
        "warning: ride 3, part 0: the last block is cut short, as by a power cut: left out",
        "warning: ride 4, part 0: not of a ride at byte 0: left out",
        "warning: ride 4: nothing in it can be read",
        f"warning: ride 4: {warning}",
        "warning: ride 5, part 0: cut short: left out",
        "warning: ride 5: 1 blocks are missing: the log has a gap there",
        f"warning: ride 5: {warning}",
    ]
    assert [path.name[:10] for path in logs(tmp_path)] == [f"ride-0000{ride}" for ride in (1, 2, 3, 5)]
    assert max(np.diff(read_log(logs(tmp_path)[1]).time_us)) > 500_000


# Faults of the cable and of the flash


def on_the_cable(change, times=99):
    """Change the lines of a ride on the cable. change(lines): returns the changed lines. times: number of transfers."""

    def plant(board):
        send, transfers = board.exec_raw_no_follow, iter(range(times))

        def sends(script):
            board.serial.data = b""
            send(script)
            content, end, tail = board.serial.data.partition(b"\x04")
            if len(content) > 4000 and next(transfers, None) is not None:
                content = b"".join(change(content.splitlines(keepends=True)))
            board.serial.data = content + end + tail

        board.exec_raw_no_follow = sends

    return plant


SHORT, WRONG = "only %d of its 4096 bytes arrived: try another cable", "some bytes arrived with errors: try another"


@pytest.mark.parametrize(
    ("plant", "words"),
    [
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


@pytest.mark.parametrize("damage", [(b"'rides/000", b"'rider/000"), (b"(3, 0", b"(300000, 0")])
def test_damaged_list_of_rides_is_refused(damage, board, tmp_path):
    """Otherwise `--delete` would remove other files of the board."""
    board.put("000/03/00000.rid", small(1))
    board.put("../rider/000/03/00000.rid", small(1))
    send = board.exec_raw
    board.exec_raw = lambda *script, **options: (send(*script, **options)[0].replace(*damage), b"")
    command.refused(board.root, "pull", "--out", tmp_path / "out", "--delete", words="lists invalid rides")


# The files on this computer


def test_pulled_log_is_not_replaced_by_a_shorter_one(board, tmp_path):
    blocks = small(4)
    board.put("000/03/00000.rid", blocks)
    command.works("pull", "--out", tmp_path / "out")
    (log,) = logs(tmp_path)
    content = log.read_bytes()
    board.put("000/03/00000.rid", blocks[:2])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    readings = len(gzip.decompress(content).splitlines()) - 1
    assert f"{log} has more of this ride, {readings} readings, and stays as it is" in result.err and board.paths()
    second = log.with_name(log.name.replace(".csv", "-2.csv"))
    assert log.read_bytes() == content and logs(tmp_path) == [second, log]


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")
def test_log_is_on_the_disk_before_the_ride_is_deleted(board, tmp_path, monkeypatch):
    board.put("000/03/00000.rid", small(4))
    events = []
    flush, remove = os.fsync, board.fs_rmfile
    monkeypatch.setattr(os, "fsync", lambda fd: events.append(os.readlink(f"/proc/self/fd/{fd}")) or flush(fd))
    board.fs_rmfile = lambda path: events.append("removed") or remove(path)
    command.works("pull", "--out", tmp_path / "out", "--delete")
    assert [Path(event).suffix for event in events] == [".gz", "", ".json", "", ""] and events[-1] == "removed"
