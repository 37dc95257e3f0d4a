"""The settings of config.py, each with its default and its check.

settings.py removes this module after use, to free heap. To add a setting, write a line in _TABLE or _PINS, and a line
with its purpose in config.py.
"""

from .board import pins, port
from .board.display import ADDRESSES, KINDS, LCD_HZ, OLED_HZ
from .errors import SettingsError
from .imu.mpu6050 import ACCEL_LSB_PER_G, GYRO_LSB_PER_DPS

# For each sample rate in Hz, the dlpf of the widest low-pass (98, 44 or 21 Hz) below half of the rate (register map,
# p. 13)
MIN_DLPF = {50: 4, 100: 3, 125: 3, 200: 2}


def _one_of(*choices):
    return lambda value: value in choices, "one of " + ", ".join(repr(choice) for choice in choices)


def _whole(low, high):
    words = "a whole number from %d to %d" % (low, high)
    return lambda value: isinstance(value, int) and low <= value <= high, words


def _addresses(value):
    return isinstance(value, tuple) and bool(value) and all(isinstance(a, int) and 8 <= a <= 0x77 for a in value)


def _or_none(check):
    return lambda value: value is None or check[0](value), check[1]


def _pulses(value):
    return isinstance(value, (int, float)) and 0.1 <= value <= 100


def _pin(value):
    return isinstance(value, int) and 0 <= value <= 48 and value not in pins.TAKEN_PINS


_INPUT = _pin, "a number from 0 to 48, no pin of the chip's own USB, flash or console"
# A button needs a pull-up. Pins that are only inputs have no pull-up.
_PIN = (lambda v: _pin(v) and v not in pins.INPUT_PINS), _INPUT[1] + ", and none that is an input only"
_SD_PINS = ("SD_SCK", "SD_MOSI", "SD_MISO", "SD_CS")
# For each speed source, the names of its pin settings
_SPEED_PINS = {None: (), "gps": ("GPS_TX", "GPS_RX"), "wheel": ("WHEEL_PIN",)}

# Each entry maps the name of a setting to its default and a tuple of two: the check, and the allowed values in words
_TABLE = {
    "SIDE": ("left", _one_of("left", "right")),
    "SAMPLE_HZ": (200, (lambda v: isinstance(v, int) and v in MIN_DLPF, "50, 100, 125 or 200")),
    "ACCEL_RANGE_G": (16, _one_of(*sorted(ACCEL_LSB_PER_G))),
    "GYRO_RANGE_DPS": (500, _one_of(*sorted(GYRO_LSB_PER_DPS))),
    "DLPF": (3, _whole(1, 6)),
    "ACCEPT_WHO_AM_I": (None, _or_none(_whole(0x01, 0xFE))),
    "SENSOR_ADDRESS": (0x68, _one_of(0x68, 0x69)),
    "SENSOR_I2C": (0, _one_of(0, 1)),
    "SENSOR_BUS_HZ": (400_000, _whole(100_000, 400_000)),
    "DISPLAY": ("auto", _one_of(*KINDS)),
    "OLED_CONTRAST": (255, _whole(0, 255)),
    "OLED_INVERTED": (False, _one_of(True, False)),
    "LCD_ADDRESSES": (ADDRESSES, (_addresses, "I2C addresses as (0x27, 0x3F)")),
    "LCD_WIRING": (1, _whole(1, 4)),
    "LCD_I2C": (1, _one_of(0, 1)),
    "LCD_BUS_HZ": (None, _or_none(_whole(100_000, 400_000))),
    "WATCHDOG": (True, _one_of(True, False)),
    "RECORD": (False, _one_of(True, False)),
    "LIVE": (False, _one_of(True, False)),
    "LIVE_PIN": (None, _or_none(_whole(100_000, 999_999))),
    "SD_SPI": (None, _or_none(_one_of(*pins.SD_SPI))),
    "VEHICLE": ("motorcycle", _one_of("motorcycle", "car")),
    "SPEED": (None, _one_of(None, "gps", "wheel")),
    "GPS_UART": (pins.GPS_UART, _whole(0, 2)),
    "GPS_BAUD": (9600, _whole(4800, 115_200)),
    "PULSES_PER_METRE": (0.5, (_pulses, "pulses along a metre of road, from 0.1 to 100")),
}
# The settings of the pins, as entries like those of _TABLE. A wrong pin is replaced by None, because the default pin
# may be connected to something else.
_PINS = {
    "SENSOR_SDA": (pins.SENSOR_PINS[0], _PIN),
    "SENSOR_SCL": (pins.SENSOR_PINS[1], _PIN),
    "LCD_SDA": (pins.LCD_PINS[0], _PIN),
    "LCD_SCL": (pins.LCD_PINS[1], _PIN),
    "BUTTON_PIN": (pins.BUTTON_PIN, _PIN),
    "SD_SCK": (None, _or_none(_PIN)),
    "SD_MOSI": (None, _or_none(_PIN)),
    "SD_MISO": (None, _or_none(_INPUT)),
    "SD_CS": (None, _or_none(_PIN)),
    "GPS_TX": (pins.GPS_PINS[0], _PIN),
    "GPS_RX": (pins.GPS_PINS[1], _INPUT),
    "WHEEL_PIN": (pins.WHEEL_PIN, _PIN),
}
_NAMES = set(_TABLE) | set(_PINS)


def fill(settings, config, refusal):
    """Check the values of config.py and set them in a Settings.

    A wrong value is replaced by its default. A wrong pin is replaced by None. Raises SettingsError for a wrong value.

    Args:
        settings: the Settings.
        config: the module config, or None for the defaults.
        refusal: an exception to raise at the end, or None.
    """
    for table in (_TABLE, _PINS):
        for name, (default, (check, allowed)) in table.items():
            value = getattr(config, name, default)
            if value is not default and not check(value):
                refusal = refusal or SettingsError("not-allowed", name, value, allowed)
                value = default if table is _TABLE else None
            setattr(settings, name, value)
    settings.leans = settings.VEHICLE == "motorcycle"
    settings.one_bus = (
        (settings.SENSOR_SDA, settings.SENSOR_SCL) == (settings.LCD_SDA, settings.LCD_SCL) != (None, None)
    )
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
        if name not in _NAMES and (name.isupper() or name.upper() in _NAMES):
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
    if pins.I2C_NUMBERED:
        _check_i2c(settings)
    if not settings.leans and settings.SPEED is None:
        raise SettingsError("needs-speed", "SPEED")
    fitting = MIN_DLPF[settings.SAMPLE_HZ]
    # A wider low-pass would alias the engine's vibration, which then looks like a slow motion
    if settings.DLPF < fitting:
        raise SettingsError("aliasing", "DLPF", settings.DLPF, settings.SAMPLE_HZ, fitting)
