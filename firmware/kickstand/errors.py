"""What the rider is told when something is refused."""


class Refusal(Exception):
    """A request that cannot be carried out, with the reason.

    reason: one line for a console.  lcd: two lines of at most 16 characters for the display.
    """

    def __init__(self, reason, line1, line2=""):
        super().__init__(reason)
        self.reason = reason
        self.lcd = (line1, line2)


class CaptureError(Refusal):
    """A pose that was not held still, or readings no still sensor gives."""


class CalibrationError(Refusal):
    """Six-position captures that give no believable calibration."""


class AlignmentError(Refusal):
    """Two poses that do not fix the sensor's mounting."""


class StoreError(Refusal):
    """A record that could not be written and read back."""


class CardError(Refusal):
    """No SD card that can be written, or no driver for it."""


class SettingsError(Refusal):
    """A value in config.py that cannot be used."""
