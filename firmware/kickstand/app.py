"""The device: wires sensor, mathematics, button, store and display, and owns the loop.

sensor -> calibration and alignment -> lean -> page -> display, in one direction. The chip samples at SAMPLE_HZ by
itself; a turn of the loop takes what has come in.

What lasts for most of a turn (step, _take, LeanMeter.update, Sensor.fetch) needs at most eleven words for locals and
stack: more of them MicroPython keeps on the heap, and where they were freed the next search for memory begins, before
all that the turns since the last collection have left. That took up to a millisecond a turn.
"""

import gc
from time import sleep_us, ticks_add, ticks_diff, ticks_ms, ticks_us

from .board import port
from .calibration.parameters import Calibration
from .calibration.store import Store
from .devices import open_button, open_sensor
from .errors import StoreError
from .imu.mpu6050 import GYRO_DELAY_S
from .imu.sample_clock import SampleClock
from .lean.meter import LeanMeter
from .rides.flash_ring import RideRing
from .rides.recorder import Recorder
from .ui.screen import Screen

LOOP_US = 10_000  # the chip's FIFO keeps the samples meanwhile, and much longer
COLLECT_TURNS = 25  # 70 KB of heap: less than half of what is free
SINGLE_GAPS = 300  # that a collection leaves
PAGE_MS = 100
TRIM_MS = 60_000


def fill_gaps(n):
    """Take n single places of the heap, one by one and for nothing: else each object that needs more than one place
    would be searched for past all of them, until samples have filled them. 2 ms here in place of 0.4 in samples."""
    value = 0.5
    for _ in range(n):
        value = -value


