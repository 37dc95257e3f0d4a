"""Alignment by driving while the device does everything else: feeds it, says what it waits for, saves what it finds.

With a speed source it always runs. What is not aligned, or is asked for in the menu, is taken when it is ready; an
alignment that is there is checked and refined. Flash is written at standstill only.
"""

from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..calibration.parameters import Calibration
from ..errors import StoreError
from ..rotation import matrix
from ..ui.pages import DEGREE
from .alignment import (
    BRAKING,
    DRIVE,
    GAP_US,
    MOTORCYCLE,
    READY,
    TURNING,
    WAITING_FOR_SPEED,
    WAITING_FOR_STOP,
    DriveAlignment,
)
from .quality import CHECKED
from .verdict import MOVED, REFINED, REVERSED, SAME, compare, turn_round

FEED_TURNS = 2  # of the loop: whole numbers are summed in each, floats cost too much
GAP_MS = 300  # readings are missing
LOOK_MS = 1000
FRESH_MS = 3000  # of a speed that says that the vehicle stands
AWAY_MPS = 2.0

_WAITS = {
    WAITING_FOR_SPEED: "waiting: speed",
    WAITING_FOR_STOP: "stop needed",
    DRIVE: "brake straight",
    BRAKING: "braking...",
    TURNING: "turn not counted",
}
_KNOWN_BIAS = (0.0, 0.0, 0.0)  # with an alignment the gyro's bias was measured too, and is taken off
STAND_SIDE = ("Stand was right?", "hold = fix")
MOUNT_MOVED = ("Mount has moved", "Align again")
_DOUBTS = {STAND_SIDE: "stand was right?", MOUNT_MOVED: "mount has moved"}  # in place of the lean, until answered


