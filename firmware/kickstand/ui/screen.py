"""A stack of views. The display shows the front view, and the front view gets the presses of the button.

A view has these attributes:
* lines(now_ms) returns two lines of 16 characters, or None while the view has nothing to show.
* press(event, now_ms) returns True if the view used the press.
* name is the view's name for programs.
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
    """Shows two lines for two seconds. A press ends the notice early and is passed to the view below.

    Attributes:
        code: the code of the Notice, or None.
    """

    name = "notice"

    def __init__(self):
        self._lines = self.code = None
        self._until_ms = 0

    def show(self, lines, now_ms, code=None):
        """Show two lines for _NOTICE_MS."""
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
    """A view that consists of a name and two functions, lines and press."""

    def __init__(self, name, lines, press):
        self.name = name
        self.lines = lines
        self.press = press


class Screen:
    """The views of the device.

    Args:
        settings: a Settings.
        sensor: the Sensor.
        clock: the SampleClock.
        meter: the LeanMeter.
        calibration: the ActiveCalibration.
        drive: the BackgroundAlignment, or None.
        rides: the Recording, which the menu can start and stop.

    Attributes:
        wizard: the current AlignWizard or SixWizard, which takes every sample, or None.
        menu: the open Menu, or None.
        pages: the PageRing.
        front: the view that the display shows.
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
        # the view with the reason why readings are missing
        self._fault = View(
            "fault", lambda now_ms: sensor.fault and messages.lines(sensor.fault), lambda event, now_ms: False
        )
        self._clock = clock
        self._info_open = False
        self._info = View("info", self._info_lines, self._press_info)
        # the view with a report of alignment by driving, or a question to the rider
        self._question = View(
            "question", lambda now_ms: drive and drive.message and messages.lines(drive.message), self._press_question
        )
        self.pages = PageRing(settings.leans, meter, calibration, drive, rides, self._align_now)
        self.front = self.pages

    def lines(self, now_ms):
        """Return the content of the display: two lines and, for a display that draws, a picture. Call this method about
        every 100 ms."""
        self.front, lines = self._update_front(now_ms)
        return lines

    def press(self, event, now_ms):
        """React to a press. A long press that the front view does not use opens the menu.

        If the press needs missing modules or too much memory, the rider gets a notice and the ride continues.

        Args:
            event: SHORT or LONG.
            now_ms: ticks_ms().
        """
        problem = attempt(self._press, event, now_ms)
        if problem:
            self.notify(problem, now_ms)

    def notify(self, notice, now_ms):
        """Show a Notice for two seconds."""
        self._notice.show(messages.lines(notice), now_ms, notice.code)

    def _press(self, event, now_ms):
        view = self._update_front(now_ms)[0]
        if view is self._notice:  # the press ends the notice and is passed to the view below
            self._notice.press(event, now_ms)
            view = self._update_front(now_ms)[0]
            if view is self._question:  # the rider has not seen the question yet, so the press is not its answer
                return
        if not view.press(event, now_ms) and event == LONG:
            self._open_menu(now_ms)
        self._drop_ended()

    def _info_lines(self, now_ms):
        """Return the lines about the sensor until a short press closes them."""
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
        """Find the front view, the first view in this method's order that has something to show.

        Also drop a wizard or menu that has ended, and go back to the first page when a question is shown.

        Returns:
            view: the front view.
            lines: its lines.
        """
        for view in (self._notice, self.wizard, self.menu, self._info, self._fault, self._question, self.pages):
            lines = view.lines(now_ms) if view else None
            if lines:
                break
        self._drop_ended()
        if view is self._question:
            self.pages.first()  # go to the first page, which is shown after the rider's answer
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
        """Return the entries of the menu as a tuple of (name, function), see Menu."""
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
        """Start the AlignWizard with the kickstand pose, because the rider has just pressed the button for it."""
        self._begin_align(True)

    # The wizards are imported only when needed, because with their own imports they take 12 KB of heap. Garbage is
    # collected before the import. Without this collection the new modules, which stay loaded, would be placed at the
    # far end of the heap and make each later collection longer.

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
