"""Keeps the chip working. Sensor finds the chip, sets it up, watches it, and sets it up again after a fault.
SampleClock computes the times of the samples."""

from time import ticks_add, ticks_diff, ticks_ms

from ..errors import Notice
from ..units import const
from .axes import DUE, LOST
from .mpu6050 import UnknownChip

_RETRY_MS = const(50)  # time between two attempts to set the chip up
_FAILURES = const(3)  # number of successive failed transfers that are a fault; one or two are tolerated
_SILENT_MS = const(100)  # after a longer time without a sample a fault is reported
# Longest time without a sample while the FIFO overflows, because the board has no time to read the FIFO
_STALE_MS = const(500)
_SETTLED_MS = const(1000)  # a set-up did not help if a fault comes within this time after it
_FRUITLESS = const(3)  # number of successive set-ups that did not help before the FIFO is tested
# The fault is explained after EXPLAINED successive failed set-ups, and again every EXPLAINED_EVERY set-ups (about 1 s)
EXPLAINED, EXPLAINED_EVERY = 3, 20
_CORRECTION_SHIFT = const(4)  # SampleClock.emptied() corrects by 1/16 of the clocks' difference


class Sensor:
    """Reads the samples of one chip, which may fail at any time.

    Args:
        chip: an Mpu6050.
        reopen: reopen() frees the bus and returns it as a machine.I2C.
        explain: a function, or None. explain(chip, error) returns a Notice with the reason for a failed set-up, and
            the addresses that answer. explain(chip, None) tests the FIFO, and returns a Notice if the FIFO is broken,
            else None, and the addresses.

    Attributes:
        found: list of the addresses that answered at the last explanation.
        fault: the Notice of a fault, or None.
        restarts: number of gaps in the samples. A gap is the first set-up, _STALE_MS without a sample, a faulty axis,
            or wrong samples of a chip with another configuration.
        starts: number of set-ups, and of lost contacts after which the chip needed no set-up.
        clock: the SampleClock. fetch() counts skipped samples in it; the caller counts the others.
    """

    def __init__(self, chip, reopen, explain=None):
        self.chip = chip
        self.reopen = reopen
        self.explain = explain
        self.found = []
        self._refused = 0  # number of successive set-ups that failed
        self._fruitless = 0  # number of successive set-ups that were followed by a fault within _SETTLED_MS
        self._started_ms = 0
        self._failures = 0  # number of successive transfers that failed
        self._overflows = 0  # number of the chip's overflows handled so far
        self._due_ms = ticks_ms()  # time of the next step of the set-up
        self._steps = None  # the steps of the set-up, a generator
        self._lost = False  # True if the last fault was lost contact, after which the chip may need no set-up
        self._ready = False  # True while the chip is set up but its FIFO is not started
        self._sample_ms = 0  # time when the last sample was read, or the FIFO was emptied after an overflow
        # _emptied_ms: time of the last overflow of the FIFO
        # _read_ms: time when the last sample before that overflow was read
        self._emptied_ms = self._read_ms = 0
        self.restarts = self.starts = 0
        self.clock = SampleClock(1000 * chip.period_ms)
        self.fault = Notice("starting")
        self._running = False

    def set_up(self):
        """Free the bus and set the chip up. This takes 0.2 s. Raises UnknownChip, OSError, or SettingsError for wrong
        pins."""
        self.chip.connect(self.reopen())
        self.chip.setup()

    def fetch(self, now_ms):
        """Read the samples in the FIFO. Afterwards chip.sums holds their sums, and chip.take(k) returns each sample.

        If the chip does not run, each call does a step of its set-up. The whole set-up takes 0.2 s.

        Args:
            now_ms: ticks_ms().

        Returns:
            The number of samples, at most eight. The number is 0 while an axis is faulty or the chip does not run.

        Raises:
            SettingsError: the pins cannot be used. This method raises nothing else.
        """
        if not self._running:
            self.prepare(now_ms)
            if self._ready:
                self._start(now_ms)
            return 0
        try:
            if self._failures:
                self.chip.realign()
            waiting = self.chip.fetch()
        except OSError:
            self._missed(now_ms)
            return 0
        self._failures = 0
        if not waiting:
            self._no_sample(now_ms)
            return 0
        self._sample_ms = now_ms
        good = self.chip.add_up(waiting)
        axes = self.chip.axes
        if good == waiting and axes.notes[DUE] > 0 and axes.fault is None:
            self.fault = None
            return good
        return self._judge(good, waiting, now_ms)

    def _judge(self, good, waiting, now_ms):
        """Set the fault.

        Args:
            good: number of samples in the sums.
            waiting: number of samples that were read from the FIFO.

        Returns:
            The number of usable samples: `good`, or 0 while an axis is faulty.
        """
        axes = self.chip.axes
        if good:
            self.fault = None
        if good < waiting:
            clipped = axes.notes[LOST]
            self.clock.skip(clipped)
            if good + clipped < waiting:
                self._fail_again("sensor-frozen", now_ms)
                return good
            if not good:
                self.fault = axes.clips() or self.fault
        if axes.notes[DUE] <= 0:
            ill = axes.fault
            setup = axes.look()
            if ill and not axes.fault:
                self.restarts += 1
            if setup:
                self._running = self._ready = self._lost = False
                self._due_ms = now_ms
        if axes.fault:
            self.fault = axes.fault
            return 0
        return good

    def _no_sample(self, now_ms):
        """Report a fault if no sample was read for too long. After an overflow the limit is longer, because the FIFO
        was just emptied."""
        if self._overflows != self.chip.overflows:
            self._overflows = self.chip.overflows
            if self._sample_ms != self._emptied_ms:  # True if a sample was read since the last overflow
                self._read_ms = self._sample_ms
            # now_ms may have been read before the long pause that caused the overflow
            self._sample_ms = self._emptied_ms = ticks_ms()
            if ticks_diff(self._emptied_ms, self._read_ms) > _STALE_MS:
                self.fault = self._fifo_fault() or Notice("readings-lost")
                self.restarts += 1
        elif ticks_diff(now_ms, self._sample_ms) > _SILENT_MS:
            self._fail_again("sensor-silent", now_ms)

    def _fail_again(self, code, now_ms):
        """Report a fault and set the chip up again. If set-ups do not help, test the FIFO and report a broken FIFO."""
        self._fruitless = self._fruitless + 1 if ticks_diff(now_ms, self._started_ms) < _SETTLED_MS else 1
        fault = self._fifo_fault() if self._fruitless % _FRUITLESS == 0 else self._named_fifo()
        self._fail(code, now_ms)
        if fault:
            self.fault = fault

    def _named_fifo(self):
        """Return the current fault if it says that the FIFO is broken, else None. Such a fault stays until a sample
        arrives."""
        return self.fault if self.fault is not None and self.fault.code == "sensor-fifo" else None

    def _fifo_fault(self):
        """Return a Notice if the chip measures but its FIFO does not work, else None. The test takes up to 0.3 s. The
        test is skipped if the current fault already says that the FIFO is broken."""
        return self._named_fifo() or (self.explain(self.chip, None)[0] if self.explain else None)

    def check(self, now_ms):
        """Check that the chip is still configured. Call this method before readings are shown, because a supply dip
        during a transfer can corrupt half a sample. The check takes 0.6 ms. Raises nothing.

        After a failed transfer nothing is checked, because a restart of the FIFO may be incomplete.

        Args:
            now_ms: ticks_ms().
        """
        if not self._running or self._failures:
            return
        try:
            if not self.chip.configured():  # the chip has lost its configuration in a supply dip
                if ticks_diff(now_ms, self._sample_ms) < 2 * self.chip.period_ms:  # it still sends wrong samples
                    self.restarts += 1
                self._fail("sensor-reset", now_ms)
        except OSError:
            self._missed(now_ms)

    def _missed(self, now_ms):
        """Count a failed transfer (NACK or time-out). Report a fault after _FAILURES successive failures."""
        self._failures += 1
        if self._failures >= _FAILURES:
            self._fail("sensor-lost", now_ms)

    def _fail(self, code, now_ms):
        self.fault = Notice(code)
        self._running = self._ready = False
        self._lost = code == "sensor-lost"
        self._due_ms = now_ms

    def prepare(self, now_ms):
        """Do the next step of the set-up if its time has come. The last step, the start of the FIFO, is left to
        fetch(). A chip that has only lost its contact for a moment needs no set-up.

        Args:
            now_ms: ticks_ms().

        Raises:
            SettingsError: the pins cannot be used. This method raises nothing else.
        """
        if self._ready or ticks_diff(now_ms, self._due_ms) < 0:
            return
        wait_ms = _RETRY_MS
        try:
            if self._steps is None:
                self.chip.connect(self.reopen())
                settled = ticks_diff(now_ms, self._started_ms) > _SETTLED_MS
                if self._lost and settled and self.chip.configured():
                    self.chip.realign()
                    self._runs(now_ms)
                    return
                self._steps = self.chip.configure()
            wait_ms = next(self._steps)
        except StopIteration:
            self._ready = True
            self._steps = None
        except (UnknownChip, OSError) as error:
            self._not_set_up(error)
        self._due_ms = ticks_add(now_ms, wait_ms)

    def _not_set_up(self, error):
        """Count a failed set-up. After a few successive failures, set the fault. The next attempt frees the bus
        first."""
        self._ready = False
        self._steps = None
        self._refused += 1
        if not self.explain:
            unknown = isinstance(error, UnknownChip)
            self.fault = Notice("unknown-chip", error.args[0]) if unknown else Notice("no-sensor")
        elif self._refused % EXPLAINED_EVERY == EXPLAINED:
            self.fault, self.found = self.explain(self.chip, error)

    def _start(self, now_ms):
        """Start the FIFO of a chip that is set up."""
        try:
            self.chip.start()
        except OSError as error:
            self._not_set_up(error)
            return
        self._runs(now_ms)

    def _runs(self, now_ms):
        """The chip runs, but the fault stays until a good sample arrives."""
        if not self.starts or ticks_diff(now_ms, self._sample_ms) > _STALE_MS:
            self.restarts += 1
        self.starts += 1
        self._running = True
        self._refused = self._failures = 0
        self._started_ms = self._sample_ms = now_ms


