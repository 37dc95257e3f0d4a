"""Begins and ends recordings: imports their modules step by step, and tries an SD card out before."""

import gc

from ..errors import attempt


class NoRecorder:
    """Takes the place of the Recorder until one is made."""

    active = stalled = False

    def take_problem(self):
        """None: nothing has been recorded."""


class Recording:
    """Begins and ends the recording of rides.

    settings: a Settings. chip: the Mpu6050. meter, calibration: the LeanMeter and its ActiveCalibration. keeper: see
    Recorder; None for flash or SD card. If one is given, recording begins with the first readings.

    recorder: a Recorder, or a NoRecorder before there is one. on_card: rides are kept on an SD card.
    """

    def __init__(self, settings, chip, meter, calibration, keeper=None):
        self._settings = settings
        self._chip = chip
        self._meter = meter
        self._calibration = calibration
        self._keeper = keeper
        self.recorder = NoRecorder()
        self.on_card = settings.SD_SPI is not None and keeper is None
        self._due = settings.RECORD or keeper is not None  # to begin with the first readings
        self._steps = self._make()
        self._refused = None  # a Notice why there is no Recorder
        if self._due or self.on_card:
            self._finish()
        if self._due and not (keeper or self.on_card or self._refused):
            try:  # make its directory now: an ESP32 takes so long that it would lose the first readings
                self.recorder.keeper.begin()
            except (OSError, MemoryError):
                pass  # start() says why

    def _make(self):
        """Make the Recorder; a generator of short steps. Modules that only recording needs are imported one in each
        step."""
        names = ["block", "recorder"] if self._keeper else ["block", "ride_paths", "flash_ring", "recorder"]
        for name in names + ["card_trial"] * self.on_card:
            gc.collect()  # as before each import while the loop runs: lasting objects must not lie behind garbage
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
                self._step()  # an exception is for the computer that waits for the ride
            else:
                self.prepare()

    def _step(self):
        if next(self._steps, True):
            self._steps = None

    def prepare(self):
        """Take one step of making the Recorder. The open menu calls this again and again: the chip's FIFO bridges one
        import (0.1 s), not all of them. If a step fails, start() says why."""
        if self._steps and not self._refused:
            self._refused = attempt(self._step)

    def try_out_card(self):
        """Try the SD card out (see card_trial.py), before the watchdog runs. Raises nothing."""
        if not self._refused:
            from . import card_trial

            card_trial.prepare(self.recorder, self._settings)

    def start(self):
        """Begin to record a ride; return None, or a Notice that says why it failed. If the bike stands, the lean filter
        restarts too, so that a replay shows the same lean; it then has to estimate the gyro's errors again in the first
        bends. A recording begun while riding is replayed by a filter with less certain errors at its beginning than
        those of the one on the board."""
        if self._meter.at_rest:
            self._calibration.restart()
        if self._refused and not self.on_card:  # a card has to be tried out before the watchdog runs
            self._refused, self._steps = None, self._make()
        self._finish()
        if not self._refused:
            self.recorder.start(self._chip, self._calibration.value)
        return self._refused

    def start_due(self):
        """Begin to record with the first readings, if the settings or the keeper ask for it. Returns as start()
        does."""
        due, self._due = self._due, False
        return self.start() if due else None

    def calibration_changed(self):
        """End the ride and begin another, because a ride has one calibration. The meter restarts: a replay of the ride,
        which does not know of poses just taken, begins like that too."""
        if self.recorder.active:
            self._calibration.restart()
            self.recorder.start(self._chip, self._calibration.value)

    def stop(self):
        """End the ride, if there is one."""
        if self.recorder.active:
            self.recorder.stop()
