"""The recorder: turns of the loop into blocks, and these to where they are kept, a little in each turn.

While one block fills (four seconds or more) the one before is written: a piece, a flush or the removal of an old
file a turn, so that no turn waits for more than one erase of the flash (45 ms); the chip's FIFO keeps the samples.
"""

from time import ticks_diff, ticks_ms

from ..calibration.store import pack
from ..errors import CardError, RecordingError
from ..lean.meter import GAP_US
from .block import MAX_DT_US, RideBlock

PIECE = 256  # a page of the flash
STALL_MS = 10  # an erase of the flash; writing a page takes 1


class Recorder:
    """keeper: where blocks go, a RideRing or RideStream.

    active: a ride is being recorded.  problem: None, or a CardError or RecordingError: why the recording ended by
    itself, to be taken by whoever shows it.  stalled: interrupts were off for longer than
    STALL_MS, until whoever counts with them sets it back.
    """

    def __init__(self, keeper, sample_hz):
        self.keeper = keeper
        self.active = False
        self.problem = None
        self.stalled = False
        self._sample_hz = sample_hz
        self._block = self._spare = None  # 8 KB of heap from the first start() on

    def start(self, chip, calibration):
        """Begin a ride that is measured by this chip (an Mpu6050 that runs) with this Calibration. What went
        before has to be forgotten by the meter, or its lean cannot be replayed. Ends the ride before."""
        self.stop()
        try:
            if not self._spare:
                period_us = 1_000_000 // self._sample_hz
                self._block, self._spare = RideBlock(period_us), RideBlock(period_us)
            self._ride = self.keeper.begin()
        except CardError as error:
            self._end(error)
            return
        except (OSError, MemoryError) as error:
            self._fail(error)
            return
        self._chip = chip
        self._body = pack(chip.who_am_i, chip.accel_range_g, calibration)
        now_ms = ticks_ms()
        self._start_us = self._time_us = now_ms * 1000
        self._before_ms = now_ms
        self._sequence = 0
        self._bytes = 0
        self._interrupted = False
        self._speed = None  # cm/s, that has come since the turn before
        self._waiting = None  # the block that is being written, its place in it
        self._at = 0
        self.active = True
        self._begin_block()

    def stop(self):
        """End the ride: what has been measured until now is written, in at most 0.1 s."""
        if not self.active:
            return
        if self._block.count:
            self._end_block()
        while self._waiting and self.active:
            self.tick()
        if self.active:
            self.active = False
            self.stalled = self.keeper.stops_interrupts
            try:
                self.keeper.end()
            except (OSError, MemoryError) as error:
                self._fail(error)

    def interrupt(self):
        """The chip was started again: the next turn does not follow on the one before."""
        self._interrupted = True

    def add(self, sums, n, dt_us):
        """One turn's sums of n samples. dt_us: since the turn before. For an active recorder."""
        now_ms = ticks_ms()
        if self._interrupted:  # replay has to start its filter again, too, which it does after a gap
            self._interrupted = False
            if self._time_us != self._start_us:
                dt_us = max(GAP_US + 1, min(MAX_DT_US, ticks_diff(now_ms, self._before_ms) * 1000))
        self._before_ms = now_ms
        if self._speed is not None:
            self._block.add_speed(self._speed)
            self._speed = None
        self._block.add(sums, n, dt_us)
        self._time_us += dt_us
        if self._block.full():
            self._end_block()
            if self.active:
                self._begin_block()

    def add_speed(self, cm_per_s):
        """A new speed, which belongs to the turn added next: the last that comes before it."""
        self._speed = cm_per_s

    def tick(self):
        """One step of the writing. Call once a turn while active."""
        waiting = self._waiting
        if not waiting:
            return
        begun_ms = ticks_ms()
        self._write(waiting)
        if ticks_diff(ticks_ms(), begun_ms) > STALL_MS and self.keeper.stops_interrupts:
            self.stalled = True

    def _write(self, waiting):
        try:
            if not self.keeper.ready():
                return
            if self._at < waiting.length:
                end = min(self._at + PIECE, waiting.length)
                self.keeper.write(memoryview(waiting.buffer)[self._at : end])
                self._at = end
            else:
                self.keeper.end_block()
                self._bytes += waiting.length
                self._waiting = None
        except (OSError, MemoryError) as error:
            self._fail(error)

    def seconds(self):
        """How long this ride has been recorded."""
        return (self._time_us - self._start_us) // 1_000_000

    def room_s(self):
        """For how many more seconds there is room, or None where that is not known."""
        room = self.keeper.room()
        if room is None:
            return None
        if not self._bytes:
            return room // 1024
        return room * self.seconds() // self._bytes

    def _begin_block(self):
        self._block.begin(
            self.keeper.next_length(),
            self._ride,
            self._sequence,
            self._time_us,
            self._chip,
            self._sample_hz,
            self._body,
        )
        self._sequence += 1

    def _end_block(self):
        while self._waiting and self.active:  # a keeper slower than the ride
            self.tick()
        self._block.close()
        self._block, self._spare = self._spare, self._block
        self._waiting, self._at = self._spare, 0

    def _fail(self, error):
        """No more of this ride; the display goes on."""
        self.active = False
        self.keeper.abandon()
        self._end(RecordingError(self.keeper.fault_code(error), str(error)))

    def _end(self, problem):
        from ..console import sentence

        self.problem = problem
        print(sentence(problem))
