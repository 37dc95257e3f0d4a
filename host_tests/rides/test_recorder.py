"""The recorder: blocks of a ride in small steps, gaps, times, and what happens if writing fails."""

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
    """A writer of blocks, as RideRing and RideStream are.

    steps: names of the calls so far.
    blocks: the complete blocks.
    takes_ms: {name of a step: its duration in ms}.
    fails: the name of the step that raises `error`.
    """

    stops_interrupts = True
    fails = ""
    error: Exception = OSError(5)
    is_ready, free, length = True, 1_000_000, 1024

    def __init__(self, clock):
        self.clock, self.steps, self.blocks, self.begun, self.takes_ms = clock, [], [], b"", {}

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
        self.blocks.append(self.begun)
        self.begun = b""

    def end(self):
        self._step("end")

    def abandon(self):
        self._step("abandon")

    def fault_code(self, error):
        return "flash-fault"

    def read(self):
        """Return the complete blocks as the tools read them."""
        blocks, problems = block_reader.read(b"".join(self.blocks))
        assert problems == []
        return blocks

    def turns(self):
        return [turn for block in self.read() for turn in block.turns]


@pytest.fixture
def keeper(clock):
    return Keeper(clock)


@pytest.fixture
def recorder(keeper):
    from kickstand.rides.recorder import Recorder  # needs the clock of the board

    return Recorder(keeper, 200)


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


def stalled(recorder):
    """Return and reset the recorder's mark of a stall, as the app does."""
    mark, recorder.stalled = recorder.stalled, False
    return mark


def test_block_is_written_256_bytes_per_pass(recorder, keeper):
    keeper.length = 700
    start(recorder)
    while "write" not in keeper.steps:
        add(recorder, 1)
    keeper.steps.clear()
    written = [len(keeper.begun)]
    while not keeper.blocks:
        count = len(keeper.steps)
        add(recorder, 1)
        assert len(keeper.steps) == count + 2  # the recorder called ready() and did one other step
        written.append(len(keeper.begun))
    assert written == [256, 512, 700, 0] and [len(data) for data in keeper.blocks] == [700]
    count = len(keeper.steps)
    recorder.tick()
    assert len(keeper.steps) == count  # tick() does nothing, because no block waits to be written


@pytest.mark.parametrize("tick", [True, False])
def test_all_blocks_have_their_ride_and_sequence(tick, recorder, keeper, clock):
    """Without tick() the flash is slower than the ride. No block may be lost."""
    start(recorder)
    add(recorder, 1500, clock, tick)
    recorder.stop()
    blocks = keeper.read()
    assert [block.sequence for block in blocks] == list(range(len(blocks))) and len(blocks) >= 3
    assert {(block.ride, block.sample_hz, block.accel_lsb_per_g) for block in blocks} == {(7, 200, 4096)}
    assert blocks[0].time_us == pytest.approx(3_000_000, abs=1000) and blocks[0].time_us % 1000 == 0
    assert [turn.time_us for turn in keeper.turns()] == [blocks[0].time_us + TURN_US * (i + 1) for i in range(1500)]
    assert [block.time_us for block in blocks[1:]] == [block.turns[-1].time_us for block in blocks[:-1]]
    assert blocks[0].calibration().aligned


def test_writer_that_is_not_ready_is_asked_in_the_next_pass(recorder, keeper):
    start(recorder)
    keeper.is_ready = False
    while "ready" not in keeper.steps:
        add(recorder, 1)
    add(recorder, 5)
    assert keeper.steps.count("ready") == 6 and "write" not in keeper.steps
    keeper.is_ready = True
    add(recorder, 5)
    assert len(keeper.blocks) == 1


@pytest.mark.parametrize("stops_interrupts", [True, False])
@pytest.mark.parametrize(
    ("step", "fails", "ms", "slow"),
    [("begin", "", 9, False), ("begin", "", 12, True), ("begin", "begin", 12, True), ("abandon", "begin", 12, True),
     ("write", "", 9, False), ("write", "", 12, True)],
)  # fmt: skip
def test_step_of_over_10_ms_was_an_erase_of_the_flash(step, fails, ms, slow, stops_interrupts, recorder, keeper):
    """The recorder reports the erase even if the ride could not begin."""
    keeper.stops_interrupts, keeper.fails = stops_interrupts, fails
    keeper.takes_ms = {step: ms}
    start(recorder)
    assert recorder.active is (not fails)
    while step not in keeper.steps:
        assert not stalled(recorder)
        add(recorder, 1)
    assert stalled(recorder) is (slow and stops_interrupts) and not stalled(recorder)
    if recorder.active:
        keeper.takes_ms = {}
        recorder.stop()  # closing a file may erase the flash
        assert stalled(recorder) is stops_interrupts


@pytest.mark.parametrize(("waited_us", "step_us"), [(100_000, 500_001), (3_000_000, 3_000_000), (600_000_000, 1 << 29)])
def test_after_a_gap_the_recorded_time_is_over_half_a_second(waited_us, step_us, recorder, keeper, clock):
    start(recorder)
    add(recorder, 4, clock)
    recorder.mark_gap()
    clock.advance(waited_us)
    recorder.add([0, 0, 8192, 0, 0, 0, 0], 2, 1)
    add(recorder, 3, clock)
    recorder.stop()
    steps = [after.time_us - before.time_us for before, after in pairwise(keeper.turns())]
    assert steps == [TURN_US] * 3 + [pytest.approx(step_us, abs=1000)] + [TURN_US] * 3 and steps[3] > 500_000


