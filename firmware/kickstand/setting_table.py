"""The settings of config.py, each with its default and the allowed values, and the usual pins of each board.

settings.py removes this module after use, to free heap. To add a setting, write a line in _TABLE, and a line with its
purpose in config.py.
"""

import sys
from io import StringIO

from .board import port
from .board.display import ADDRESSES, KINDS, LCD_HZ, OLED_HZ
from .errors import SettingsError
from .imu.mpu6050 import ACCEL_LSB_PER_G, GYRO_LSB_PER_DPS

if port.IS_ESP32:
    _KNOWN = port.MACHINE.startswith("Generic ESP32 module")  # ESP32-DevKitC and similar, with the classic chip
    SENSOR_PINS, LCD_PINS, BUTTON_PIN = (21, 22), (18, 19), 4  # (SDA, SCL)
    GPS_UART, GPS_PINS, WHEEL_PIN = 2, (17, 16), 27  # (TX, RX)
    if "SPIRAM" in port.MACHINE:  # MicroPython's image for PSRAM uses pins 16 and 17 itself, and has no Pin for them
        GPS_PINS = None, None
    I2C_NUMBERED = False  # see port.open_i2c()
    SD_SPI = (2, 3)  # slots of machine.SDCard that use SPI
    # Pins that the chip itself needs. An output on a pin of the chip's USB disconnects the board from the computer
    # until BOOT is held. An output on a pin of a classic chip's flash (6 to 11) crashes the board at each start. Pins 1
    # and 3 of a classic chip are the console. ESP32-PICO-D4 and D2WD have their flash on 16 and 17, too (data sheet of
    # the PICO-D4, section 2.2).
    _CHIP = port.MACHINE.split(" with ESP32")[-1].lstrip("-")[:2]  # "S2", "C3", ...; classic: "", "UN", "D2" or "PI"
    _CLASSIC = not (_CHIP[:1] in ("S", "C", "H", "P") and _CHIP[1:].isdigit())
    TAKEN_PINS = {
        "S2": (19, 20), "S3": (19, 20), "C3": (18, 19), "C5": (13, 14), "C6": (12, 13), "H2": (26, 27), "P4": (24, 25),
    }.get(_CHIP, (1, 3, 6, 7, 8, 9, 10, 11) if _CLASSIC else ())  # fmt: skip
    if "PICO-D4" in port.MACHINE or "D2WD" in port.MACHINE:
        TAKEN_PINS += 16, 17
        GPS_PINS = None, None
    INPUT_PINS = (34, 35, 36, 37, 38, 39) if _CLASSIC else ()  # pins without output and without pull-up
else:  # Raspberry Pi Pico and Pico 2, and boards of other makers with the same pins and name
    _KNOWN = sys.platform != "rp2" or "Pico" in port.MACHINE
    SENSOR_PINS, LCD_PINS, BUTTON_PIN = (4, 5), (6, 7), 15
    GPS_UART, GPS_PINS, WHEEL_PIN = 1, (8, 9), 14
    I2C_NUMBERED = True  # two I2C buses must have two different controller numbers
    SD_SPI = (0, 1)  # the numbers of machine.SPI
    TAKEN_PINS = INPUT_PINS = ()
if not _KNOWN:  # an unknown board may lack these pins or use them for something else
    SENSOR_PINS = LCD_PINS = GPS_PINS = None, None
    BUTTON_PIN = WHEEL_PIN = None
    GPS_UART = 1

# For each sample rate in Hz, the dlpf of the widest low-pass (98, 44 or 21 Hz) below half of the rate (register map,
# p. 13)
MIN_DLPF = {50: 4, 100: 3, 125: 3, 200: 2}


def _rate(value):
    return isinstance(value, int) and value in MIN_DLPF


def _addresses(value):
    return isinstance(value, tuple) and bool(value) and all(isinstance(a, int) and 8 <= a <= 0x77 for a in value)


def _pulses(value):
    return isinstance(value, (int, float)) and 0.1 <= value <= 100


def _pin(value):
    return isinstance(value, int) and 0 <= value <= 48 and value not in TAKEN_PINS


