"""The chip kept alive: found, set up, watched, and set up again after a fault."""

from time import ticks_add, ticks_diff, ticks_ms

from ..errors import SensorFault
from .mpu6050 import UnknownChip

CHECK_MS = 100  # 0.6 ms each
RETRY_MS = 50
SAY_MS = 30  # before starting again, which takes 0.2 s: time to get the fault onto the display
FAILURES = 3  # single failed transfers are ridden out
SILENT_MS = 100  # without a sample


class Sensor:
    """Samples of one chip that may fail at any time.

    chip: an Mpu6050.  reopen: called to free the bus, returns it as a machine.I2C.
    fault: None, or a SensorFault: what is wrong.  restarts: how often the chip was set up.
    """

    def __init__(self, chip, reopen):
        self.chip = chip
        self.reopen = reopen
        self._failures = 0
        self._overflows = 0
        self._due_ms = ticks_ms()  # of the next check, or of the next attempt while faulty
        self._sample_ms = 0
        self.restarts = 0
        self.fault = SensorFault("starting")
        self._running = False

    def fetch(self, now_ms):
        """How many samples have come in, at most MAX_FRAMES: their sum is in chip.sums, each can be had by
        chip.take(k). Starts the chip when it is not running. Raises SettingsError for pins that cannot be used, and
        nothing else."""
        if not self._running:
            if ticks_diff(now_ms, self._due_ms) >= 0:
                self._start(now_ms)
            return 0
        waiting = self._transfer(now_ms)
        if waiting < 0:
            return 0
        self._failures = 0
        if not waiting:
            self._wait(now_ms)
            return 0
        self._sample_ms = now_ms
        good = self.chip.add_up(waiting)
        if good:
            self.fault = None
        if good < waiting:
            self._fail("sensor-frozen", now_ms)
        return good

    def _transfer(self, now_ms):
        """How many samples have come in, -1 if that could not be read."""
        try:
            if self._failures:
                self.chip.restart_fifo()  # what broke off may have left half a frame
            return self.chip.fetch()
        except OSError:
            self._missed(now_ms)
            return -1

    def _wait(self, now_ms):
        if self._overflows != self.chip.overflows:  # nobody came to fetch; the FIFO begins again now
            self._overflows = self.chip.overflows
            self._sample_ms = ticks_ms()  # now_ms may be of before the pause
        elif ticks_diff(now_ms, self._sample_ms) > SILENT_MS:
            self._fail("sensor-silent", now_ms)

    def check(self, now_ms):
        """Now and then: is the chip still set up as it was? Never raises. Call it before readings are shown."""
        if not self._running or ticks_diff(now_ms, self._due_ms) < 0:
            return
        self._due_ms = ticks_add(now_ms, CHECK_MS)
        try:
            if not self.chip.configured():  # a supply dip: asleep, with the ranges of the factory
                self._fail("sensor-reset", now_ms)
        except OSError:
            self._missed(now_ms)

    def _missed(self, now_ms):
        self._failures += 1
        if self._failures >= FAILURES:
            self._fail("sensor-lost", now_ms)

    def _fail(self, code, now_ms):
        self.fault = SensorFault(code)
        self._running = False
        self._due_ms = ticks_add(now_ms, SAY_MS)

    def _start(self, now_ms):
        """Free the bus and set the chip up; 0.2 s when it answers."""
        try:
            self.chip.connect(self.reopen())
            self.chip.setup()
        except UnknownChip as error:
            self.fault = SensorFault("unknown-chip", error.args[0])
        except OSError:
            self.fault = SensorFault("no-sensor")
        else:
            self._running = True  # the fault stays until there is a good sample
            self.restarts += 1
            self._failures = 0
        now_ms = ticks_ms()  # setting up took its time
        self._sample_ms = now_ms
        self._due_ms = ticks_add(now_ms, CHECK_MS if self._running else RETRY_MS)
