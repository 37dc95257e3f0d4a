"""The recorder, the ring of rides and the format at their limits, each with nothing real behind it."""

import contextlib
import io
import os
import shutil
import sys
import types
from binascii import a2b_base64, crc32
from itertools import pairwise
from pathlib import Path

import pytest
import ride_writer
from kickstand.errors import CardError, Notice
from kickstand.rides import block as block_format
from kickstand.rides import flash_ring, ride_paths
from kickstand.rides.block import RideBlock, block_length
from kickstand.rides.flash_ring import RideRing
from kickstand_tools.rides import block_reader
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.fakes import fake_machine, fake_os, fake_time

TURN_US = 10_000


class Keeper:
    """Takes the place of a RideRing. steps: what was asked of it; taken: whole blocks. fails: the name of a step that
    raises."""

    stops_interrupts = True
    fails = ""
    error: Exception = OSError(5)

    def __init__(self, clock, length=1024):
        self.clock, self.length = clock, length
        self.steps, self.taken, self.begun = [], [], b""
        self.takes_ms = {}  # by the name of a step
        self.is_ready, self.slow_us, self.free = True, 0, 1_000_000

    def _step(self, name):
        self.steps.append(name)
        self.clock.advance(1000 * self.takes_ms.get(name, 0))
        if name == self.fails:
            raise self.error

    def begin(self):
        self._step("begin")
        return 7

    def next_length(self):
        return self.length

    def room(self):
        return self.free

    def ready(self):
        self._step("ready")
        return self.is_ready

    def write(self, piece):
        self._step("write")
        self.clock.advance(self.slow_us)
        self.begun += bytes(piece)

    def end_block(self):
        self._step("end_block")
        self.taken.append(self.begun)
        self.begun = b""

    def end(self):
        self._step("end")

    def abandon(self):
        self._step("abandon")

    def fault_code(self, error):
        return "flash-fault"


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    fake_time.use(clock, 0)
    for name in fake_time.ADDED:
        monkeypatch.setattr("time." + name, getattr(fake_time, name), raising=False)
    clock.advance(3_000_000)  # since power-on
    return clock


@pytest.fixture
def keeper(clock):
    return Keeper(clock)


@pytest.fixture
def recorder(clock, keeper):
    from kickstand.rides.recorder import Recorder

    return Recorder(keeper, 200)


def take_stall(recorder):
    """As the app does it."""
    stalled, recorder.stalled = recorder.stalled, False
    return stalled


def start(recorder):
    recorder.start(ride_writer.CHIP, ride_writer.calibration())


def add(recorder, turns, clock=None, tick=True):
    """So many turns of 10 ms with the same two samples."""
    for _ in range(turns):
        if clock:
            clock.advance(TURN_US)
        recorder.add([200, -100, 8192, 60, 4, -4, 8], 2, TURN_US)
        if tick:
            recorder.tick()


def blocks(keeper):
    found, problems = block_reader.read(b"".join(keeper.taken))
    assert problems == []
    return found


def times(keeper):
    return [turn.time_us for block in blocks(keeper) for turn in block.turns]


def test_a_block_is_written_by_pieces_of_256_bytes_one_a_turn(recorder, keeper):
    keeper.length = 700
    start(recorder)
    while "write" not in keeper.steps:
        add(recorder, 1)
    keeper.steps.clear()
    written = [len(keeper.begun)]
    while not keeper.taken:
        before = len(keeper.steps)
        add(recorder, 1)
        assert len(keeper.steps) == before + 2  # ready, and one more
        written.append(len(keeper.begun))
    assert written == [256, 512, 700, 0]
    assert [len(data) for data in keeper.taken] == [700]
    before = len(keeper.steps)
    recorder.tick()
    assert len(keeper.steps) == before  # nothing is waiting


def test_what_is_not_ready_is_asked_again_in_the_next_turn(recorder, keeper):
    start(recorder)
    keeper.is_ready = False
    while "ready" not in keeper.steps:
        add(recorder, 1)
    add(recorder, 5)
    assert keeper.steps.count("ready") == 6
    assert "write" not in keeper.steps
    keeper.is_ready = True
    add(recorder, 5)
    assert len(keeper.taken) == 1


