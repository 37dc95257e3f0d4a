"""The limits of each setting in config.py, the settings that do not fit together, and the words of errors."""

import types
from typing import Any

import pytest
from kickstand import console
from kickstand.errors import Notice, SettingsError
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level

# {name: (values within the limits, values beyond them)}
LIMITS = {
    "SIDE": (("left", "right"), ("up", None)),
    "SAMPLE_HZ": ((100, 125, 200), (51, 200.0)),
    "ACCEL_RANGE_G": ((2, 4, 8, 16), (3,)),
    "GYRO_RANGE_DPS": ((250, 500, 1000, 2000), (300,)),
    "DLPF": ((3, 6), (0, 7)),
    "ACCEPT_WHO_AM_I": ((None, 0x01, 0xFE), (0x00, 0xFF)),
    "SENSOR_ADDRESS": ((0x68, 0x69), (0x67, 0x6A)),
    "SENSOR_BUS_HZ": ((100_000, 400_000), (99_999, 400_001)),
    "DISPLAY": (("auto", "lcd", "ssd1306", "sh1106", "ssd1306-32"), ("oled",)),
    "OLED_CONTRAST": ((0, 255), (-1, 256)),
    "OLED_INVERTED": ((True, False), ()),
    "LCD_ADDRESSES": (((8,), (0x77, 0x27)), ((), (7,), (0x78,), [0x27], 0x27)),
    "LCD_WIRING": ((1, 4), (0, 5)),
    "LCD_BUS_HZ": ((None, 100_000, 400_000), (99_999, 400_001)),
    "WATCHDOG": ((True, False), ()),
    "RECORD": ((True, False), ()),
    "LIVE": ((True, False), ()),
    "LIVE_PIN": ((None, 100_000, 999_999), (99_999, 1_000_000)),
    "VEHICLE": (("motorcycle",), ("bus",)),
    "SPEED": ((None, "gps", "wheel"), ("radar",)),
    "GPS_UART": ((0, 2), (-1, 3)),
    "GPS_BAUD": ((4800, 115_200), (4799, 115_201)),
    "PULSES_PER_METRE": ((0.1, 100, 2.5), (0.09, 101, "2")),
    "BUTTON_PIN": ((0, 48), ()),
    "SD_SPI": ((None,), (2,)),
}
BAD_PINS = {"BUTTON_PIN": (-1, 49, None, "15"), "SENSOR_SDA": (-1, 49), "GPS_RX": (49,), "SD_MISO": (49,)}
CARD = {"SD_SPI": 0, "SD_SCK": 18, "SD_MOSI": 19, "SD_MISO": 16, "SD_CS": 17}


def settings(**config) -> tuple[Any, Any]:
    """Return the Settings of a config.py with these values, and the SettingsError or None."""
    with Board(level):
        from kickstand.settings import Settings

        try:
            return Settings(types.SimpleNamespace(**config)), None
        except SettingsError as error:
            return error.settings, error


@pytest.mark.parametrize("name", LIMITS)
def test_value_within_the_limits_is_used(name):
    for value in LIMITS[name][0]:
        values, error = settings(**{name: value})
        assert error is None and getattr(values, name) == value


@pytest.mark.parametrize("name", [*LIMITS, *BAD_PINS])
def test_value_beyond_the_limits_is_replaced(name):
    """The default replaces a wrong value. None replaces a wrong pin, because something else may be connected to the
    default pin."""
    default = getattr(settings()[0], name)
    for value in BAD_PINS.get(name) or LIMITS[name][1]:
        values, error = settings(**{name: value})
        assert (error.code, error.values[:2]) == ("not-allowed", (name, value))
        assert getattr(values, name) == (None if name in BAD_PINS else default)


@pytest.mark.parametrize(
    ("config", "code", "values"),
    [
        ({"BUTTON_PIN": 4}, "pin-twice", ("",)),
        ({"LCD_I2C": 0, "LCD_SDA": 8, "LCD_SCL": 9}, "one-i2c", ("LCD_I2C", 0)),
        ({"LCD_SDA": 8, "LCD_SCL": 9}, "i2c-pins", ("LCD_SDA", "LCD", 8, 9, 1)),
        ({"SENSOR_SDA": 2}, "i2c-pins", ("SENSOR_SDA", "SENSOR", 2, 5, 0)),
        ({"VEHICLE": "car"}, "needs-speed", ("SPEED",)),
        ({"SAMPLE_HZ": 100, "DLPF": 2}, "aliasing", ("DLPF", 2, 100)),
        ({"SD_SPI": 0}, "card-pins", ("SD_SCK",)),
        ({**CARD, "SD_SPI": None}, "card-pins", ("SD_SPI",)),
        ({**CARD, "SD_CS": None}, "card-pins", ("SD_CS",)),
        ({**CARD, "SD_CS": 15}, "pin-twice", ("",)),
        ({"SPEED": "gps", "GPS_RX": 15}, "pin-twice", ("",)),
        ({"SIDES": "left"}, "no-setting", ("SIDES",)),
        ({"side": "left"}, "no-setting", ("side",)),
    ],
)
def test_settings_that_do_not_fit_together_are_named(config, code, values):
    _, error = settings(**config)
    assert (error.code, error.values[: len(values)]) == (code, values)


def test_other_names_and_a_complete_card_are_accepted():
    values, error = settings(**CARD, my_note="x", VEHICLE="car", SPEED="wheel", BUTTON_PIN=9)
    assert error is None and not values.leans and values.SD_CS == 17
    assert settings()[0].leans


@pytest.mark.parametrize(
    ("name", "config", "code", "values"),
    [
        ("button", {"BUTTON_PIN": 47}, "no-such-pin", ("BUTTON_PIN", 47)),
        ("speed", {"SPEED": "gps", "GPS_RX": 11}, "uart-pins", ("GPS_TX / GPS_RX", 8, 11, 1)),
    ],
)
def test_pins_that_the_chip_cannot_use_are_named(name, config, code, values, on_board):
    def opened(board, settings):
        from kickstand.speed.source import open_speed

        with pytest.raises(SettingsError) as refused:
            settings.open_button() if name == "button" else open_speed(settings, [])
        return refused.value.code, refused.value.values[: len(values)]

    assert on_board(opened, config) == (code, values)


@pytest.mark.parametrize(
    ("refusal", "words"),
    [
        (Notice("gyro-scale", "z", -31.4), "about z with -31 %: another sensor"),
        (Notice("gyro-tilt", 11.26, 7.0), "between the poses are 11.3 degrees, but by the gyro 7.0:"),
        (SettingsError("aliasing", "DLPF", 2, 100, 3), "alias at SAMPLE_HZ = 100: set DLPF = 3"),
        (SettingsError("not-allowed", "SIDE", "up", "left"), "config.py: SIDE = 'up', but it must be left"),
    ],
)
def test_sentence_has_the_values_of_its_refusal(refusal, words):
    sentence = console.sentence(refusal)
    assert words in sentence and "\n" not in sentence and "|" not in sentence
