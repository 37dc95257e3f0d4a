"""Display, sensor and button as config.py has them: what the app, kickstand.status() and main.py open."""

from machine import Pin

from .board import i2c_bus
from .board.button import Button
from .board.hd44780 import Lcd
from .errors import SettingsError
from .imu.mpu6050 import Mpu6050
from .imu.sensor import Sensor


def open_lcd(settings):
    """The display of these settings; pins that the controller cannot use raise SettingsError when it is first spoken
    to."""
    return Lcd(lambda: _open_bus(settings, "LCD"), settings.LCD_ADDRESSES)


def open_sensor(settings):
    """The chip of these settings, watched over; wrong pins raise SettingsError at its first fetch()."""
    chip = Mpu6050(
        None,
        settings.SENSOR_ADDRESS,
        settings.ACCEL_RANGE_G,
        settings.GYRO_RANGE_DPS,
        settings.DLPF,
        settings.SAMPLE_HZ,
        settings.ACCEPT_WHO_AM_I,
    )
    return Sensor(chip, lambda: _open_bus(settings, "SENSOR"))


def open_button(settings):
    """The button of these settings. Raises SettingsError for a pin that the board does not have."""
    try:
        return Button(Pin(settings.BUTTON_PIN, Pin.IN, Pin.PULL_UP))
    except ValueError as error:
        raise SettingsError("no-such-pin", "BUTTON_PIN", settings.BUTTON_PIN, str(error))


def _open_bus(settings, name):
    controller = getattr(settings, name + "_I2C")
    sda, scl = getattr(settings, name + "_SDA"), getattr(settings, name + "_SCL")
    try:
        return i2c_bus.open_i2c(controller, sda, scl, getattr(settings, name + "_BUS_HZ"))
    except ValueError as error:
        raise SettingsError("not-i2c-pins", name + "_SDA / SCL", name, sda, scl, controller, str(error))