class App:
    """The lean meter on a board. settings: a Settings.  lcd: of hardware.open_lcd().  keeper: of its rides, see
    Recorder; one that is given gets a ride from the start. Raises SettingsError for pins that cannot be used."""

    def __init__(self, settings, lcd, keeper=None):
        self.settings = settings
        self.lcd = lcd
        self.button = open_button(settings)
        self.sensor = open_sensor(settings)
        self.store = None  # until the chip has said who it is: a calibration belongs to one chip
        self.meter = LeanMeter(Calibration(), settings.VEHICLE == "motorcycle", GYRO_DELAY_S[settings.DLPF])
        self.drive = self._open_drive() if settings.SPEED else None
        self._clock = SampleClock(1_000_000 // settings.SAMPLE_HZ)
        self._restarts = 0
        self.recorder = Recorder(keeper or RideRing(settings), settings.SAMPLE_HZ)
        self._record_due = settings.RECORD or keeper is not None
        self.screen = Screen(settings, self.sensor, self.meter, self.drive, self._save, self.recorder, self._record)
        self._page_ms = ticks_ms()
        self._trim_ms = self._page_ms
        self._fault_shown = False

    def _open_drive(self):
        from .drive_alignment.background import (
            DriveMode,  # 30 KB of heap with all that they import: not for those without a source
        )
        from .speed.source import open_speed

        return DriveMode(self.settings.VEHICLE, open_speed(self.settings), self.meter, self._keep)

    def run(self):
        """Loop until Ctrl-C, LOOP_US a turn."""
        try:
            self._loop()
        except KeyboardInterrupt:
            self.recorder.stop()
            raise

    def _loop(self):
        watchdog = port.start_watchdog() if self.settings.WATCHDOG else None
        gc.threshold(-1)
        due_us = ticks_us()
        turns = 0
        while True:
            self.step()
            turns += 1
            if turns >= COLLECT_TURNS:  # here and not in the middle of a sample; the FIFO keeps what comes meanwhile
                turns = 0
                gc.collect()
                fill_gaps(SINGLE_GAPS)
            if watchdog:
                watchdog.feed()
            due_us = ticks_add(due_us, LOOP_US)
            wait_us = ticks_diff(due_us, ticks_us())
            if wait_us > 0:
                sleep_us(wait_us)
            else:  # late, as after setting the chip up: count from here instead of racing to catch up
                due_us = ticks_us()

    def step(self):
        """One turn of the loop: the samples that wait, one event, at most one transfer to the display."""
        now_us, now_ms = ticks_us(), ticks_ms()
        n = self.sensor.fetch(now_ms)
        if n:
            dt_us = self._clock.step(n, now_us)
            self._take(n, dt_us, now_ms)
        if self.drive:
            self._poll_speed(now_ms)
        self.sensor.check(now_ms)
        if self.sensor.fault is not None:
            self._clock.restart()
            self.screen.interrupt(now_ms)
            if not self._fault_shown:
                self._page_ms = now_ms  # at once: the next thing is to start the sensor again
        elif not self.sensor.chip.left:
            self._clock.emptied(now_us)
        self.screen.handle(self.button.poll(now_ms), now_ms)
        if ticks_diff(now_ms, self._page_ms) >= 0:
            self._show(now_ms)
        self.lcd.tick(now_ms)
        if self.recorder.active:
            self.recorder.tick()
        if self.recorder.stalled:
            self.recorder.stalled = False
            if self.drive:
                self.drive.speed.skip(ticks_ms())

    def _poll_speed(self, now_ms):
        speed = self.drive.poll(now_ms)
        if speed is not None and self.recorder.active:
            self.recorder.add_speed(int(100 * speed + 0.5))

    def _show(self, now_ms):
        """The page as it is now."""
        self._page_ms = ticks_add(now_ms, PAGE_MS)
        self._fault_shown = self.sensor.fault is not None
        line1, line2 = self.screen.lines(now_ms)
        self.lcd.show(line1, line2)
        self._keep_trim(now_ms)

    def _record(self):
        """Begin a ride. Where the bike stands the filter begins with it, so that a replay shows the same, and finds the
        gyro's errors anew in the first turns. A ride begun on the way is replayed with a filter that still has to find
        what this one knows."""
        if self.meter.at_rest:
            self._save_trim()
            self.meter.use(self.meter.calibration)
        self.recorder.start(self.sensor.chip, self.meter.calibration)

    def _keep_trim(self, now_ms):
        """What riding taught about upright goes to flash when the bike stands, at most once in TRIM_MS."""
        if self.screen.wizard or not self.meter.calibration.aligned:
            return
        if ticks_diff(now_ms, self._trim_ms) < TRIM_MS:
            return
        if self._save_trim():
            self._trim_ms = now_ms

    def _save_trim(self):
        """True if there was something to save."""
        if not self.meter.keep_trim() or not self.store.unchanged():
            return False
        try:
            self.store.save(self.meter.calibration)
        except StoreError as error:  # the next ride finds it again
            print(error.reason)
        return True

    def _take(self, n, dt_us, now_ms):
        """The n samples that came in, dt_us after those before: each to the wizard, all at once to the meter."""
        if self._restarts != self.sensor.restarts:
            self._restarts = self.sensor.restarts
            self._sensor_started()
        chip = self.sensor.chip
        self.meter.update_sum(chip.sums, n, dt_us)
        if self.recorder.active:
            self.recorder.add(chip.sums, n, dt_us)
        if self.drive:
            self.drive.feed(chip.sums, n, dt_us, now_ms)
        if self.screen.wizard:
            self._teach(n, now_ms)

    def _teach(self, n, now_ms):
        chip, wizard = self.sensor.chip, self.screen.wizard
        for k in range(n):
            chip.take(k)
            wizard.sample(chip.counts, now_ms)

    def _sensor_started(self):
        """The chip runs, for the first time or again after a fault, perhaps another one."""
        chip = self.sensor.chip
        self.meter.restart()
        self.recorder.interrupt()
        if self.store is None or self.store.who_am_i != chip.who_am_i:
            self.store = Store(chip.who_am_i, chip.accel_range_g)
            self._use(self.store.load())
            if self._record_due:
                self._record_due = False
                self._record()

    def _use(self, calibration):
        """From flash or from a wizard: nothing of before counts."""
        self._set(calibration)
        self.meter.reset_maxima()
        if self.drive:
            self.drive.begin()

    def _set(self, calibration):
        chip = self.sensor.chip
        calibration.set_scale(chip.accel_lsb_per_g, chip.gyro_lsb_per_dps)
        self.meter.use(calibration)
        if self.recorder.active:  # a ride has one calibration
            self.recorder.start(chip, calibration)

    def _save(self, calibration):
        """For the wizards: on flash first, then in use. Raises StoreError."""
        self.store.save(calibration)
        self._use(calibration)

    def _keep(self, calibration):
        """For alignment by driving, which goes on. Raises StoreError."""
        self.store.save(calibration)
        self._set(calibration)
