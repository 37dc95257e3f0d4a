"""Guides the rider through the two poses, kickstand first, and hands over a new calibration."""

from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from ..calibration.parameters import Calibration
from ..calibration.pose_taker import DONE, SPOILT, PoseTaker
from ..calibration.two_position import CALIBRATED_TOLERANCE_G, UNCALIBRATED_TOLERANCE_G, WARN_TILT_DEG, two_position
from ..errors import Refusal
from . import pages

POSE_SECONDS = 3
RESULT_MS = 4000
_ASK = (("On the stand,", "press button"), ("Now upright:", "hold it, press"))
_TAKING = ("Stand: hold", "Upright: hold")


class AlignWizard:
    """sample() with each sample, step() with each event; lines is what to show; ended: the pages may come
    back.

    chip, saturated, rate_hz: as for PoseTaker.  old: the Calibration in use.  side: "left" or "right".
    save: called with the new Calibration, raises StoreError.  pressed: the press on the kickstand has just
    been made.
    """

    def __init__(self, chip, saturated, rate_hz, old, side, save, pressed=False):
        self._taker = PoseTaker(chip, saturated, rate_hz, POSE_SECONDS)
        self._old = old
        self._side = side
        self._save = save
        self._kickstand = None
        self._gyro = None
        self._leave_ms = None
        self.ended = False
        self._ask(0)
        if pressed:
            self._begin()

    def sample(self, counts, now_ms):
        """Take one sample: seven counts, the chip's order."""
        if self._taking:
            self._take(counts, now_ms)

    def step(self, event, now_ms):
        """Take a button event (0, SHORT, LONG)."""
        if event == LONG:
            self.ended = True
        elif self._leave_ms is not None:
            self.ended = event == SHORT or ticks_diff(now_ms, self._leave_ms) >= 0
        elif event == SHORT and not self._taking:
            if self._unlike:  # the two poses did not fit together: from the beginning
                self._ask(0)
            else:
                self._begin()

    def _ask(self, pose):
        self._pose = pose
        self._taking = False
        self._unlike = False
        self.lines = _ASK[pose]

    def _begin(self):
        self._taking = True
        self._taker.restart()
        self.lines = (_TAKING[self._pose], "")

    def _take(self, counts, now_ms):
        state = self._taker.step(counts)
        if state == SPOILT:
            self._refuse(self._taker.problem)
        elif state == DONE:
            self._pose_done(self._taker.capture, now_ms)
        else:
            restless = "not still yet" if self._taker.restless else ""
            self.lines = (_TAKING[self._pose], pages.progress_bar(*self._taker.progress()) or restless)

    def _pose_done(self, capture, now_ms):
        if self._pose == 0:
            self._kickstand = capture.accel
            self._gyro = capture.gyro
            self._ask(1)
            return
        try:
            tilt = self._finish(capture)
        except Refusal as problem:
            self._refuse(problem)
            self._unlike = True
            return
        self._taking = False
        self._leave_ms = ticks_add(now_ms, RESULT_MS)
        warning = "Little, 8%s best" % pages.DEGREE if tilt < WARN_TILT_DEG else "Ride safely"
        self.lines = ("Aligned! %5.1f%s" % (tilt, pages.DEGREE), warning)

    def _finish(self, capture):
        """Compute, check and save; return the tilt. Raises AlignmentError, StoreError."""
        old = self._old
        new = Calibration()
        new.set_accel(old.accel_offset, old.accel_slope)
        new.six_done = old.six_done
        # the bias is that of the kickstand pose: a stand holds stiller than a rider
        for i in range(3):
            new.gyro_bias[i] = self._gyro[i]
        tilt = two_position(
            new.vehicle_from_sensor,
            new.correct(self._kickstand),
            new.correct(capture.accel),
            self._side,
            CALIBRATED_TOLERANCE_G if new.six_done else UNCALIBRATED_TOLERANCE_G,
        )
        new.aligned = True
        self._save(new)
        return tilt

    def _refuse(self, problem):
        """Say why; the next press does the pose again."""
        self._taking = False
        self.lines = problem.lcd
