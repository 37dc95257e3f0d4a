"""The device: connects sensor, mathematics, button, flash and display, and runs the loop.

Data flows in one direction: sensor -> calibration and alignment -> lean -> page -> display. The chip takes samples at
SAMPLE_HZ on its own. App.turn() processes the new samples. App.step() is one pass of the loop: it calls turn(),
collects garbage, feeds the watchdog and waits until the next pass is due.

Most of a pass is spent in the methods step, turn, _pass_on, LeanMeter.update_sum and Sensor.fetch. Each of these
methods must need at most eleven words for locals and stack, because MicroPython puts a larger stack frame on the heap.
After a frame on the heap is freed, MicroPython's next search for free memory begins where the frame was. This search
scans all garbage since the last collection, which takes up to 1 ms per pass.

MicroPython takes 20 us longer to set an attribute if the object's class has a property. So the classes whose objects
set attributes in each pass have no properties: Mpu6050, Sensor, SampleClock and BackgroundAlignment.
"""

import gc
import os
from time import sleep_ms, sleep_us, ticks_add, ticks_diff, ticks_ms, ticks_us

from .board import port
from .board.display import STOPPED
from .calibration.active import ActiveCalibration
from .calibration.parameters import Calibration
from .errors import report
from .lean.meter import LeanMeter
from .rides.rides import Rides
from .ui.screen import Screen
from .units import const

LOOP_US = 10_000  # length of a pass of the loop in us; the chip's FIFO can keep samples for much longer
_PLAN_EVERY = const(8)  # number of collections between two checks of the free heap; a check takes 3 to 7 ms
_PAGE_MS = const(100)
# A lean on the display must be at most half a second old. So a page shows no lean if its own delay plus the age of the
# readings in the FIFO is longer than _LATE_MS. A display that draws needs about _DRAWING_MS longer to send a picture
# than another display needs to send its lines (estimated).
_LATE_MS = const(400)
_DRAWING_MS = const(200)
# Time from the start of the sensor to the first page, long enough for the lean filter's first window
_FIRST_PAGE_MS = const(60)


# Worst values of the last run, which kickstand.status() prints. Ctrl-C sets them. The values are the length of the
# longest pass of the loop in us, the smallest free space found in the chip's FIFO, in samples, and the result of
# AxisWatch.shaken().
worst = None


