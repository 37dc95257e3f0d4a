"""The ring of rides: the oldest are removed first, some room is always left, and a file system that fails ends a ride
without an exception."""

import contextlib
import io
import os
import types

import pytest
import ride_writer
from kickstand.rides import flash_ring
from kickstand.rides.flash_ring import RideRing
from kickstand.ui import messages
from kickstand_tools.rides import block_reader
from kickstand_tools.simulated_board.fakes import fake_os

SETTINGS = types.SimpleNamespace(SD_SPI=None)
PART = 4  # blocks, so that little has to be recorded


def small_parts():
    ring = RideRing(SETTINGS)
    ring._part_blocks, ring.needed = PART, ring.needed - 12 * 4096
    return ring


NEEDED = small_parts().needed


def _taken(directory):
    """Bytes of whole sectors in all files. After each turn of the loop this has to be quick, which pathlib is not."""
    with os.scandir(directory) as entries:
        return sum(
            _taken(entry.path) if entry.is_dir() else -(-entry.stat().st_size // 4096) * 4096 for entry in entries
        )


class Flash:
    """A small flash of `size` bytes. least: the fewest that were free."""

    def __init__(self, root, size):
        self.root, self.size = root, size
        self.least = size

    def free(self, _path=None):
        taken = _taken(self.root)
        self.least = min(self.least, self.size - taken)
        return self.size - taken


@pytest.fixture
def flash(tmp_path, monkeypatch):
    """Room for four parts beside what is kept free."""
    monkeypatch.chdir(tmp_path)
    flash = Flash(tmp_path, NEEDED + 3 * PART * 4096 + 8192)
    monkeypatch.setattr(flash_ring, "free_bytes", flash.free)
    monkeypatch.setattr(flash_ring, "all_bytes", lambda _path: flash.size + flash_ring.FIRMWARE)
    monkeypatch.setattr("os.ilistdir", fake_os.ilistdir, raising=False)
    return flash


@pytest.fixture
def recorder(flash, clock):
    """A Recorder on that flash."""
    from kickstand.rides.recorder import Recorder

    return Recorder(small_parts(), 200)


def ride(recorder, flash, turns, seed=0):
    """One ride of so many turns of the loop."""
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    for i, (sums, n, dt_us) in enumerate(ride_writer.turns(turns, seed)):
        if recorder.active:
            recorder.add(sums, n, dt_us)
            recorder.tick()
            if i % 8 == 0:
                flash.free()
    recorder.stop()


def found(flash):
    """{ride: sequence numbers} of all whole blocks."""
    rides = {}
    for path in sorted(flash.root.glob("rides/*/*/*.rid")):
        blocks, problems = block_reader.read(path.read_bytes())
        assert problems == []
        for block in blocks:
            rides.setdefault(block.ride, []).append(block.sequence)
    return rides


def test_the_oldest_ride_goes_first_and_the_flash_never_fills(recorder, flash):
    for seed in range(4):
        ride(recorder, flash, 3000, seed)  # one and a half parts
    rides = found(flash)
    assert sorted(rides) in ([2, 3, 4], [3, 4])
    assert rides[4] == list(range(len(rides[4])))
    assert flash.least >= flash_ring.RESERVE
    assert recorder.problem is None


def test_a_ride_longer_than_the_flash_keeps_its_end(recorder, flash):
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    rooms = []
    for i, (sums, n, dt_us) in enumerate(ride_writer.turns(9000)):
        recorder.add(sums, n, dt_us)
        recorder.tick()
        if i % 500 == 499:
            rooms.append(recorder.room_s())
    recorder.stop()
    sequences = found(flash)[1]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    assert sequences[0] > 0 and sequences[0] % PART == 0
    assert rooms[2:] == sorted(rooms[2:], reverse=True)
    assert rooms[-1] == 0
    # the room that it showed when the ride had just begun was right
    bytes_s = sum(map(len, ride_writer.blocks(20)[0])) / (sum(dt for _, _, dt in ride_writer.blocks(20)[1]) / 1e6)
    assert rooms[2] + 20 == pytest.approx((flash.size - NEEDED) / bytes_s, rel=0.2)


def test_a_ride_without_a_block_leaves_no_directory_of_its_own(recorder, flash):
    """The power goes again and again within the first seconds. In flash each directory would take 8 KB."""
    for _ in range(5):
        recorder.start(ride_writer.CHIP, ride_writer.calibration())
        recorder.active = False
    assert [path.relative_to(flash.root).as_posix() for path in flash.root.rglob("*")] == [
        "rides",
        "rides/000",
        "rides/000/01",
    ]
    ride(recorder, flash, 1000)
    ride(recorder, flash, 1000)
    assert sorted(found(flash)) == [1, 2]


def test_a_flash_that_is_full_of_other_things_refuses_in_one_line(recorder, flash):
    (flash.root / "map.bin").write_bytes(bytes(flash.size - NEEDED + 4096))
    with contextlib.redirect_stdout(io.StringIO()) as said:
        ride(recorder, flash, 3000)
    assert messages.lines(recorder.problem) == ("Rec. stopped", "no room")
    assert said.getvalue().count("\n") == 1
    assert found(flash) == {}