def test_all_blocks_follow_one_another_and_tell_what_they_belong_to(recorder, keeper, clock):
    start(recorder)
    add(recorder, 1500, clock)
    recorder.stop()
    found = blocks(keeper)
    assert len(found) >= 3
    assert [block.sequence for block in found] == list(range(len(found)))
    assert {(block.ride, block.sample_hz, block.accel_lsb_per_g) for block in found} == {(7, 200, 4096)}
    assert found[0].time_us == pytest.approx(3_000_000, abs=1000)
    assert found[0].time_us % 1000 == 0
    assert times(keeper) == [found[0].time_us + TURN_US * (i + 1) for i in range(1500)]
    assert [block.time_us for block in found[1:]] == [block.turns[-1].time_us for block in found[:-1]]
    assert found[0].calibration().aligned


def test_a_ride_without_a_turn_has_no_block(recorder, keeper):
    start(recorder)
    assert recorder.active
    recorder.stop()
    assert not recorder.active
    assert keeper.steps == ["begin", "end"]
    recorder.stop()
    assert keeper.steps == ["begin", "end"]


def test_a_new_ride_ends_the_one_before(recorder, keeper):
    start(recorder)
    add(recorder, 3)
    start(recorder)
    assert keeper.steps[-2:] == ["end", "begin"]
    assert len(keeper.taken) == 1
    assert recorder.seconds() == 0


def test_a_turn_that_fills_a_block_waits_for_the_one_before(recorder, keeper):
    """Where flash was slower than the ride no block may be lost."""
    start(recorder)
    add(recorder, 1500, tick=False)
    recorder.stop()
    assert [block.sequence for block in blocks(keeper)] == list(range(len(keeper.taken)))
    assert len(times(keeper)) == 1500


@pytest.mark.parametrize(
    ("ms", "stops_interrupts", "stalled"), [(10, True, False), (12, True, True), (12, False, False)]
)
def test_a_write_of_over_10_ms_was_an_erase_of_the_flash(ms, stops_interrupts, stalled, recorder, keeper):
    keeper.slow_us = ms * 1000
    keeper.stops_interrupts = stops_interrupts
    start(recorder)
    assert not take_stall(recorder)
    while "write" not in keeper.steps:
        assert not take_stall(recorder)
        add(recorder, 1)
    assert take_stall(recorder) is stalled
    assert not take_stall(recorder)


@pytest.mark.parametrize("stops_interrupts", [True, False])
@pytest.mark.parametrize(("step", "fails"), [("begin", ""), ("begin", "begin"), ("abandon", "begin")])
def test_the_beginning_of_a_ride_may_erase_flash_also_one_that_fails(step, fails, stops_interrupts, recorder, keeper):
    keeper.stops_interrupts, keeper.fails = stops_interrupts, fails
    for ms, stalled in ((9, False), (12, True)):
        keeper.takes_ms = {step: ms}
        start(recorder)
        assert recorder.active is (not fails)
        assert take_stall(recorder) is (stalled and stops_interrupts)
        keeper.takes_ms = {}
        recorder.stop()
        take_stall(recorder)


def test_a_write_that_fails_may_have_erased_flash(recorder, keeper):
    start(recorder)
    keeper.fails, keeper.takes_ms = "write", {"abandon": 45}
    while recorder.active:
        assert not take_stall(recorder)
        add(recorder, 1)
    assert take_stall(recorder)


def test_the_end_of_a_ride_closes_a_file_and_may_erase_flash(recorder, keeper):
    for stops_interrupts in (True, False):
        keeper.stops_interrupts = stops_interrupts
        start(recorder)
        recorder.stop()
        assert take_stall(recorder) is stops_interrupts


