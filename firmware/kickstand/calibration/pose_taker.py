"""One pose taken while the loop runs: wait until the sensor is still, then average."""

from ..errors import CaptureError
from .still_pose import StillPose

SETTLE_MS = 500
GIVE_UP_MS = 10_000

SETTLING = 0  # waiting for stillness
SETTLED = 1  # returned once: half a second of stillness is over and `settled` holds its mean; taking begins
TAKING = 2
DONE = 3  # pose holds it
SPOILT = 4  # problem holds the CaptureError
_ENDED = 5


class PoseTaker:
    """Takes a StillPose while the loop runs. chip: an Mpu6050, for its scale and range.  rate_hz: samples a
    second.  seconds: to average."""

    def __init__(self, chip, rate_hz, seconds):
        self._chip = chip
        self._settle_count = rate_hz * SETTLE_MS // 1000
        self._give_up_count = rate_hz * GIVE_UP_MS // 1000
        self._take_count = int(rate_hz * seconds)
        self.restart()

    def restart(self):
        """Begin again with waiting for stillness."""
        self._state = SETTLING
        self._waited = 0
        self.settled = None
        self.problem = None
        self.pose = self._new(self._settle_count)

    def step(self, counts):
        """Take one sample; return the state."""
        if self._state == SETTLING:
            return self._settle(counts)
        if self._state == TAKING:
            return self._take(counts)
        return _ENDED

    @property
    def restless(self):
        """True while stillness is being waited for longer than a still sensor would need."""
        return self._state == SETTLING and self._waited > 2 * self._settle_count

    def progress(self):
        """(samples taken, samples wanted) of the pose itself."""
        return (self.pose.count, self._take_count) if self._state == TAKING else (0, self._take_count)

    def _new(self, expected):
        chip = self._chip
        return StillPose(chip.accel_lsb_per_g, chip.gyro_lsb_per_dps, chip.SATURATED, expected)

    def _settle(self, counts):
        self._waited += 1
        still = self.pose.add(counts)
        if still and self.pose.count < self._settle_count:
            return SETTLING
        try:
            self.pose.finish()
        except CaptureError as problem:
            if self._waited < self._give_up_count:
                self.pose = self._new(self._settle_count)
                return SETTLING
            return self._spoil(problem)
        self.settled = self.pose.accel
        self._state = TAKING
        self.pose = self._new(self._take_count)
        return SETTLED

    def _take(self, counts):
        if self.pose.add(counts) and self.pose.count < self._take_count:
            return TAKING
        try:
            self.pose.finish()
        except CaptureError as problem:
            return self._spoil(problem)
        self._state = _ENDED
        return DONE

    def _spoil(self, problem):
        self.problem = problem
        self._state = _ENDED
        return SPOILT
