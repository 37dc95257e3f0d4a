"""Tests the limits of the recorder with a fake writer."""

import contextlib
import io
from itertools import pairwise
from types import SimpleNamespace

import pytest
from kickstand.errors import CardError, Notice
from kickstand_tools.rides import block_reader
from support.recordings import ride_writer

TURN_US = 10_000


class Keeper:
    """Replaces a RideRing.

    steps: names of the calls so far.
    taken: the complete blocks.
    takes_ms: {name of a step: its duration in ms}.
    fails: the name of the step that raises `error`.
    """

    stops_interrupts = True
    fails = ""
    error: Exception = OSError(5)

    def __init__(self, clock, length=1024):
        self.clock, self.length = clock, length
        self.steps, self.taken, self.begun = [], [], b""
        self.takes_ms = {}
        self.is_ready, self.free = True, 1_000_000

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
def keeper(clock):
    return Keeper(clock)


@pytest.fixture
def recorder(clock, keeper):
    from kickstand.rides.recorder import Recorder

    return Recorder(keeper, 200)


def take_stall(recorder):
    """Return and reset the recorder's mark of a stall, as the app does."""
    stalled, recorder.stalled = recorder.stalled, False
    return stalled


def start(recorder):
    recorder.start(ride_writer.CHIP, ride_writer.calibration())


def add(recorder, turns, clock=None, tick=True):
    """Add `turns` passes of the loop of 10 ms, with the same two samples in each pass."""
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


def test_a_ride_after_an_alignment_begins_like_its_replay(keeper):
    """After an alignment the meter knows that the bike is upright, but a replay does not know it. So the meter restarts
    without knowing that the bike is upright."""
    from kickstand.rides.recording import Recording

    settings = SimpleNamespace(SD_SPI=None, RECORD=True, SAMPLE_HZ=200)

    class Calibration:
        value = ride_writer.calibration()

        def restart(self):
            keeper.steps.append("restart")

    recording = Recording(settings, ride_writer.CHIP, None, Calibration(), keeper)
    recording.calibration_changed()
    assert keeper.steps == []  # no ride is being recorded
    start(recording.recorder)
    recording.calibration_changed()
    assert keeper.steps == ["begin", "restart", "end", "begin"]


def test_the_second_start_reuses_the_recorder(root, clock):
    """A recording also starts if the menu was closed before the recording was prepared."""
    from kickstand.rides.recording import Recording

    settings = SimpleNamespace(SD_SPI=None, RECORD=False, SAMPLE_HZ=200)
    calibration = SimpleNamespace(value=ride_writer.calibration())
    recording = Recording(settings, ride_writer.CHIP, SimpleNamespace(at_rest=False), calibration)
    assert not recording.recorder.active
    assert recording.start() is None
    made = recording.recorder
    assert made.active
    recording.stop()
    assert not made.active
    assert recording.start() is None
    assert recording.recorder is made and made.active


def test_a_block_is_written_256_bytes_per_turn(recorder, keeper):
    keeper.length = 700
    start(recorder)
    while "write" not in keeper.steps:
        add(recorder, 1)
    keeper.steps.clear()
    written = [len(keeper.begun)]
    while not keeper.taken:
        before = len(keeper.steps)
        add(recorder, 1)
        assert len(keeper.steps) == before + 2  # the recorder called ready() and did one other step
        written.append(len(keeper.begun))
    assert written == [256, 512, 700, 0]
    assert [len(data) for data in keeper.taken] == [700]
    before = len(keeper.steps)
    recorder.tick()
    assert len(keeper.steps) == before  # tick() does nothing, because no block waits to be written


def test_all_blocks_have_their_ride_and_sequence(recorder, keeper, clock):
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


def test_a_turn_that_fills_a_block_waits_for_the_previous_one(recorder, keeper):
    """If the flash is slower than the ride, no block may be lost."""
    start(recorder)
    add(recorder, 1500, tick=False)
    recorder.stop()
    assert [block.sequence for block in blocks(keeper)] == list(range(len(keeper.taken)))
    assert len(times(keeper)) == 1500


