"""What the rider sees and what a press does: pages, menu, wizards, short notices."""

from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from ..imu.mpu6050 import SATURATED
from ..lean.meter import FALLEN_DEG
from . import pages
from .align_wizard import AlignWizard
from .menu import ALIGN, DRIVE, INFO, LEAVE, RECORD, RESET, SIX, STOP, Menu
from .six_wizard import SixWizard

NOTICE_MS = 2000


class Screen:
    """settings: a Settings.  sensor: a Sensor.  meter: a LeanMeter.  drive: a DriveMode, None without a speed source.
    save: for the wizards, called with a new Calibration, raises StoreError.  recorder: a Recorder.  record: called to
    begin a ride.

    wizard: the one under way, which wants every sample, or None.
    """

    def __init__(self, settings, sensor, meter, drive, save, recorder, record):
        self.settings = settings
        self.sensor = sensor
        self.meter = meter
        self.drive = drive
        self._save = save
        self._recorder = recorder
        self._record = record
        self.wizard = None
        self._page = 0
        self._pages = (pages.lean, pages.maxima, pages.acceleration, pages.formula, pages.raw)
        self._entries = (ALIGN, SIX, RESET, INFO) + ((DRIVE,) if drive else ())
        if settings.VEHICLE == "car":
            self._pages = (pages.acceleration, pages.cornering, pages.raw)
            self._entries = (DRIVE, SIX, RESET, INFO)
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
        elif event and self._asking(now_ms):
            self.drive.answer(event)
        elif event == LONG:
            self._menu = Menu(self._entries + (STOP if self._recorder.active else RECORD, LEAVE), now_ms)
        elif event == SHORT:
            self._turn_page()

    def _asking(self, now_ms):
        """True while alignment by driving has a message, and nothing else is in front of it."""
        if self.sensor.fault is not None or self._info or self._noticed(now_ms):
            return False
        return self.drive is not None and self.drive.message is not None

    def _noticed(self, now_ms):
        """The notice, while it lasts, else None."""
        if self._notice and ticks_diff(now_ms, self._notice_ms) >= 0:
            self._notice = None
        return self._notice

    def _turn_page(self):
        if self._info:
            self._info = False
        elif self._driving or self.meter.calibration.aligned:
            self._page += 1
        elif self.sensor.fault is None:
            self._align(pressed=True)

    @property
    def _driving(self):
        """True while what alignment by driving waits for is a page, the first until there is an alignment."""
        return self.drive is not None and self.drive.shown

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
        elif entry == STOP:
            self._recorder.stop()
            self._notify(("Recording ended", ""), now_ms)
        elif self.sensor.fault is not None and entry in (ALIGN, SIX, DRIVE, RECORD):
            self._notify(self.sensor.fault, now_ms)
        elif entry == ALIGN:
            self._align(pressed=False)
        elif entry == DRIVE:
            self.drive.ask()
            self._page = len(self._pages) if self.meter.calibration.aligned else 0
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
        problem = self._recorder.take_problem()
        if problem:
            self._notify(problem, now_ms)
        if self._noticed(now_ms):
            return self._notice
        if self.wizard:
            return self.wizard.lines
        if self._menu:
            return self._menu.lines
        if self.sensor.fault is not None:
            return self.sensor.fault
        if self._info:
            return pages.sensor_info(self.sensor, self.meter, now_ms // 1000)
        if self._asking(now_ms):
            self._page = 0  # after it
            return self.drive.message
        return self._page_lines(now_ms)

    def _page_lines(self, now_ms):
        if not self.meter.calibration.aligned:
            if not self._driving:
                return pages.not_aligned(self.meter, now_ms // 1000)
            if self._page % 2 == 0:
                return self.drive.lines(now_ms)
            return pages.not_aligned(self.meter, now_ms // 1000, "drive and brake")
        count = len(self._pages) + self._driving + self._recorder.active
        if self._page >= count:  # here and not in each use: when a page goes, the others stay where they are
            self._page = 0
        page = self._page
        if page == len(self._pages) and self._driving:
            return self.drive.lines(now_ms)
        if page >= len(self._pages):
            return pages.recording(self._recorder)
        if self.meter.fallen:
            return pages.FALLEN
        if not self.meter.trusted or abs(self.meter.lean_deg) > FALLEN_DEG:
            return pages.unsure(self.meter.doubt)
        line1, line2 = self._pages[page](self.meter)
        if page == 0 and self._recorder.active:
            line1 = pages.recorded(line1)
        return line1, line2
