"""Keeps the chip working: finds it, sets it up, watches it, and sets it up again after a fault. SampleClock computes
the times of the samples."""

from time import ticks_add, ticks_diff, ticks_ms

from ..errors import Notice
from ..units import const
from .fifo_frames import DUE, LOST
from .mpu6050 import UnknownChip

_RETRY_MS = const(50)  # time between two attempts to set the chip up
_FAILURES = const(3)  # so many failed transfers in a row are a fault; one or two NACKs are tolerated
_SILENT_MS = const(100)  # time without a sample that is a fault
_STALE_MS = const(500)  # the same while overflows lose all samples because the board has no time to read
_SETTLED_MS = const(1000)  # if a fault returns sooner than this, the set-up did not help
_FRUITLESS = const(3)  # after this many such faults in a row the FIFO is tested
# The first explanation follows this many failed set-ups in a row, each further one this many later (about a second)
EXPLAINED, EXPLAINED_EVERY = 3, 20
_CORRECTION_SHIFT = const(4)  # SampleClock.emptied() corrects by 1/16 of the difference between the two clocks


class Sensor:
    """Samples of one chip, which may fail at any time. _missed() handles every failed transfer (NACK or time-out).

    chip: an Mpu6050.  reopen(): frees the bus and returns it as a machine.I2C.  explain(chip, error): returns a Notice
    with the reason for a failed set-up, and the addresses that answer. explain(chip, None) tests the FIFO: the first
    value is then a Notice if the FIFO is broken, else None. explain may be None.
    found: list of the addresses on the bus at the last explanation.
    fault: the Notice of a fault, or None.  restarts: number of gaps in the samples: after a set-up, after
    _STALE_MS without a sample, after a faulty axis.  clipped: samples that fetch() skipped because an axis was at the
    end of its range; the caller sets it to 0.
    """

    def __init__(self, chip, reopen, explain=None):
        self.chip = chip
        self.reopen = reopen
        self.explain = explain
        self.found = []
        self._refused = 0  # set-ups that failed in a row
        self._fruitless = 0  # set-ups in a row with a fault within _SETTLED_MS after them
        self._started_ms = 0
        self._failures = 0  # transfers that failed in a row
        self._overflows = 0  # number of the chip's overflows handled so far
        self._due_ms = ticks_ms()  # time of the next step of the set-up
        self._steps = None  # the steps of the set-up, a generator
        self._ready = False  # True while the chip is set up but its FIFO is not started
        self._sample_ms = 0  # when the last sample was read, or the FIFO was emptied after an overflow
        # _emptied_ms: when the FIFO last overflowed; _read_ms: when the last sample before that overflow was read
        self._emptied_ms = self._read_ms = 0
        self.restarts = self.clipped = 0
        self.fault = Notice("starting")
        self._running = False

    def set_up(self):
        """Free the bus and set the chip up. Takes 0.2 s. Raises UnknownChip, OSError, or SettingsError for wrong
        pins."""
        self.chip.connect(self.reopen())
        self.chip.setup()

    def fetch(self, now_ms):
        """Read the waiting samples; return their number, at most eight. now_ms: ticks_ms().

        chip.sums has their sum, chip.take(k) returns each of them. The number is 0 while an axis is faulty. If the chip
        does not run, the calls of 0.2 s set it up first. Raises SettingsError for pins that cannot be used, and nothing
        else."""
        if not self._running:
            self.prepare(now_ms)
            if self._ready:
                self._start(now_ms)
            return 0
        try:
            if self._failures:
                self.chip.restart_fifo()  # the failed transfer may have left half a frame in the FIFO
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
        """Set the fault. Return the number of usable samples: good, or 0 while an axis is faulty.

        good: number of samples in the sums. waiting: number of samples that were waiting."""
        axes = self.chip.axes
        if good:
            self.fault = None
        if good < waiting:
            clipped = axes.notes[LOST]
            self.clipped += clipped
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
                self._running = self._ready = False
                self._due_ms = now_ms
        if axes.fault:
            self.fault = axes.fault
            return 0
        return good

    def _no_sample(self, now_ms):
        """Report a fault if the FIFO has held no sample for too long. After an overflow the limit is longer, because
        the FIFO was just emptied."""
        if self._overflows != self.chip.overflows:
            self._overflows = self.chip.overflows
            if self._sample_ms != self._emptied_ms:  # at least one sample was read since the last overflow
                self._read_ms = self._sample_ms
            # now_ms may be older than the long pause that led to the overflow
            self._sample_ms = self._emptied_ms = ticks_ms()
            if ticks_diff(self._emptied_ms, self._read_ms) > _STALE_MS:
                self.fault = self._fifo_fault() or Notice("readings-lost")
                self.restarts += 1
        elif ticks_diff(now_ms, self._sample_ms) > _SILENT_MS:
            self._fail_again("sensor-silent", now_ms)

    def _fail_again(self, code, now_ms):
        """Fail. If set-ups do not help, test the FIFO and report it if it is broken."""
        self._fruitless = self._fruitless + 1 if ticks_diff(now_ms, self._started_ms) < _SETTLED_MS else 1
        fault = self._fifo_fault() if self._fruitless % _FRUITLESS == 0 else self._named_fifo()
        self._fail(code, now_ms)
        if fault:
            self.fault = fault

    def _named_fifo(self):
        """Return the fault if it is that of a broken FIFO, else None. This fault stays until a sample arrives."""
        return self.fault if self.fault is not None and self.fault.code == "sensor-fifo" else None

    def _fifo_fault(self):
        """Return a Notice if the chip measures but its FIFO does not work, else None. The test runs once and takes up
        to 0.3 s."""
        return self._named_fifo() or (self.explain(self.chip, None)[0] if self.explain else None)

    def check(self, now_ms):
        """Check that the chip is still configured. A supply dip during a transfer can corrupt half a sample: call this
        before readings are shown. It takes 0.6 ms. Raises nothing. now_ms: ticks_ms().

        After a failed transfer nothing is checked, because a restart of the FIFO may be incomplete."""
        if not self._running or self._failures:
            return
        try:
            if not self.chip.configured():  # a supply dip has reset the chip
                self._fail("sensor-reset", now_ms)
        except OSError:
            self._missed(now_ms)

    def _missed(self, now_ms):
        """Count a failed transfer. _FAILURES in a row are a fault."""
        self._failures += 1
        if self._failures >= _FAILURES:
            self._fail("sensor-lost", now_ms)

    def _fail(self, code, now_ms):
        self.fault = Notice(code)
        self._running = self._ready = False
        self._due_ms = now_ms

    def prepare(self, now_ms):
        """Do the next step of the set-up if its time has come. Leave the last step, the start of the FIFO, to fetch().
        Raises SettingsError for pins that cannot be used, and nothing else. now_ms: ticks_ms()."""
        if self._ready or ticks_diff(now_ms, self._due_ms) < 0:
            return
        wait_ms = _RETRY_MS
        try:
            if self._steps is None:
                self.chip.connect(self.reopen())
                self._steps = self.chip.configure()
            wait_ms = next(self._steps)
        except StopIteration:
            self._ready = True
            self._steps = None
        except (UnknownChip, OSError) as error:
            self._not_set_up(error)
        self._due_ms = ticks_add(now_ms, wait_ms)

    def _not_set_up(self, error):
        """Record a failed set-up; after a few in a row, set the fault. The next attempt begins with freeing the bus."""
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
        self._running = True  # the fault stays until a good sample arrives
        self._refused = 0
        self._started_ms = now_ms
        self.restarts += 1
        self._failures = 0
        self._sample_ms = now_ms


