"""The calibration in use: loaded for the chip that runs, saved to flash, and kept up to date while riding."""

from time import ticks_add, ticks_diff, ticks_ms

from ..errors import StoreError, report
from .store import Store

TRIM_MS = 60_000  # flash wears: the roll-misalignment correction is saved no more often


class ActiveCalibration:
    """meter: the LeanMeter that works with it. changed: called as changed(replaced) after each change.
    replaced: True for another alignment, so that maxima and what driving has shown are discarded; False for a small
    correction.

    The trim, short for the roll-misalignment correction, is in degrees, and riding finds it (see Calibration).
    """

    def __init__(self, meter, changed):
        self._meter = meter
        self._changed = changed
        self._store = None  # a stored calibration belongs to one chip, and which one is known once it runs
        self._trim_due_ms = ticks_add(ticks_ms(), TRIM_MS)

    @property
    def value(self):
        """The Calibration. Until the first chip has started it is that with which the meter was made."""
        return self._meter.calibration

    @property
    def aligned(self):
        """True once there is an alignment."""
        return self.value.aligned

    def chip_started(self, chip):
        """Load the stored calibration of chip (an Mpu6050 that runs) unless it is in use. True if it was loaded."""
        if self._store and self._store.who_am_i == chip.who_am_i:
            return False
        self._chip = chip
        self._store = Store(chip.who_am_i, chip.accel_range_g)
        self._use(self._store.load(), True)
        return True

    def save(self, calibration):
        """Put a calibration that the rider made into flash, then into use. Raises StoreError."""
        self._store.save(calibration)
        self._use(calibration, True)

    def refine(self, calibration):
        """Like save(), but the alignment came from driving; what was estimated stays valid. Raises StoreError."""
        self._store.save(calibration)
        self._use(calibration, False)

    def restart(self):
        """Begin with the values in flash, as a replay of a ride will: the trim found so far is saved first."""
        self._save_trim()
        self._meter.use(self.value)

    def keep_trim(self, now_ms):
        """Save the trim that riding has found, when the bike stands. Call it about every 100 ms."""
        if self.value.aligned and ticks_diff(now_ms, self._trim_due_ms) >= 0 and self._save_trim():
            self._trim_due_ms = ticks_add(now_ms, TRIM_MS)

    def _save_trim(self):
        """True if there was something to save."""
        if not self._meter.keep_trim() or not self._store.unchanged():
            return False
        try:
            self._store.save(self.value)
        except StoreError as error:  # the next ride finds it again
            report(error)
        return True

    def _use(self, calibration, replaced):
        calibration.set_scale(self._chip.accel_lsb_per_g, self._chip.gyro_lsb_per_dps)
        self._meter.use(calibration)
        self._changed(replaced)