@pytest.mark.parametrize(("waited_us", "step_us"), [(100_000, 500_001), (3_000_000, 3_000_000), (600_000_000, 1 << 29)])
def test_after_a_gap_the_time_is_the_clocks_and_more_than_half_a_second(waited_us, step_us, recorder, keeper, clock):
    start(recorder)
    add(recorder, 4, clock)
    recorder.mark_gap()
    clock.advance(waited_us)
    recorder.add([0, 0, 8192, 0, 0, 0, 0], 2, 1)
    add(recorder, 3, clock)
    recorder.stop()
    found = times(keeper)
    steps = [b - a for a, b in pairwise(found)]
    assert steps == [TURN_US] * 3 + [pytest.approx(step_us, abs=1000)] + [TURN_US] * 3
    assert steps[3] > 500_000


def test_a_gap_before_the_first_turn_is_none(recorder, keeper, clock):
    start(recorder)
    recorder.mark_gap()
    add(recorder, 2, clock)
    recorder.stop()
    assert times(keeper)[0] - blocks(keeper)[0].time_us == TURN_US


def test_a_gap_belongs_to_its_own_ride(recorder, keeper, clock):
    start(recorder)
    add(recorder, 2, clock)
    recorder.mark_gap()
    start(recorder)
    recorder.add_speed(500)
    start(recorder)
    add(recorder, 3, clock)
    recorder.stop()
    found = blocks(keeper)[-1].turns
    assert [b.time_us - a.time_us for a, b in pairwise(found)] == [TURN_US] * 2
    assert [turn.speed_mps for turn in found] == [None] * 3


def test_a_speed_goes_with_the_next_turn_alone(recorder, keeper):
    start(recorder)
    add(recorder, 1)
    recorder.add_speed(1200)
    recorder.add_speed(0)  # the newest one counts, a zero is one
    add(recorder, 2)
    recorder.add_speed(1234)
    add(recorder, 1)
    recorder.stop()
    assert [turn.speed_mps for turn in blocks(keeper)[0].turns] == [None, 0.0, None, 12.34]


def test_time_and_room(recorder, keeper):
    """A kilobyte a second, until it is known how many they are."""
    start(recorder)
    assert recorder.seconds() == 0
    assert recorder.room_s() == 1_000_000 // 1024
    add(recorder, 99)
    assert recorder.seconds() == 0
    add(recorder, 1)
    assert recorder.seconds() == 1
    while len(keeper.taken) < 3:
        add(recorder, 1)
    seconds = recorder.seconds()
    assert seconds > 2
    assert recorder.room_s() == 1_000_000 * seconds // (3 * 1024)
    keeper.free = 0
    assert recorder.room_s() == 0
    keeper.free = None
    assert recorder.room_s() is None


@pytest.mark.parametrize("step", ["begin", "ready", "write", "end_block", "end"])
@pytest.mark.parametrize("error", [OSError(5), MemoryError("no memory")])
def test_whatever_fails_ends_the_ride_once_with_one_notice(step, error, recorder, keeper):
    keeper.fails, keeper.error = step, error
    with contextlib.redirect_stdout(io.StringIO()) as said:
        start(recorder)
        for _ in range(1500):
            if recorder.active:
                add(recorder, 1)
        recorder.stop()
    assert not recorder.active
    assert keeper.steps.count("abandon") == 1
    assert said.getvalue().count("\n") == 1
    assert isinstance(recorder.problem, Notice)
    assert recorder.take_problem().values == (str(error),)
    assert recorder.take_problem() is None


def test_a_card_that_is_refused_says_so_itself(recorder, keeper):
    keeper.fails, keeper.error = "begin", CardError("no-card", "no SD card")
    with contextlib.redirect_stdout(io.StringIO()):
        start(recorder)
    assert not recorder.active
    assert recorder.problem is keeper.error
    assert keeper.steps == ["begin"]


def some_turns(count):
    """Turns that are the same in any version of Python."""
    for i in range(count):
        n = (2, 2, 3, 1, 8, 2)[i % 6]
        yield [n * (i * k * 7919 % 4001 - 2000) for k in range(1, 8)], n, n * 5000 + i * 37 % 400 - 200


FORMAT_1 = 1672459265  # the check sum of what the test below writes


