"""Guides the rider through the six positions, each side up once in any order, and a slanted pose that verifies them."""

from ..calibration import six_position
from ..calibration.parameters import six_position_calibration
from . import messages, pages
from .wizard import NOTICE, RESULT, Wizard

NOTICE_MS = 1500
RESULT_MS = 6000
ROUGH_TILT_DEG = 30.0  # largest tilt of a side in uncalibrated readings; the fit has a stricter limit


class SixWizard(Wizard):
    """See Wizard."""

    def _start(self):
        self._poses = [None] * 6
        self._gyro = [0.0] * 3
        self._fitted = None  # offset and slope, once all six poses are taken
        self._next_pose()

    def _next_pose(self):
        """Ask for the next pose and wait until the sensor lies still."""
        if self._fitted:
            self._begin_pose("Check: slant it", "and hold still")
        else:
            missing = [six_position.SIDES[k] for k in range(6) if self._poses[k] is None]
            self._begin_pose("Side up, still:", "any of the six" if len(missing) == 6 else " ".join(missing))

    def _progress(self, done, total):
        if done:
            name = "Check" if self._fitted else "Side " + six_position.SIDES[self._side]
            self._lines = (name + ", hold", pages.progress_bar(done, total))

    def _spoilt(self, problem, now_ms):
        self._notice(now_ms, *messages.lines(problem))

    def _settled(self, accel, now_ms):
        """Check, after half a second of stillness, that this is a pose that is still missing; else tell the rider."""
        if self._fitted:
            offset, slope = self._fitted
            tilt = six_position.tilt_deg([slope[i] * accel[i] + offset[i] for i in range(3)])
            if tilt < six_position.FREE_TILT_DEG:
                self._notice(now_ms, "Slant it more:", "%d%s is too flat" % (tilt, messages.DEGREE))
            return
        self._side = six_position.side_of(accel)
        tilt = six_position.tilt_deg(accel)
        if tilt > ROUGH_TILT_DEG:
            self._notice(now_ms, "Not on a side:", "%d%s off" % (tilt, messages.DEGREE))
        elif self._poses[self._side] is not None:
            self._side_done(now_ms, "Side %s is done")

    def _pose_done(self, pose, now_ms):
        """Keep the pose; after the sixth one fit the calibration. Raises CalibrationError, StoreError."""
        if self._fitted:
            self._prove(pose, now_ms)
            return
        self._poses[self._side] = pose.accel
        for i in range(3):
            self._gyro[i] += pose.gyro[i] / 6
        if None not in self._poses:
            self._fitted = six_position.fit(self._poses)
        self._side_done(now_ms, "Side %s done")

    def _side_done(self, now_ms, words):
        done = 6 - self._poses.count(None)
        self._notice(now_ms, words % six_position.SIDES[self._side], "%d/6, turn it" % done)

    def _prove(self, pose, now_ms):
        """Save the calibration if the seventh pose confirms it. Raises CalibrationError, StoreError."""
        offset, slope = self._fitted
        error = six_position.check_free_pose(offset, slope, pose.accel)
        self._calibration.save(six_position_calibration(offset, slope, self._gyro))
        self._show_for(RESULT_MS, RESULT, now_ms, "Saved, err %d mg" % round(abs(error) * 1000), "Now align it")

    def _notice(self, now_ms, *lines):
        self._show_for(NOTICE_MS, NOTICE, now_ms, *lines)
