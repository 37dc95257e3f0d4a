"""What both wizards are: views that take poses, one after the other, in one of a few named states."""

from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..calibration.pose_taker import DONE, SETTLED, SPOILT, PoseTaker
from ..errors import Refusal
from . import messages

# What a wizard does now
ASKING = 0  # waiting for the press that begins a pose
TAKING = 1  # each sample goes to the PoseTaker
NOTICE = 2  # something is shown for a moment, then comes the next pose
REFUSED = 3  # the reason is shown until a press, then it begins anew
RESULT = 4  # what came of it is shown for some seconds, then it ends
ENDED = 5


class Wizard:
    """A view (see screen.py) that also takes each sample, until it has ended.

    chip, rate_hz, seconds: as for PoseTaker. calibration: the ActiveCalibration. A subclass says what is asked for, and
    what is done with what was taken.
    """

    def __init__(self, chip, rate_hz, seconds, calibration):
        self._taker = PoseTaker(chip, rate_hz, seconds)
        self._calibration = calibration
        self._start()

    @property
    def ended(self):
        """True once it is over."""
        return self._state == ENDED

    def sample(self, counts, now_ms):
        """Take one sample: 7 counts, the chip's order."""
        if self._state != TAKING:
            return
        step = self._taker.step(counts)
        if step == SPOILT:
            self._spoilt(self._taker.problem, now_ms)
        elif step == SETTLED:
            self._settled(self._taker.settled, now_ms)
        elif step == DONE:
            try:
                self._pose_done(self._taker.pose, now_ms)
            except Refusal as problem:
                self._show(REFUSED, messages.lines(problem))
        else:
            self._progress(*self._taker.progress())

    def _start(self):
        """Ask for the first pose."""

    def _next_pose(self):
        """Begin the next pose."""

    def _settled(self, accel, now_ms):
        """The sensor has been still for half a second. accel: the mean reading (3, g)."""

    def _progress(self, done, total):
        """done of total samples of the pose are taken."""

    def _spoilt(self, problem, now_ms):
        """The pose was refused. problem: a CaptureError."""

    def _pose_done(self, pose, now_ms):
        """A StillPose is complete. May raise a Refusal, which is shown."""

    def lines(self, now_ms):
        if self._state in (NOTICE, RESULT) and ticks_diff(now_ms, self._until_ms) >= 0:
            if self._state == NOTICE:
                self._next_pose()
            else:
                self._state = ENDED
        return None if self.ended else self._lines

    def press(self, event, now_ms):
        if event == LONG or self._state == RESULT:
            self._state = ENDED
        elif self._state == ASKING:
            self._next_pose()
        elif self._state == REFUSED:
            self._start()
        return True

    def _show(self, state, lines):
        """Go into a state. lines: two."""
        self._state = state
        self._lines = lines

    def _show_for(self, ms, state, now_ms, *lines):
        """Go into NOTICE or RESULT for so long."""
        self._until_ms = ticks_add(now_ms, ms)
        self._show(state, lines)

    def _begin_pose(self, *lines):
        """Wait until the sensor is still, then take a pose."""
        self._taker.restart()
        self._show(TAKING, lines)
