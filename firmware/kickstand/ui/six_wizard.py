"""Guides the rider through the six positions and a slanted pose that verifies them.

In the six positions each side of the sensor is up once, in any order. The turns of the sensor between the poses
calibrate the gyro: see calibration/sensor_fit.py.
"""

from ..calibration import six_position
from ..calibration.parameters import six_position_calibration
from ..errors import GyroError
from ..units import const
from . import messages, pages
from .wizard import COMPUTING, NOTICE, RESULT, TAKING, Wizard

_NOTICE_MS = const(1500)
_RESULT_MS = const(6000)
_ROUGH_TILT_DEG = const(30.0)  # largest tilt of a side in uncalibrated readings; the fit has a stricter limit
_MAX_POSES = const(12)  # most poses: six sides, a slanted pose, and repetitions after unusable turns


class SixWizard(Wizard):
    """The guided six positions. The arguments are those of Wizard."""

    name = "six"

    def _start(self):
        self._sides = [-1] * 6  # index of the pose of each side; -1 until the pose is taken
        self._poses, self._turns = [], []  # the arguments of SensorFit
        self._bias = [0.0] * 3  # sum of the gyro's readings in all poses
        self._fitted = None  # offset and slope; None until all six poses are taken
        self._unproved = None  # name of the axis about which another turn is needed, or None
        self._work = self._fit = None
        self._told = False  # True once the rider was told that the current turn cannot be used
        self._turn.running = False
        self._next_pose()

    def _next_pose(self):
        """Ask for the next pose and wait until the sensor is still."""
        if self._unproved:
            self._begin_pose("Slant it again,", "another way")
        elif self._fitted:
            self._begin_pose("Check: slant it", "and hold still")
        else:
            missing = [six_position.SIDES[k] for k in range(6) if self._sides[k] < 0]
            self._begin_pose("Side up, still:", "any of the six" if len(missing) == 6 else " ".join(missing))

    def _progress(self, done, total):
        if done:
            name = "Check" if self._fitted else "Side " + six_position.SIDES[self._side]
            self._lines = (name + ", hold", pages.progress_bar(done, total))

    def _spoilt(self, problem, now_ms):
        self._notice(now_ms, *messages.lines(problem))

    def _settled(self, accel, now_ms):
        """Check after half a second of stillness that this pose is still missing. If not, tell the rider."""
        if self._fitted:
            offset, slope = self._fitted
            tilt = six_position.tilt_deg([slope[i] * accel[i] + offset[i] for i in range(3)])
            if tilt < six_position.FREE_TILT_DEG:
                self._notice(now_ms, "Slant it more:", "%d%s is too flat" % (tilt, messages.DEGREE))
            return
        self._side = six_position.side_of(accel)
        tilt = six_position.tilt_deg(accel)
        if tilt > _ROUGH_TILT_DEG:
            self._notice(now_ms, "Not on a side:", "%d%s off" % (tilt, messages.DEGREE))
        elif self._sides[self._side] >= 0 and not self._again():
            self._side_done(now_ms, "Side %s is done")

    def _again(self):
        """Return True if the rider may repeat a side to start a new turn, because the last turn cannot be used."""
        return self._spoilt_turn and len(self._poses) + self._sides.count(-1) + 1 < _MAX_POSES

    @property
    def _spoilt_turn(self):
        """True if the turn since the last pose cannot be used."""
        return self._turn.running and (self._turn.quick or self._turn.lost)

    def bears(self, fault, now_ms):
        """Return True for rates at the end of the range, because turning the sensor too fast is not a defect."""
        if fault is None or fault.code != "clips" or fault.values[0] != "Gyro" or not self._turn.running:
            return False
        self._turn.quick = True
        self._followed(now_ms)
        return True

    def _followed(self, now_ms):
        if self.state == COMPUTING:
            if next(self._work, True):  # next() returns None while the work continues, and True at its end
                self._computed(now_ms)
        elif self._spoilt_turn and not self._told and self.state in (TAKING, NOTICE):
            # The turn was too fast, or readings were lost. Readings at the end of the range are lost too, so one
            # message is enough.
            self._told = True
            self._notice(now_ms, "Turned too fast:", "turn it slower")

    def _pose_done(self, pose, now_ms):
        """Keep the pose and the turn before it. Fit the accelerometer after the sixth side, and the whole sensor after
        the slanted pose. Raises CalibrationError."""
        turn, spoilt = self._turn, self._spoilt_turn
        if self._poses:
            turn.end()
            self._turns.append(None if spoilt else (turn.packed(pose.gyro), turn.seconds))
        turn.start(pose.gyro)
        self._told = False
        self._poses.append(pose.accel)
        for i in range(3):
            self._bias[i] += pose.gyro[i]
        if self._fitted:
            self._prove(pose)
            return
        if self._sides[self._side] < 0:
            self._sides[self._side] = len(self._poses) - 1
        if -1 not in self._sides:
            self._fitted = six_position.fit([self._poses[k] for k in self._sides])
        self._side_done(now_ms, "Side %s done")

    def _side_done(self, now_ms, words):
        done = 6 - self._sides.count(-1)
        self._notice(now_ms, words % six_position.SIDES[self._side], "%d/6, turn it" % done)

    def _prove(self, pose):
        """Begin to fit the whole sensor if the slanted pose confirms the six positions. Raises CalibrationError."""
        from ..calibration.sensor_fit import SensorFit  # imported only when needed, because it takes 5 KB of heap

        offset, slope = self._fitted
        self._error = six_position.check_free_pose(offset, slope, pose.accel)
        self._fit = SensorFit(self._poses, self._turns, offset, slope)
        self._work = self._fit.run()
        self._show(COMPUTING, ("Computing...", ""))

    def _computed(self, now_ms):
        """Save the result of the fit. If the sensor did not turn enough about an axis, ask for another pose instead.
        Raises GyroError, StoreError."""
        fit = self._fit
        self._work = self._fit = None
        self._unproved = fit.unproved[0] if fit.unproved else None
        if self._unproved:
            if len(self._poses) == _MAX_POSES:
                raise GyroError("unproved-gyro", self._unproved)
            self._next_pose()
            return
        bias = [value / len(self._poses) for value in self._bias]
        self._calibration.save(six_position_calibration(fit.offset, fit.slope, bias, fit.matrices()))
        self._show_for(_RESULT_MS, RESULT, now_ms, "Saved, err %d mg" % round(abs(self._error) * 1000), "Now align it")

    def _notice(self, now_ms, *lines):
        self._show_for(_NOTICE_MS, NOTICE, now_ms, *lines)
