"""The ring of rides: the oldest are removed first, some room is always left, and a file system that fails ends a ride
without an exception."""

import contextlib
import io
import os
import sys
import types

import pytest
import ride_writer
from kickstand.rides import flash_ring, ride_paths
from kickstand.rides.flash_ring import RideRing
from kickstand.rides.ride_paths import part_path
from kickstand.ui import messages
from kickstand_tools.rides import block_reader
from kickstand_tools.simulated_board.fakes import fake_machine, fake_os, fake_time
from kickstand_tools.simulated_board.simulator import Board

SETTINGS = types.SimpleNamespace(SD_SPI=None)
NEEDED = RideRing(SETTINGS).needed


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
    flash = Flash(tmp_path, NEEDED + 3 * 65536 + 8192)
    monkeypatch.setattr(flash_ring, "free_bytes", flash.free)
    monkeypatch.setattr(flash_ring, "all_bytes", lambda _path: flash.size + flash_ring.FIRMWARE)
    monkeypatch.setattr("os.ilistdir", fake_os.ilistdir, raising=False)
    return flash


@pytest.fixture
def recorder(flash, monkeypatch):
    """A Recorder on that flash, its clock that of a board."""
    from kickstand_tools.simulated_board.clock import Clock

    clock = Clock()
    fake_time.use(clock, 0)
    for name in fake_time.ADDED:
        monkeypatch.setattr("time." + name, getattr(fake_time, name), raising=False)
    from kickstand.rides.recorder import Recorder

    return Recorder(RideRing(SETTINGS), 200)


def ride(recorder, flash, turns, seed=0):
    """One ride of so many turns of the loop."""
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    for sums, n, dt_us in ride_writer.turns(turns, seed):
        if recorder.active:
            recorder.add(sums, n, dt_us)
            recorder.tick()
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
    for seed in range(6):
        ride(recorder, flash, 12_000, seed)  # one and a half parts
    rides = found(flash)
    assert sorted(rides) == [4, 5, 6] or sorted(rides) == [5, 6]
    assert rides[6] == list(range(len(rides[6])))
    assert flash.least >= flash_ring.RESERVE
    assert recorder.problem is None


def test_a_ride_longer_than_the_flash_keeps_its_end(recorder, flash):
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    rooms = []
    for i, (sums, n, dt_us) in enumerate(ride_writer.turns(60_000)):
        recorder.add(sums, n, dt_us)
        recorder.tick()
        if i % 2000 == 1999:
            rooms.append(recorder.room_s())
    recorder.stop()
    sequences = found(flash)[1]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    assert sequences[0] > 0 and sequences[0] % 16 == 0
    assert rooms[2:] == sorted(rooms[2:], reverse=True)
    assert rooms[-1] == 0
    # the room that it showed when the ride had just begun was right
    bytes_s = sum(map(len, ride_writer.blocks(20)[0])) / (sum(dt for _, _, dt in ride_writer.blocks(20)[1]) / 1e6)
    assert rooms[2] + 80 == pytest.approx((flash.size - NEEDED) / bytes_s, rel=0.2)


