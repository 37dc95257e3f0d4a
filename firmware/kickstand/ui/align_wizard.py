"""Guides the rider through the two poses and saves the alignment. The first pose is on the kickstand, the second is
upright."""

from time import ticks_diff

from ..calibration.two_position import WARN_TILT_DEG, align, check_turn
from ..units import const
from . import messages, pages
from .wizard import ASKING, RESULT, Wizard

_RESULT_MS = const(4000)
# time after the kickstand pose for which the gyro's bias from this pose is valid; later the bias may drift
_FRESH_MS = const(90_000)
_ASK = (("On the stand,", "press button"), ("Now upright:", "hold it, press"))
_TAKING = ("Stand: hold", "Upright: hold")


class AlignWizard(Wizard):
    """The guided alignment.

    Args:
        chip, rate_hz, calibration: as for Wizard.
        side: "left" or "right", the side to which the kickstand leans the bike.
        pressed: True if the rider has already pressed the button for the kickstand pose.
    """

    name = "align"
    POSE_SECONDS = 3

    def __init__(self, chip, rate_hz, calibration, side, pressed=False):
        self._side = side
        super().__init__(chip, rate_hz, calibration)
        if pressed:
            self._next_pose()

    @property
    def upright(self):
        """True after the kickstand pose, when the upright pose is next."""
        return self._kickstand is not None

    def _start(self):
        self._kickstand = None  # the kickstand pose, or None until it is taken
        self._show(ASKING, _ASK[0])

    def _next_pose(self):
        self._begin_pose(_TAKING[self.upright], "")

    def _progress(self, done, total):
        restless = "not still yet" if self._taker.restless else ""
        self._lines = (_TAKING[self.upright], pages.progress_bar(done, total) or restless)

    def _spoilt(self, problem, now_ms):
        self._show(ASKING, messages.lines(problem), problem)  # with the next press the pose is taken again

    def _pose_done(self, pose, now_ms):
        """Keep the first pose. After the second pose compute and save the alignment.

        Raises:
            AlignmentError: the two poses do not fit together.
            GyroError: the gyro's turn does not fit the two poses.
            StoreError: the alignment cannot be saved.
        """
        if not self.upright:
            self._kickstand, self._kickstand_ms = pose, now_ms
            self._turn.start(pose.gyro)
            self._show(ASKING, _ASK[1])
            return
        before = self._calibration.value
        new, tilt = align(before, self._kickstand, pose, self._side)
        self._turn.end()
        check_turn(before, self._kickstand, pose, self._turn)
        self._calibration.save(new, 0 <= ticks_diff(now_ms, self._kickstand_ms) < _FRESH_MS)
        warning = "Little, 8%s best" % messages.DEGREE if tilt < WARN_TILT_DEG else "Ride safely"
        self._show_for(_RESULT_MS, RESULT, now_ms, "Aligned! %5.1f%s" % (tilt, messages.DEGREE), warning)
