"""The recorder writes the passes of the loop to the ring of rides: order, times, gaps, positions, and a failure."""

import contextlib
import io
import itertools
from itertools import pairwise

import pytest
from kickstand.errors import Notice
from kickstand.rides import ride_files
from kickstand_tools.rides import ride_log
from rings import FLASH, ride_ring
from support.recordings import ride_writer

TURN_US = 10_000


@pytest.fixture
def notices():
    """The notices of the recorder."""
    return []


@pytest.fixture
def recorder(notices, clock, root):
    from kickstand.rides.recorder import Recorder  # needs the clock of the board

    return Recorder(ride_ring(FLASH), 200, notices)


def start(recorder):
    recorder.start(ride_writer.CHIP, ride_writer.calibration())


def add(recorder, turns, clock):
    """Add `turns` passes of the loop of 10 ms, with the same two samples in each pass."""
    for _ in range(turns):
        clock.advance(TURN_US)
        recorder.add([200, -100, 8192, 60, 4, -4, 8], 2, TURN_US)
        recorder.tick()


def stored(root):
    """Return the blocks of all rides in flash, and their passes."""
    parts = [path.read_bytes() for path in sorted(root.path.rglob("*.rid"))]
    blocks, problems = ride_log.read(b"".join(parts))
    assert problems == [] and all(parts)
    return blocks, [turn for block in blocks for turn in block.turns]


@pytest.mark.parametrize(("tick", "writes"), [(True, 0), (False, 0), (True, -1), (True, 1), (True, 17), (True, 30)])
def test_all_blocks_have_their_ride_and_sequence(tick, writes, recorder, root, clock, monkeypatch):
    """No block may be lost if the flash is slower than the ride, without tick(), or after Ctrl-C.

    writes: number of writes before Ctrl-C. 0 is without Ctrl-C, and -1 is Ctrl-C when the first file is opened.
    """
    count, write, ends_us = itertools.count(1), ride_files.RideFiles.write, []

    def interrupted(*arguments):
        write(*arguments)
        if next(count) == writes:
            raise KeyboardInterrupt

    def opened(*arguments):
        if writes < 0 and next(count) == 1:
            open(*arguments).close()
            raise KeyboardInterrupt
        return open(*arguments)

    monkeypatch.setattr(ride_files.RideFiles, "write", interrupted)
    monkeypatch.setattr(ride_files, "open", opened, raising=False)
    start(recorder)
    with contextlib.suppress(KeyboardInterrupt):
        for entry in ride_writer.turns(1200):
            recorder.add(*entry)
            ends_us.append((ends_us or [0])[-1] + entry[-1])
            if tick:
                recorder.tick()
    assert recorder.seconds() == ends_us[-1] // 1_000_000 and (writes or len(ends_us) == 1200)
    recorder.stop()
    blocks, turns = stored(root)
    assert [block.sequence for block in blocks] == list(range(len(blocks))) and (len(blocks) >= 2 or writes < 0)
    assert {(block.ride, block.sample_hz, block.accel_lsb_per_g) for block in blocks} == {(1, 200, 4096)}
    assert blocks[0].time_us == pytest.approx(3_000_000, abs=1000) and blocks[0].calibration().aligned
    assert [turn.time_us - blocks[0].time_us for turn in turns] == ends_us


def test_the_loops_numbers_stay_small_in_a_day(recorder, clock):
    """An integer of over 30 bits would take heap in each pass."""
    clock.advance(86_400_000_000)
    start(recorder)
    add(recorder, 3, clock)
    assert max(number for number in vars(recorder).values() if isinstance(number, int)) < 1 << 30


@pytest.mark.parametrize(("waited_us", "step_us"), [(100_000, 500_001), (3_000_000, 3_000_000), (600_000_000, 1 << 29)])
def test_after_a_gap_the_recorded_time_is_over_half_a_second(waited_us, step_us, recorder, root, clock):
    start(recorder)
    add(recorder, 4, clock)
    recorder.mark_gap()
    clock.advance(waited_us)
    recorder.add([0, 0, 8192, 0, 0, 0, 0], 2, 1)
    add(recorder, 3, clock)
    recorder.stop()
    steps = [later.time_us - earlier.time_us for earlier, later in pairwise(stored(root)[1])]
    assert steps == [TURN_US] * 3 + [pytest.approx(step_us, abs=1000)] + [TURN_US] * 3 and steps[3] > 500_000


@pytest.mark.parametrize("code", ["flash-fault", "out-of-room"])
def test_failure_ends_the_ride_once_with_one_notice(code, recorder, notices, root, clock):
    """A file in the place of the directory of rides stops the beginning, a full flash the first block."""
    free = root.free
    if code == "flash-fault":
        (root.path / "rides").write_text("a file")
    root.free = 0
    with contextlib.redirect_stdout(io.StringIO()) as console:
        start(recorder)
        for _ in range(3000):
            if recorder.active:
                add(recorder, 1, clock)
        recorder.stop()
    assert not recorder.active and console.getvalue().count("\n") == 1
    (notice,) = notices
    assert isinstance(notice, Notice) and notice.code == code
    (root.path / "rides").unlink() if code == "flash-fault" else None
    root.free = free  # the flash works again, so the next ride is recorded
    start(recorder)
    add(recorder, 3, clock)
    recorder.stop()
    assert len(notices) == 1 and len(stored(root)[1]) == 3
