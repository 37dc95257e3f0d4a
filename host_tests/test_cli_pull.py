"""kickstand pull, from an imagined board: rides become logs, damage is said, nothing unverified is deleted."""

import json
import types

import command
import fake_board
import numpy as np
import pytest
import ride_writer
from kickstand import __version__
from kickstand_tools import deploy
from kickstand_tools.logs import read_log
from serial.tools import list_ports


@pytest.fixture
def board(tmp_path, monkeypatch):
    """A board with the firmware, and no rides yet."""
    (tmp_path / "flash").mkdir()
    (tmp_path / "out").mkdir()
    board = fake_board.FakeBoard(tmp_path / "flash")
    pico = types.SimpleNamespace(device="/dev/ttyACM0", vid=0x2E8A, pid=0x0005)
    monkeypatch.setattr(list_ports, "comports", lambda: [pico])
    monkeypatch.setattr(deploy, "SerialTransport", lambda name, timeout: board)
    monkeypatch.setattr(deploy, "_RESTART_S", 0)
    board.modules["kickstand"] = types.SimpleNamespace(
        ride_ring=types.SimpleNamespace(directory=lambda _settings: "rides", ENDING=".ride"),
        settings=types.SimpleNamespace(load=lambda: None),
    )
    return board


def put(board, name, blocks):
    (board.root / "rides").mkdir(exist_ok=True)
    (board.root / "rides" / name).write_bytes(b"".join(blocks))


def logs(tmp_path):
    return sorted(tmp_path.glob("out/*.csv.gz"))


def test_rides_become_logs_with_their_calibration(board, tmp_path):
    first, turns = ride_writer.blocks(20, ride=3, trim_deg=1.25)
    put(board, "00003-0000.ride", first[:16])
    put(board, "00003-0001.ride", first[16:])
    put(board, "00004-0000.ride", ride_writer.blocks(1, ride=4, speed=True)[0])
    result = command.works("pull", "--out", tmp_path / "out")
    assert result.err == ""
    assert result.out.count("written: ") == 2
    assert board.resets == 1
    one, other = logs(tmp_path)
    assert one.name.startswith("ride-00003-")
    log = read_log(one)
    assert log.time_us == list(np.cumsum([dt for _, _, dt in turns]) - turns[0][2])
    counts = np.array([np.array(sums) / n for sums, n, _ in turns])
    readings = np.array(log.readings)
    assert np.abs(readings[:, :3] * 4096 - counts[:, :3]).max() < 1e-3
    assert np.abs(readings[:, 4:] * 65.5 - counts[:, 3:]).max() < 1e-3
    assert readings[0, 3] == 31.25
    assert [v for v in read_log(other).speed_mps if v is not None][:3] == [0, 1, 2]
    cal = json.loads((tmp_path / "out" / one.name.replace(".csv.gz", ".cal.json")).read_text())
    assert cal["vehicle_from_sensor"] == [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    assert cal["accel_offset_g"] == pytest.approx([0.01, -0.02, 0.03])
    assert (cal["trim_deg"], cal["firmware"], cal["who_am_i"], cal["sample_hz"]) == (1.25, __version__, "0x68", 200)
    assert len(list(board.root.glob("rides/*"))) == 3  # nothing was to be deleted


def test_another_ride_of_the_same_number_gets_a_file_of_its_own(board, tmp_path):
    for trim in (0.0, 0.5):
        put(board, "00001-0000.ride", ride_writer.blocks(1, trim_deg=trim)[0])
        for _ in range(2):
            command.works("pull", "--out", tmp_path / "out", "--delete")
            put(board, "00001-0000.ride", ride_writer.blocks(1, trim_deg=trim)[0])
    assert len(logs(tmp_path)) == 2


def test_only_what_came_over_whole_is_deleted(board, tmp_path):
    """A ride cut short by the power is whole up to there."""
    data = {ride: ride_writer.blocks(4, ride=ride)[0] for ride in range(1, 5)}
    put(board, "00001-0000.ride", data[1])
    put(board, "00002-0000.ride", [data[2][0], data[2][1][:1000] + b"?" + data[2][1][1001:], *data[2][2:]])
    put(board, "00003-0000.ride", [*data[3][:3], data[3][3][:700]])
    put(board, "00004-0000.ride", [b"something else altogether"])
    put(board, "notes.txt", [b"the rider's own"])
    result = command.works("pull", "--out", tmp_path / "out", "--delete")
    assert sorted(path.name for path in (board.root / "rides").iterdir()) == [
        "00002-0000.ride",
        "00004-0000.ride",
        "notes.txt",
    ]
    assert "00002-0000.ride: damaged at byte 4096: left out" in result.err
    assert "ride 2: 1 blocks are missing: the log has a gap there" in result.err
    assert "ride 2: not deleted" in result.err
    assert "00003-0000.ride: the last block is cut short" in result.err
    assert "ride 4: nothing in it can be read; it stays on the board" in result.err
    assert [path.name[:10] for path in logs(tmp_path)] == ["ride-00001", "ride-00002", "ride-00003"]
    log = read_log(logs(tmp_path)[1])
    assert max(np.diff(log.time_us)) > 1_000_000


def test_a_ride_whose_beginning_is_gone(board, tmp_path):
    put(board, "00001-0003.ride", ride_writer.blocks(2, sequence=48, time_us=300_000_000)[0])
    result = command.works("pull", "--out", tmp_path / "out")
    assert "ride 1: its beginning had to make room" in result.err
    assert read_log(logs(tmp_path)[0]).time_text[0].startswith("0.")


def test_a_board_without_rides_or_without_the_recorder(board, tmp_path):
    assert "no rides on the board" in command.works("pull", "--out", tmp_path / "out").out
    del board.modules["kickstand"]
    words = "kickstand flash brings it up to date"
    command.refused(tmp_path, "pull", "--out", tmp_path / "out", words=words)
    command.refused(tmp_path, "pull", "--out", tmp_path / "out" / "a" / "b", words="make it first")
