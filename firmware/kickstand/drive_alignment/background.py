"""Alignment by driving while the device does everything else: feeds it, says what it waits for, saves what it finds.

With a speed source it always runs. What is not aligned, or is asked for in the menu, is taken when it is ready; an
alignment that is there is checked and refined. Flash is written at standstill only.
"""

from time import ticks_add, ticks_diff

from ..errors import AlignmentError, Notice, StoreError
from ..rotation import matrix
from .alignment import (
    BRAKING,
    GAP_US,
    MOTORCYCLE,
    TURNING,
    DriveAlignment,
)
from .quality import CHECKED
from .verdict import MOVED, REFINED, REVERSED, SAME, compare, turn_round

FEED_TURNS = 2  # of the loop: whole numbers are summed in each, floats cost too much
GAP_MS = 300  # readings are missing
LOOK_MS = 1000
FRESH_MS = 3000  # of a speed that says that the vehicle stands
AWAY_MPS = 2.0

_KNOWN_BIAS = (0.0, 0.0, 0.0)  # with an alignment the gyro's bias was measured too, and is taken off
STAND_SIDE, MOUNT_MOVED = "stand-on-other-side", "mount-moved"
_DOUBTS = (STAND_SIDE, MOUNT_MOVED)  # codes of messages until whose answer no lean is to be trusted


class BackgroundAlignment:
    """vehicle: "motorcycle" or "car".  speed: a Speed.  meter: a LeanMeter.  calibration: the ActiveCalibration.

    shown: what it waits for is a page now, see ui/drive_page.py.  message: an AlignmentError, StoreError or Notice that
    goes before everything else until answer(), or until the ride goes on.  result: the Notice or AlignmentError that
    the last drive ended with, or None.
    """

    def __init__(self, vehicle, speed, meter, calibration):
        self.vehicle = vehicle
        self.speed = speed
        self._meter = meter
        self._active = calibration
        self.shown = False
        self._speed_mps = 0.0
        self._speed_ms = self._fed_ms = self._look_ms = None
        self._total = [0] * 7
        self._force, self._rate = [0.0] * 3, [0.0] * 3
        self.begin()

    def begin(self, asked=False):
        """With another calibration, from flash or by a wizard: it is to be checked. asked: it is not to be trusted."""
        self._asked = asked
        self._told = []  # codes of what the rider has seen and needs no more
        self.message = None
        self._restart()

    def _restart(self):
        old = self._meter.calibration
        self._calibration = old  # of all that is fed from now on, whatever is saved meanwhile
        trusted = self.vehicle == MOTORCYCLE and old.aligned and not self._asked
        up = old.vehicle_from_sensor[3:6] if trusted else None
        self.drive = DriveAlignment(self.vehicle, up, _KNOWN_BIAS if old.aligned else None)
        self.shown = self.shown or (self.vehicle != MOTORCYCLE and not old.aligned)
        self.result = None
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
            self._refused(drive.problem, aligned)
        elif self._asked or not aligned:
            if drive.ready:
                self._take(True)
        else:
            verdict = compare(drive, self._meter.calibration.vehicle_from_sensor)
            if self.vehicle != MOTORCYCLE:
                if drive.ready and verdict in (REFINED, MOVED, REVERSED):
                    self._take(verdict != REFINED)
            elif verdict == REVERSED:
                self._say(AlignmentError(STAND_SIDE))
            elif verdict == MOVED:
                self._say(AlignmentError(MOUNT_MOVED, "since-alignment"))
            elif verdict == REFINED and drive.ready:
                self._take(False)
            elif verdict == SAME:
                self._meter.trust()

    def _away(self):
        """True while the ride goes on. A source with a fault may say zero for ever: then by the lean filter."""
        faulty = self.drive.problem is not None or (self.message is not None and self.message.code not in _DOUBTS)
        return self._speed_mps > AWAY_MPS or (faulty and self._meter.speed_mps > AWAY_MPS)

    def _refused(self, problem, aligned):
        """What has gone wrong so far may end: the drive is begun anew, the reason stays on the page until then."""
        if aligned:
            self._say(problem)
        self._restart()
        self.result = problem

    def _say(self, message):
        if message.code not in self._told:
            self.message = message
            if self.vehicle == MOTORCYCLE and message.code in _DOUBTS:
                self._meter.distrust(message.code)

    def answer(self, agreed):
        """The rider has read the message. agreed: and wants what it offers."""
        code, self.message = self.message.code, None
        self._told.append(code)
        if code in _DOUBTS:
            self._meter.trust()
        if agreed and code == STAND_SIDE:
            old = self._meter.calibration
            turned = matrix()
            for i in range(9):
                turned[i] = old.vehicle_from_sensor[i]
            turn_round(turned)
            if self._save(turned, -self._meter.trim_deg):
                self.message = Notice("side-put-right")
                self._meter.reset_maxima()

    def _take(self, anew):
        """anew: the vertical is another one too."""
        found = matrix()
        self.drive.matrix(found)
        if not self._save(found, 0.0 if anew else self._meter.trim_deg):
            return
        self.result = Notice("aligned-by-drive", self.drive.quality_deg)
        if anew:
            self.message = self.result
            self._asked = False
            self._meter.reset_maxima()

    def _save(self, vehicle_from_sensor, trim_deg):
        """True once it is in flash."""
        old, used = self._meter.calibration, self._calibration
        # at a stop the gyro feels its bias alone
        bias = [used.gyro_bias[i] + self.drive.standing.bias[i] for i in range(3)]
        try:
            self._active.refine(old.with_alignment(vehicle_from_sensor, bias, trim_deg, True))
        except StoreError as problem:
            self._say(problem)
            return False
        return True

    @property
    def state(self):
        """The DriveAlignment's state; the end of a braking event, too slow to tell a turn, still counts as braking."""
        state = self.drive.state
        return BRAKING if state == TURNING and self._speed_mps < AWAY_MPS else state