def test_the_bytes_of_a_block_are_those_of_format_1(monkeypatch):
    """Rides that were recorded by an older firmware have to be readable: whoever changes these bytes has to change the
    format's number, and to keep a reader for the old ones."""
    monkeypatch.setattr(block_format, "__version__", "0.0.0")
    block = RideBlock(5000)
    block.begin(4092, 7, 3, 123456789012, ride_writer.CHIP, 200, bytes(range(80)))
    assert block_format.BODY_LENGTH == 80
    for i, turn in enumerate(some_turns(120)):
        if i % 10 == 0:
            block.add_speed(i * 13)
        block.add(*turn)
    block.add([32767] * 7, 1, 1)
    block.add([-32768] * 7, 1, 1 << 29)
    for turn in some_turns(6):
        block.add(*turn)
    block.close()
    data = bytes(block.buffer[:4092])
    assert (data[:4], data[4:6], data[6:8]) == (b"KRID", b"\1\0", (4092).to_bytes(2, "little"))
    assert block.count == 120 + 12 + 8
    assert crc32(data[:-4]) == int.from_bytes(data[-4:], "little") == FORMAT_1


def test_a_block_takes_what_fits_and_the_worst_turn_always_does():
    """A turn and a speed of the longest codes: 12 ones and 31 bits for each of the ten numbers, 54 bytes."""
    body = bytes(80)
    for length in (512, 700):
        block = RideBlock(5000)
        block.begin(length, 1, 0, 0, ride_writer.CHIP, 200, body)
        assert not block.full()
        sign = 1
        written = 0
        while not block.full():
            sign = -sign
            block.add_speed((1 << 24) * (sign > 0))
            block.add([sign * 8 * 32767] * 7, 8, (1 << 29) if sign > 0 else 0)
            written += 1
        block.close()
        found = block_reader.parse(bytes(block.buffer[:length]))
        assert len(found.turns) == written > 3
        assert found.turns[-1].sums == (sign * 8 * 32767,) * 6
        data = bytes(block.buffer[: length - 6])
        assert len(data) - len(data.rstrip(b"\0")) < 60


def quiet(length, count=0):
    """A block of turns that do not differ, so that each takes few bits: so many, or until it is full."""
    block = RideBlock(5000)
    block.begin(length, 1, 0, 0, ride_writer.CHIP, 200, bytes(80))
    while block.count < count or (not count and not block.full()):
        block.add([800] * 7, 8, 40_000)
    return block


@pytest.mark.parametrize("length", range(700, 704))
def test_however_full_a_block_is_the_worst_turn_fits(length):
    """After quiet turns every number of a violent one takes the longest code."""
    count = quiet(length).count
    block = quiet(length, count - 1)
    assert not block.full()
    block.add_speed(1 << 24)
    block.add([-32768] * 7, 1, 1 << 29)
    assert block.full()
    block.close()
    found = block_reader.parse(bytes(block.buffer[:length])).turns
    assert len(found) == count > 100  # so that the codes became short
    assert (found[-1].sums, found[-1].n, found[-1].speed_mps) == ((-32768,) * 6, 1, (1 << 24) / 100)
    assert found[-1].time_us == (count - 1) * 40_000 + (1 << 29)
    assert {turn.sums for turn in found[:-1]} == {(800,) * 6}


@pytest.mark.parametrize("count", range(1, 17))
def test_a_block_may_end_within_any_byte(count):
    block = RideBlock(5000)
    block.begin(1024, 1, 0, 0, ride_writer.CHIP, 200, bytes(80))
    for turn in some_turns(count):
        block.add(*turn)
    block.close()
    found = block_reader.parse(bytes(block.buffer[:1024])).turns
    assert [(turn.sums, turn.n) for turn in found] == [((*s[:3], *s[4:]), n) for s, n, _ in some_turns(count)]


def test_a_block_begins_without_anything_of_the_one_before():
    """Each can be read without the others. What is left of a longer one is overwritten with zeros."""
    first, again = RideBlock(5000), RideBlock(5000)
    first.begin(4096, 1, 0, 0, ride_writer.CHIP, 200, bytes(80))
    for turn in some_turns(150):
        first.add_speed(900)
        first.add(*turn)
    first.close()
    for block in (first, again):
        block.begin(1024, 1, 1, 55, ride_writer.CHIP, 200, bytes(80))
        for turn in some_turns(5):
            block.add(*turn)
        block.close()
    assert first.buffer[:1024] == again.buffer[:1024]
    assert first.count == again.count == 5