@pytest.mark.parametrize("stops_interrupts", [True, False])
@pytest.mark.parametrize(("ms", "slow"), [(9, False), (12, True)])
@pytest.mark.parametrize(("step", "fails"), [("begin", ""), ("begin", "begin"), ("abandon", "begin"), ("write", "")])
def test_a_step_of_over_10_ms_was_an_erase_of_the_flash(step, fails, ms, slow, stops_interrupts, recorder, keeper):
    """The recorder reports the erase even if the ride could not begin."""
    keeper.stops_interrupts, keeper.fails = stops_interrupts, fails
    keeper.takes_ms = {step: ms}
    start(recorder)
    assert recorder.active is (not fails)
    while step not in keeper.steps:
        assert not take_stall(recorder)
        add(recorder, 1)
    assert take_stall(recorder) is (slow and stops_interrupts)
    assert not take_stall(recorder)


@pytest.mark.parametrize("stops_interrupts", [True, False])
def test_the_end_of_a_ride_closes_a_file_and_may_erase_flash(stops_interrupts, recorder, keeper):
    keeper.stops_interrupts = stops_interrupts
    start(recorder)
    recorder.stop()
    assert take_stall(recorder) is stops_interrupts


@pytest.mark.parametrize(("waited_us", "step_us"), [(100_000, 500_001), (3_000_000, 3_000_000), (600_000_000, 1 << 29)])
def test_after_a_gap_the_recorded_time_is_over_half_a_second(waited_us, step_us, recorder, keeper, clock):
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


def test_a_gap_belongs_to_its_own_ride(recorder, keeper, clock):
    start(recorder)
    add(recorder, 2, clock)
    recorder.mark_gap()
    start(recorder)
    recorder.add_fix(5.0, None)
    start(recorder)
    add(recorder, 3, clock)
    recorder.stop()
    found = blocks(keeper)[-1].turns
    assert [b.time_us - a.time_us for a, b in pairwise(found)] == [TURN_US] * 2
    assert [turn.speed_mps for turn in found] == [None] * 3


def test_a_position_and_a_speed_belong_to_the_next_turn_only(recorder, keeper):
    """A pass of the loop may have a position without a speed, or a speed without a position. Zero is a valid speed."""
    start(recorder)
    recorder.add_fix(None, ride_writer.place(0))
    recorder.add_fix(None, ride_writer.place(1))  # the newest position is recorded
    add(recorder, 2)
    recorder.add_fix(5.0, None)
    recorder.add_fix(0.0, None)
    add(recorder, 1)
    recorder.add_fix(6.0, ride_writer.place(2))
    add(recorder, 1)
    recorder.add_fix(None, ride_writer.place(3))
    start(recorder)
    add(recorder, 1)
    recorder.stop()
    first, second = blocks(keeper)
    hundredths = [turn.place and turn.place.utc_s and round(100 * turn.place.utc_s % 100) for turn in first.turns]
    assert hundredths == [20, None, None, 30]
    assert [turn.speed_mps for turn in first.turns] == [None, None, 0.0, 6.0]
    assert [turn.place for turn in second.turns] == [None]


def test_time_and_room(recorder, keeper):
    """Until the recorder has measured its first block, it assumes a kilobyte per second."""
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
    keeper.fails = ""  # the flash works again, so the next ride is recorded
    start(recorder)
    add(recorder, 3)
    recorder.stop()
    assert recorder.problem is None
    assert len(blocks(keeper)[-1].turns) == 3


def test_a_refused_card_has_its_own_message(recorder, keeper):
    keeper.fails, keeper.error = "begin", CardError("no-card", "no SD card")
    with contextlib.redirect_stdout(io.StringIO()):
        start(recorder)
    assert not recorder.active
    assert recorder.problem is keeper.error
    assert keeper.steps == ["begin"]


def test_a_new_ride_ends_the_previous_one(recorder, keeper):
    start(recorder)
    add(recorder, 3)
    start(recorder)
    assert keeper.steps[-2:] == ["end", "begin"]
    assert len(keeper.taken) == 1
    assert recorder.seconds() == 0


def test_a_writer_that_is_not_ready_is_asked_in_the_next_turn(recorder, keeper):
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
