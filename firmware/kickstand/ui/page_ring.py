"""The pages, which a short press turns. A page is a function in pages.py. To add one called load, add
pages.load to MOTORCYCLE or CAR, and a row to the table of pages in firmware/README.md."""

from ..board.button import SHORT
from ..lean.meter import FALLEN_DEG
from . import pages

MOTORCYCLE = (pages.lean, pages.maxima, pages.acceleration, pages.formula, pages.raw)
CAR = (pages.acceleration, pages.cornering, pages.raw)


class PageRing:
    """The page that is shown, as a view (see screen.py). leans: False for a car. meter, calibration, drive, rides: the
    LeanMeter, the ActiveCalibration, the BackgroundAlignment or None, and the Recording, all to be read only. align:
    called for a short press while there is no alignment: it means that the bike is on its kickstand.

    late: the page that is due is to show no lean. live: a Live, which has a page then, or None.
    """

    def __init__(self, leans, meter, calibration, drive, rides, align):
        self._meter = meter
        self._calibration = calibration
        self._drive = drive
        self._rides = rides
        self._align = align
        self._pages = MOTORCYCLE if leans else CAR
        self._at = 0
        self.late = False
        self.live = None

    def add(self, page):
        """Add a page behind the others."""
        self._pages += (page,)

    def first(self):
        """Back to the first page."""
        self._at = 0

    def drive(self):
        """To the page of alignment by driving."""
        self._at = len(self._pages) if self._calibration.aligned else 0

    def press(self, event, now_ms):
        if event != SHORT:
            return False
        if self._driving or self._calibration.aligned:
            self._at += 1
        else:
            self._align()
        return True

    @property
    def _driving(self):
        """True while alignment by driving has a page: the first one until there is an alignment, then the last."""
        return self._drive is not None and self._drive.shown

    def _drive_lines(self, now_ms):
        from . import drive_page  # only with a speed source

        return drive_page.lines(self._drive, now_ms)

    def lines(self, now_ms):
        if not self._calibration.aligned:
            if not self._driving:
                return pages.not_aligned(self._meter, now_ms // 1000)
            if self._at % 2 == 0:
                return self._drive_lines(now_ms)
            return pages.not_aligned(self._meter, now_ms // 1000, "drive and brake")
        more = len(self._pages) + self._driving
        count = more + (self.live is not None) + self._rides.recorder.active
        if self._at >= count:  # the last page has gone; checked here, so that the other pages keep their places
            self._at = 0
        if self._at == len(self._pages) and self._driving:
            return self._drive_lines(now_ms)
        if self._at == more and self.live:
            return self.live.lines()
        if self._at >= more:
            return pages.recording(self._rides.recorder)
        return self._page(self._pages[self._at])

    def _page(self, page):
        meter = self._meter
        if meter.fallen:
            return pages.FALLEN
        if self.late or not meter.trusted or abs(meter.lean_deg) > FALLEN_DEG:
            return pages.unsure(meter.suppressed_reason)
        line1, line2 = page(meter)
        if self._at == 0 and self._rides.recorder.active:
            line1 = pages.recorded(line1)
        return line1, line2
