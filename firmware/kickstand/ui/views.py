"""What may stand in front of the pages: a short notice, a fault, the sensor's data, a question.

A view has lines(now_ms), which gives two lines of 16 characters, or None while it has nothing to show, and
press(event, now_ms), which gives True if the press was for it.
"""

from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from . import messages, pages

NOTICE_MS = 2000


class NoticeView:
    """Two lines for two seconds, or until a press, which is then for what they covered."""

    def __init__(self):
        self._lines = None
        self._until_ms = 0

    def show(self, lines, now_ms):
        """lines: two, for NOTICE_MS from now on."""
        self._lines = lines
        self._until_ms = ticks_add(now_ms, NOTICE_MS)

    def lines(self, now_ms):
        if self._lines and ticks_diff(now_ms, self._until_ms) >= 0:
            self._lines = None
        return self._lines

    def press(self, event, now_ms):
        self._lines = None
        return False


class FaultView:
    """Why there are no readings."""

    def __init__(self, sensor):
        self._sensor = sensor

    def lines(self, now_ms):
        fault = self._sensor.fault
        return None if fault is None else messages.lines(fault)

    def press(self, event, now_ms):
        return False


class InfoView:
    """Which chip it is, how warm, what is calibrated; until a short press."""

    def __init__(self, app):
        self._app = app
        self.open = False

    def show(self, now_ms):
        """From now on."""
        self.open = True

    def lines(self, now_ms):
        return pages.sensor_info(self._app, now_ms // 1000) if self.open else None

    def press(self, event, now_ms):
        if event == SHORT:
            self.open = False
        return event == SHORT


class QuestionView:
    """What alignment by driving has to tell or to ask. drive: a BackgroundAlignment, or None."""

    def __init__(self, drive):
        self._drive = drive

    def lines(self, now_ms):
        if self._drive is None or self._drive.message is None:
            return None
        return messages.lines(self._drive.message)

    def press(self, event, now_ms):
        self._drive.answer(event == LONG)
        return True
