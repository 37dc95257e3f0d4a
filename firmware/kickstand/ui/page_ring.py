"""The ring of pages: a short press shows the next one. A page is a function in pages.py. To add a page called load,
write pages.load, add it to MOTORCYCLE or CAR, and add a row to the table of pages in firmware/docs/displays.md."""

from ..board.button import SHORT
from ..errors import attempt
from ..lean.meter import FALLEN_DEG
from . import pages

MOTORCYCLE = (pages.lean, pages.maxima, pages.acceleration, pages.formula, pages.raw)
CAR = (pages.acceleration, pages.cornering, pages.raw)


class PageRing:
    """The current page, as a view (see screen.py). leans: False for a car. meter, calibration, drive, rides: the
    LeanMeter, the ActiveCalibration, the BackgroundAlignment or None, and the Recording, all read-only. align(): called
    for a short press without an alignment; the press means that the bike is on its kickstand.

    name: the name of the page that is shown: its function in pages.py, or "drive", "live" or "own". late: True if the
    lean is too old for the next page. live: None, or a Live, which adds its page. draws: True if the display shows
    pictures. own: the owner's pages, functions that return two lines each.
    """

    def __init__(self, leans, meter, calibration, drive, rides, align):
        self._meter = meter
        self._calibration = calibration
        self._drive = drive
        self._rides = rides
        self._align = align
        self._pages = MOTORCYCLE if leans else CAR
        self.first()
        self.late = self.draws = False
        self._glance = None  # the module glance, imported once a display draws
        self._glance_tried = False
        self.name = "not_aligned"
        self.live = None
        self.own = []

    def show_own(self, now_ms):
        """Go to the first of the owner's pages. The menu calls this function. Without an alignment there is no other
        way to these pages."""
        self._own_at = 0

    def first(self):
        """Go back to the first page."""
        self._at = 0
        self._own_at = None  # index of the owner's page on display

    def drive(self):
        """Go to the page for alignment by driving."""
        self._at = len(self._pages) if self._calibration.aligned else 0

    def press(self, event, now_ms):
        if event != SHORT:
            return False
        if self._own_at is not None:
            self._own_at += 1
            if self._own_at >= len(self.own):
                self.first()
        elif self._driving or self._calibration.aligned:
            self._at += 1
        else:
            self._align()
        return True

    @property
    def _driving(self):
        """Return True while alignment by driving has a page: the first one without an alignment, else the last."""
        return self._drive is not None and self._drive.shown

    def _drive_lines(self, now_ms):
        from . import drive_page  # only with a speed source

        self.name = "drive"
        return drive_page.lines(self._drive, now_ms)

    def _own_page(self):
        self.name = "own"
        return self.own[self._own_at or 0]()

    def lines(self, now_ms):
        if self._own_at is not None:
            return self._own_page()
        if not self._calibration.aligned:
            self.name = "not_aligned"
            if not self._driving:
                return pages.not_aligned(self._meter, now_ms // 1000)
            if self._at % 2 == 0:
                return self._drive_lines(now_ms)
            return pages.not_aligned(self._meter, now_ms // 1000, "drive and brake")
        more = len(self._pages) + self._driving
        count = more + (self.live is not None) + self._rides.recorder.active
        if self._at >= count:  # the last page was removed; the other pages keep their places
            self._at = 0
            if self.own:
                self._own_at = 0
                return self._own_page()
        if self._at == len(self._pages) and self._driving:
            return self._drive_lines(now_ms)
        if self._at == more and self.live:
            self.name = "live"
            return self.live.lines()
        if self._at >= more:
            self.name = "recording"
            return pages.recording(self._rides.recorder)
        return self._page(self._pages[self._at])

    @property
    def trusted(self):
        """Return True if the lean may be shown."""
        meter = self._meter
        shown = meter.trusted and not meter.fallen and abs(meter.lean_deg) <= FALLEN_DEG
        return shown and self._calibration.aligned and not self.late

    def _page(self, page):
        meter, pictures = self._meter, self._pictures
        self.name = page.__name__
        recording = self._at == 0 and self._rides.recorder.active
        if meter.fallen:
            return pages.FALLEN
        if not self.trusted:
            lines = pages.unsure(meter.suppressed_reason or meter.odd)
            return lines + (pictures.unsure(*lines),) if pictures else lines
        line1, line2 = page(meter)
        if recording:
            line1 = pages.recorded(line1)
        if pictures and page in pictures.PICTURES:
            return line1, line2, pictures.PICTURES[page](meter, recording)
        return line1, line2

    @property
    def _pictures(self):
        """Return the module glance if the display draws and the module can be loaded, else None."""
        if self.draws and not self._glance_tried:
            self._glance_tried = True
            attempt(self._load)
        return self._glance if self.draws else None

    def _load(self):
        from . import glance

        self._glance = glance