_INPUT = _pin, "a number from 0 to 48, no pin of the chip's own USB, flash or console"
# A button needs a pull-up. Pins that are only inputs have no pull-up.
_PIN = (lambda v: _pin(v) and v not in INPUT_PINS), _INPUT[1] + ", and none that is an input only"
_FLAG = True, False
_BUS_HZ = range(100_000, 400_001)
_SD_PINS = ("SD_SCK", "SD_MOSI", "SD_MISO", "SD_CS")
# For each speed source, the names of its pin settings
_SPEED_PINS = {None: (), "gps": ("GPS_TX", "GPS_RX"), "wheel": ("WHEEL_PIN",)}

# Each entry maps the name of a setting to its default and the allowed values: a tuple of choices, a range of whole
# numbers, or a check and its words. The default is always allowed.
_TABLE = {
    "SIDE": ("left", ("left", "right")),
    "SAMPLE_HZ": (200, (_rate, "50, 100, 125 or 200")),
    "ACCEL_RANGE_G": (16, tuple(sorted(ACCEL_LSB_PER_G))),
    "GYRO_RANGE_DPS": (500, tuple(sorted(GYRO_LSB_PER_DPS))),
    "DLPF": (3, range(1, 7)),
    "ACCEPT_WHO_AM_I": (None, range(0x01, 0xFF)),
    "SENSOR_ADDRESS": (0x68, (0x68, 0x69)),
    "SENSOR_I2C": (0, (0, 1)),
    "SENSOR_SDA": (SENSOR_PINS[0], _PIN),
    "SENSOR_SCL": (SENSOR_PINS[1], _PIN),
    "SENSOR_BUS_HZ": (400_000, _BUS_HZ),
    "DISPLAY": ("auto", KINDS),
    "OLED_CONTRAST": (255, range(256)),
    "OLED_INVERTED": (False, _FLAG),
    "LCD_ADDRESSES": (ADDRESSES, (_addresses, "I2C addresses as (0x27, 0x3F)")),
    "LCD_WIRING": (1, range(1, 5)),
    "LCD_I2C": (1, (0, 1)),
    "LCD_SDA": (LCD_PINS[0], _PIN),
    "LCD_SCL": (LCD_PINS[1], _PIN),
    "LCD_BUS_HZ": (None, _BUS_HZ),
    "BUTTON_PIN": (BUTTON_PIN, _PIN),
    "WATCHDOG": (True, _FLAG),
    "RECORD": (False, _FLAG),
    "LIVE": (False, _FLAG),
    "LIVE_PIN": (None, range(100_000, 1_000_000)),
    "SD_SPI": (None, SD_SPI),
    "SD_SCK": (None, _PIN),
    "SD_MOSI": (None, _PIN),
    "SD_MISO": (None, _INPUT),
    "SD_CS": (None, _PIN),
    "VEHICLE": ("motorcycle", ("motorcycle", "car")),
    "SPEED": (None, (None, "gps", "wheel")),
    "GPS_UART": (GPS_UART, range(3)),
    "GPS_TX": (GPS_PINS[0], _PIN),
    "GPS_RX": (GPS_PINS[1], _INPUT),
    "GPS_BAUD": (9600, range(4800, 115_201)),
    "WHEEL_PIN": (WHEEL_PIN, _PIN),
    "PULSES_PER_METRE": (0.5, (_pulses, "pulses along a metre of road, from 0.1 to 100")),
}


def _misfit(value, allowed):
    """Return None if a value is allowed, else the allowed values in words."""
    if isinstance(allowed, range):
        low, high = allowed[0], allowed[-1]
        fits, words = isinstance(value, int) and low <= value <= high, "a whole number from %d to %d" % (low, high)
    elif callable(allowed[0]):
        fits, words = allowed[0](value), allowed[1]
    else:
        fits, words = value in allowed, "one of " + ", ".join([repr(choice) for choice in allowed])
    return None if fits else words


