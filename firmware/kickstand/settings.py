"""The settings in config.py: loads and checks them, and opens the parts on their pins. setting_table.py has their
defaults and the allowed values."""

from machine import Pin

from .board import port
from .board.button import Button
from .board.display import Display
from .errors import Notice, SettingsError, tried, unload
from .imu.mpu6050 import Mpu6050
from .imu.sensor import Sensor


def load():
    """Return the Settings of config.py, or the defaults without a config.py. Raises SettingsError."""
    config = refusal = None
    try:
        import config
    except ImportError:
        pass
    except Exception as error:  # config.py is the rider's code and may raise anything
        from .setting_table import line_of

        refusal = SettingsError("unreadable", "config.py", line_of(error), str(error))
    return Settings(config, refusal)


class Settings:
    """The settings. Each name in setting_table.py is an attribute. Raises SettingsError.

    Args:
        config: the module config, or None for the defaults.
        refusal: the SettingsError to raise if config.py cannot be read, else None.

    Attributes:
        one_bus: True if sensor and display share one I2C bus.
        leans: True if the vehicle leans (a motorcycle).
    """

    def __init__(self, config=None, refusal=None):
        try:
            from .setting_table import fill

            fill(self, config, refusal)
        except SettingsError as error:
            error.settings = self
            raise
        finally:
            unload("setting_table")  # which takes 8 KB of heap

    def open_lcd(self, wiring=None):
        """Open the Display. Its tick() raises SettingsError for pins that the I2C controller cannot use.

        Args:
            wiring: the wiring of a character display's backpack. The default is LCD_WIRING.
        """
        look = self.OLED_CONTRAST, self.OLED_INVERTED, wiring or self.LCD_WIRING
        return Display(lambda hz: self.open_bus("LCD", hz), self.LCD_BUS_HZ, self.DISPLAY, self.LCD_ADDRESSES, *look)

    def open_sensor(self):
        """Return the Sensor. Its first step opens the bus. This step raises SettingsError for pins that the I2C
        controller cannot use."""
        ranges = self.ACCEL_RANGE_G, self.GYRO_RANGE_DPS
        rates = self.DLPF, self.SAMPLE_HZ
        chip = Mpu6050(None, self.SENSOR_ADDRESS, *ranges, *rates, self.ACCEPT_WHO_AM_I)
        return Sensor(chip, self._reopen_sensor, self._explain)

    def _reopen_sensor(self):
        return self.open_bus("SENSOR", self.SENSOR_BUS_HZ)

    def _explain(self, chip, error):
        """Explain a fault of the sensor, see Sensor."""
        try:
            result = tried(self._diagnose, chip, error)[0]
        except OSError:
            result = None
        return result or (error and Notice("no-sensor"), [])

    def _diagnose(self, chip, error):
        from .diagnosis import explain  # imported here, because it takes 6 KB of heap and most boards never need it

        return explain(self.SENSOR_SDA, self.SENSOR_SCL, self._reopen_sensor, chip, error)

    def open_button(self):
        """Open the Button. Raises SettingsError as open_pin() does."""
        return Button(self.open_pin("BUTTON_PIN"))

    def open_pin(self, name):
        """Open the pin of a setting as an input with pull-up. Raises SettingsError for a pin that the board does not
        have."""
        pin = getattr(self, name)
        try:
            return Pin(pin, Pin.IN, Pin.PULL_UP)
        except ValueError as error:
            raise SettingsError("no-such-pin", name, pin, str(error))

    def open_bus(self, name, hz):
        """Open a machine.I2C. Raises SettingsError for pins that the I2C controller cannot use.

        Args:
            name: "SENSOR" or "LCD", the beginning of the names of the bus's settings.
            hz: clock rate of the bus.
        """
        controller, sda, scl = [getattr(self, name + end) for end in ("_I2C", "_SDA", "_SCL")]
        try:
            return port.open_i2c(controller, sda, scl, hz)
        except (ValueError, TypeError) as error:  # a pin that is not set raises TypeError on a Pico
            raise SettingsError("i2c-pins", name + "_SDA / SCL", name, sda, scl, controller, str(error))
