"""The chip kept alive: found, set up, watched, and set up again after a fault."""

from time import ticks_add, ticks_diff, ticks_ms

from .mpu6050 import UnknownChip

CHECK_MS = 100  # before a page with readings of another range can be drawn; 0.4 ms each
RETRY_MS = 50
SAY_MS = 30  # before starting again, which takes 0.2 s: time to get the fault onto the display
FAILURES = 3  # single failed transfers are ridden out
SILENT_MS = 100  # without a sample
FROZEN_MS = 100  # noise changes a living chip's readings in every sample


class Sensor:
    """Samples of one chip that may fail at any time.

    chip: an Mpu6050.  reopen: called to free the bus, returns it as a machine.I2C.  fetch() never raises.
    fault: None, or two display lines that say what is wrong.  restarts: how often the chip was set up.
    """

    def __init__(self, chip, reopen, rate_hz):
        self.chip = chip
        self.reopen = reopen
        self._frozen_count = rate_hz * FROZEN_MS // 1000
        self._failures = 0
        self._same = 0
        self._signature = 0
        self._due_ms = None  # of the next check, or of the next attempt while faulty
        self._sample_ms = 0
        self.restarts = 0
        self.fault = ("Kickstand", "starting")
        self._running = False

    def fetch(self, now_ms):
        """How many samples wait to be taken with take(); starts the chip when it is not running."""
        if not self._running:
            if self._due_ms is None or ticks_diff(now_ms, self._due_ms) >= 0:
                self._start(now_ms)
            return 0
        try:
            if self._failures:
                self.chip.restart_fifo()  # what broke off may have left half a frame
            waiting = self.chip.fetch()
            if ticks_diff(now_ms, self._due_ms) >= 0:
                self._due_ms = ticks_add(now_ms, CHECK_MS)
                if not self.chip.configured():  # a supply dip: asleep, with the ranges of the factory
                    self._fail("Sensor reset", "starting again", now_ms)
                    return 0
        except OSError:
            self._failures += 1
            if self._failures >= FAILURES:
                self._fail("Sensor lost", "check wiring", now_ms)
            return 0
        self._failures = 0
        if waiting:
            self._sample_ms = now_ms
        elif ticks_diff(now_ms, self._sample_ms) > SILENT_MS:
            self._fail("Sensor silent", "starting again", now_ms)
        return waiting

    def take(self, k, now_ms):
        """Sample k into chip.counts; False if it is none to trust."""
        self.chip.take(k)
        if self._dead(self.chip.counts):
            self._fail("Sensor frozen", "starting again", now_ms)
            return False
        self.fault = None
        return True

    def _dead(self, c):
        """All zero or all -1 is no reading; nor is one that has not changed for a while."""
        if c[0] == c[1] == c[2] and (c[0] == 0 or c[0] == -1):
            return True
        signature = 5 * c[0] + 7 * c[1] + 11 * c[2] + 13 * c[4] + 17 * c[5] + 19 * c[6]  # a small integer: no heap
        self._same = self._same + 1 if signature == self._signature else 0
        self._signature = signature
        return self._same >= self._frozen_count

    def _fail(self, line1, line2, now_ms):
        self.fault = (line1, line2)
        self._running = False
        self._due_ms = ticks_add(now_ms, SAY_MS)

    def _start(self, now_ms):
        """Free the bus and set the chip up; 0.2 s when it answers."""
        try:
            self.chip.connect(self.reopen())
            self.chip.setup()
        except UnknownChip as error:
            self.fault = ("Unknown sensor", "WHO_AM_I %s" % hex(error.args[0]))
        except OSError:
            self.fault = ("No sensor", "check wiring")
        else:
            self._running = True  # the fault stays until there is a good sample
            self.restarts += 1
            self._failures = 0
            self._same = 0
        now_ms = ticks_ms()  # setting up took its time
        self._sample_ms = now_ms
        self._due_ms = ticks_add(now_ms, CHECK_MS if self._running else RETRY_MS)