class App:
    """The lean meter on a board.

    Args:
        settings: a Settings.
        lcd, sensor: results of Settings.open_lcd() and Settings.open_sensor().
        writer: see Rides.

    Attributes:
        notices: list of the Notices that the display shows next, one after the other.
        late: True if the readings are too old to be shown.
        live: an attached Live (see live/live.py), or None.
        user: the UserCode, or None.

    Raises SettingsError for pins that cannot be used.
    """

    def __init__(self, settings, lcd, sensor, writer=None):
        self.settings = settings
        self.lcd = lcd
        self.button = settings.open_button()
        self.sensor = sensor
        self.notices = []
        self.meter = LeanMeter(Calibration(), settings.leans, sensor.chip.gyro_delay_s)
        self.calibration = ActiveCalibration(self.meter)
        self.drive = self._open_drive() if settings.SPEED else None
        self.rides = Rides(self, writer)
        self.clock = sensor.clock
        self.late = False
        self._restarts = 0
        self._least_wait_us = LOOP_US
        self._page_ms = ticks_ms()
        self.live = self.user = None
        self.screen = Screen(self)
        self.user = self._open_user()

    def _open_user(self):
        try:
            os.stat("user.py")
        except OSError:
            return None
        from .user_code import UserCode  # imported only if needed, because it takes 3 KB of heap

        return UserCode(self)

    def _open_drive(self):
        # Imported only with a speed source, because it takes 30 KB of heap with its own imports
        from .drive_alignment.background import BackgroundAlignment
        from .speed.source import open_speed

        speed = open_speed(self.settings, self.notices)
        return BackgroundAlignment(self.settings.leans, speed, self.meter, self.calibration)

    def run(self):
        """Run the loop until Ctrl-C, one pass per LOOP_US. At the end the display says that the firmware has stopped,
        because an old lean must not stay on it."""
        try:
            self.begin()
            while True:
                self.step()
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                # Stop the watchdog first, because nothing feeds it now, and a second Ctrl-C may interrupt the next
                # steps.
                port.rest_watchdog()
            self.lcd.end(*STOPPED)
            global worst
            chip = self.sensor.chip
            shaken = chip.axes.shaken(self.clock.skipped)
            worst = LOOP_US - self._least_wait_us, chip.least_free_samples(), shaken
            # Ctrl-C ends the firmware; after an error the board is restarted instead
            if not isinstance(error, Exception):
                port.rest_watchdog()
                self.rides.stop()
                if self.live:
                    self.live.stop()
            raise

    def begin(self):
        """Prepare the loop: test the SD card, start the watchdog. Then call step() repeatedly."""
        if self.rides.on_card:
            self.lcd.show("SD card", "is being read")
            self.lcd.flush()
        self.rides.begin()
        self._watchdog = port.start_watchdog() if self.settings.WATCHDOG else None
        gc.threshold(-1)
        self._due_us = ticks_us()
        self._collections = 0
        self._plan_collection()

    def step(self):
        """Do one pass of the loop: turn(), collect garbage if it is time, feed the watchdog, wait. One pass takes
        LOOP_US."""
        self.turn()
        self._turns_left -= 1
        if self._turns_left <= 0:  # collect between two passes, while the FIFO keeps the samples
            gc.collect()
            self._plan_collection()
            if self.user:
                self.user.check_memory()
        if self._watchdog:
            self._watchdog.feed()
        self._due_us = ticks_add(self._due_us, LOOP_US)
        wait_us = ticks_diff(self._due_us, ticks_us())
        if wait_us < self._least_wait_us:
            self._least_wait_us = wait_us
        if wait_us > 0:
            if port.ONLY_MS_YIELD:
                sleep_ms(wait_us // 1000)
                wait_us = max(0, ticks_diff(self._due_us, ticks_us()))
            sleep_us(wait_us)
        else:  # the pass took too long, for example because of a write to flash: do not try to catch up
            self._due_us = ticks_us()

    @property
    def shown_deg(self):
        """As lean_deg, but 0 for a car whose readings may be shown."""
        return self.meter.shown_deg(self.late, self.sensor.fault)

    @property
    def lean_deg(self):
        """The lean in degrees, positive to the right, or None if it may not be shown. None for a car."""
        return self.shown_deg if self.settings.leans else None

    @property
    def trusted(self):
        """True if there is a lean to show."""
        return self.lean_deg is not None

    def _plan_collection(self):
        """Set the number of passes until the next garbage collection."""
        if self._collections % _PLAN_EVERY == 0:
            self._planned_turns = port.turns_to_collect()
        self._collections += 1
        self._turns_left = self._planned_turns

    def turn(self):
        """Process the samples in the FIFO and one press, and do at most one transfer to the display. Never wait."""
        now_us, now_ms = ticks_us(), ticks_ms()
        n, dt_us = self.sensor.fetch(now_ms), 0
        if n:
            if self._restarts != self.sensor.restarts:
                self._sensor_started()
            dt_us = self.clock.step(n, now_us)
            self._pass_on(n, dt_us, now_ms)
        if self.drive:
            self._poll_speed(now_ms)
        if self.screen.wizard:
            self.screen.guide(n, dt_us, now_ms)
        # The times are compared twice in this method, because a local variable would put the method's stack frame on
        # the heap
        if ticks_diff(now_ms, self._page_ms) >= 0:
            self.sensor.check(now_ms)
        if self.sensor.fault is not None:
            self.screen.interrupt()
        elif not self.sensor.chip.frames_left:
            self.clock.emptied(now_us)
        event = self.button.poll(now_ms)
        if event:
            self.screen.press(event, now_ms)
            if self.user:
                self.user.call("on_press", event)
        # Begin another ride before the next samples and speeds, so that the earlier ride gets none of them
        if self.calibration.changed:
            self.rides.split()
        if ticks_diff(now_ms, self._page_ms) >= 0:
            self._show(now_ms)
        self.lcd.tick(now_ms)
        if self.rides.recorder.active:  # read directly, because recording() would cost 20 us
            self.rides.recorder.tick()
        if self.live:
            self.live.poll(now_ms)

    @property
    def recording(self):
        """True while a ride is being recorded."""
        return self.rides.recorder.active

    def _poll_speed(self, now_ms):
        recorder = self.rides.recorder
        if recorder.stalled:  # a write, or the start or end of a ride, has stopped the loop for some time
            recorder.stalled = False
            self.drive.speed.source.after_stall(now_ms)
        speed = self.drive.poll(now_ms)
        if recorder.active:
            recorder.add_fix(speed, self.drive.speed.source.place(now_ms))

    def _show(self, now_ms):
        """Show the view in front. Also do two tasks that run at the same rate: prepare a recording while the menu shows
        its entry, and save the roll-misalignment correction at standstill."""
        waiting_ms = 1000 * self.sensor.chip.frames_left // self.settings.SAMPLE_HZ
        self.late = ticks_diff(now_ms, self._page_ms) + waiting_ms > _LATE_MS - _DRAWING_MS * self.lcd.draws
        self._page_ms = ticks_add(now_ms, _PAGE_MS)
        screen = self.screen
        if screen.menu and screen.menu.records:
            self.rides.prepare()
        axes = self.sensor.chip.axes
        if axes.notice:
            report(axes.notice, self.notices)
            axes.notice = None
        if self.user:
            self.user.call("on_lean", self.meter.lean_deg, self.trusted, self.meter)
        screen.tick(now_ms)
        if screen.view != "fault" or self.sensor.fault.code != "starting":  # the display already says "starting"
            self.lcd.show(*screen.lines(now_ms))
        if not screen.wizard:
            self.calibration.keep_trim(now_ms)

    def _pass_on(self, n, dt_us, now_ms):
        """Pass on the sum of n new samples. dt_us: time from the previous sample to the last new sample."""
        chip = self.sensor.chip
        self.meter.update_sum(chip.sums, n, dt_us)
        if self.rides.recorder.active:
            self.rides.recorder.add(chip.sums, n, dt_us)
        if self.drive:
            self.drive.feed(chip.sums, n, dt_us, now_ms)
        if self.live and self.live.period_ms:
            self.live.feed(chip.sums, n)

    def _sensor_started(self):
        """Handle a chip that was set up at the start or after a fault. After a fault the chip may be another one than
        before."""
        self._restarts = self.sensor.restarts
        self.clock.restart()
        self.meter.restart()
        if self.recording:
            self.rides.recorder.mark_gap()
        if self.calibration.chip_started(self.sensor.chip):
            self.rides.split()
            self.rides.start_due()
        # Delay the first page, because a page shown now would only say that there is no lean yet
        self._page_ms = ticks_add(ticks_ms(), _FIRST_PAGE_MS)
