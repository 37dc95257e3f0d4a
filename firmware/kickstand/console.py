"""The sentences for the board's USB console. Each code (see errors.py) has one sentence.

This module is imported only when there is something to print. Most boards never print anything.
"""

import time

from .units import const

# Shortest duration of a slow print. Most prints take a few ms. If the computer on USB sleeps, a print takes 500 ms, and
# the sensor's FIFO overflows.
_SLOW_MS = const(100)
_QUIET_MS = const(60_000)  # time after a slow print in which no refusal is printed

_slow_ms = None  # ticks_ms() of the last slow print

# Each row is code|sentence. {0}, {1} ... are the refusal's values. For a SettingsError {0} is the setting's name.
_SENTENCES = """
not-written|calibration not saved: {0}; the old one is kept
read-back|calibration not saved: it reads back differently; the old one is kept
gyro-scale|calibration refused: the gyro reads rates about {0} with {1:+.0f} %: another sensor is needed
gyro-reversed|calibration refused: the gyro reads rates about {0} with the wrong sign: another sensor is needed
gyro-misfit|calibration refused: by the gyro a turn between two poses is {0:.1f} degrees off: repeat the six \
positions; if it happens again, an axis is late, clipped or dead: another sensor is needed
unproved-gyro|calibration refused: no turn shows that the gyro is right about {0}: repeat the six positions
dead-gyro|pose refused: the gyro's reading about {0} never changes: switch off and on; if it stays, another sensor \
is needed
stuck-accel|pose refused: the accelerometer's reading along {0} never changes: switch off and on; if it stays, another \
sensor is needed
noisy-gyro|pose refused: the gyro is very noisy about {0}: switch the engine off; if it stays, another sensor is \
needed
gyro-tilt|not aligned: between the poses are {0:.1f} degrees, but by the gyro {1:.1f}: align again; if it happens \
again, another sensor is needed
incomplete|incomplete firmware ({0}): run kickstand flash
no-memory|no memory for that ({0}): restart the board
no-driver|SD card: its driver is not on the board: mpremote mip install sdcard
no-card|SD card: no usable card ({0}): check wiring and card, which must be FAT32; then restart the board
user-failed|user.py: {0} is left out: {1}
user-slow|user.py: {0} took {1} ms: make it shorter; over 300 ms, or 5 times over 50 ms in a row, it is left out
user-memory|user.py is left out: it leaves too little memory ({0})
unreadable|config.py cannot be read ({1}{2}): correct it, then kickstand flash --config
not-allowed|config.py: {0} = {1!r}, but it must be {2}
no-setting|config.py: {0} is not a setting; see the list in that file
card-pins|config.py: an SD card needs all of {1}
no-pins|config.py: no usual pins are known for this board ({2}): set {1}
aliasing|config.py: DLPF = {1} lets vibration alias at SAMPLE_HZ = {2}: set DLPF = {3} or higher
pin-twice|config.py: a pin is used twice among {1}
one-i2c|config.py: SENSOR_I2C and LCD_I2C are both {1} on different pins; give each its own
wrong-code|the machine code for {0}() gives wrong results on this board: slower code runs instead
needs-speed|config.py: VEHICLE = "car" needs a speed source to be aligned: SPEED = "gps" or "wheel"
no-radio|LIVE: this board has no Bluetooth in its MicroPython: nothing is sent to a phone, the lean meter works
no-pairing|LIVE_PIN: this board cannot ask for a PIN: nothing is sent to a phone; LIVE_PIN = None allows every phone
radio-fault|LIVE: the radio does not start ({0}): nothing is sent to a phone, the lean meter works
live-memory|LIVE: too little memory ({0}): nothing is sent to a phone, the lean meter works
no-sensor|none answers on SDA {0}, SCL {1}: check these wires and the 3.3 V of the module
unknown-chip|unknown chip, WHO_AM_I 0x{0:02x}: set ACCEPT_WHO_AM_I = 0x{0:02x} in config.py to try it as an MPU6500
no-chip|the device at 0x{1:02x} is not an MPU6050 (it reads 0x{0:02x}): it is another device, such as a clock, or a \
broken chip
not-kept|the chip at 0x{0:02x} answers, but does not keep its settings: it is broken or not an MPU6050; the wires are \
good
bus-errors|the sensor at 0x{0:02x} answers, but transfers fail: use shorter wires, or SENSOR_BUS_HZ = 100_000
other-chip|{0} at 0x{1:02x}: not supported, its registers are different ones; use a module with an MPU6050
other-device|none answers, but a {0} at 0x{1:02x}: connect a module with an MPU6050
exchanged|SDA and SCL are exchanged: GPIO {0} belongs to SDA and GPIO {1} to SCL
wire-low|{0} (GPIO {1}) stays low: it touches GND, or a device that is broken or has no power pulls it down
no-pull-ups|none answers, SDA {0} and SCL {1} have no pull-up: connect the module's wires, and its 3.3 V
no-pull-up|none answers: nothing pulls up {0} (GPIO {1}): that wire is open
sensor-fifo|the sensor measures, but its FIFO {0}: a clone that cannot be used; use another module
axis-ill|sensor: {0} {1} {2}, so there is no lean: switch it off and on; if that does not help, replace it
clips|sensor: {0} at the end of its range: mount the sensor softly, on foam or rubber
no-such-pin|config.py: {0} = {1} is not a pin of this board ({2})
i2c-pins|config.py: {1}_SDA = {2} and {1}_SCL = {3} do not belong to I2C {4} ({5})
uart-pins|config.py: GPS_TX = {1} and GPS_RX = {2} do not belong to UART {3} ({4})
"""
# one sentence for all faults of a recording; only the display names the fault
_RECORDING_STOPPED = "recording stopped: {0}"


def sentence(refusal):
    """Return the sentence for a Refusal or a Notice, in one line."""
    return refusal.words(_SENTENCES, _RECORDING_STOPPED)


def say(text, end="\n"):
    """Print a text. Return True if the print was slow."""
    global _slow_ms
    begun_ms = time.ticks_ms()
    print(text, end=end)
    if time.ticks_diff(time.ticks_ms(), begun_ms) < _SLOW_MS:
        return False
    _slow_ms = begun_ms
    return True


def tell(refusal):
    """Print the sentence for a Refusal or a Notice, unless a print was slow in the last _QUIET_MS."""
    if _slow_ms is None or not 0 <= time.ticks_diff(time.ticks_ms(), _slow_ms) < _QUIET_MS:
        say(sentence(refusal))
