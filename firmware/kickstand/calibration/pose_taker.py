"""Takes one pose while the loop runs: waits until the sensor is still, then averages."""

from ..errors import CaptureError
from ..units import const
from .still_pose import StillPose

_SETTLE_MS = const(500)
_GIVE_UP_MS = const(10_000)  # longest time to wait until the sensor is still

# The states that step() returns
SETTLING = 0  # waiting until the sensor is still
SETTLED = 1  # returned once, when the sensor has been still for _SETTLE_MS and averaging begins
AVERAGING = 2
DONE = 3  # returned once, when the pose is complete
_ENDED = 4


class PoseTaker:
    """Takes one pose from successive samples.

    Args:
        chip: an Mpu6050, for its scale and range.
        rate_hz: samples per second.
        seconds: duration of the average.

    Attributes:
        settled: the mean reading of the accelerometer (3 values, in g) in the half second before averaging. This mean
            is available from SETTLED on.
        pose: the StillPose, which is finished at DONE.
    """

    def __init__(self, chip, rate_hz, seconds):
        self._chip = chip
        self._settle_count = rate_hz * _SETTLE_MS // 1000
        self._give_up_count = rate_hz * _GIVE_UP_MS // 1000
        self._take_count = int(rate_hz * seconds)
        self.restart()

    def restart(self):
        """Begin again: wait for stillness."""
        self._state = SETTLING
        self._waited = 0
        self.settled = None
        self.pose = self._new(self._settle_count)

    def step(self, counts):
        """Take one sample of 7 counts in the chip's order. Return SETTLING, SETTLED, AVERAGING or DONE. Raises
        CaptureError, which ends the pose."""
        if self._state == SETTLING:
            return self._settle(counts)
        if self._state == AVERAGING:
            return self._average(counts)
        return _ENDED

    @property
    def averaging(self):
        """True from SETTLED until DONE or an error."""
        return self._state == AVERAGING

    @property
    def restless(self):
        """True if the wait for stillness is already longer than a sensor at rest would need."""
        return self._state == SETTLING and self._waited > 2 * self._settle_count

    def progress(self):
        """Return the number of samples averaged so far, and the number needed."""
        return (self.pose.count, self._take_count) if self._state == AVERAGING else (0, self._take_count)

    def _new(self, expected):
        chip = self._chip
        return StillPose(chip.accel_lsb_per_g, chip.gyro_lsb_per_dps, chip.saturated, expected)

    def _settle(self, counts):
        self._waited += 1
        try:
            self.pose.add(counts)
            if self.pose.count < self._settle_count:
                return SETTLING
            self.pose.finish()
        except CaptureError:
            if self._waited >= self._give_up_count:
                self._state = _ENDED
                raise
            self.pose = self._new(self._settle_count)
            return SETTLING
        self.settled = self.pose.accel
        self._state = AVERAGING
        self.pose = self._new(self._take_count)
        return SETTLED

    def _average(self, counts):
        try:
            self.pose.add(counts)
            if self.pose.count < self._take_count:
                return AVERAGING
            self.pose.finish()
        except CaptureError:
            self._state = _ENDED
            raise
        self._state = _ENDED
        return DONE
