"""Aligns by driving, in the background: feeds a DriveAlignment and saves the result.

This alignment always runs if there is a speed source. If the sensor is not aligned, or after a request in the menu, the
drive's alignment is used as soon as it is ready. In all other cases the drive checks and refines the earlier alignment.
Flash is written only at standstill.
"""

from time import ticks_add, ticks_diff

from ..errors import Notice, Refusal, attempt
from ..rotation import matrix
from ..units import const
from . import alignment

# Number of passes of the loop between two steps of the drive's work, to save time
_FEED_TURNS = const(2)
_GAP_MS = const(300)  # a longer time between two readings means that readings were lost
_LOOK_MS = const(1000)  # time between two calls of _look()
_FRESH_MS = const(3000)  # an older speed proves no standstill
_AWAY_MPS = const(2.0)  # speed above which the vehicle has driven off

# The gyro's bias that remains in the rates of an aligned sensor: 0, because the bias measured in the poses is already
# subtracted.
_KNOWN_BIAS = (0.0, 0.0, 0.0)
STAND_SIDE, MOUNT_MOVED = "other-side", "mount-moved"
_QUESTIONS = (STAND_SIDE, MOUNT_MOVED)  # codes of the messages that hide the lean until the rider answers


class BackgroundAlignment:
    """Runs the alignment by driving.

    The app's loop calls poll() and feed() in each pass. The menu calls ask(), and a press calls answer().

    Args:
        leans: True for a motorcycle, False for a car.
        speed: a Speed.
        meter: a LeanMeter.
        calibration: the ActiveCalibration.

    Attributes:
        speed: the Speed.
        drive: the current DriveAlignment, read-only.
        shown: True if the progress has its own page (ui/drive_page.py).
        result: the Notice or Refusal at the end of the last drive, or None.
        message: a Refusal or Notice to show before everything else, or None. The message is shown until answer() is
            called or the vehicle drives off.
    """

    def __init__(self, leans, speed, meter, calibration):
        self._leans = leans
        self.speed = speed
        self._meter = meter
        self._active = calibration
        self.shown = False
        self._speed_mps = 0.0
        self._speed_ms = self._fed_ms = self._look_ms = None
        self._total = [0] * 7
        self._begin()

    def _begin(self, asked=False):
        """Start a new drive.

        Args:
            asked: True if the drive must replace the alignment, False if it must check the alignment.
        """
        self._asked = asked
        self._answered = []  # codes of messages not to show again
        self.message = None
        self._restart()

    def _restart(self):
        # _checked: the calibration that the drive checks and refines
        self._checked = current = self._meter.calibration
        # use one calibration for all samples of this drive, even if the drive refines it meanwhile
        self._calibration = current
        trusted = self._leans and current.aligned and not self._asked
        up = current.vehicle_from_sensor[3:6] if trusted else None
        kind = alignment.MOTORCYCLE if self._leans else alignment.CAR
        self.drive = alignment.DriveAlignment(kind, up, _KNOWN_BIAS if current.aligned else None)
        self.shown = self.shown or not (self._leans or current.aligned)
        self.result = None
        self._clear_sums()

    def ask(self):
        """Drop the current drive, and start a drive that replaces the alignment. The rider requests a new alignment
        after remounting the sensor."""
        self.shown = True
        self._begin(True)

    def _clear_sums(self):
        self._n = self._us = self._turns = 0
        for i in range(7):
            self._total[i] = 0

    def poll(self, now_ms):
        """Read the speed source. Once per second, handle the drive's result. Call this in each pass of the loop.

        Returns:
            A new speed in m/s for a recording, or None.
        """
        if self._meter.calibration is not self._checked:  # from a wizard or for another chip
            self._begin()
        speed = self.speed.poll(now_ms)
        if speed is not None:
            self._speed_mps = speed
            self._speed_ms = now_ms
            self.drive.measure_speed(speed, self.speed.age_us)
            speed = self._share(speed)
        if self._look_ms is None or ticks_diff(now_ms, self._look_ms) >= 0:
            self._look_ms = ticks_add(now_ms, _LOOK_MS)
            self.fresh_speed(now_ms)
            if self._fed_ms is not None and ticks_diff(now_ms, self._fed_ms) > _LOOK_MS:
                self._begin_again()  # begin again now, because after 6 days without a reading ticks_diff() is negative
            notice = attempt(None, self._look, now_ms)
            if notice:
                self._say(notice)
        return speed

    def fresh_speed(self, now_ms):
        """Return the last speed in m/s, or None if the speed is old."""
        if self._speed_ms is not None and ticks_diff(now_ms, self._speed_ms) >= _FRESH_MS:
            # forget the time, because after 6 days ticks_diff() is negative and the speed would seem new
            self._speed_ms = None
        return self._speed_mps if self._speed_ms is not None else None

    def _share(self, speed):
        """Pass a speed to the lean filter if it is reliable.

        A speed that the braking events have not confirmed is not passed, because a wheel may have two magnets. Zero is
        not passed either, because a broken wire also reads zero. The filter detects a standstill on its own.

        Args:
            speed: in m/s.

        Returns:
            The speed, rounded as in a recording, or None if it was not passed. A car's speed is returned unchanged.
        """
        if not self._leans:
            return speed
        if speed <= 0.0 or self.drive.problem is not None or not self.drive.quality.speed_confirmed:
            return None
        speed = int(100 * speed + 0.5) / 100
        self._meter.measure_speed(speed)
        return speed

    def feed(self, sums, n, dt_us, now_ms):
        """Take the samples of a pass of the loop. Call this once per pass with samples.

        Args:
            sums: sums of the samples' counts in the chip's order, 7 values.
            n: number of samples.
            dt_us: microseconds since the previous samples.
            now_ms: ticks_ms().
        """
        if self._fed_ms is not None and ticks_diff(now_ms, self._fed_ms) > _GAP_MS:
            self._begin_again()
        self._fed_ms = now_ms
        total = self._total
        for i in range(7):
            total[i] += sums[i]
        self._n += n
        self._us += dt_us
        self._turns += 1
        if self._turns < _FEED_TURNS:
            return
        if self.drive.elapse(self._us):
            n, force, rate = self._n, [0.0] * 3, [0.0] * 3
            self._calibration.apply([t / n for t in total], force, rate)
            self.drive.end_bin(force, rate)
            self._clear_sums()
        self._us = self._turns = 0

    def _begin_again(self):
        """Drop the sums, because readings are missing."""
        self._fed_ms = None
        self._clear_sums()
        self.drive.interrupt()

    def _look(self, now_ms):
        """Handle the drive's result, but only while speed and sensor show a standstill. Called once per second."""
        if self._away():
            self.message = None
            return
        if self.fresh_speed(now_ms) is None or not self.drive.standing.standing or self.message:
            return
        drive, aligned = self.drive, self._meter.calibration.aligned
        if drive.problem is not None:
            self._refuse(drive.problem, aligned)
        elif self._asked or not aligned:
            if drive.ready:
                self._adopt(True)
        else:
            verdict = alignment.compare(drive, self._meter.calibration.vehicle_from_sensor)
            if not self._leans:
                if drive.ready and verdict in (alignment.REFINED, alignment.MOVED, alignment.REVERSED):
                    self._adopt(verdict != alignment.REFINED)
            elif verdict == alignment.REVERSED:
                self._say(Notice(STAND_SIDE))
            elif verdict == alignment.MOVED:
                self._say(Notice(MOUNT_MOVED, "since-alignment"))
            elif verdict == alignment.REFINED and drive.ready:
                self._adopt(False)
            elif verdict == alignment.SAME:
                self._meter.distrust(None)

    def _away(self):
        """Return True while the vehicle drives. A faulty speed source may report zero forever, so the lean filter's own
        estimate of the speed counts too."""
        faulty = self.drive.problem is not None or (self.message is not None and self.message.code not in _QUESTIONS)
        return self._speed_mps > _AWAY_MPS or (faulty and self._meter.speed_mps > _AWAY_MPS)

    def _refuse(self, problem, aligned):
        """Report a problem and begin a new drive, because the problem may disappear. The page shows the problem as the
        result until an event has counted in the new drive."""
        if aligned:
            self._say(problem)
        self._restart()
        self.result = problem

    def _say(self, message):
        if message.code not in self._answered:
            self.message = message
            if self._leans and message.code in _QUESTIONS:
                self._meter.distrust(message.code)

    def answer(self, agreed):
        """Clear the message after the rider has read it.

        Args:
            agreed: True to accept what the message offers. STAND_SIDE offers to exchange forward and backward.
        """
        code, self.message = self.message.code, None
        self._answered.append(code)
        if code in _QUESTIONS:
            self._meter.distrust(None)
        if agreed and code == STAND_SIDE:
            current = self._meter.calibration
            turned = matrix(current.vehicle_from_sensor)
            alignment.turn_round(turned)
            if self._save(turned, -self._meter.trim_deg):
                self.message = Notice("side-fixed")

    def _adopt(self, is_new):
        """Save the drive's alignment.

        Args:
            is_new: True for a new alignment, which resets trim and maxima. False for a refinement.
        """
        aligned = matrix()
        self.drive.matrix(aligned)
        if not self._save(aligned, 0.0 if is_new else self._meter.trim_deg, not is_new):
            return
        self.result = Notice("aligned", self.drive.quality_deg)
        if is_new:
            self.message = self.result
            self._asked = False

    def _save(self, vehicle_from_sensor, trim_deg, refined=False):
        """Save an alignment. Return True on success. On failure return False and set `message` to the reason."""
        current, used = self._meter.calibration, self._calibration
        # The bias of `used` was subtracted from the drive's rates. The drive measured the remaining bias. The sum of
        # both is the gyro's bias.
        bias = [used.gyro_bias[i] + self.drive.standing.bias[i] for i in range(3)]
        try:
            self._active.save(current.with_alignment(vehicle_from_sensor, bias, trim_deg, True), refined=refined)
        except Refusal as problem:
            self._say(problem)
            return False
        self._checked = self._meter.calibration
        return True

    def state(self):
        """Return the drive's state (see alignment.py). At walking pace a bend cannot be recognised, so TURNING is
        replaced by BRAKING."""
        state = self.drive.state
        return alignment.BRAKING if state == alignment.TURNING and self._speed_mps < _AWAY_MPS else state
