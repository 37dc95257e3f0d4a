"""What the display shows, and what a press of the button does.

The display shows the view in front. A notice is before all other views. Then follow a guided calibration, the menu, the
information about the sensor, a fault of the sensor, a message of the alignment by driving, and the page.

A page is a function in pages.py. To add a page called load, write pages.load, and add it to MOTORCYCLE or CAR.
CONTRIBUTING.md has the other steps.
"""

import gc
from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from ..errors import Notice, attempt
from ..units import const
from . import pages

MOTORCYCLE = (pages.lean, pages.maxima, pages.acceleration, pages.formula, pages.raw)
CAR = (pages.acceleration, pages.cornering, pages.raw)
_NOTICE_MS = const(2000)
_MENU_MS = const(20_000)  # time without a press after which the menu closes


class Screen:
    """The views of an App.

    tick() follows what has happened, lines() reads what to show.

    Attributes:
        view: the name of the view in front: "notice", "align", "six", "menu", "info", "fault", "question", or the name
            of a page, which is "own" for a page of the board's owner.
        shown: the Notice or Refusal in front, or None. A wizard has its own.
        notice: the Notice before all other views, or None. It disappears after two seconds, or with a press.
        wizard: the current AlignWizard or SixWizard, which takes every sample, or None.
        entry: the name of the menu's entry that is shown, or None.
    """

    def __init__(self, app):
        self._app = app
        self._pages = MOTORCYCLE if app.settings.leans else CAR
        self._at = 0  # index of the page in the ring
        self._menu = None  # the entries of the open menu, the shown entry first
        self._info = False  # True while the information about the sensor is open
        self.notice = self.wizard = None
        self._glance = None  # the module glance, or False if it cannot be loaded
        self._update()

    @property
    def entry(self):
        return self._menu[0][0] if self._menu else None

    def tick(self, now_ms):
        """Drop what has ended, and take the next notice. Call this method about every 100 ms, before lines()."""
        app = self._app
        if self.notice and ticks_diff(now_ms, self._notice_ms) >= 0:
            self.notice = None
        if app.notices and not self.notice:
            self.notice, self._notice_ms = app.notices.pop(0), ticks_add(now_ms, _NOTICE_MS)
        if self.wizard:
            self.wizard.tick(now_ms)
            if self.wizard.ended:
                self.wizard = None
        if self._menu and ticks_diff(now_ms, self._menu_ms) >= 0:
            self._menu = None
        self._update()
        if self.view == "question":
            self._at = 0  # the page that is shown after the rider's answer

    def _update(self):
        """Find the view in front."""
        app = self._app
        ring = self._ring()
        self._at %= len(ring)
        self._page = page = ring[self._at]
        self.shown = None
        if self.notice:
            self.view, self.shown = "notice", self.notice
        elif self.wizard:
            self.view = self.wizard.name
        elif self._menu:
            self.view = "menu"
        elif self._info:
            self.view = "info"
        elif app.sensor.fault is not None:
            self.view, self.shown = "fault", app.sensor.fault
        elif app.drive and app.drive.message:
            self.view, self.shown = "question", app.drive.message
        else:
            self.view = "own" if app.user and page in app.user.pages else page.__name__

    def _ring(self):
        """Return the pages in the order of short presses: functions of pages.py, then the owner's functions."""
        app = self._app
        ring = (pages.drive,) if app.drive and app.drive.shown else ()
        if app.calibration.aligned:
            ring = self._pages + ring
            if app.live:
                ring += (pages.live,)
            if app.rides.recorder.active:
                ring += (pages.recording,)
        else:
            ring += (pages.not_aligned,)
        return ring + tuple(app.user.pages) if app.user else ring

    def lines(self, now_ms):
        """Return the content of the display: two lines and, for a display that draws, a picture."""
        app, view = self._app, self.view
        if self.shown:
            return pages.words(self.shown)
        if self.wizard:
            return self.wizard.lines
        if view == "menu":
            count = len(self._menu)
            return pages.ARROW + self.entry, "next %d/%d hold=ok" % (count - self._menu.index(_LEAVE), count)
        if view == "info":
            return pages.sensor_info(app.sensor, app.clock.lost, app.meter, now_ms // 1000)
        page = self._page
        if view == "own":
            return page()
        if view == "drive":
            return page(app.drive, now_ms)
        if view == "live":
            return app.live.lines()
        if view == "recording":
            return page(app.rides.recorder)
        if view == "not_aligned":
            todo = "drive and brake" if pages.drive in self._ring() else "On stand: press"
            return page(app.meter, now_ms // 1000, todo)
        return self._readings(page)

    def _readings(self, page):
        """Return the lines of a page with readings, and its picture."""
        app, meter, glance = self._app, self._app.meter, self._pictures()
        if meter.fallen:
            return pages.FALLEN
        if meter.shown_deg(app.late) is None:
            lines = pages.unsure(meter.suppressed_reason or meter.odd)
            return lines + (glance.unsure(*lines),) if glance else lines
        line1, line2 = page(meter)
        recording = page is self._pages[0] and app.rides.recorder.active
        if recording:
            line1 = pages.recorded(line1)
        if glance and page in glance.PICTURES:
            return line1, line2, glance.PICTURES[page](meter, recording)
        return line1, line2

    def _pictures(self):
        """Return the module glance if the display draws and the module can be loaded, else None."""
        if self._app.lcd.draws and self._glance is None:
            self._glance = False
            attempt(self._load)
        return self._app.lcd.draws and self._glance

    def _load(self):
        from . import glance

        self._glance = glance

    def press(self, event, now_ms):
        """React to a press.

        If the press needs missing modules or too much memory, the rider gets a notice and the ride continues.

        Args:
            event: SHORT or LONG.
            now_ms: ticks_ms().
        """
        self.tick(now_ms)
        notice = attempt(self._press, event, now_ms)
        if notice:
            self._app.notices.append(notice)
        self.tick(now_ms)

    def _press(self, event, now_ms):
        if self.notice:  # the press ends the notice and is for the view below
            self.notice = None
            self._update()
            if self.view == "question":  # the rider has not seen the question yet, so the press is not its answer
                return
        if self.wizard:
            self.wizard.press(event)
        elif self._menu:
            self._press_menu(event, now_ms)
        elif self.view == "question":
            self._app.drive.answer(event == LONG)
        elif event == LONG:
            self._menu, self._menu_ms = self._entries(), ticks_add(now_ms, _MENU_MS)
        elif self._info:
            self._info = False
        elif self.view == "not_aligned" and not self._at:
            self._align(True)  # the press means that the bike is on its kickstand
        elif self.view != "fault":
            self._at += 1

    def _press_menu(self, event, now_ms):
        if event == SHORT:
            self._menu = self._menu[1:] + self._menu[:1]
            self._menu_ms = ticks_add(now_ms, _MENU_MS)
            return
        _, function, needs_readings = self._menu[0]
        self._menu = None
        fault = self._app.sensor.fault
        if needs_readings and fault is not None:
            self._app.notices.append(fault)
        elif function:
            function()

    def _entries(self):
        """Return the entries of the menu as a tuple of (name, function, True if it needs readings). A name has at most
        15 characters."""
        app = self._app
        entries = (("Align the bike", self._align, True),) if app.settings.leans else ()
        drive = (("Align by drive", self._align_by_drive, True),) if app.drive else ()
        rest = (
            ("Six positions", self._six, True),
            ("Reset maxima", self._reset, False),
            ("Sensor info", self._show_info, False),
        )
        entries += rest + drive if app.settings.leans else drive + rest
        active = app.rides.recorder.active
        entries += (("Stop recording", self._stop, False) if active else ("Record ride", self._record, True),)
        if app.user and app.user.pages:
            entries += (("Own pages", self._show_own, False),)
        if app.live:
            entries += (("Stop Bluetooth", app.live.stop, False),)
        return entries + (_LEAVE,)

    def interrupt(self):
        """Cancel the guided calibration because the sensor has failed, unless the wizard can continue."""
        if self.wizard and not self.wizard.bears(self._app.sensor.fault):
            self.wizard = None
            self._update()  # state() may ask before the display changes
            self._app.notices.append(Notice("stopped"))

    # The wizards are imported only when needed, because with their own imports they take 12 KB of heap. Garbage is
    # collected before the import. Without this collection the new modules, which stay loaded, would be placed at the
    # far end of the heap and make each later collection longer.

    def _align(self, pressed=False):
        gc.collect()
        from .wizard import AlignWizard

        self._at = 0
        settings, calibration = self._app.settings, self._app.calibration
        chip, rate_hz = self._app.sensor.chip, settings.SAMPLE_HZ
        self.wizard = AlignWizard(chip, rate_hz, calibration, settings.SIDE, pressed)

    def _six(self):
        gc.collect()
        from .six_wizard import SixWizard

        app = self._app
        self.wizard = SixWizard(app.sensor.chip, app.settings.SAMPLE_HZ, app.calibration)

    def _reset(self):
        self._app.meter.reset_maxima()
        self._app.notices.append(Notice("maxima-reset"))

    def _show_info(self):
        self._info = True

    def _show_own(self):
        self._at = self._ring().index(self._app.user.pages[0])

    def _align_by_drive(self):
        self._app.drive.ask()
        self._at = self._ring().index(pages.drive)

    def _record(self):
        rides = self._app.rides
        rides.start()
        if rides.recorder.active:
            self._app.notices.append(Notice("recording", *pages.recording(rides.recorder)))

    def _stop(self):
        self._app.rides.stop()
        self._app.notices.append(Notice("recording-ended"))


_LEAVE = ("Leave menu", None, False)
