"""The guided calibrations: takes one pose after another, and computes and saves the result.

The flow of a guided calibration is a generator. The generator waits by `yield`, and is continued with an event: the
counts of a sample while a pose is taken, True for a press, and None once per pass of the loop.

Between two poses the wizard integrates the gyro's rates. The result must agree with the turn that gravity shows between
the two poses.
"""

from time import ticks_add, ticks_diff, ticks_ms

from ..board.button import LONG
from ..board.display import DEGREE
from ..calibration.poses import WARN_TILT_DEG, StillPose, Turn, align
from ..errors import CaptureError, Refusal, SickSensor, report
from ..units import const
from .messages import lines

_SETTLE_MS = const(500)  # time for which the sensor must be still before a pose
_GIVE_UP_MS = const(10_000)  # longest time to wait until the sensor is still
_RESULT_MS = const(4000)
# time after the kickstand pose for which the gyro's bias from this pose is valid; later the bias may drift
_FRESH_MS = const(90_000)

# The steps of a wizard
ASK = "ask"  # waits for the press that begins a pose
TAKE = "take"  # gets each sample
NOTICE = "notice"  # shows a notice for a moment, then asks for the next pose
REFUSED = "refused"  # shows the reason until a press, then starts again
RESULT = "result"  # shows the result for some seconds, then ends
COMPUTE = "compute"  # computes one step each time that it is continued


