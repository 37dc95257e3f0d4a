"""Guides the rider through the six positions, each side up once in any order, and a slanted pose as the proof."""

from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..calibration import six_position
from ..calibration.parameters import six_position_calibration
from ..calibration.pose_taker import DONE, SETTLED, SPOILT, PoseTaker
from ..errors import Refusal
from . import messages, pages

POSE_SECONDS = 2
NOTICE_MS = 1500
RESULT_MS = 6000
ROUGH_TILT_DEG = 30.0  # largest tilt of a side before it is calibrated; the fit checks it more strictly


class SixWizard:
    """A view (see views.py) that also takes each sample, until it has ended.

    chip, rate_hz: as for PoseTaker. calibration: the ActiveCalibration.
    """

    def __init__(self, chip, rate_hz, calibration):
        self._taker = PoseTaker(chip, rate_hz, POSE_SECONDS)
        self._calibration = calibration
        self._notice_ms = None
        self._leave_ms = None
        self._refused = False
        self.ended = False
        self._start()

    def _start(self):
        self._poses = [None] * 6
        self._gyro = [0.0] * 3
        self._fitted = None
        self._next()

    def sample(self, counts, now_ms):
        """Take one sample: 7 counts, the chip's order."""
        if self._leave_ms is None and self._notice_ms is None and not self._refused:
            self._take(counts, now_ms)

    def lines(self, now_ms):
        if self._leave_ms is not None and ticks_diff(now_ms, self._leave_ms) >= 0:
            self.ended = True
        elif self._notice_ms is not None and ticks_diff(now_ms, self._notice_ms) >= 0:
            self._notice_ms = None
            self._next()
        return None if self.ended else self._lines

    def press(self, event, now_ms):
        if event == LONG or self._leave_ms is not None:
            self.ended = True
        elif self._refused:
            self._refused = False
            self._start()
        return True

    def _next(self):
        """Ask for the next pose and wait until the sensor lies still."""
        self._taker.restart()
        if self._fitted:
            self._lines = ("Check: slant it", "and hold still")
        else:
            missing = [six_position.SIDES[k] for k in range(6) if self._poses[k] is None]
            self._lines = ("Side up, still:", "any of the six" if len(missing) == 6 else " ".join(missing))

    def _take(self, counts, now_ms):
        state = self._taker.step(counts)
        if state == SPOILT:
            self._notice(messages.lines(self._taker.problem), now_ms)
        elif state == SETTLED:
            self._look(now_ms)
        elif state == DONE:
            try:
                self._pose_done(self._taker.pose, now_ms)
            except Refusal as problem:
                self._refused = True
                self._lines = messages.lines(problem)
        else:
            done, total = self._taker.progress()
            if done:
                name = "Check" if self._fitted else "Side " + six_position.SIDES[self._side]
                self._lines = (name + ", hold", pages.progress_bar(done, total))

    def _look(self, now_ms):
        """It has lain still for half a second: is this a pose that is still missing?"""
        accel = self._taker.settled
        if self._fitted:
            offset, slope = self._fitted
            tilt = six_position.tilt_deg([slope[i] * accel[i] + offset[i] for i in range(3)])
            if tilt < six_position.FREE_TILT_DEG:
                self._notice(("Slant it more:", "%d%s is too flat" % (tilt, messages.DEGREE)), now_ms)
            return
        self._side = six_position.side_of(accel)
        tilt = six_position.tilt_deg(accel)
        if tilt > ROUGH_TILT_DEG:
            self._notice(("Not on a side:", "%d%s off" % (tilt, messages.DEGREE)), now_ms)
        elif self._poses[self._side] is not None:
            done = 6 - self._poses.count(None)
            self._notice(("Side %s is done" % six_position.SIDES[self._side], "%d/6, turn it" % done), now_ms)

    def _pose_done(self, pose, now_ms):
        if self._fitted:
            self._prove(pose, now_ms)
            return
        self._poses[self._side] = pose.accel
        for i in range(3):
            self._gyro[i] += pose.gyro[i] / 6
        done = 6 - self._poses.count(None)
        if done == 6:
            self._fitted = six_position.fit(self._poses)
        self._notice(("Side %s done" % six_position.SIDES[self._side], "%d/6, turn it" % done), now_ms)

    def _prove(self, pose, now_ms):
        """The seventh pose: the calibration is saved only if this pose confirms it. Raises CalibrationError,
        StoreError."""
        offset, slope = self._fitted
        error = six_position.check_free_pose(offset, slope, pose.accel)
        self._calibration.save(six_position_calibration(offset, slope, self._gyro))
        self._leave_ms = ticks_add(now_ms, RESULT_MS)
        self._lines = ("Saved, err %d mg" % round(abs(error) * 1000), "Now align it")

    def _notice(self, lines, now_ms):
        self._lines = lines
        self._notice_ms = ticks_add(now_ms, NOTICE_MS)
