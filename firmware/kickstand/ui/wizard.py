"""The base of both wizards, a view that takes one pose after another.

Between two poses the wizard integrates the gyro's rates. The result must agree with the turn that gravity shows between
the two poses."""

from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..calibration.pose_taker import DONE, SETTLED, PoseTaker
from ..calibration.turn import Turn
from ..errors import CaptureError, GyroError, Refusal, SickSensor, report
from ..units import const
from . import messages

# The states of a wizard
ASKING = 0  # waiting for the press that begins a pose
TAKING = 1  # each sample goes to the PoseTaker
NOTICE = 2  # shows a notice for a moment, then asks for the next pose
_REFUSED = const(3)  # shows the reason until a press, then starts again
RESULT = 4  # shows the result for some seconds, then ends
_ENDED = const(5)
COMPUTING = 6  # computes one step in each pass of the main loop


class Wizard:
    """A view (see screen.py) that also takes each sample until it has ended.

    A subclass defines which poses it asks for and how it uses them. A subclass may also set POSE_SECONDS, the duration
    of a pose.

    Args:
        chip, rate_hz: as for PoseTaker.
        calibration: the ActiveCalibration.

    Attributes:
        state: one of the states above.
        problem: the Refusal that is shown, or None.
    """

    POSE_SECONDS = 2

    def __init__(self, chip, rate_hz, calibration):
        self._taker = PoseTaker(chip, rate_hz, self.POSE_SECONDS)
        self._turn = Turn(chip.gyro_lsb_per_dps, 1_000_000 // rate_hz)
        self._calibration = calibration
        self._start()

    @property
    def ended(self):
        """True after the end of the wizard."""
        return self.state == _ENDED

    def sample(self, counts, now_ms):
        """Take one sample of 7 counts, in the chip's order."""
        if self.state != TAKING:
            return
        try:
            step = self._taker.step(counts)
            if step == SETTLED:
                self._settled(self._taker.settled, now_ms)
            elif step == DONE:
                self._pose_done(self._taker.pose, now_ms)
            else:
                self._progress(*self._taker.progress())
        except CaptureError as problem:
            if isinstance(problem, SickSensor):
                report(problem)
            self._spoilt(problem, now_ms)
        except Refusal as problem:
            self._refuse(problem)

    def follow(self, sums, n, dt_us, now_ms):
        """Take the sums of the samples that sample() has just taken.

        Args:
            sums: sums of the samples' counts in the chip's order, 7 values.
            n: number of samples.
            dt_us: microseconds since the previous samples.
            now_ms: ticks_ms().
        """
        self._turn.add(sums, n, dt_us, self.state == TAKING and self._taker.averaging)
        try:
            self._followed(now_ms)
        except Refusal as problem:
            self._refuse(problem)

    def bears(self, fault, now_ms):
        """Return True if the wizard continues despite a fault of the sensor.

        By default the wizard continues only without a fault.

        Args:
            fault: a Notice, or None without a fault.
            now_ms: ticks_ms().
        """
        return fault is None

    def _refuse(self, problem):
        """Show the reason of a refusal until a press. A fault of the gyro is also printed, because its remedy is too
        long for the display."""
        if isinstance(problem, GyroError):
            report(problem)
        self._turn.running = False
        self._show(_REFUSED, messages.lines(problem), problem)

    def _followed(self, now_ms):
        """Do the work of one pass of the main loop. May raise a Refusal, which is shown."""

    def _start(self):
        """Ask for the first pose."""

    def _next_pose(self):
        """Begin the next pose."""

    def _settled(self, accel, now_ms):
        """React when the sensor has been still for half a second.

        Args:
            accel: mean reading of the accelerometer in this time, 3 values in g.
            now_ms: ticks_ms().
        """

    def _progress(self, done, total):
        """Show that `done` of `total` samples of the pose are taken."""

    def _spoilt(self, problem, now_ms):
        """React when the pose was rejected.

        Args:
            problem: a CaptureError.
            now_ms: ticks_ms().
        """

    def _pose_done(self, pose, now_ms):
        """Use a complete StillPose. May raise a Refusal, which is shown."""

    def lines(self, now_ms):
        if self.state in (NOTICE, RESULT) and ticks_diff(now_ms, self._until_ms) >= 0:
            if self.state == NOTICE:
                self._next_pose()
            else:
                self.state = _ENDED
        return None if self.ended else self._lines

    def press(self, event, now_ms):
        if event == LONG or self.state == RESULT:
            self.state = _ENDED
        elif self.state == ASKING:
            self._next_pose()
        elif self.state == _REFUSED:
            self._start()
        return True

    def _show(self, state, lines, problem=None):
        """Enter a state and show two lines."""
        self.problem = problem
        self.state = state
        self._lines = lines

    def _show_for(self, ms, state, now_ms, *lines):
        """Enter NOTICE or RESULT for the given time, and show two lines."""
        self._until_ms = ticks_add(now_ms, ms)
        self._show(state, lines)

    def _begin_pose(self, *lines):
        """Wait until the sensor is still, then take a pose."""
        self._taker.restart()
        self._show(TAKING, lines)
