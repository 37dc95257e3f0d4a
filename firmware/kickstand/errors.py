"""What is refused and what has failed: a code, and the numbers that belong to it.

A code is a name for programs, never shown. ui/messages.py words it for the display in 2 x 16 characters, console.py
what a board says on its USB console, and the host's tools word it for a terminal.
"""


class Refusal(Exception):
    """A request that cannot be carried out. code: which reason; values: its numbers and names, in the order that the
    words for the code use them."""

    def __init__(self, code, *values):
        super().__init__(code, *values)
        self.code = code
        self.values = values


class CaptureError(Refusal):
    """A pose that was not held still, or readings that no still sensor gives."""


class CalibrationError(Refusal):
    """Six-position poses that give no believable calibration."""


class AlignmentError(Refusal):
    """Two poses, or a drive, that do not tell how the sensor is mounted."""


class StoreError(Refusal):
    """A record that could not be written and read back."""


class CardError(Refusal):
    """No SD card that can be written, or no driver for it."""


class SettingsError(Refusal):
    """A value in config.py that cannot be used. values[0]: the name of the setting."""


class SensorFault(Refusal):
    """Why there are no readings."""


class SpeedFault(Refusal):
    """Why there is no speed."""


class RecordingError(Refusal):
    """Why the recording of a ride has ended by itself."""


class Notice:
    """Something to be told that is no refusal: a code and its values, worded like those of a Refusal."""

    def __init__(self, code, *values):
        self.code = code
        self.values = values
