"""Records a ride. The samples of each pass of the loop are added to a ride block. Full blocks are written to flash step
by step.

A block takes four seconds or more to fill. Meanwhile the previous block is written. Each pass of the loop writes a
page, flushes a file, or removes an old file. So no pass waits for more than one erase of the flash (45 ms). The chip's
FIFO keeps the samples during that time.
"""

from time import ticks_diff, ticks_ms

from ..calibration.store import pack
from ..errors import Notice, Refusal, report
from ..units import GAP_US, const
from .block import MAX_DT_US, RideBlock

_PAGE = const(256)  # bytes in a page of the flash, the unit of writing
_STALL_MS = const(10)  # duration above which a write has included an erase of the flash; a page alone takes 1 ms


class Recorder:
    """Records rides.

    Args:
        writer: the writer of the blocks, a RideFiles (flash or SD card) or a RideStream (USB).
        sample_hz: samples per second of the chip.
        notices: list to which the reason is appended if a recording stops.

    Attributes:
        active: True while a ride is being recorded.
        stalled: True if interrupts were off for longer than _STALL_MS. During such a stall GPS bytes or wheel pulses
            may be lost. The caller calls the speed source's after_stall() and resets stalled to False.
    """

    def __init__(self, writer, sample_hz, notices):
        self._writer = writer
        self._notices = notices
        self.active = False
        self.stalled = False
        self._sample_hz = sample_hz
        self._block = self._spare = None  # two RideBlocks, which take 8 KB of heap; the first start() creates them

    def start(self, chip, calibration):
        """End the current ride and begin a new one. Raises nothing. Afterwards `active` shows if a ride is being
        recorded.

        A replay begins with a new filter. So the caller must restart the meter's filter too, or the replay's lean will
        differ.

        Args:
            chip: a running Mpu6050.
            calibration: the Calibration in use.
        """
        self.stop()
        begun_ms = ticks_ms()
        try:
            if not self._spare:
                period_us = 1_000_000 // self._sample_hz
                self._block, self._spare = RideBlock(period_us), RideBlock(period_us)
            self._ride = self._writer.begin()
        except (Refusal, OSError, MemoryError) as error:
            self._fail(error)
            return
        finally:
            self._note_stall(begun_ms)  # making a directory, or closing a file after an error, may have taken long
        self._chip = chip
        self._body = pack(chip.who_am_i, chip.accel_range_g, calibration)
        self._start_ms = self._before_ms = ticks_ms()
        # The time since the start is kept in two parts, because integers of over 30 bits would take heap in each pass
        self._time_s = self._time_us = 0
        self._empty = True  # until the first samples
        self._sequence = 0
        self._bytes = 0
        self._interrupted = False
        self._speed = self._place = None  # the last speed (cm/s) and position since the previous pass of the loop
        self._writing = None  # the generator that writes the previous block
        self.active = True
        self._begin_block()

    def stop(self):
        """End the ride if one is being recorded. Write all added entries, in at most 0.1 s."""
        if not self.active:
            return
        if self._block.count:
            self._end_block()
        while self._writing and self.active:
            self.tick()
        if self.active:
            self.active = False
            self.stalled = self._writer.stops_interrupts
            try:
                self._writer.end()
            except (OSError, MemoryError) as error:
                self._fail(error)

    def mark_gap(self):
        """Mark a gap before the next samples, because the chip was set up again."""
        self._interrupted = True

    def add(self, sums, n, dt_us):
        """Add the samples of a pass of the loop. Call this method only while active.

        Args:
            sums: the sums of the samples' seven counts.
            n: number of samples.
            dt_us: microseconds since the previous samples.
        """
        now_ms = ticks_ms()
        if self._interrupted:  # a replay recognises a gap by its length, and restarts its filter as the board did
            self._interrupted = False
            if not self._empty:
                dt_us = max(GAP_US + 1, min(MAX_DT_US, ticks_diff(now_ms, self._before_ms) * 1000))
        self._before_ms = now_ms
        if self._speed is not None:
            self._block.add_speed(self._speed)
            self._speed = None
        if self._place is not None:
            self._block.add_place(self._place)
            self._place = None
        self._block.add(sums, n, dt_us)
        self._empty = False
        self._time_us += dt_us
        if self._time_us >= 1_000_000:
            self._time_s += self._time_us // 1_000_000
            self._time_us %= 1_000_000
        if self._block.full():
            self._end_block()
            if self.active:
                self._begin_block()

    def add_fix(self, speed_mps, place):
        """Keep a speed and a position until the next samples are added. The new values replace earlier kept values.

        Args:
            speed_mps: a new speed in m/s, or None.
            place: a new position from Gps.place(), or None.
        """
        if speed_mps is not None:
            self._speed = int(100 * speed_mps + 0.5)
        if place is not None:
            self._place = place

    def tick(self):
        """Do one step of the writing. Call this method once per pass of the loop while active."""
        if not self._writing:
            return
        begun_ms = ticks_ms()
        try:
            if next(self._writing, True):
                self._writing = None
        except (OSError, MemoryError) as error:
            self._fail(error)
        except KeyboardInterrupt:  # it may have ended the generator, so stop() writes the whole block again
            self._writing = self._write(self._spare, True) if self._unwritten else None
            raise
        self._note_stall(begun_ms)

    def _note_stall(self, begun_ms):
        """Set stalled if the write since begun_ms was long enough to include an erase of the flash."""
        if ticks_diff(ticks_ms(), begun_ms) > _STALL_MS and self._writer.stops_interrupts:
            self.stalled = True

    def _write(self, block, again=False):
        """Write a block, as a generator of short steps. Raises OSError, MemoryError.

        again: True if Ctrl-C has interrupted the writing of this block."""
        writer = self._writer
        if again:
            writer.again()
        while not writer.ready():
            yield
        for at in range(0, block.length, _PAGE):
            writer.write(memoryview(block.buffer)[at : min(at + _PAGE, block.length)])
            yield
        writer.end_block()
        self._unwritten = False
        self._bytes += block.length

    def seconds(self):
        """Return the duration of this recording so far, in seconds."""
        return self._time_s

    def room_s(self):
        """Return the number of seconds that can still be recorded, or None without a limit."""
        room = self._writer.room()
        if room is None:
            return None
        if not self._bytes:
            return room // 1024  # assume 1 KB/s until the first block is measured
        return room * self.seconds() // self._bytes

    def _begin_block(self):
        """Begin an empty block. The next passes of the app's loop fill the block."""
        length, number = self._writer.next_length(), (self._ride, self._sequence)
        time_us = 1000 * self._start_ms + 1_000_000 * self._time_s + self._time_us
        self._block.begin(length, *number, time_us, self._chip, self._sample_hz, self._body)
        self._sequence += 1

    def _end_block(self):
        """Close the full block. tick() will write it."""
        # write the rest of the previous block first, if flash was slower than the ride
        while self._writing and self.active:
            self.tick()
        self._block.close()
        self._block, self._spare = self._spare, self._block
        self._unwritten = True
        self._writing = self._write(self._spare)

    def _fail(self, error):
        """End the ride after an error, and report it. Unwritten blocks are lost."""
        self.active = False
        self._writer.abandon()
        is_card = isinstance(error, Refusal)
        report(error if is_card else Notice(self._writer.fault_code(error), str(error)), self._notices)
