"""Opens the display, the sensor and the button on the pins set in config.py. The argument `settings` is a Settings."""

from machine import Pin

from .board import i2c_bus
from .board.button import Button
from .board.display import Display
from .errors import Notice, SettingsError, tried
from .imu.mpu6050 import Mpu6050
from .imu.sensor import Sensor


def open_lcd(settings, wiring=None):
    """Open the Display. The Display's tick() raises SettingsError for pins that the I2C controller cannot use.

    Args:
        wiring: the wiring of a character display's backpack. The default is LCD_WIRING.
    """
    return Display(
        lambda hz: open_bus(settings, "LCD", hz),
        settings.LCD_BUS_HZ,
        settings.DISPLAY,
        settings.LCD_ADDRESSES,
        settings.OLED_CONTRAST,
        settings.OLED_INVERTED,
        wiring or settings.LCD_WIRING,
    )


def open_sensor(settings):
    """Return the Sensor of the settings. The Sensor's first step opens the bus. This step raises SettingsError for pins
    that the I2C controller cannot use."""
    ranges = settings.ACCEL_RANGE_G, settings.GYRO_RANGE_DPS
    rates = settings.DLPF, settings.SAMPLE_HZ
    chip = Mpu6050(None, settings.SENSOR_ADDRESS, *ranges, *rates, settings.ACCEPT_WHO_AM_I)

    def reopen():
        return open_bus(settings, "SENSOR", settings.SENSOR_BUS_HZ)

    def look(chip, error):
        from .diagnosis import explain  # imported here, because it takes 6 KB of heap and most boards never need it

        return explain(settings.SENSOR_SDA, settings.SENSOR_SCL, reopen, chip, error)

    def explain(chip, error):
        try:
            result = tried(look, chip, error)[0]
        except OSError:
            result = None
        return result or (error and Notice("no-sensor"), [])

    return Sensor(chip, reopen, explain)


def open_button(settings):
    """Open the Button. Raises SettingsError for a pin that the board does not have."""
    try:
        return Button(Pin(settings.BUTTON_PIN, Pin.IN, Pin.PULL_UP))
    except ValueError as error:
        raise SettingsError("no-such-pin", "BUTTON_PIN", settings.BUTTON_PIN, str(error))


def open_bus(settings, name, hz):
    """Open a machine.I2C. Raises SettingsError for pins that the I2C controller cannot use.

    Args:
        name: "SENSOR" or "LCD", the beginning of the names of the bus's settings.
        hz: clock rate of the bus.
    """
    controller = getattr(settings, name + "_I2C")
    sda, scl = getattr(settings, name + "_SDA"), getattr(settings, name + "_SCL")
    try:
        return i2c_bus.open_i2c(controller, sda, scl, hz)
    except (ValueError, TypeError) as error:  # a pin that is not set raises TypeError on a Pico
        raise SettingsError("i2c-pins", name + "_SDA / SCL", name, sda, scl, controller, str(error))