class SampleClock:
    """Computes the times of the samples.

    The chip samples at a steady rate, independent of the program. The chip's clock may be off by 1 %. The board's clock
    corrects the error of the chip's clock. Times are integers in microseconds, because a 32-bit float would lose
    microseconds after 17 seconds.

    Args:
        period_us: nominal time from one sample to the next.

    Attributes:
        skipped: number of samples since power-on that were skipped, because an axis was at the end of its range.
        lost: number of samples since power-on that were skipped or lost in overflows.
    """

    def __init__(self, period_us):
        self._period_us = period_us
        self.lost = self.skipped = 0
        self._pending_us = 0  # correction to add in the next step()
        self._skipped_us = 0  # duration of the samples that were skipped since the last step()
        self._sample_us = None  # time of the last sample, in ticks_us(); None before the first sample

    def restart(self):
        """Drop the time of the last sample, because of a gap in the samples."""
        self._sample_us = None
        self._pending_us = self._skipped_us = 0

    def skip(self, n):
        """Count n skipped samples. The next step() includes the time of these samples."""
        self.lost += n
        self.skipped += n
        if self._sample_us is not None:
            self._skipped_us += n * self._period_us

    def step(self, n, now_us):
        """Count n new samples. Return the microseconds from the previous sample to the last of the new samples.

        After a restart() the time begins at the first new sample.

        Args:
            n: number of new samples.
            now_us: ticks_us().
        """
        if self._sample_us is None:
            n -= 1
            self._sample_us = ticks_add(now_us, -n * self._period_us)
        dt_us = max(0, n * self._period_us + self._skipped_us + self._pending_us)
        self._pending_us = self._skipped_us = 0
        self._sample_us = ticks_add(self._sample_us, dt_us)
        return dt_us

    def emptied(self, now_us):
        """Correct the clock. Call this method when the chip's FIFO is empty and all its samples were counted.

        At that time the last sample is half a period old on average.

        Args:
            now_us: ticks_us() when the FIFO was empty.
        """
        if self._sample_us is None:
            return
        late_us = ticks_diff(now_us, self._sample_us) - self._skipped_us - self._period_us // 2
        if late_us > 2 * self._period_us:  # an overflow lost samples, so the next step() includes the gap
            self.lost += (late_us - self._pending_us) // self._period_us
            self._pending_us = late_us
        else:
            self._pending_us = late_us >> _CORRECTION_SHIFT