def test_gap_and_speed_belong_to_their_own_ride(recorder, keeper, clock):
    start(recorder)
    add(recorder, 2, clock)
    recorder.mark_gap()
    start(recorder)
    recorder.add_fix(5.0, None)
    assert keeper.steps[-2:] == ["end", "begin"] and len(keeper.blocks) == 1 and recorder.seconds() == 0
    start(recorder)
    add(recorder, 3, clock)
    recorder.stop()
    turns = keeper.read()[-1].turns
    assert [after.time_us - before.time_us for before, after in pairwise(turns)] == [TURN_US] * 2
    assert [turn.speed_mps for turn in turns] == [None] * 3


def test_position_and_speed_belong_to_the_next_pass_only(recorder, keeper):
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
    recorder.stop()
    turns = keeper.turns()
    hundredths = [turn.place and turn.place.utc_s and round(100 * turn.place.utc_s % 100) for turn in turns]
    assert hundredths == [20, None, None, 30] and [turn.speed_mps for turn in turns] == [None, None, 0.0, 6.0]


def test_time_and_room(recorder, keeper):
    """Until the recorder has measured its first block, it assumes a kilobyte per second."""
    start(recorder)
    assert recorder.seconds() == 0 and recorder.room_s() == 1_000_000 // 1024
    add(recorder, 99)
    assert recorder.seconds() == 0
    add(recorder, 1)
    assert recorder.seconds() == 1
    while len(keeper.blocks) < 3:
        add(recorder, 1)
    assert recorder.seconds() > 2 and recorder.room_s() == 1_000_000 * recorder.seconds() // (3 * 1024)
    for free, room_s in ((0, 0), (None, None)):
        keeper.free = free
        assert recorder.room_s() == room_s


@pytest.mark.parametrize("step", ["begin", "ready", "write", "end_block", "end"])
@pytest.mark.parametrize("error", [OSError(5), MemoryError("no memory")])
def test_failure_ends_the_ride_once_with_one_notice(step, error, recorder, keeper):
    keeper.fails, keeper.error = step, error
    with contextlib.redirect_stdout(io.StringIO()) as console:
        start(recorder)
        for _ in range(600):
            if recorder.active:
                add(recorder, 1)
        recorder.stop()
    assert not recorder.active and keeper.steps.count("abandon") == 1
    assert console.getvalue().count("\n") == 1 and isinstance(recorder.problem, Notice)
    assert recorder.take_problem().values == (str(error),) and recorder.take_problem() is None
    keeper.fails = ""  # the flash works again, so the next ride is recorded
    start(recorder)
    add(recorder, 3)
    recorder.stop()
    assert recorder.problem is None and len(keeper.read()[-1].turns) == 3


def test_refused_card_has_its_own_message(recorder, keeper):
    keeper.fails, keeper.error = "begin", CardError("no-card", "no SD card")
    with contextlib.redirect_stdout(io.StringIO()):
        start(recorder)
    assert not recorder.active and recorder.problem is keeper.error and keeper.steps == ["begin"]


# Recording, which makes the recorder


class Calibration:
    """The calibration of the meter. restarts: number of restarts of the meter."""

    value = ride_writer.calibration()
    restarts = 0

    def restart(self):
        self.restarts += 1


def test_ride_after_an_alignment_begins_like_its_replay(keeper):
    """After an alignment the meter knows that the bike is upright, but a replay does not know it. So the meter restarts
    without knowing that the bike is upright."""
    from kickstand.rides.recording import Recording

    calibration = Calibration()
    settings = SimpleNamespace(SD_SPI=None, RECORD=True, SAMPLE_HZ=200)
    recording = Recording(settings, ride_writer.CHIP, None, calibration, keeper)
    recording.calibration_changed()
    assert keeper.steps == [] and calibration.restarts == 0  # no ride is being recorded
    start(recording.recorder)
    recording.calibration_changed()
    assert keeper.steps == ["begin", "end", "begin"] and calibration.restarts == 1


@pytest.mark.parametrize("at_rest", [False, True])
def test_second_start_reuses_the_recorder(at_rest, root, clock):
    """A recording also starts if the menu was closed before the recording was prepared. At rest the meter restarts."""
    from kickstand.rides.recording import Recording

    calibration = Calibration()
    settings = SimpleNamespace(SD_SPI=None, RECORD=False, SAMPLE_HZ=200)
    recording = Recording(settings, ride_writer.CHIP, SimpleNamespace(at_rest=at_rest), calibration)
    assert not recording.recorder.active and recording.start_due() is None and not recording.recorder.active
    assert recording.start() is None
    recorder = recording.recorder
    assert recorder.active and calibration.restarts == at_rest
    recording.stop()
    assert not recorder.active
    assert recording.start() is None and recording.recorder is recorder and recorder.active
    recording.stop()
