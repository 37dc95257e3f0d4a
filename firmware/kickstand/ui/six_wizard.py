"""Guides the rider through the six positions and a slanted pose that verifies them.

In the six positions each side of the sensor is up once, in any order. The turns of the sensor between the poses
calibrate the gyro: see calibration/six_position.py.
"""

from ..board.display import DEGREE
from ..calibration import six_position
from ..errors import CaptureError, SickSensor
from ..units import const
from .wizard import COMPUTE, NOTICE, RESULT, TAKE, Wizard, words

_NOTICE_MS = const(1500)
_RESULT_MS = const(6000)
_ROUGH_TILT_DEG = const(30.0)  # largest tilt of a side in uncalibrated readings; the fit has a stricter limit
_MAX_POSES = const(12)  # most poses: six sides, a slanted pose, and repetitions after unusable turns


class SixWizard(Wizard):
    """The guided six positions. The arguments are those of Wizard."""

    name = "six"

    def _flow(self):
        self._sides = [-1] * 6  # index of the pose of each side; -1 until the pose is taken
        self._poses, self._turns = [], []  # the arguments of SensorFit
        self._fitted = None  # offset and slope; None until all six poses are taken
        self._turn.running = False
        self._warned = False  # True after the rider was warned that the current turn cannot be used
        bias = [0.0] * 3  # sum of the gyro's readings in all poses
        fit = lines = None
        while not fit or fit.unproved:
            pose = yield from self._next_pose(lines, fit)
            self._keep(pose)
            for i in range(3):
                bias[i] += pose.gyro[i]
            if not self._fitted:
                lines = self._keep_side()
                continue
            lines, (offset, slope) = None, self._fitted
            error = six_position.check_free_pose(offset, slope, pose.accel)
            fit = six_position.SensorFit(self._poses, self._turns, offset, slope)
            self._show(COMPUTE, ("Computing...", ""))
            for _ in fit.run():
                yield
            if fit.unproved and len(self._poses) == _MAX_POSES:
                raise SickSensor("unproved-gyro", fit.unproved[0])
        bias = [value / len(self._poses) for value in bias]
        self._calibration.save(six_position.six_position_calibration(fit.offset, fit.slope, bias, fit.matrices()))
        lines = "Saved, err %d mg" % round(abs(error) * 1000), "Now align it"
        yield from self._show_for(_RESULT_MS, RESULT, lines)

    def _next_pose(self, lines, fit):
        """Take the next pose and return its StillPose.

        Args:
            lines: two lines to show first, or None.
            fit: the SensorFit that needs another turn, or None.
        """
        while True:
            try:
                if lines:
                    yield from self._show_for(_NOTICE_MS, NOTICE, lines)
                if fit:
                    lines = "Slant it again,", "another way"
                elif self._fitted:
                    lines = "Check: slant it", "and hold still"
                else:
                    missing = [six_position.SIDES[k] for k in range(6) if self._sides[k] < 0]
                    lines = "Side up, still:", "any of the six" if len(missing) == 6 else " ".join(missing)
                accel = yield from self._settle(lines, lines[1])
                lines = self._unfit(accel)
                if not lines:
                    title = "Check" if self._fitted else "Side " + six_position.SIDES[self._side]
                    return (yield from self._average(title + ", hold"))
            except CaptureError as refusal:
                lines = words(refusal)

    def _unfit(self, accel):
        """Return two lines if a pose is not one of those that are missing, else None.

        accel: mean reading of the accelerometer, 3 values in g."""
        if self._fitted:
            offset, slope = self._fitted
            tilt = six_position.tilt_deg([slope[i] * accel[i] + offset[i] for i in range(3)])
            if tilt >= six_position.FREE_TILT_DEG:
                return None
            return "Slant it more:", "%d%s is too flat" % (tilt, DEGREE)
        self._side = six_position.side_of(accel)
        tilt = six_position.tilt_deg(accel)
        if tilt > _ROUGH_TILT_DEG:
            return "Not on a side:", "%d%s off" % (tilt, DEGREE)
        # The rider may repeat a side to start a new turn, because the last turn cannot be used
        again = self._spoilt_turn and len(self._poses) + self._sides.count(-1) + 1 < _MAX_POSES
        return self._count("Side %s is done") if self._sides[self._side] >= 0 and not again else None

    def _keep(self, pose):
        """Keep a pose and the turn before it."""
        turn, spoilt = self._turn, self._spoilt_turn
        if self._poses:
            turn.end()
            self._turns.append(None if spoilt else (turn.packed(pose.gyro), turn.seconds))
        turn.start(pose.gyro)
        self._warned = False
        self._poses.append(pose.accel)

    def _keep_side(self):
        """Keep the side of the last pose, and fit the accelerometer after the sixth side. Return two lines. Raises
        Refusal."""
        if self._sides[self._side] < 0:
            self._sides[self._side] = len(self._poses) - 1
        if -1 not in self._sides:
            self._fitted = six_position.fit([self._poses[k] for k in self._sides])
        return self._count("Side %s done")

    def _count(self, words):
        return words % six_position.SIDES[self._side], "%d/6, turn it" % (6 - self._sides.count(-1))

    @property
    def _spoilt_turn(self):
        """True if the turn since the last pose cannot be used."""
        return self._turn.running and (self._turn.quick or self._turn.lost)

    def bears(self, fault):
        """Return True for rates at the end of the range, because turning the sensor too fast is not a defect."""
        if fault.code != "clips" or fault.values[0] != "Gyro" or not self._turn.running:
            return False
        self._turn.quick = True
        return True

    def follow(self, n, dt_us, now_ms):
        """Also tell the rider if the turn was too fast, or readings were lost. Readings at the end of the range are
        lost too, so one message is enough."""
        super().follow(n, dt_us, now_ms)
        if self._spoilt_turn and not self._warned and self.step in (TAKE, NOTICE):
            self._warned = True
            self._flows.throw(CaptureError("turned-fast"))