def fill(settings, config, refusal):
    """Check the values of config.py and set them in a Settings.

    A wrong value is replaced by its default. A wrong pin is replaced by None, because the default pin may be connected
    to something else. Raises SettingsError for a wrong value.

    Args:
        settings: the Settings.
        config: the module config, or None for the defaults.
        refusal: an exception to raise at the end, or None.
    """
    for name, (default, allowed) in _TABLE.items():
        value = getattr(config, name, default)
        words = None if value is default else _misfit(value, allowed)
        if words:
            refusal = refusal or SettingsError("not-allowed", name, value, words)
            value = None if allowed in (_PIN, _INPUT) else default
        setattr(settings, name, value)
    settings.leans = settings.VEHICLE == "motorcycle"
    sensor, lcd = (settings.SENSOR_SDA, settings.SENSOR_SCL), (settings.LCD_SDA, settings.LCD_SCL)
    settings.one_bus = sensor == lcd != (None, None)
    if settings.one_bus:  # a PCF8574 allows 100 kHz, which limits a shared bus
        settings.LCD_I2C = settings.SENSOR_I2C
        lcd_hz = settings.LCD_BUS_HZ or (OLED_HZ if settings.DISPLAY not in ("auto", "lcd") else LCD_HZ)
        settings.SENSOR_BUS_HZ = settings.LCD_BUS_HZ = min(settings.SENSOR_BUS_HZ, lcd_hz)
    if refusal:
        raise refusal
    _check(settings, config)


_WHICH_I2C = "set SENSOR_I2C and LCD_I2C to the I2C of their pins, or exchange SDA and SCL"


def _check_i2c(settings):
    """Raise SettingsError if the pins of a bus belong to the other I2C, or if both buses have the same I2C.

    The I2C functions of an RP2040's pins repeat every four pins: SDA and SCL of I2C 0, then SDA and SCL of I2C 1 (data
    sheet, section 1.4.3)."""
    if not settings.one_bus and settings.SENSOR_I2C == settings.LCD_I2C:
        raise SettingsError("one-i2c", "LCD_I2C", settings.LCD_I2C)
    for name in ("SENSOR", "LCD"):
        sda, scl, number = [getattr(settings, name + end) for end in ("_SDA", "_SCL", "_I2C")]
        if (sda % 4, scl % 4) != (2 * number, 2 * number + 1):
            settings.LCD_I2C = settings.LCD_SDA // 2 % 2  # the display can then show the refusal
            raise SettingsError("i2c-pins", name + "_SDA", name, sda, scl, number, _WHICH_I2C)


def _check(settings, config):
    for name in dir(config) if config else ():
        if name not in _TABLE and (name.isupper() or name.upper() in _TABLE):
            raise SettingsError("no-setting", name)
    card = [getattr(settings, name) for name in ("SD_SPI",) + _SD_PINS]
    if None in card and card != [None] * 5:
        missing = _SD_PINS[card.index(None) - 1] if card[0] is not None else "SD_SPI"
        raise SettingsError("card-pins", missing, "SD_SPI, " + ", ".join(_SD_PINS))
    names = ("BUTTON_PIN", "SENSOR_SDA", "SENSOR_SCL") + (() if settings.one_bus else ("LCD_SDA", "LCD_SCL"))
    names += _SPEED_PINS[settings.SPEED] + (() if None in card else _SD_PINS)
    missing = [name for name in names if getattr(settings, name) is None]
    if missing:
        raise SettingsError("no-pins", missing[0], ", ".join(missing), port.MACHINE)
    if len({getattr(settings, name) for name in names}) != len(names):
        raise SettingsError("pin-twice", "", ", ".join(names))
    if I2C_NUMBERED:
        _check_i2c(settings)
    if not settings.leans and settings.SPEED is None:
        raise SettingsError("needs-speed", "SPEED")
    fitting = MIN_DLPF[settings.SAMPLE_HZ]
    # A wider low-pass would alias the engine's vibration, which then looks like a slow motion
    if settings.DLPF < fitting:
        raise SettingsError("aliasing", "DLPF", settings.DLPF, settings.SAMPLE_HZ, fitting)


def line_of(error):
    """Return the place of an error in config.py, such as "line 3: ", or "" if the traceback does not show it."""
    text = StringIO()
    # the stubs for the type checker do not accept a StringIO here
    sys.print_exception(error, text)  # type: ignore[arg-type]
    traceback = text.getvalue()  # type: ignore[attr-defined]
    _, separator, tail = traceback.rpartition('config.py", line ')
    return "line %s: " % tail.split("\n")[0].split(",")[0].strip() if separator else ""