class Wizard:
    """A guided calibration, a view of Screen.

    A subclass has the flow, the generator _flow(). It may raise a Refusal, which is shown until a press.

    Args:
        app: the App, whose chip, settings and calibration are used.

    Attributes:
        lines: the two lines to show.
        step: one of the steps above.
        notice: the Refusal that is shown, or None.
        ended: True after the end of the wizard.
    """

    SECONDS = 2  # duration of a pose

    def __init__(self, app):
        self._chip, self._rate_hz = app.sensor.chip, app.settings.SAMPLE_HZ
        self._calibration = app.calibration
        self._turn = Turn(self._chip.gyro_lsb_per_dps, 1_000_000 // self._rate_hz)
        self._averaging = self.ended = False
        self._now_ms = ticks_ms()
        self._flows = self._repeat()
        self._go()

    def follow(self, n, dt_us, now_ms):
        """Take the samples of a pass of the loop, then continue. Call this method once per pass.

        Args:
            n: number of samples that the chip has, or 0.
            dt_us: microseconds since the previous samples.
            now_ms: ticks_ms().
        """
        chip, self._now_ms = self._chip, now_ms
        for k in range(n):
            chip.take(k)
            if self.step == TAKE:
                self._go(chip.counts)
        if n:
            self._turn.add(chip.sums, n, dt_us, self._averaging)
        self._go()

    def press(self, event):
        """React to a press. A long press cancels the wizard."""
        if event == LONG or self.step == RESULT:
            self.ended = True
        elif self.step in (ASK, REFUSED):
            self._go(True)

    def bears(self, fault):
        """Return True if the wizard continues despite a fault of the sensor. fault: a Notice."""
        return False

    def _go(self, event=None):
        if not self.ended:
            try:
                self._flows.send(event)
            except StopIteration:
                self.ended = True

    def _repeat(self):
        """Run the flow, again after each refusal."""
        while True:
            try:
                yield from self._flow()
                return
            except Refusal as error:
                refusal = error
            self._turn.running = False
            yield from self._ask(words(refusal), REFUSED, refusal)

    def _show(self, step, lines, notice=None):
        self.step, self.lines, self.notice = step, lines, notice

    def _ask(self, lines, step=ASK, notice=None):
        """Show two lines until a press."""
        self._show(step, lines, notice)
        while not (yield):
            pass

    def _show_for(self, ms, step, lines):
        """Show two lines for the given time."""
        self._show(step, lines)
        until_ms = ticks_add(self._now_ms, ms)
        while ticks_diff(self._now_ms, until_ms) < 0:
            yield

    def _settle(self, lines, restless):
        """Wait until the sensor is still.

        Args:
            lines: the two lines to show.
            restless: the second line after more time than a sensor at rest would need.

        Returns:
            The mean reading of the accelerometer in _SETTLE_MS, 3 values in g.

        Raises:
            CaptureError: the sensor is not still within _GIVE_UP_MS.
        """
        self._show(TAKE, lines)
        expected, waited = self._rate_hz * _SETTLE_MS // 1000, 0
        pose = self._pose(expected)
        while True:
            counts = yield
            if counts is None:
                continue
            waited += 1
            if waited > 2 * expected:
                self.lines = lines[0], restless
            try:
                pose.add(counts)
                if pose.count == expected:
                    pose.finish()
                    return pose.accel
            except CaptureError:
                if waited >= self._rate_hz * _GIVE_UP_MS // 1000:
                    raise
                pose = self._pose(expected)

    def _average(self, title):
        """Take a pose while the sensor is still. Return the StillPose. Raises CaptureError.

        title: the first line. The second line has a bar."""
        total = self._rate_hz * self.SECONDS
        pose = self._pose(total)
        self._averaging = True
        try:
            while pose.count < total:
                counts = yield
                if counts is not None:
                    pose.add(counts)
                    self.lines = title, progress_bar(pose.count, total)
            pose.finish()
            return pose
        finally:
            self._averaging = False

    def _pose(self, expected):
        chip = self._chip
        return StillPose(chip.accel_lsb_per_g, chip.gyro_lsb_per_dps, chip.saturated, expected)


def words(refusal):
    """Return the lines for a Refusal. A fault of the sensor is also printed."""
    if isinstance(refusal, SickSensor):
        report(refusal)
    return lines(refusal)


def progress_bar(done, total):
    """Return a bar that has 16 full cells when `done` reaches `total`."""
    filled = 16 * done // total if total else 0
    return "\xff" * min(16, filled)


class AlignWizard(Wizard):
    """Aligns the sensor by two poses. The first pose is on the kickstand, the second is upright.

    Args:
        app: as for Wizard.
        pressed: True if the rider has already pressed the button for the kickstand pose.

    Attributes:
        upright: True after the kickstand pose, when the upright pose is next.
    """

    name = "align"
    SECONDS = 3

    def __init__(self, app, pressed):
        self._side, self._rides = app.settings.SIDE, app.rides
        self._pressed = pressed
        super().__init__(app)

    def _flow(self):
        self.upright = False
        if not self._pressed:
            yield from self._ask(("On the stand,", "press button"))
        self._pressed = False
        stand = yield from self._take("Stand: hold")
        stand_ms = self._now_ms
        self._turn.start(stand.gyro)
        self.upright = True
        yield from self._ask(("Now upright:", "hold it, press"))
        upright = yield from self._take("Upright: hold")
        self._turn.end()
        new, tilt = align(self._calibration.value, stand, upright, self._side, self._turn)
        # While a ride is recorded the poses do not count, because a replay of the next ride does not know them
        posed = not self._rides.recorder.active and 0 <= ticks_diff(self._now_ms, stand_ms) < _FRESH_MS
        self._calibration.save(new, posed)
        advice = "Little, 8%s best" % DEGREE if tilt < WARN_TILT_DEG else "Ride safely"
        yield from self._show_for(_RESULT_MS, RESULT, ("Aligned! %5.1f%s" % (tilt, DEGREE), advice))

    def _take(self, title):
        """Take a pose. If it is refused, take it again after a press. Return the StillPose."""
        while True:
            try:
                yield from self._settle((title, ""), "not still yet")
                self.lines = title, ""
                return (yield from self._average(title))
            except CaptureError as error:
                refusal = error
            yield from self._ask(words(refusal), ASK, refusal)