def test_the_temperature_is_that_of_the_last_turns_mean():
    chip = types.SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=16.4, gyro_delay_s=0.0186)
    chip.temperature_c = lambda counts: counts / 4
    block = RideBlock(5000)
    block.begin(1024, 1, 0, 0, chip, 200, bytes(80))
    block.add([0, 0, 0, 900, 0, 0, 0], 3, 15_000)
    block.add([0, 0, 0, -303, 0, 0, 0], 3, 15_000)
    block.close()
    found = block_reader.parse(bytes(block.buffer[:1024]))
    assert found.centidegrees == -2525
    assert found.gyro_lsb_tenths == 164
    assert found.delay_tenths_ms == 186


@pytest.mark.parametrize("index", [1, 2, 3, 4, 6, 8, 96, 1 << 12])
def test_a_block_of_littlefs_begins_with_a_pointer_for_each_halving(index):
    pointers = 1 + max(k for k in range(20) if index % (1 << k) == 0)
    assert block_length(index) == 4096 - 4 * pointers
    assert block_length(0) == 4096


FLASH = types.SimpleNamespace(SD_SPI=None)
CARD = types.SimpleNamespace(SD_SPI=1)
KB_4 = 4096


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A directory that stands for flash, of which space.free bytes of space.all are free."""
    space = types.SimpleNamespace(free=400 * KB_4, all=500 * KB_4, path=tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(flash_ring, "free_bytes", lambda _path: space.free)
    monkeypatch.setattr(flash_ring, "all_bytes", lambda _path: space.all)
    monkeypatch.setattr("os.ilistdir", fake_os.ilistdir, raising=False)
    monkeypatch.setattr(ride_paths, "directory", lambda settings: "rides" if settings is FLASH else "card")
    return space


def write_block(ring, size=100):
    steps = 0
    while not ring.ready():
        steps += 1
    ring.write(b"x" * size)
    ring.end_block()
    return steps


@pytest.mark.parametrize(("settings", "blocks"), [(FLASH, 16), (CARD, 256)])
def test_a_part_has_16_blocks_in_flash_and_256_on_a_card(settings, blocks, root):
    root.free = root.all = 2000 * KB_4
    ring = RideRing(settings)
    assert ring.stops_interrupts is (settings is FLASH)
    assert ring.needed == (40 + blocks + 2) * KB_4
    ring.begin()
    lengths = []
    for _ in range(2 * blocks + 1):
        lengths.append(ring.next_length())
        write_block(ring)
    ring.end()
    assert lengths == [block_length(i) for i in range(blocks)] * 2 + [KB_4]
    sizes = {part: size for _, part, size in ride_paths.parts("rides" if settings is FLASH else "card")}
    assert sizes == {0: 100 * blocks, 1: 100 * blocks, 2: 100}


def test_the_room_is_what_is_free_and_what_older_rides_have(root):
    """Of the flash, 80 blocks are taken for firmware; 40, a part and two more always stay free."""
    ring = RideRing(FLASH)
    ring.begin()
    assert ring.room() == (400 + (500 - 400 - 80) - 58) * KB_4
    write_block(ring)
    assert ring.room() == (400 + 20 - 58 - 1) * KB_4
    root.free = 430 * KB_4  # less is taken than by firmware alone
    ring.begin()
    assert ring.room() == (430 - 58) * KB_4
    root.free = 50 * KB_4
    root.all = 130 * KB_4
    ring.begin()
    assert ring.room() == 0


def old_ride(root, ride, parts=1, size=KB_4):
    directory = root.path / ride_paths.ride_path("rides", ride)
    directory.mkdir(parents=True, exist_ok=True)
    for part in range(parts):
        (root.path / ride_paths.part_path("rides", ride, part)).write_bytes(bytes(size))
    return directory


def test_room_is_made_exactly_when_a_part_does_not_fit(root):
    for free, steps in ((58 * KB_4, 1), (58 * KB_4 - 1, 3)):
        old = old_ride(root, 1)
        root.free = free
        ring = RideRing(FLASH)
        assert ring.begin() > 1
        assert write_block(ring) == steps  # the oldest is found, its part is removed, the new one is opened
        assert (old / "00000.rid").exists() is (steps == 1)
        ring.end()


def test_removed_parts_count_as_free_and_no_longer_as_room(root):
    old_ride(root, 1, parts=2, size=3 * KB_4)
    root.free, root.all = 54 * KB_4, 200 * KB_4
    ring = RideRing(FLASH)
    ring.begin()
    room = ring.room()
    assert room == (54 + (200 - 54 - 80) - 58) * KB_4
    assert write_block(ring) == 4
    assert ring.room() == room - KB_4
    assert list(ride_paths.parts("rides")) == [(2, 0, 100)]


def test_its_own_first_parts_go_last_and_then_there_is_no_room(root):
    root.free = 58 * KB_4
    old_ride(root, 1)
    ring = RideRing(FLASH)
    assert ring.begin() == 2
    for _ in range(16):
        write_block(ring, KB_4)
    assert sorted(ride_paths.parts("rides")) == [(1, 0, KB_4), (2, 0, 16 * KB_4)]
    rooms = [ring.room()]
    while not ring.ready():
        root.free = 43 * KB_4
        rooms.append(ring.room())
    # ride 1 is found, its part is removed, its directory too, ride 2 is found, its part is removed, the next is opened
    assert [room > 0 for room in rooms] == [True] * 5 + [False] * 2
    assert [part for part in ride_paths.parts("rides") if part[1] == 0] == []
    assert not (root.path / "rides/000/01").exists()


def test_the_oldest_go_ride_by_ride_and_group_by_group(root):
    """One step removes one thing. What has no parts left is passed over, and what the owner put there stays."""
    for ride in (98, 99, 100, 300):
        old_ride(root, ride)
    (root.path / "rides/000/98/notes.txt").write_bytes(b"the rider's own")
    (root.path / "rides/001/notes.txt").write_bytes(b"the rider's own")
    (root.path / "rides/002").mkdir()
    (root.path / "rides/000/00").mkdir()
    root.free = 10 * KB_4
    ring = RideRing(FLASH)
    assert ring.begin() == 301

    def left():
        return sorted(path.relative_to("rides").as_posix() for path in Path("rides").rglob("*"))

    gone, before = [], left()
    with pytest.raises(OSError):
        for _ in range(50):
            assert not ring.ready()
            now = left()
            gone.append([path for path in before if path not in now])
            before = now
    assert all(len(paths) <= 1 for paths in gone)
    assert [path for paths in gone for path in paths] == [
        "000/00",
        "000/98/00000.rid",
        "000/99/00000.rid",
        "000/99",
        "001/00/00000.rid",
        "001/00",
        "002",
        "003/00/00000.rid",
        "003/00",
    ]
    assert before == ["000", "000/98", "000/98/notes.txt", "001", "001/notes.txt", "003", "003/01"]
    # ride 0 found and removed; of each other found, its part and its directory removed; groups 1 and 2 found empty; the
    # ride itself found
    assert len(gone) == 2 + 4 * 3 + 2 + 1


def test_where_somebody_has_removed_the_ride_there_is_no_room(root):
    root.free = 0
    ring = RideRing(FLASH)
    ring.begin()
    shutil.rmtree("rides/000")
    with pytest.raises(OSError) as error:
        ring.ready()
    assert ring.fault_code(error.value) == "out-of-room"


def test_a_flash_without_rides_to_remove_is_full(root):
    root.free = 57 * KB_4
    ring = RideRing(FLASH)
    ring.begin()
    with pytest.raises(OSError) as error:
        for _ in range(10):
            assert not ring.ready()
    assert error.value.args[0] == 28
    assert not list((root.path / "rides").rglob("*.rid"))


class File:
    """An open file. short: by how much each write falls short. closed: how often it was."""

    def __init__(self, short=0, error=None):
        self.short, self.error, self.closed = short, error, 0

    def write(self, piece):
        return len(piece) - self.short

    def close(self):
        self.closed += 1
        if self.error:
            raise self.error


def begun(file, monkeypatch):
    """A ring whose first part is this file."""
    monkeypatch.setattr(flash_ring, "open", lambda path, mode: file, raising=False)
    ring = RideRing(FLASH)
    ring.begin()
    while not ring.ready():
        pass
    return ring


def test_a_write_that_is_cut_short_says_that_there_is_no_room(root, monkeypatch):
    begun(File(), monkeypatch).write(b"abc")
    ring = begun(File(short=1), monkeypatch)
    with pytest.raises(OSError) as error:
        ring.write(b"abc")
    assert ring.fault_code(error.value) == "out-of-room"


def test_faults_have_their_codes():
    for settings, code in ((FLASH, "flash-fault"), (CARD, "card-fault")):
        ring = RideRing(settings)
        assert ring.fault_code(OSError(5)) == code
        assert ring.fault_code(OSError()) == code
        assert ring.fault_code(OSError(28)) == "out-of-room"
        assert ring.fault_code(MemoryError()) == "out-of-memory"


def test_ending_closes_once_and_abandoning_raises_nothing(root, monkeypatch):
    RideRing(FLASH).end()  # there is nothing to close
    file = File(error=OSError(5))
    ring = begun(file, monkeypatch)
    ring.abandon()
    ring.abandon()
    assert file.closed == 1
    with pytest.raises(OSError):
        begun(file, monkeypatch).end()


def test_a_directory_that_cannot_be_made_ends_in_its_error(root, monkeypatch):
    def refuse(path):
        raise OSError(30)

    RideRing(FLASH).begin()  # it is there now
    assert RideRing(FLASH).begin() == 1  # and empty: the same ride again
    monkeypatch.setattr("os.mkdir", refuse)
    with pytest.raises(OSError, match="30"):
        RideRing(FLASH).begin()


def test_free_and_all_bytes_are_blocks_of_the_size_that_counts(monkeypatch):
    """Of statvfs: block size, fragment size (in which blocks are counted), all, free."""
    monkeypatch.setattr("os.statvfs", lambda path: (512, 4096, 300, 200, 190, 0, 0, 0, 0, 255), raising=False)
    assert flash_ring.free_bytes("") == 200 * 4096
    assert flash_ring.all_bytes("") == 300 * 4096


def test_a_part_has_its_place():
    assert ride_paths.RIDES_IN_GROUP == 100
    assert ride_paths.group_path("rides", 3) == "rides/003"
    assert ride_paths.ride_path("rides", 345) == "rides/003/45"
    assert ride_paths.part_path("rides", 345, 2) == "rides/003/45/00002.rid"


def test_only_what_is_named_as_a_part_is_one(root):
    old_ride(root, 345, parts=3)
    old_ride(root, 307)
    (root.path / "rides/003/45/00003.rid").mkdir()
    for name in ("00004.txt", "0005.rid", "000006.rid", "0000x.rid"):
        (root.path / "rides/003/45" / name).write_bytes(b"x")
    (root.path / "rides/003/46").write_bytes(b"x")
    (root.path / "rides/003/1").mkdir()
    (root.path / "rides/03").mkdir()
    assert sorted(ride_paths.parts("rides")) == [(307, 0, KB_4)] + [(345, i, KB_4) for i in range(3)]
    assert sorted(ride_paths.rides("rides", 3)) == [307, 345]
    assert list(ride_paths.groups("rides")) == [3]
    assert ride_paths.first_part("rides/003/45") == (0, KB_4)
    os.remove("rides/003/45/00000.rid")
    assert ride_paths.first_part("rides/003/45") == (1, KB_4)
    assert ride_paths.newest_ride("rides") == 345


def test_numbers_of_rides_go_on(root):
    Path("rides").mkdir()
    assert ride_paths.newest_ride("rides") == 0
    (root.path / "rides/002").mkdir()
    assert ride_paths.newest_ride("rides") == 200
    old_ride(root, 99)
    ring = RideRing(FLASH)
    assert ring.begin() == 200
    write_block(ring)
    assert ring.begin() == 201


def test_the_stream_is_base64_in_lines_and_a_point_after_each_block(clock):
    from kickstand.rides.usb_stream import RideStream

    stream = RideStream()
    assert not stream.stops_interrupts
    assert stream.begin() == 0
    assert stream.next_length() == stream.next_length() == 512
    assert stream.room() is None
    assert stream.ready() is True
    with contextlib.redirect_stdout(io.StringIO()) as said:
        stream.write(b"abc" * 50)
        stream.write(b"\0\xff")
        stream.end_block()
        stream.write(b"x")
        stream.end()
        stream.abandon()
    lines = said.getvalue().split("\n")
    assert [a2b_base64(line) for line in (lines[0], lines[1], lines[3])] == [b"abc" * 50, b"\0\xff", b"x"]
    assert lines[2] == "."
    assert lines[4:] == [""]
    assert stream.fault_code(OSError(5)) == "usb-fault"


def tried(root, monkeypatch, **failing):
    """The problem that the trial of a card finds. failing: what raises which error."""
    from kickstand.rides import card_trial

    def raised(error):
        def call(*_):
            raise error

        return call

    if "mount" in failing:
        monkeypatch.setattr(ride_paths, "directory", raised(failing["mount"]))
    if "free" in failing:
        monkeypatch.setattr(flash_ring, "free_bytes", raised(failing["free"]))
    recorder = types.SimpleNamespace(problem=None, keeper=types.SimpleNamespace(refused=None))
    with contextlib.redirect_stdout(io.StringIO()) as said:
        card_trial.prepare(recorder, CARD)
    assert recorder.problem is recorder.keeper.refused
    assert said.getvalue().count("\n") == (recorder.problem is not None)
    return recorder.problem


def test_a_card_is_tried_out_before_it_is_needed(root, monkeypatch):
    assert tried(root, monkeypatch) is None
    assert os.listdir("card") == []  # what was written is gone


def test_whatever_a_card_does_in_the_trial_is_its_own_refusal(root, monkeypatch):
    refusal = CardError("no-driver")
    with monkeypatch.context() as patch:
        assert tried(root, patch, mount=refusal) is refusal
    for error in (OSError(5), ValueError("a driver's own"), MemoryError()):
        with monkeypatch.context() as patch:
            problem = tried(root, patch, free=error)
        assert isinstance(problem, CardError)
        assert problem.code == "no-card"
        assert problem.values == (str(error),)


def test_a_card_that_reads_other_than_it_was_written_is_refused(root, monkeypatch):
    from kickstand.rides import card_trial

    class Wrong(io.BytesIO):
        def read(self, *_):
            return b"something"

    monkeypatch.setattr(card_trial, "open", lambda path, mode: Wrong(), raising=False)
    assert tried(root, monkeypatch).code == "no-card"


def test_rides_are_in_flash_without_a_card_and_else_on_it(clock, monkeypatch):
    monkeypatch.setitem(sys.modules, "machine", fake_machine)
    from kickstand.board import sd_card

    monkeypatch.setattr(sd_card, "mount", lambda settings: "/sd")
    assert ride_paths.directory(FLASH) == "rides"
    assert ride_paths.directory(CARD) == "/sd/rides"


def test_the_second_slow_print_within_a_minute_ends_the_stream(clock, monkeypatch):
    from kickstand.rides import usb_stream

    slow = []
    monkeypatch.setattr(usb_stream, "say", lambda text, end: slow.pop(0))
    stream = usb_stream.RideStream()
    stream.begin()
    slow += [False, True, False]
    for _ in range(3):
        stream.write(b"x")
    clock.advance(60_100_000)
    slow += [True]
    stream.end_block()
    clock.advance(59_000_000)
    slow += [True]
    with pytest.raises(OSError):
        stream.write(b"x")
    stream.begin()  # a new ride begins anew
    slow += [True]
    stream.write(b"x")
