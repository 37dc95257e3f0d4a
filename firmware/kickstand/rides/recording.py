"""Begins and ends recordings. Before a recording this module imports the modules that recording needs, step by step,
and tests the SD card."""

import gc

from ..errors import attempt


class NoRecorder:
    """Takes the place of the Recorder until the Recorder is created."""

    active = stalled = False

    def take_problem(self):
        """Return None, because nothing was recorded."""


class Recording:
    """Begins and ends the recording of rides.

    Args:
        settings: a Settings.
        chip: the Mpu6050.
        meter: the LeanMeter.
        calibration: the meter's ActiveCalibration.
        keeper: the writer of the blocks, as for Recorder, or None for flash or SD card. With a keeper, recording begins
            with the first readings.

    Attributes:
        recorder: the Recorder, or a NoRecorder until the Recorder is created.
        on_card: True if rides are stored on an SD card.
    """

    def __init__(self, settings, chip, meter, calibration, keeper=None):
        self._settings = settings
        self._chip = chip
        self._meter = meter
        self._calibration = calibration
        self._keeper = keeper
        self.recorder = NoRecorder()
        self.on_card = settings.SD_SPI is not None and keeper is None
        self._due = settings.RECORD or keeper is not None  # True if recording begins with the first readings
        self._steps = self._make()
        self._refused = None  # a Notice with the reason why there is no Recorder
        if self._due or self.on_card:
            self._finish()
        if self._due and not (keeper or self.on_card or self._refused):
            try:  # an ESP32 makes a directory so slowly that the first readings would be lost, so make it now
                self.recorder.keeper.begin()
            except (OSError, MemoryError):
                pass  # start() reports a failure

    def _make(self):
        """Create the Recorder, as a generator of short steps. Each step imports one of the modules that only recording
        needs."""
        names = ["block", "recorder"] if self._keeper else ["block", "ride_paths", "flash_ring", "recorder"]
        for name in names + ["card_trial"] * self.on_card:
            gc.collect()  # without a collection the imported module, which stays loaded, would be placed behind garbage
            __import__("kickstand.rides." + name)
            yield
        from .recorder import Recorder

        keeper = self._keeper
        if keeper is None:
            from .flash_ring import RideRing

            keeper = RideRing(self._settings)
        self.recorder = Recorder(keeper, self._settings.SAMPLE_HZ)

    def _finish(self):
        """Do all remaining steps of _make()."""
        while self._steps and not self._refused:
            if self._keeper:
                self._step()  # an exception goes to the computer, which is waiting for the ride
            else:
                self.prepare()

    def _step(self):
        if next(self._steps, True):
            self._steps = None

    def prepare(self):
        """Do one step of creating the Recorder. The open menu calls this method repeatedly.

        One step is the import of one module and takes 0.1 s. The chip's FIFO can keep the samples of that time, but not
        the samples of all steps together. If a step fails, start() reports it."""
        if self._steps and not self._refused:
            self._refused = attempt(self._step)

    def try_out_card(self):
        """Test the SD card (see card_trial.py). Call this method before the watchdog runs. Raises nothing."""
        if not self._refused:
            from . import card_trial

            card_trial.prepare(self.recorder, self._settings)

    def start(self):
        """Begin to record a ride. Return None, or a Notice with the reason for a failure.

        If the bike is at rest, the lean filter restarts too. With this restart a replay shows the same lean as the
        display, and the filter estimates the gyro's errors again in the first bends. If the bike is moving, the filter
        does not restart, so the replay's filter at first knows the gyro's errors less well than the board's filter."""
        if self._meter.at_rest:
            self._calibration.restart()
        if self._refused and not self.on_card:  # not for a card, which must be tested before the watchdog runs
            self._refused, self._steps = None, self._make()
        self._finish()
        if not self._refused:
            self.recorder.start(self._chip, self._calibration.value)
        return self._refused

    def start_due(self):
        """Begin to record if the settings or the keeper require it. Call this method at the first readings. Return
        None, or a Notice with the reason for a failure."""
        due, self._due = self._due, False
        return self.start() if due else None

    def calibration_changed(self):
        """End the ride and begin another, because a ride has only one calibration. The meter restarts too, because a
        replay of the new ride does not know the poses that were just taken."""
        if self.recorder.active:
            self._calibration.restart()
            self.recorder.start(self._chip, self._calibration.value)

    def stop(self):
        """End the ride, if there is one."""
        if self.recorder.active:
            self.recorder.stop()
