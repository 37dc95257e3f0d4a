"""What the rider sees and what a press does: pages, menu, wizards, short notices."""

from time import ticks_add, ticks_diff

from . import pages
from .align_wizard import AlignWizard
from .button import LONG, SHORT
from .menu import ALIGN, INFO, RECORD, RESET, SIX, Menu
from .meter import FALLEN_DEG
from .mpu6050 import SATURATED
from .six_wizard import SixWizard

NOTICE_MS = 2000


class Screen:
    """settings: a Settings.  sensor: a Sensor.  meter: a LeanMeter.  save: for the wizards, called with a new
    Calibration, raises StoreError.  recorder: a Recorder.  record: called to begin a ride.

    wizard: the one under way, which wants every sample, or None.
    """

    def __init__(self, settings, sensor, meter, save, recorder, record):
        self.settings = settings
        self.sensor = sensor
        self.meter = meter
        self._save = save
        self._recorder = recorder
        self._record = record
        self.wizard = None
        self._page = 0
        self._pages = (pages.lean, pages.maxima, pages.acceleration, pages.formula, pages.raw)
        self._menu = None
        self._info = False
        self._notice = None
        self._notice_ms = 0

    def interrupt(self, now_ms):
        """The sensor fails: what it was calibrated for is broken off."""
        if self.wizard:
            self.wizard = None
            self._notify(("Calibration", "stopped: fault"), now_ms)

    def handle(self, event, now_ms):
        """Give the event to the wizard, the menu or the pages, whichever is on the display."""
        if self.wizard:
            self.wizard.step(event, now_ms)
            if self.wizard.ended:
                self.wizard = None
        elif self._menu:
            self._menu.step(event, now_ms)
            if self._menu.chosen is not None:
                self._choose(self._menu.chosen, now_ms)
                self._menu = None
        elif event == LONG:
            self._menu = Menu(now_ms, self._recorder.active)
        elif event == SHORT:
            self._turn_page()

    def _turn_page(self):
        if self._info:
            self._info = False
        elif self.meter.calibration.aligned:
            self._page = (self._page + 1) % (len(self._pages) + self._recorder.active)
        elif self.sensor.fault is None:
            self._align(pressed=True)

    def _align(self, pressed):
        self._page = 0
        self.wizard = AlignWizard(
            self.sensor.chip,
            SATURATED,
            self.settings.SAMPLE_HZ,
            self.meter.calibration,
            self.settings.SIDE,
            self._save,
            pressed,
        )

    def _choose(self, entry, now_ms):
        if entry == RESET:
            self.meter.reset_maxima()
            self._notify(("Maxima reset", ""), now_ms)
        elif entry == INFO:
            self._info = True
        elif entry == RECORD and self._recorder.active:
            self._recorder.stop()
            self._notify(("Recording ended", ""), now_ms)
        elif self.sensor.fault is not None and entry in (ALIGN, SIX, RECORD):
            self._notify(self.sensor.fault, now_ms)
        elif entry == ALIGN:
            self._align(pressed=False)
        elif entry == SIX:
            self.wizard = SixWizard(self.sensor.chip, SATURATED, self.settings.SAMPLE_HZ, self._save)

        elif entry == RECORD:
            self._record()
            if self._recorder.active:
                self._notify(pages.recording(self._recorder), now_ms)

    def _notify(self, lines, now_ms):
        self._notice = lines
        self._notice_ms = ticks_add(now_ms, NOTICE_MS)

    def lines(self, now_ms):
        """What the display should say now."""
        if self._recorder.problem:
            self._notify(self._recorder.problem, now_ms)
            self._recorder.problem = None
        if self._notice:
            if ticks_diff(now_ms, self._notice_ms) < 0:
                return self._notice
            self._notice = None
        if self.wizard:
            return self.wizard.lines
        if self._menu:
            return self._menu.lines
        if self.sensor.fault is not None:
            return self.sensor.fault
        if self._info:
            return pages.sensor_info(self.sensor, self.meter, now_ms // 1000)
        if not self.meter.calibration.aligned:
            return pages.not_aligned(self.meter, now_ms // 1000)
        if self.meter.fallen:
            return pages.FALLEN
        if not self.meter.trusted or abs(self.meter.lean_deg) > FALLEN_DEG:
            return pages.UNSURE
        if self._page >= len(self._pages):
            if self._recorder.active:
                return pages.recording(self._recorder)
            self._page = 0
        line1, line2 = self._pages[self._page](self.meter)
        if self._page == 0 and self._recorder.active:
            line1 = pages.recorded(line1)
        return line1, line2