class SampleClock:
    """Computes the times of the samples. The chip samples at a steady rate, whatever the program does. The chip's clock
    may be off by 1 %; the board's clock corrects this. Times are integers in microseconds: a 32-bit float would lose
    microseconds after 17 seconds.

    period_us: nominal time from one sample to the next.  lost: samples lost in overflows or skipped, since power-on."""

    def __init__(self, period_us):
        self._period_us = period_us
        self.lost = 0
        self._pending_us = 0  # the correction for the next step()
        self._skipped_us = 0  # time of samples that were skipped since the last step()
        self._sample_us = None  # when the last sample was taken, in ticks_us(); None: no sample yet

    def restart(self):
        """Drop the time of the last sample, because of a gap in the samples."""
        self._sample_us = None
        self._pending_us = self._skipped_us = 0

    def skip(self, n):
        """Count n skipped samples: the next step() spans them."""
        self.lost += n
        if self._sample_us is not None:
            self._skipped_us += n * self._period_us

    def step(self, n, now_us):
        """Count n new samples; return the microseconds from the last earlier sample to the last new one.

        After a restart() the time begins at the first new sample. now_us: ticks_us().
        """
        if self._sample_us is None:
            n -= 1
            self._sample_us = ticks_add(now_us, -n * self._period_us)
        dt_us = max(0, n * self._period_us + self._skipped_us + self._pending_us)
        self._pending_us = self._skipped_us = 0
        self._sample_us = ticks_add(self._sample_us, dt_us)
        return dt_us

    def emptied(self, now_us):
        """Correct the clock. Call this when the chip's FIFO was empty at now_us (ticks_us()) and all its samples were
        counted.

        The last sample was then half a period old on average."""
        if self._sample_us is None:
            return
        late_us = ticks_diff(now_us, self._sample_us) - self._skipped_us - self._period_us // 2
        if late_us > 2 * self._period_us:  # an overflow lost samples: the next step() spans the gap
            self.lost += (late_us - self._pending_us) // self._period_us
            self._pending_us = late_us
        else:
            self._pending_us = late_us >> _CORRECTION_SHIFT
