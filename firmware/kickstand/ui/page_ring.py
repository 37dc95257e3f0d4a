"""The ring of pages. A short press shows the next page. A page is a function in pages.py. To add a page called load,
write pages.load, and add it to MOTORCYCLE or CAR. CONTRIBUTING.md has the other steps."""

from ..board.button import SHORT
from ..errors import attempt
from ..lean.meter import FALLEN_DEG
from . import pages

MOTORCYCLE = (pages.lean, pages.maxima, pages.acceleration, pages.formula, pages.raw)
CAR = (pages.acceleration, pages.cornering, pages.raw)


class PageRing:
    """The current page, as a view (see screen.py).

    Args:
        leans: False for a car.
        meter: the LeanMeter, read-only.
        calibration: the ActiveCalibration, read-only.
        drive: the BackgroundAlignment, read-only, or None.
        rides: the Recording, read-only.
        align: a function that is called after a short press without an alignment. The press means that the bike is on
            its kickstand.

    Attributes:
        name: the name of the page that is shown: the name of its function in pages.py, or "drive", "live" or "own".
        late: True if the lean is too old for the next page.
        live: the Live whose page is added, or None.
        draws: True if the display shows pictures.
        own: list of the owner's pages, which are functions that return two lines.
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
        self._glance = None  # the module glance, which is imported when a display that draws is found
        self._glance_tried = False
        self.name = "not_aligned"
        self.live = None
        self.own = []

    def show_own(self, now_ms):
        """Go to the first of the owner's pages. The menu calls this method. Without an alignment only the menu leads to
        the owner's pages."""
        self._own_at = 0

    def first(self):
        """Go back to the first page."""
        self._at = 0
        self._own_at = None  # index of the owner's page that is shown, or None if another page is shown

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
        """True while alignment by driving has a page. Without an alignment this page is the first page. With an
        alignment this page follows the usual pages."""
        return self._drive is not None and self._drive.shown

    def _drive_lines(self, now_ms):
        from . import drive_page  # imported here, because only boards with a speed source need it

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
        if self._at >= count:  # after the last page the owner's pages follow, then the first page
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
        """True if the lean may be shown."""
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
        """The module glance if the display draws and the module can be loaded, else None."""
        if self.draws and not self._glance_tried:
            self._glance_tried = True
            attempt(self._load)
        return self._glance if self.draws else None

    def _load(self):
        from . import glance

        self._glance = glance
