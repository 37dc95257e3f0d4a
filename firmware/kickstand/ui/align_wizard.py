"""Guides the rider through the two poses, first on the kickstand, then upright, and saves the alignment."""

from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..calibration.pose_taker import DONE, SPOILT, PoseTaker
from ..calibration.two_position import WARN_TILT_DEG, align
from ..errors import Refusal
from . import messages, pages

POSE_SECONDS = 3
RESULT_MS = 4000
_ASK = (("On the stand,", "press button"), ("Now upright:", "hold it, press"))
_TAKING = ("Stand: hold", "Upright: hold")


class AlignWizard:
    """A view (see views.py) that also takes each sample, until it has ended.

    chip, rate_hz: as for PoseTaker. calibration: the ActiveCalibration. side: where the kickstand leans the bike to,
    "left" or "right". pressed: the rider has already pressed the button for the pose on the kickstand.
    """

    def __init__(self, chip, rate_hz, calibration, side, pressed=False):
        self._taker = PoseTaker(chip, rate_hz, POSE_SECONDS)
        self._calibration = calibration
        self._side = side
        self._kickstand = None
        self._leave_ms = None
        self.ended = False
        self._ask(0)
        if pressed:
            self._begin()

    def sample(self, counts, now_ms):
        """Take one sample: 7 counts, the chip's order."""
        if self._taking:
            self._take(counts, now_ms)

    def lines(self, now_ms):
        if self._leave_ms is not None and ticks_diff(now_ms, self._leave_ms) >= 0:
            self.ended = True
        return None if self.ended else self._lines

    def press(self, event, now_ms):
        if event == LONG or self._leave_ms is not None:
            self.ended = True
        elif not self._taking:
            if self._unlike:  # the two poses did not fit together: begin with the first
                self._ask(0)
            else:
                self._begin()
        return True

    def _ask(self, pose):
        self._pose = pose
        self._taking = False
        self._unlike = False
        self._lines = _ASK[pose]

    def _begin(self):
        self._taking = True
        self._taker.restart()
        self._lines = (_TAKING[self._pose], "")

    def _take(self, counts, now_ms):
        state = self._taker.step(counts)
        if state == SPOILT:
            self._refuse(self._taker.problem)
        elif state == DONE:
            self._pose_done(self._taker.pose, now_ms)
        else:
            restless = "not still yet" if self._taker.restless else ""
            self._lines = (_TAKING[self._pose], pages.progress_bar(*self._taker.progress()) or restless)

    def _pose_done(self, pose, now_ms):
        if self._pose == 0:
            self._kickstand = pose
            self._ask(1)
            return
        try:
            new, tilt = align(self._calibration.value, self._kickstand, pose, self._side)
            self._calibration.save(new)
        except Refusal as problem:
            self._refuse(problem)
            self._unlike = True
            return
        self._taking = False
        self._leave_ms = ticks_add(now_ms, RESULT_MS)
        warning = "Little, 8%s best" % messages.DEGREE if tilt < WARN_TILT_DEG else "Ride safely"
        self._lines = ("Aligned! %5.1f%s" % (tilt, messages.DEGREE), warning)

    def _refuse(self, problem):
        """Say why. The next press takes the pose again."""
        self._taking = False
        self._lines = messages.lines(problem)