class DriveMode:
    """vehicle: "motorcycle" or "car".  speed: a Speed.  meter: a LeanMeter.  keep: called with a Calibration to save
    and use, raises StoreError.

    shown: lines() is a page now.  message: two lines over everything else until answer(), or until the ride goes on.
    """

    def __init__(self, vehicle, speed, meter, keep):
        self.vehicle = vehicle
        self.speed = speed
        self._meter = meter
        self._keep = keep
        self.shown = False
        self._speed_mps = 0.0
        self._speed_ms = self._fed_ms = self._look_ms = None
        self._total = [0] * 7
        self._force, self._rate = [0.0] * 3, [0.0] * 3
        self.begin()

    def begin(self, asked=False):
        """With another calibration, from flash or by a wizard: it is to be checked. asked: it is not to be trusted."""
        self._asked = asked
        self._told = []  # what the rider has seen and needs no more
        self.message = None
        self._restart()

    def _restart(self):
        old = self._meter.calibration
        self._calibration = old  # of all that is fed from now on, whatever is saved meanwhile
        trusted = self.vehicle == MOTORCYCLE and old.aligned and not self._asked
        up = old.vehicle_from_sensor[3:6] if trusted else None
        self.drive = DriveAlignment(self.vehicle, up, _KNOWN_BIAS if old.aligned else None)
        self.shown = self.shown or (self.vehicle != MOTORCYCLE and not old.aligned)
        self._result = None
        self._clear()

    def ask(self):
        """The rider wants it, for a sensor that is mounted anew: nothing of before counts."""
        self.shown = True
        self.begin(True)

    def _clear(self):
        self._n = self._us = self._turns = 0
        for i in range(7):
            self._total[i] = 0

    def poll(self, now_ms):
        """Once each turn of the loop: speed, and what there is to do. Returns a new speed in m/s that is fit to be
        kept, or None."""
        speed = self.speed.poll(now_ms)
        if speed is not None:
            self._speed_mps = speed
            self._speed_ms = now_ms
            self.drive.measure_speed(speed, self.speed.age_us)
            speed = self._for_lean(speed)
        if self._look_ms is None or ticks_diff(now_ms, self._look_ms) >= 0:
            self._look_ms = ticks_add(now_ms, LOOK_MS)
            self._look(now_ms)
        return speed

    def _for_lean(self, speed):
        """What the lean filter may have: not what no braking has confirmed yet, as a wheel may have two magnets; and no
        zero, which a broken wire gives too; a standstill it sees by itself. Rounded as a record keeps it. None
        otherwise."""
        if self.vehicle != MOTORCYCLE:
            return speed
        drive = self.drive
        confirmed = drive.counted >= CHECKED and drive.quality.speed_problem is None
        if speed <= 0.0 or drive.problem is not None or not confirmed:
            return None
        speed = int(100 * speed + 0.5) / 100
        self._meter.measure_speed(speed)
        return speed

    def feed(self, sums, n, dt_us, now_ms):
        """Sums (7, counts in the chip's order) of the n samples of a turn, within dt_us."""
        if self._fed_ms is not None and ticks_diff(now_ms, self._fed_ms) > GAP_MS:
            self._clear()
            self.drive.update(self._force, self._rate, GAP_US + 1)
        self._fed_ms = now_ms
        total = self._total
        for i in range(7):
            total[i] += sums[i]
        self._n += n
        self._us += dt_us
        self._turns += 1
        if self._turns >= FEED_TURNS:
            n = self._n
            self._calibration.apply([t / n for t in total], self._force, self._rate)
            self.drive.update(self._force, self._rate, self._us)
            self._clear()

    def _look(self, now_ms):
        """Once a second: is there anything to do? Only when the vehicle stands, by its speed and by the sensor."""
        if self._away():
            self.message = None
            return
        fresh = self._speed_ms is not None and ticks_diff(now_ms, self._speed_ms) < FRESH_MS
        if not (fresh and self.drive.standing.standing) or self.message:
            return
        drive, aligned = self.drive, self._meter.calibration.aligned
        if drive.problem is not None:
            self._refused(drive.problem.lcd, aligned)
        elif self._asked or not aligned:
            if drive.ready:
                self._take(True)
        else:
            verdict = compare(drive, self._meter.calibration.vehicle_from_sensor)
            if self.vehicle != MOTORCYCLE:
                if drive.ready and verdict in (REFINED, MOVED, REVERSED):
                    self._take(verdict != REFINED)
            elif verdict == REVERSED:
                self._say(STAND_SIDE)
            elif verdict == MOVED:
                self._say(MOUNT_MOVED)
            elif verdict == REFINED and drive.ready:
                self._take(False)
            elif verdict == SAME:
                self._meter.trust()

    def _away(self):
        """True while the ride goes on. A source with a fault may say zero for ever: then by the lean filter."""
        faulty = self.drive.problem is not None or (self.message is not None and self.message not in _DOUBTS)
        return self._speed_mps > AWAY_MPS or (faulty and self._meter.speed_mps > AWAY_MPS)

    def _refused(self, lines, aligned):
        """What has gone wrong so far may end: the drive is begun anew, the reason stays on the page until then."""
        if aligned:
            self._say(lines)
        self._restart()
        self._result = lines

    def _say(self, lines):
        if lines not in self._told:
            self.message = lines
            if self.vehicle == MOTORCYCLE and lines in _DOUBTS:
                self._meter.distrust(_DOUBTS[lines])

    def answer(self, event):
        """A press while there is a message."""
        message, self.message = self.message, None
        self._told.append(message)
        if message in _DOUBTS:
            self._meter.trust()
        if event == LONG and message == STAND_SIDE:
            old = self._meter.calibration
            turned = matrix()
            for i in range(9):
                turned[i] = old.vehicle_from_sensor[i]
            turn_round(turned)
            if self._save(turned, -self._meter.trim_deg):
                self.message = ("Side put right", "Ride safely")
                self._meter.reset_maxima()

    def _take(self, anew):
        """anew: the vertical is another one too."""
        found = matrix()
        self.drive.matrix(found)
        if not self._save(found, 0.0 if anew else self._meter.trim_deg):
            return
        self._result = ("Aligned by drive", "error about %.1f%s" % (self.drive.quality_deg, DEGREE))
        if anew:
            self.message = self._result
            self._asked = False
            self._meter.reset_maxima()

    def _save(self, vehicle_from_sensor, trim_deg):
        """True once it is in flash."""
        old, used = self._meter.calibration, self._calibration
        new = Calibration()
        new.set_accel(old.accel_offset, old.accel_slope)
        new.six_done = old.six_done
        for i in range(9):
            new.vehicle_from_sensor[i] = vehicle_from_sensor[i]
        for i in range(3):  # standing still, the gyro feels its bias alone
            new.gyro_bias[i] = used.gyro_bias[i] + self.drive.standing.bias[i]
        new.trim_deg = trim_deg
        new.aligned = new.by_drive = True
        try:
            self._keep(new)
        except StoreError as problem:
            self._say(problem.lcd)
            return False
        return True

    def lines(self, now_ms):
        """The page: what it waits for."""
        drive = self.drive
        if drive.problem is not None:
            return drive.problem.lcd
        if self._result and (drive.ready or not drive.counted):
            return self._result
        state = drive.state
        if state == TURNING and self._speed_mps < AWAY_MPS:
            state = BRAKING  # its end, too slow to tell
        if state == READY:
            return "Ready:", "stop to save it"
        if state == WAITING_FOR_SPEED:
            return self.speed.fault(now_ms) or ("Align by drive", _WAITS[state])
        if drive.counted < drive.needed:
            return "Brakings %3d/%d" % (drive.counted, drive.needed), _WAITS[state]
        return "Brake%3d +-%4.1f%s" % (drive.counted, min(drive.quality_deg, 99.9), DEGREE), _WAITS[state]
