"""What the display shows, and what a press of the button does.

The display shows the view in front. A notice is before all other views. Then follow a guided calibration, the menu, the
information about the sensor, a fault of the sensor, a message of the alignment by driving, and the page.
"""

import gc
from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..errors import Notice, attempt, unload
from ..units import const
from .pages import CAR, FALLEN, MOTORCYCLE, live, not_aligned, recorded, recording, unsure, words

_NOTICE_MS = const(2000)
# The modules that only the wizards need
_OF_WIZARDS = ("ui.six_wizard", "ui.wizard", "calibration.six_position", "calibration.poses")


class Screen:
    """The views of an App.

    tick() follows what has happened, lines() reads what to show.

    Attributes:
        view: the name of the view in front: "notice", "align", "six", "menu", "info", "fault", "question", or the name
            of a page, which is "own" for a page of the board's owner.
        shown: the Notice or Refusal in front, or None. A wizard has its own.
        notice: the Notice before all other views, or None. It disappears after two seconds, or with a press.
        wizard: the current AlignWizard or SixWizard, which takes every sample, or None.
        menu: the Menu while it or the information about the sensor is open, or None.
    """

    def __init__(self, app):
        self._app = app
        self._pages = MOTORCYCLE if app.settings.leans else CAR
        self._drive = None  # the page of the alignment by driving, or None
        if app.drive:
            from .drive_page import drive

            self._drive = drive
        self._at = 0  # index of the page in the ring
        self.notice = self.wizard = self.menu = None
        self._glance = None  # the module glance, or False if it cannot be loaded
        self._update()

    def tick(self, now_ms):
        """Drop what has ended, and take the next notice. Call this method about every 100 ms, before lines()."""
        app = self._app
        if self.notice and ticks_diff(now_ms, self._notice_ms) >= 0:
            self.notice = None
        if app.notices and not self.notice:
            self.notice, self._notice_ms = app.notices.pop(0), ticks_add(now_ms, _NOTICE_MS)
        if self.menu:
            self.menu.tick(now_ms)
        self._update()
        if self.view == "question":
            self._at = 0  # the page that is shown after the rider's answer

    def _update(self):
        """Find the view in front."""
        app = self._app
        if self.wizard and self.wizard.ended:
            self._end_wizard()
        if self.menu and not self.menu.view:
            self.menu = None
            unload("ui.menu")
        ring = self._ring()
        self._at %= len(ring)
        self._page = page = ring[self._at]
        self.shown = None
        if self.notice:
            self.view, self.shown = "notice", self.notice
        elif self.wizard:
            self.view = self.wizard.name
        elif self.menu:
            self.view = self.menu.view
        elif app.sensor.fault is not None:
            self.view, self.shown = "fault", app.sensor.fault
        elif app.drive and app.drive.message:
            self.view, self.shown = "question", app.drive.message
        else:
            self.view = "own" if app.user and page in app.user.pages else page.__name__

    def _ring(self):
        """Return the pages in the order of short presses: those of pages.py, then the owner's."""
        app = self._app
        ring = (self._drive,) if app.drive and app.drive.shown else ()
        if app.calibration.aligned:
            ring = self._pages + ring
            if app.live:
                ring += (live,)
            if app.rides.recorder.active:
                ring += (recording,)
        else:
            ring += (not_aligned,)
        return ring + tuple(app.user.pages) if app.user else ring

    def lines(self, now_ms):
        """Return the content of the display: two lines and, for a display that draws, a picture."""
        app, view = self._app, self.view
        if self.shown:
            return words(self.shown)
        if self.wizard:
            return self.wizard.lines
        if self.menu:
            return self.menu.lines(now_ms)
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
            todo = "drive and brake" if self._drive in self._ring() else "On stand: press"
            return page(app.meter, now_ms // 1000, todo)
        return self._readings(page)

    def _readings(self, page):
        """Return the lines of a page with readings, and its picture."""
        app, meter, glance = self._app, self._app.meter, self._pictures()
        if meter.fallen:
            return FALLEN
        if app.shown_deg is None:
            lines = unsure(meter.suppressed_reason or meter.odd)
            return lines + (glance.unsure(*lines),) if glance else lines
        line1, line2 = page(meter)
        recording = page is self._pages[0] and app.rides.recorder.active
        if recording:
            line1 = recorded(line1)
        if glance and self.view in glance.PICTURES:
            return line1, line2, glance.PICTURES[self.view](meter, recording, line2)
        return line1, line2

    def _pictures(self):
        """Return the module glance if the display draws and the module can be loaded, else None."""
        if self._app.lcd.draws and self._glance is None:
            self._glance = False
            attempt(None, self._load)
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
        attempt(self._app.notices, self._press, event, now_ms)
        self.tick(now_ms)

    def guide(self, n, dt_us, now_ms):
        """Pass the samples and the time to the wizard, once per pass of the loop. If memory is too short, the wizard
        ends with a notice.

        Args:
            n: number of new samples, which the chip has, or 0.
            dt_us: microseconds since the previous samples.
            now_ms: ticks_ms().
        """
        if attempt(self._app.notices, self.wizard.follow, n, dt_us, now_ms):
            self._end_wizard()
            self._update()

    def _press(self, event, now_ms):
        if self.notice:  # the press ends the notice and is for the view below
            self.notice = None
            self._update()
            if self.view == "question":  # the rider has not seen the question yet, so the press is not its answer
                return
        if self.wizard:
            self.wizard.press(event)
        elif self.menu:
            self.menu.press(event, now_ms)
        elif self.view == "question":
            self._app.drive.answer(event == LONG)
        elif event == LONG:
            self._open_menu(now_ms)
        elif self.view == "not_aligned" and not self._at:
            self.align(True)  # the press means that the bike is on its kickstand
        elif self.view != "fault":
            self._at += 1

    def interrupt(self):
        """Cancel the guided calibration because the sensor has failed, unless the wizard can continue."""
        if self.wizard and not self.wizard.bears(self._app.sensor.fault):
            self._end_wizard()
            self._update()  # state() may ask before the display changes
            self._app.notices.append(Notice("stopped"))

    # Menu and wizards are loaded only while they are open, because the wizards with their own imports take 12 KB of
    # heap. Garbage is collected before the import. Without this collection the new modules would be placed at the far
    # end of the heap and make each collection longer.

    def _open_menu(self, now_ms):
        gc.collect()
        from .menu import Menu

        self.menu = Menu(self, self._app, now_ms)

    def align(self, pressed=False):
        """Begin the alignment by two poses. pressed: True if the bike is on its kickstand already."""
        gc.collect()
        from .wizard import AlignWizard

        self._at = 0
        self.wizard = AlignWizard(self._app, pressed)

    def _end_wizard(self):
        self.wizard = None
        for name in _OF_WIZARDS:
            unload(name)

    def turn_to(self, page):
        """Show a page of the ring."""
        self._at = self._ring().index(page)
