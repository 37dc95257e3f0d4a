"""The words of the USB console, in whole sentences: for what a board itself reports there. By code, see errors.py.

Imported only when there is something to say: on most boards never.
"""

# code|sentence; {0}, {1} ... are the refusal's values, of a setting first its name
_SENTENCES = """
not-written|calibration not saved: {0}; the old one is kept
read-back|calibration not saved: it reads back differently; the old one is kept
no-driver|SD card: its driver is not on the board: mpremote mip install sdcard
no-card|SD card: none that can be read ({0}): check card and wiring
unreadable|config.py cannot be read ({1}{2}): correct it, then kickstand flash --config
not-allowed|config.py: {0} = {1!r}, but it must be {2}
no-setting|config.py: {0} is not a setting; see the list in that file
card-pins|config.py: an SD card needs all of {1}
pin-twice|config.py: a pin is used twice among {1}
one-i2c|config.py: SENSOR_I2C and LCD_I2C are both {1} on different pins; give each its own
wrong-code|the machine code for {0}() gives wrong results on this board: slower code runs instead
needs-speed|config.py: VEHICLE = "car" needs a speed source to be aligned: SPEED = "gps" or "wheel"
no-such-pin|config.py: {0} = {1} is no pin of this board ({2})
i2c-pins|config.py: {1}_SDA = {2} and {1}_SCL = {3} do not belong to I2C {4} ({5})
uart-pins|config.py: GPS_TX = {1} and GPS_RX = {2} do not belong to UART {3} ({4})
"""
_RECORDING_STOPPED = "recording stopped: {0}"  # for all of its faults, which only the display tells apart


def sentence(refusal):
    """One line for a Refusal."""
    return refusal.words(_SENTENCES, _RECORDING_STOPPED)
