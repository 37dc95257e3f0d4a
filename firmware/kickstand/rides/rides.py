"""Begins and ends recordings. The modules that only a recording needs are imported one by one, before the first
recording."""

import gc

from ..errors import attempt, tried


class NoRecorder:
    """Takes the place of the Recorder until the Recorder is created."""

    active = stalled = False


class Rides:
    """Begins and ends the recording of rides.

    Args:
        app: the App.
        writer: the writer of the blocks, as for Recorder, or None for flash or SD card. With a writer, recording begins
            with the first readings.

    Attributes:
        recorder: the Recorder, or NoRecorder until the Recorder is created.
        on_card: True if rides are stored on an SD card.
    """

    def __init__(self, app, writer=None):
        self._app = app
        self._writer = writer
        self._modules = ("block", "recorder") if writer else ("block", "ride_files", "recorder")  # not yet imported
        self.recorder = NoRecorder
        self.on_card = app.settings.SD_SPI is not None and writer is None
        self._due = app.settings.RECORD or writer is not None  # True if recording begins with the first readings
        self._refused = None  # a Notice with the reason why no ride can be recorded on the card

    def begin(self):
        """Prepare a recording that begins with the first readings, and test the SD card. Call this method before the
        watchdog runs."""
        if self._writer:
            self._create()  # an exception goes to the computer, which is waiting for the ride
        elif self._due or self.on_card:
            refused = attempt(None, self._create)
            if self.on_card:  # not tried again later, because a card must be tested before the watchdog runs
                self._refused = refused
            if not refused:
                self._writer.prepare(self._app.notices)

    def prepare(self):
        """Import one module that recording needs. Call this method repeatedly while the menu's entry is shown. The long
        press that chooses the entry takes longer than all imports, so the recording begins at once.

        An import takes 0.1 s. The chip's FIFO can keep the samples of that time, but not the samples of all imports
        together. If an import fails, start() reports it."""
        if self._modules and tried(self._import)[1]:
            self._modules = ()

    def _import(self):
        gc.collect()  # without a collection the imported module, which stays loaded, would be placed behind garbage
        __import__("kickstand.rides." + self._modules[0])
        self._modules = self._modules[1:]

    def _create(self):
        """Create the Recorder unless it exists."""
        if self.recorder is NoRecorder:
            while self._modules:
                self._import()
            from .recorder import Recorder

            settings = self._app.settings
            if not self._writer:
                from .ride_files import RideFiles

                self._writer = RideFiles(settings)
            self.recorder = Recorder(self._writer, settings.SAMPLE_HZ, self._app.notices)

    def start(self):
        """Begin to record a ride. A failure is reported to the rider.

        If the bike is at rest, the lean filter restarts too. With this restart a replay shows the same lean as the
        display, and the filter estimates the gyro's errors again in the first bends. If the bike is moving, the filter
        does not restart, so the replay's filter at first knows the gyro's errors less well than the board's filter."""
        app = self._app
        if app.meter.at_rest:
            app.calibration.restart()
        if self._refused:
            app.notices.append(self._refused)
        elif not attempt(app.notices, self._create):
            self.recorder.start(app.sensor.chip, app.calibration.value)

    def start_due(self):
        """Begin to record if the settings or the writer require it. Call this method at the first readings."""
        due, self._due = self._due, False
        if due:
            self.start()

    def split(self):
        """End the ride and begin another, because the calibration has changed and a ride has only one calibration. With
        the new calibration the lean filter has restarted, as the filter of a replay does."""
        self._app.calibration.changed = False
        if self.recorder.active:
            self.recorder.start(self._app.sensor.chip, self._app.calibration.value)

    def stop(self):
        """End the ride, if there is one."""
        if self.recorder.active:
            self.recorder.stop()
