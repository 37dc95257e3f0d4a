"""Keeps the chip working: finds it, sets it up, watches it, and sets it up again after a fault. SampleClock gives the
samples' times."""

from time import ticks_add, ticks_diff, ticks_ms

from ..errors import Notice
from ..units import const
from .fifo_frames import DUE, LOST
from .mpu6050 import UnknownChip

_RETRY_MS = const(50)  # time between two attempts to set the chip up
_FAILURES = const(3)  # so many failed transfers in a row are a fault; a NACK or two are tolerated
_SILENT_MS = const(100)  # this long without a sample is a fault
_STALE_MS = const(500)  # and this long if all samples were lost in overflows, because the board had no time to read
_SETTLED_MS = const(1000)  # a fault sooner after a set-up than this has outlasted the set-up
_FRUITLESS = const(3)  # after so many of those in a row the FIFO is tried out
# Of set-ups in a row that fail: the first one that is explained, and each so many later, about once a second
EXPLAINED, EXPLAINED_EVERY = 3, 20
_CORRECTION_SHIFT = const(4)  # SampleClock.emptied() corrects by 1/16 of the difference between the two clocks


class Sensor:
    """Samples of one chip that may fail at any time. A transfer that fails, by NACK or time-out, ends in _missed().

    chip: an Mpu6050.  reopen: called to free the bus, returns it as a machine.I2C.  explain(chip, error): returns a
    Notice, why the chip could not be set up, and the addresses that answer; for error None whether its FIFO works, a
    Notice or None. None: no such function.
    found: the addresses on the bus when it was last explained, a list.
    fault: None, or a Notice: what is wrong.  restarts: number of times that the chip was set up, that no sample could
    be read for _STALE_MS, or that an axis was ill. After each, samples do not follow on from those before.  clipped:
    samples that fetch() has left out, because an axis was at the end of its range; the caller sets it to 0.
    """

    def __init__(self, chip, reopen, explain=None):
        self.chip = chip
        self.reopen = reopen
        self.explain = explain
        self.found = []
        self._refused = 0  # set-ups that failed in a row
        self._fruitless = 0  # set-ups in a row that a fault followed within _SETTLED_MS
        self._started_ms = 0
        self._failures = 0  # transfers that failed in a row
        self._overflows = 0  # the chip's overflows that have been dealt with
        self._due_ms = ticks_ms()  # when the next step of setting the chip up is due
        self._steps = None  # these steps, a generator
        self._ready = False  # the chip is set up, but its FIFO does not fill yet
        self._sample_ms = 0  # when the last sample was read, or the FIFO was emptied after an overflow
        # _emptied_ms: when the FIFO last overflowed; _read_ms: when the last sample before that overflow was read
        self._emptied_ms = self._read_ms = 0
        self.restarts = self.clipped = 0
        self.fault = Notice("starting")
        self._running = False

    def set_up(self):
        """Free the bus and set the chip up, in 0.2 s. Raises UnknownChip, OSError, or SettingsError for wrong pins."""
        self.chip.connect(self.reopen())
        self.chip.setup()

    def fetch(self, now_ms):
        """Read the samples that have come in; return their number, at most MAX_FRAMES. now_ms: ticks_ms().

        Their sum is in chip.sums; chip.take(k) gives each of them. While an axis is ill there are none. A chip that
        does not run is set up first, which takes 0.2 s of calls. Raises SettingsError for pins that cannot be used, and
        nothing else."""
        if not self._running:
            self.prepare(now_ms)
            if self._ready:
                self._start(now_ms)
            return 0
        try:
            if self._failures:
                self.chip.restart_fifo()  # the transfer that failed may have left half a frame in the FIFO
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
        """Return the number of samples that can be used: good, or 0 while an axis is ill. Set the fault.

        good: those of the waiting ones that are in the sums."""
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
        """Report a fault if the FIFO has held no sample for too long. After an overflow it was just emptied, so that
        this takes longer."""
        if self._overflows != self.chip.overflows:
            self._overflows = self.chip.overflows
            if self._sample_ms != self._emptied_ms:  # there were samples since the last overflow
                self._read_ms = self._sample_ms
            # now_ms may be from before the long pause that led to the overflow
            self._sample_ms = self._emptied_ms = ticks_ms()
            if ticks_diff(self._emptied_ms, self._read_ms) > _STALE_MS:
                self.fault = self._fifo_fault() or Notice("readings-lost")
                self.restarts += 1
        elif ticks_diff(now_ms, self._sample_ms) > _SILENT_MS:
            self._fail_again("sensor-silent", now_ms)

    def _fail_again(self, code, now_ms):
        """Fail, and name the FIFO if set-ups do not help because that is broken."""
        self._fruitless = self._fruitless + 1 if ticks_diff(now_ms, self._started_ms) < _SETTLED_MS else 1
        fault = self._fifo_fault() if self._fruitless % _FRUITLESS == 0 else self._named_fifo()
        self._fail(code, now_ms)
        if fault:
            self.fault = fault

    def _named_fifo(self):
        """The fault, if it is the FIFO's, which stays until a sample comes; else None."""
        return self.fault if self.fault is not None and self.fault.code == "sensor-fifo" else None

    def _fifo_fault(self):
        """None, or a Notice: the chip measures, but its FIFO does not work. To find out takes up to 0.3 s, once."""
        return self._named_fifo() or (self.explain(self.chip, None)[0] if self.explain else None)

    def check(self, now_ms):
        """Make sure that the chip is still configured: a supply dip during a transfer leaves a sample that is half
        garbage. Call it before readings are shown; it takes 0.6 ms. Raises nothing. now_ms: ticks_ms().

        After a transfer that failed nothing is judged: restarting the FIFO may have failed half way."""
        if not self._running or self._failures:
            return
        try:
            if not self.chip.configured():  # a supply dip: the chip has reset itself
                self._fail("sensor-reset", now_ms)
        except OSError:
            self._missed(now_ms)

    def _missed(self, now_ms):
        """Count a failed transfer: _FAILURES of them in a row are a fault."""
        self._failures += 1
        if self._failures >= _FAILURES:
            self._fail("sensor-lost", now_ms)

    def _fail(self, code, now_ms):
        self.fault = Notice(code)
        self._running = self._ready = False
        self._due_ms = now_ms

    def prepare(self, now_ms):
        """Do the next step of setting the chip up, if it is due. The last one, to start the FIFO, is left to fetch().
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
        """Set the fault once attempts to set the chip up have failed; the next attempt begins with the bus."""
        self._ready = False
        self._steps = None
        self._refused += 1
        if not self.explain:
            unknown = isinstance(error, UnknownChip)
            self.fault = Notice("unknown-chip", error.args[0]) if unknown else Notice("no-sensor")
        elif self._refused % EXPLAINED_EVERY == EXPLAINED:
            self.fault, self.found = self.explain(self.chip, error)

    def _start(self, now_ms):
        """Start the FIFO of the chip, which is set up."""
        try:
            self.chip.start()
        except OSError as error:
            self._not_set_up(error)
            return
        self._running = True  # but the fault stays until there is a good sample
        self._refused = 0
        self._started_ms = now_ms
        self.restarts += 1
        self._failures = 0
        self._sample_ms = now_ms


class SampleClock:
    """The times of the samples: the chip samples at a steady rate, whatever the program does, but its clock may be off
    by 1 %, which is corrected by the board's. Times are integers of microseconds: a 32-bit float could no longer hold
    them after 17 seconds.

    period_us: nominal time from one sample to the next.  lost: samples lost in overflows or skipped, since power-on."""

    def __init__(self, period_us):
        self._period_us = period_us
        self.lost = 0
        self._pending_us = 0  # correction that the next step() adds
        self._skipped_us = 0  # time of samples that were skipped since the last step()
        self._sample_us = None  # when the last sample was taken, in ticks_us(); None: no sample yet

    def restart(self):
        """Drop the time of the last sample: the next ones do not follow on from it."""
        self._sample_us = None
        self._pending_us = self._skipped_us = 0

    def skip(self, n):
        """Count n samples that are left out: the next step() spans them."""
        self.lost += n
        if self._sample_us is not None:
            self._skipped_us += n * self._period_us

    def step(self, n, now_us):
        """Count n new samples; return the microseconds from the last sample before them to the last of them.

        After a restart() there is none before them: the time then begins at the first of them. now_us: ticks_us().
        """
        if self._sample_us is None:
            n -= 1
            self._sample_us = ticks_add(now_us, -n * self._period_us)
        dt_us = max(0, n * self._period_us + self._skipped_us + self._pending_us)
        self._pending_us = self._skipped_us = 0
        self._sample_us = ticks_add(self._sample_us, dt_us)
        return dt_us

    def emptied(self, now_us):
        """Correct the clock: at now_us, ticks_us(), the chip's FIFO was empty and all its samples were counted.

        So the last sample was then half a period old on average."""
        if self._sample_us is None:
            return
        late_us = ticks_diff(now_us, self._sample_us) - self._skipped_us - self._period_us // 2
        if late_us > 2 * self._period_us:  # samples were lost in an overflow: the next step() spans the gap
            self.lost += (late_us - self._pending_us) // self._period_us
            self._pending_us = late_us
        else:
            self._pending_us = late_us >> _CORRECTION_SHIFT
