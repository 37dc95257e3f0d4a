"""What the rider sees and what a press does: a stack of views. The one in front is shown, and a press is for it."""

import gc

from ..board.button import LONG
from ..errors import attempt
from . import messages, pages
from .page_ring import PageRing
from .views import FaultView, InfoView, NoticeView, QuestionView


class Screen:
    """app: the App, whose sensor, clock, meter, calibration, drive and recorder it shows.

    wizard: the AlignWizard or SixWizard under way, which takes every sample, or None.
    """

    def __init__(self, app):
        self._app = app
        self.wizard = None
        self._menu = None
        self._notice = NoticeView()
        self._fault = FaultView(app.sensor)
        self._info = InfoView(app)
        self._question = QuestionView(app.drive)
        self._pages = PageRing(app, self._align_now)

    def lines(self, now_ms):
        """What the display should say now. Call it about every 100 ms."""
        app = self._app
        if self._menu:  # in which a recording can be begun, at once
            app.prepare_recorder()
        problem = (app.recorder and app.recorder.take_problem()) or (app.drive and app.drive.speed.take_problem())
        if problem:
            self.tell(problem, now_ms)
        return self._update_front(now_ms)[1]

    def press(self, event, now_ms):
        """event: SHORT or LONG. A long press that the view in front has no use for opens the menu. What it wants may be
        missing, or have no memory: that must not end the ride."""
        problem = attempt(self._press, event, now_ms)
        if problem:
            self.tell(problem, now_ms)

    def tell(self, notice, now_ms):
        """Show a Notice for two seconds."""
        self._notice.show(messages.lines(notice), now_ms)

    def _press(self, event, now_ms):
        view = self._update_front(now_ms)[0]
        if view is self._notice:  # the press dismisses the notice, and goes to the view below it,
            self._notice.press(event, now_ms)
            view = self._update_front(now_ms)[0]
            if view is self._question:  # except to a question, which has not been seen yet
                return
        if not view.press(event, now_ms) and event == LONG:
            self._open_menu(now_ms)
        self._drop_ended()

    def add_page(self, page):
        """Add a page behind the others. page: a function of the meter that gives two lines of 16 characters."""
        self._pages.add(page)

    def interrupt(self, now_ms):
        """The sensor has failed: a calibration under way is cancelled."""
        if self.wizard:
            self.wizard = None
            self._notice.show(("Calibration", "stopped: fault"), now_ms)

    def _update_front(self, now_ms):
        """Return the view in front and its two lines: the first in this order that has something to show. Drop a
        wizard or menu that has ended, and go back to the first page when a question is shown."""
        for view in (
            self._notice,
            self.wizard,
            self._menu,
            self._fault,
            self._info,
            self._question,
            self._pages,
        ):
            lines = view.lines(now_ms) if view else None
            if lines:
                break
        self._drop_ended()
        if view is self._question:
            self._pages.first()  # where the answer leads to
        return view, lines

    def _drop_ended(self):
        """What has ended gets no more samples and no more presses."""
        if self.wizard and self.wizard.ended:
            self.wizard = None
        if self._menu and self._menu.ended:
            self._menu = None

    def _open_menu(self, now_ms):
        from .menu import Menu  # with the first long press

        self._menu = Menu(self._entries(), now_ms)

    def _entries(self):
        """The entries of the menu: (name, what to call with now_ms)."""
        align = (("Align the bike", self._align),)
        six = (("Six positions", self._six),)
        rest = (("Reset maxima", self._reset), ("Sensor info", self._info.show))
        drive = (("Align by drive", self._drive),) if self._app.drive else ()
        if self._app.recording:
            record = (("Stop recording", self._stop),)
        else:
            record = (("Record ride", self._record),)
        if self._app.settings.VEHICLE == "car":
            return drive + six + rest + record
        return align + six + rest + drive + record

    def _ready(self, now_ms):
        """True if there are readings; if not, the rider is told why."""
        fault = self._app.sensor.fault
        if fault is not None:
            self.tell(fault, now_ms)
        return fault is None

    def _align(self, now_ms):
        if self._ready(now_ms):
            self._begin_align(False)

    def _align_now(self):
        """This press is already that for the pose on the kickstand."""
        self._begin_align(True)

    # The wizards are imported when they are wanted: with what they need they take 12 KB of heap. After a collection, or
    # what stays for good would lie at the far end of the heap and make every later collection longer.

    def _begin_align(self, pressed):
        gc.collect()
        from .align_wizard import AlignWizard

        app = self._app
        self._pages.first()
        settings, calibration = app.settings, app.calibration
        self.wizard = AlignWizard(app.sensor.chip, settings.SAMPLE_HZ, calibration, settings.SIDE, pressed)

    def _six(self, now_ms):
        if self._ready(now_ms):
            gc.collect()
            from .six_wizard import SixWizard

            app = self._app
            self.wizard = SixWizard(app.sensor.chip, app.settings.SAMPLE_HZ, app.calibration)

    def _reset(self, now_ms):
        self._app.meter.reset_maxima()
        self._notice.show(("Maxima reset", ""), now_ms)

    def _drive(self, now_ms):
        if self._ready(now_ms):
            self._app.drive.ask()
            self._pages.drive()

    def _record(self, now_ms):
        if self._ready(now_ms):
            self._app.record()
            if self._app.recording:
                self._notice.show(pages.recording(self._app.recorder), now_ms)

    def _stop(self, now_ms):
        self._app.recorder.stop()
        self._notice.show(("Recording ended", ""), now_ms)
