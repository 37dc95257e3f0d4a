"""Keeps the calibration in use: loads it for the running chip, saves it to flash, and updates it while riding."""

import sys
from time import ticks_add, ticks_diff, ticks_ms

from ..errors import Refusal, report, unload
from ..units import const

_TRIM_MS = const(60_000)  # shortest time between two saves of the trim, because writing wears the flash
_LOOK_MS = const(1000)  # time until the next attempt, because at rest each attempt takes heap


class ActiveCalibration:
    """The Calibration in use, and its store.

    The trim is the correction of the roll misalignment, in degrees. The trim and the gyro's errors are estimated while
    riding, and saved together: see LeanMeter.keep_trim().

    Args:
        meter: the LeanMeter that uses the Calibration.

    Attributes:
        value: the Calibration in use. Until the first chip has started, this is the Calibration of the new meter.
        changed: True after another calibration has come into use. The app sets it to False.
    """

    def __init__(self, meter):
        self._meter = meter
        self.value = meter.calibration
        self.changed = False
        self._chip = None  # None until a chip runs, because a stored calibration belongs to one chip
        self.newest = None  # see Store
        self._trim_due_ms = ticks_add(ticks_ms(), _TRIM_MS)

    @property
    def aligned(self):
        """True if the sensor is aligned."""
        return self.value.aligned

    def chip_started(self, chip):
        """Load the stored calibration of a chip, unless it is already in use. Return True if it was loaded.

        Args:
            chip: an Mpu6050 that runs.
        """
        if self._chip and self._chip_id == chip.who_am_i:
            return False
        self._chip, self._chip_id = chip, chip.who_am_i
        self._use(self._stored())
        return True

    def save(self, calibration, posed=False, refined=False):
        """Save a calibration to flash, then use it. Raises Refusal.

        Args:
            calibration: the new Calibration.
            posed: as for LeanMeter.use().
            refined: True for a small correction, after which the maxima are still valid.
        """
        self._stored(calibration)
        self._use(calibration, posed, refined)

    def restart(self):
        """Save the current trim, then restart the meter with the calibration in flash. So a replay of the ride can
        start with the same calibration."""
        self._save_trim()
        self._meter.use(self.value)

    def keep_trim(self, now_ms):
        """Save the trim if the bike is at rest and _TRIM_MS have passed since the last save.

        Call this method about every 100 ms."""
        if ticks_diff(now_ms, self._trim_due_ms) >= 0:
            saved = self.aligned and self._save_trim()
            self._trim_due_ms = ticks_add(now_ms, _TRIM_MS if saved else _LOOK_MS)

    def _save_trim(self):
        """Save the trim if it has changed enough. Return True if it was saved."""
        try:
            return self._meter.keep_trim() and self._stored(self.value, True)
        except Refusal as error:  # a failed save is not fatal, because the next ride estimates the trim again
            report(error)
            return True

    def _stored(self, calibration=None, careful=False):
        """Save a Calibration, or without one load the Calibration in flash.

        The Store is imported only for this, because it takes 3 KB of heap. Raises Refusal if the Calibration is not
        saved. Raises ImportError or MemoryError if the Store cannot be imported to load a Calibration.

        Args:
            careful: True to save only if the files are unchanged.

        Returns:
            The loaded Calibration, or True if the Calibration was saved.
        """
        recording = "kickstand.rides.recorder" in sys.modules  # which uses the module too
        store = self  # for its attribute newest, if the import fails
        try:
            from .store import Store

            store = Store(self._chip_id, self._chip.accel_range_g, newest=self.newest)
            if calibration is None:
                return store.load()
            if careful and not store.unchanged():
                return False
            store.save(calibration)
            return True
        except (ImportError, MemoryError) as error:
            if calibration is None:
                raise
            raise Refusal("not-written", str(error))
        finally:
            self.newest = store.newest
            if not recording:
                unload("calibration.store")

    def _use(self, calibration, posed=False, refined=False):
        calibration.set_scale(self._chip.accel_lsb_per_g, self._chip.gyro_lsb_per_dps)
        self._meter.use(calibration, posed)
        self.value, self.changed = calibration, True
        if not refined:
            self._meter.reset_maxima()
