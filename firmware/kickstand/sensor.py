"""The chip kept alive: found, set up, watched, and set up again after a fault."""

from time import ticks_add, ticks_diff

from .mpu6050 import UnknownChip

CHECK_MS = 100  # before a page with readings of another range can be drawn; 0.4 ms each
RETRY_MS = 50
FAILURES = 3  # single failed transfers are ridden out
FROZEN_MS = 100  # noise changes a living chip's readings in every sample


class Sensor:
    """Readings of one chip that may fail at any time.

    chip: an Mpu6050.  reopen: called to free the bus, returns it as a machine.I2C.  read() never raises.
    fault: None, or two display lines that say what is wrong.  restarts: how often the chip was set up.
    """

    def __init__(self, chip, reopen, rate_hz):
        self.chip = chip
        self.reopen = reopen
        self._frozen_count = rate_hz * FROZEN_MS // 1000
        self._failures = 0
        self._same = 0
        self._checksum = 0
        self._due_ms = None  # of the next check, or of the next attempt while faulty
        self.restarts = 0
        self.fault = ("Kickstand", "starting")

    def read(self, now_ms):
        """True with a fresh sample in chip.counts; False where there is none, or none to trust."""
        if self.fault is not None:
            if self._due_ms is None or ticks_diff(now_ms, self._due_ms) >= 0:
                self._start(now_ms)
            return False
        try:
            self.chip.read()
            if ticks_diff(now_ms, self._due_ms) >= 0:
                self._due_ms = ticks_add(now_ms, CHECK_MS)
                if not self.chip.configured():  # a supply dip: asleep, with the ranges of the factory
                    self._fail("Sensor reset", "starting again", now_ms)
                    return False
        except OSError:
            self._failures += 1
            if self._failures >= FAILURES:
                self._fail("Sensor lost", "check wiring", now_ms)
            return False
        self._failures = 0
        if self._dead():
            self._fail("Sensor frozen", "starting again", now_ms)
            return False
        return True

    def _dead(self):
        """All zero or all -1 is no reading; nor is one that has not changed for a while."""
        counts = self.chip.counts
        total = 0
        for i in range(7):
            total = (total * 31 + counts[i]) & 0xFFFFFF
        self._same = self._same + 1 if total == self._checksum else 0
        self._checksum = total
        if counts[0] == counts[1] == counts[2] and counts[0] in (0, -1):
            return True
        return self._same >= self._frozen_count

    def _fail(self, line1, line2, now_ms):
        self.fault = (line1, line2)
        self._due_ms = now_ms  # the next read() tries at once

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
            self.fault = None
            self.restarts += 1
            self._failures = 0
            self._same = 0
        self._due_ms = ticks_add(now_ms, RETRY_MS if self.fault else CHECK_MS)
