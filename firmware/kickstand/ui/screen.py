"""A stack of views. The display shows the front view, and that view gets the presses of the button.

A view has lines(now_ms), which returns two lines of 16 characters, or None while it has nothing to show, and
press(event, now_ms), which returns True if it used the press. Its name tells programs which view it is.
"""

import gc
from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from ..errors import attempt
from ..units import const
from . import messages, pages
from .page_ring import PageRing

_NOTICE_MS = const(2000)


class NoticeView:
    """Shows two lines for two seconds. A press ends the notice early and is passed to the view below. code: the code of
    the Notice, or None."""

    name = "notice"

    def __init__(self):
        self._lines = self.code = None
        self._until_ms = 0

    def show(self, lines, now_ms, code=None):
        """Show two lines for _NOTICE_MS from now on."""
        self._lines = lines
        self.code = code
        self._until_ms = ticks_add(now_ms, _NOTICE_MS)

    def lines(self, now_ms):
        if self._lines and ticks_diff(now_ms, self._until_ms) >= 0:
            self._lines = None
        return self._lines

    def press(self, event, now_ms):
        self._lines = None
        return False


class View:
    """A view made of two functions, lines and press."""

    def __init__(self, name, lines, press):
        self.name = name
        self.lines = lines
        self.press = press


class Screen:
    """The views of the device. settings: a Settings. sensor, clock, meter: the Sensor, its SampleClock and the
    LeanMeter to show. calibration: the ActiveCalibration. drive: the BackgroundAlignment or None. rides: the Recording,
    which the menu can start and stop.

    wizard: the current AlignWizard or SixWizard, which takes every sample, or None. menu: the open Menu, or None.
    pages: the PageRing. front: the view that the display shows.
    """

    def __init__(self, settings, sensor, clock, meter, calibration, drive, rides):
        self._settings = settings
        self._sensor = sensor
        self._meter = meter
        self._calibration = calibration
        self._drive = drive
        self._rides = rides
        self.wizard = None
        self.menu = None
        self._notice = NoticeView()
        # says why readings are missing
        self._fault = View(
            "fault", lambda now_ms: sensor.fault and messages.lines(sensor.fault), lambda event, now_ms: False
        )
        self._clock = clock
        self._info_open = False
        self._info = View("info", self._info_lines, self._press_info)
        # a report of alignment by driving, or a question to the rider
        self._question = View(
            "question", lambda now_ms: drive and drive.message and messages.lines(drive.message), self._press_question
        )
        self.pages = PageRing(settings.leans, meter, calibration, drive, rides, self._align_now)
        self.front = self.pages

    def lines(self, now_ms):
        """The content for the display: two lines and, if it draws, a picture. Call it about every 100 ms."""
        self.front, lines = self._update_front(now_ms)
        return lines

    def press(self, event, now_ms):
        """React to a press. event: SHORT or LONG. A long press that the front view does not use opens the menu. If the
        press needs missing modules or too much memory, the rider gets a notice and the ride continues."""
        problem = attempt(self._press, event, now_ms)
        if problem:
            self.notify(problem, now_ms)

    def notify(self, notice, now_ms):
        """Show a Notice for two seconds."""
        self._notice.show(messages.lines(notice), now_ms, notice.code)

    def _press(self, event, now_ms):
        view = self._update_front(now_ms)[0]
        if view is self._notice:  # a press ends the notice and is passed to the view below it,
            self._notice.press(event, now_ms)
            view = self._update_front(now_ms)[0]
            if view is self._question:  # except to a question, which the rider has not seen yet
                return
        if not view.press(event, now_ms) and event == LONG:
            self._open_menu(now_ms)
        self._drop_ended()

    def _info_lines(self, now_ms):
        """Show the chip's name, its temperature and the calibrated parts, until a short press."""
        if not self._info_open:
            return None
        return pages.sensor_info(self._sensor, self._clock.lost, self._meter, now_ms // 1000)

    def _show_info(self, now_ms):
        self._info_open = True

    def _press_info(self, event, now_ms):
        self._info_open = event != SHORT
        return event == SHORT

    def _press_question(self, event, now_ms):
        self._drive.answer(event == LONG)
        return True

    def interrupt(self, now_ms):
        """Cancel the current calibration because the sensor has failed, unless the wizard can continue."""
        if self.wizard and not self.wizard.bears(self._sensor.fault, now_ms):
            self.wizard = None
            self._notice.show(("Calibration", "stopped: fault"), now_ms, "stopped")

    def _update_front(self, now_ms):
        """Return the view in front and its two lines. The front is the first view in the order below that has something
        to show. Drop a wizard or menu that has ended. Go back to the first page when a question is shown."""
        for view in (self._notice, self.wizard, self.menu, self._info, self._fault, self._question, self.pages):
            lines = view.lines(now_ms) if view else None
            if lines:
                break
        self._drop_ended()
        if view is self._question:
            self.pages.first()  # shown after the rider's answer
        return view, lines

    def _drop_ended(self):
        """Drop a wizard or a menu that has ended."""
        if self.wizard and self.wizard.ended:
            self.wizard = None
        if self.menu and self.menu.ended:
            self.menu = None

    def _open_menu(self, now_ms):
        from .menu import Menu  # imported at the first long press

        self.menu = Menu(self._entries(), now_ms)

    def _entries(self):
        """Return the entries of the menu: (name, function to call with now_ms)."""
        align = (("Align the bike", self._align),)
        drive = (("Align by drive", self._align_by_drive),) if self._drive else ()
        rest = (("Six positions", self._six), ("Reset maxima", self._reset), ("Sensor info", self._show_info))
        record = ("Stop recording", self._stop) if self._rides.recorder.active else ("Record ride", self._record)
        last = (record,) + ((("Own pages", self.pages.show_own),) if self.pages.own else ())
        last += (("Stop Bluetooth", self.pages.live.stop),) if self.pages.live else ()
        if self._settings.leans:
            return align + rest + drive + last
        return drive + rest + last

    def _ready(self, now_ms):
        """Return True if there are readings. If not, show a notice with the reason."""
        fault = self._sensor.fault
        if fault is not None:
            self.notify(fault, now_ms)
        return fault is None

    def _align(self, now_ms):
        if self._ready(now_ms):
            self._begin_align(False)

    def _align_now(self):
        """Start the AlignWizard as if the button had been pressed for the kickstand pose."""
        self._begin_align(True)

    # The wizards are imported when needed, because with their own imports they take 12 KB of heap. Garbage is collected
    # before the import: otherwise lasting objects would be placed at the far end of the heap and make each later
    # collection longer.

    def _begin_align(self, pressed):
        gc.collect()
        from .align_wizard import AlignWizard

        self.pages.first()
        settings = self._settings
        self.wizard = AlignWizard(self._sensor.chip, settings.SAMPLE_HZ, self._calibration, settings.SIDE, pressed)

    def _six(self, now_ms):
        if self._ready(now_ms):
            gc.collect()
            from .six_wizard import SixWizard

            self.wizard = SixWizard(self._sensor.chip, self._settings.SAMPLE_HZ, self._calibration)

    def _reset(self, now_ms):
        self._meter.reset_maxima()
        self._notice.show(("Maxima reset", ""), now_ms)

    def _align_by_drive(self, now_ms):
        if self._ready(now_ms):
            self._drive.ask()
            self.pages.drive()

    def _record(self, now_ms):
        if self._ready(now_ms):
            problem = self._rides.start()
            if problem:
                self.notify(problem, now_ms)
            elif self._rides.recorder.active:
                self._notice.show(pages.recording(self._rides.recorder), now_ms)

    def _stop(self, now_ms):
        self._rides.stop()
        self._notice.show(("Recording ended", ""), now_ms)