def test_the_oldest_go_part_by_part_with_their_directories_and_one_step_a_turn(recorder, flash, monkeypatch):
    """Rides 98 to 112, which are in two groups. The owner's own files stay, and their directories."""
    names = [part_path("rides", ride, part) for ride in range(98, 113) for part in range(4)]
    for name in reversed(names):
        (flash.root / name).parent.mkdir(parents=True, exist_ok=True)
        (flash.root / name).write_bytes(bytes(4096))
    strays = ["00001-0000.ride", "notes.txt", "000/99/._00000.rid", "000/3.rid", "001/notes/1", "001/02/0000.rid"]
    for name in strays:
        (flash.root / "rides" / name).parent.mkdir(exist_ok=True)
        (flash.root / "rides" / name).write_bytes(b"the rider's own")
    (flash.root / "rides/000/12").mkdir()  # the power went
    flash.size = NEEDED + (len(names) + len(strays)) * 4096
    steps = []

    def noted(function):
        def call(path):
            steps.append((function.__name__, path))
            function(path)

        return call

    patched = types.SimpleNamespace(mkdir=os.mkdir, remove=noted(os.remove), rmdir=noted(os.rmdir))
    monkeypatch.setattr(flash_ring, "os", patched)
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    assert recorder.room_s() == (len(names) + len(strays)) * 4096 // 1024
    for sums, n, dt_us in ride_writer.turns(20_000):  # two and a half parts
        recorder.add(sums, n, dt_us)
        before = len(steps)
        recorder.tick()
        assert len(steps) <= before + 1
    recorder.stop()
    assert recorder.problem is None
    removed = [path for name, path in steps if name == "remove"]
    assert len(removed) >= 32
    assert removed == names[: len(removed)]
    assert not (flash.root / "rides/000/12").exists()
    assert not (flash.root / "rides/000/98").exists()
    assert not (flash.root / "rides/001/00").exists()
    assert all((flash.root / "rides" / name).exists() for name in strays)
    assert (flash.root / part_path("rides", 113, 2)).exists()
    sizes = {ride: sizes for ride, _, sizes in ride_paths.parts("rides")}
    assert sorted(sizes) == list(range(98 + len(removed) // 4, 114))


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


def test_the_numbers_go_on_after_the_newest(recorder, flash):
    (flash.root / "rides/000/07").mkdir(parents=True)
    (flash.root / "rides/002").mkdir()
    ride(recorder, flash, 1000)
    assert sorted(found(flash)) == [200]
    (flash.root / "rides/002/99").mkdir()
    (flash.root / "rides/002/99/00003.rid").write_bytes(b"")
    ride(recorder, flash, 1000)
    assert sorted(found(flash)) == [200, 300]


def test_no_memory_for_a_ride_is_said_and_the_display_goes_on(recorder, monkeypatch):
    def listed(_path):
        raise MemoryError("memory allocation failed")

    monkeypatch.setattr("os.ilistdir", listed)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        recorder.start(ride_writer.CHIP, ride_writer.calibration())
    assert messages.lines(recorder.problem) == ("Rec. stopped", "no memory")
    assert said.getvalue().count("\n") == 1
    assert not recorder.active


def test_a_flash_that_is_full_of_other_things_refuses_in_one_line(recorder, flash):
    (flash.root / "map.bin").write_bytes(bytes(flash.size - NEEDED + 4096))
    with contextlib.redirect_stdout(io.StringIO()) as said:
        ride(recorder, flash, 3000)
    assert messages.lines(recorder.problem) == ("Rec. stopped", "no room")
    assert said.getvalue().count("\n") == 1
    assert found(flash) == {}


class Worn:
    """Files that can be used so many times; then each use fails."""

    def __init__(self, uses):
        self.uses = uses
        self.flushed = 0

    def use(self):
        self.uses -= 1
        if self.uses < 0:
            raise OSError(5)

    def open(self, path, mode):
        self.use()
        return WornFile(self, open(path, mode))


class WornFile:
    def __init__(self, worn, file):
        self._worn, self._file = worn, file

    def write(self, data):
        self._worn.use()
        return self._file.write(data)

    def flush(self):
        self._worn.use()
        self._file.flush()
        self._worn.flushed += 1

    def close(self):
        self._file.close()
        self._worn.use()


@pytest.mark.parametrize("uses", [0, 1, 2, 17, 18, 19, 35, 36, 50, 52])
def test_a_file_system_that_fails_ends_the_ride_and_keeps_what_was_written(recorder, flash, uses, monkeypatch):
    """Whenever it fails there is one notice and no exception, and the next ride is recorded when it works again."""
    worn = Worn(uses)
    with monkeypatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as said:
        patch.setattr(flash_ring, "open", worn.open, raising=False)
        ride(recorder, flash, 1000)
    assert said.getvalue().count("\n") == 1
    assert said.getvalue().startswith("recording stopped")
    assert messages.lines(recorder.problem) == ("Rec. stopped", "flash fault")
    assert not recorder.active
    assert recorder.take_problem() and recorder.take_problem() is None
    ride(recorder, flash, 2000, seed=1)
    assert recorder.problem is None
    parts = {path.parent.name: block_reader.read(path.read_bytes())[0] for path in flash.root.glob("rides/*/*/*.rid")}
    if uses:  # the ride's directory could be made
        assert len(parts.pop("01")) >= worn.flushed == (uses - 1) // 17
    assert [len(blocks) for blocks in parts.values()] == [5]


def test_a_card_that_is_pulled_is_said(recorder, flash, monkeypatch):
    monkeypatch.setattr(ride_paths, "directory", lambda _settings: "rides")
    flash.size += 1 << 20
    recorder.keeper = RideRing(types.SimpleNamespace(SD_SPI=0))
    with contextlib.redirect_stdout(io.StringIO()):
        monkeypatch.setattr(flash_ring, "open", Worn(5).open, raising=False)
        ride(recorder, flash, 1000)
    assert messages.lines(recorder.problem) == ("Rec. stopped", "card fault")


def take_stall(recorder):
    """As the app does it."""
    stalled, recorder.stalled = recorder.stalled, False
    return stalled


@pytest.mark.parametrize("stops_interrupts", [True, False])
def test_a_stall_is_told_once(stops_interrupts, recorder, flash):
    """The end of a ride closes a file, which may erase flash."""
    recorder.keeper.stops_interrupts = stops_interrupts
    assert not take_stall(recorder)
    ride(recorder, flash, 10)
    assert take_stall(recorder) is stops_interrupts
    assert not take_stall(recorder)


def test_a_gap_in_the_readings_is_one_in_the_log(recorder, flash):
    """After a fault of the sensor the board's filter starts again. A gap of half a second restarts the replay's."""
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    for i, (sums, n, dt_us) in enumerate(ride_writer.turns(100)):
        if i == 50:
            recorder.mark_gap()
            dt_us = 0
        recorder.add(sums, n, dt_us)
    recorder.stop()
    block = block_reader.read((flash.root / "rides/000/01/00000.rid").read_bytes())[0][0]
    steps = [after.time_us - before.time_us for before, after in zip(block.turns, block.turns[1:], strict=False)]
    assert [step > 500_000 for step in steps].count(True) == 1
    assert steps[49] > 500_000


def test_a_speed_source_without_a_sensor_fills_no_block(recorder, flash):
    """Speeds are written only with turns. A turn gets the newest speed."""
    recorder.start(ride_writer.CHIP, ride_writer.calibration())
    turns = list(ride_writer.turns(20))
    for sums, n, dt_us in turns[:10]:
        recorder.add(sums, n, dt_us)
    for speed in range(20_000):
        recorder.add_fix(speed % 7 / 100, None)
    recorder.add_fix(12.34, None)
    for sums, n, dt_us in turns[10:]:
        recorder.add(sums, n, dt_us)
    recorder.stop()
    block = block_reader.read((flash.root / "rides/000/01/00000.rid").read_bytes())[0][0]
    assert [turn.speed_mps for turn in block.turns] == [None] * 10 + [12.34] + [None] * 9


@pytest.mark.parametrize(
    ("driver", "words", "lcd"),
    [
        (None, "its driver is not on the board: mpremote mip install sdcard", ("SD card:", "no driver")),
        (OSError("no SD card"), "none that can be used", ("No SD card", "check, restart")),
    ],
)
def test_a_card_that_cannot_be_used_is_said_in_one_line(driver, words, lcd, recorder, monkeypatch):
    monkeypatch.setitem(sys.modules, "machine", fake_machine)
    monkeypatch.setattr(fake_machine, "board", Board(lambda t_s: (0, 0, 1, 0, 0, 0)), raising=False)  # it has the pins
    from kickstand.board import port

    pins = types.SimpleNamespace(SD_SPI=0, SD_SCK=18, SD_MOSI=19, SD_MISO=16, SD_CS=17)

    def opened(*_):
        raise driver or ImportError("no module named 'sdcard'")

    monkeypatch.setattr(port, "open_sd_card", opened)
    recorder.keeper = RideRing(pins)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        recorder.start(ride_writer.CHIP, ride_writer.calibration())
    assert words in said.getvalue()
    assert said.getvalue().count("\n") == 1
    assert messages.lines(recorder.problem) == lcd
    assert all(len(line) <= 16 for line in lcd)
    assert not recorder.active
