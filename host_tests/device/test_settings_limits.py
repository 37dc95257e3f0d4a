"""Tests the limits of each setting in config.py, the settings that do not fit together, and the words of notices."""

import sys
import types

import pytest
from kickstand.errors import Notice, Refusal, SettingsError, attempt, checked, tried
from support.board_access import on_board

GOOD = {
    "SIDE": ("left", "right"),
    "SAMPLE_HZ": (100, 125, 200),
    "ACCEL_RANGE_G": (2, 4, 8, 16),
    "GYRO_RANGE_DPS": (250, 500, 1000, 2000),
    "DLPF": (3, 6),
    "ACCEPT_WHO_AM_I": (None, 0x01, 0xFE),
    "SENSOR_ADDRESS": (0x68, 0x69),
    "SENSOR_BUS_HZ": (100_000, 400_000),
    "DISPLAY": ("auto", "lcd", "ssd1306", "sh1106", "ssd1306-32"),
    "OLED_CONTRAST": (0, 255),
    "OLED_INVERTED": (True, False),
    "LCD_ADDRESSES": ((8,), (0x77, 0x27)),
    "LCD_WIRING": (1, 4),
    "LCD_BUS_HZ": (None, 100_000, 400_000),
    "WATCHDOG": (True, False),
    "RECORD": (True, False),
    "LIVE": (True, False),
    "LIVE_PIN": (None, 100_000, 999_999),
    "VEHICLE": ("motorcycle",),
    "SPEED": (None, "gps", "wheel"),
    "GPS_UART": (0, 2),
    "GPS_BAUD": (4800, 115_200),
    "PULSES_PER_METRE": (0.1, 100, 2.5),
    "BUTTON_PIN": (0, 48),
    "SD_SPI": (None,),
}
BAD = {
    "SIDE": ("up", None),
    "SAMPLE_HZ": (51, 200.0),
    "ACCEL_RANGE_G": (3,),
    "GYRO_RANGE_DPS": (300,),
    "DLPF": (0, 7),
    "ACCEPT_WHO_AM_I": (0x00, 0xFF),
    "SENSOR_ADDRESS": (0x67, 0x6A),
    "SENSOR_BUS_HZ": (99_999, 400_001),
    "DISPLAY": ("oled",),
    "OLED_CONTRAST": (-1, 256),
    "LCD_ADDRESSES": ((), (7,), (0x78,), [0x27], 0x27),
    "LCD_WIRING": (0, 5),
    "LCD_BUS_HZ": (99_999, 400_001),
    "LIVE_PIN": (99_999, 1_000_000),
    "VEHICLE": ("bus",),
    "SPEED": ("radar",),
    "GPS_UART": (-1, 3),
    "GPS_BAUD": (4799, 115_201),
    "PULSES_PER_METRE": (0.09, 101, "2"),
    "BUTTON_PIN": (-1, 49, None, "15"),
    "SENSOR_SDA": (-1, 49),
    "GPS_RX": (49,),
    "SD_SPI": (2,),
    "SD_MISO": (49,),
}
CARD = {"SD_SPI": 0, "SD_SCK": 18, "SD_MOSI": 19, "SD_MISO": 16, "SD_CS": 17}


def settings(**config):
    """Return the Settings of a config.py with these values, and the SettingsError or None."""
    found = []

    def program(board):
        from kickstand.settings import Settings

        try:
            found.append((Settings(types.SimpleNamespace(**config)), None))
        except SettingsError as error:
            found.append((error.settings, error))

    assert on_board(program)[0] == "returned"
    return found[0]


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in GOOD.items() for value in values])
def test_a_value_within_the_limits_is_used(name, value):
    found, error = settings(**{name: value})
    assert error is None and getattr(found, name) == value


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in BAD.items() for value in values])
def test_a_value_beyond_the_limits_is_replaced_by_its_default(name, value):
    """A wrong pin is replaced by None, because something else may be connected to the default pin."""
    found, error = settings(**{name: value})
    assert (error.code, error.values[:2]) == ("not-allowed", (name, value))
    pin = name in ("BUTTON_PIN", "SENSOR_SDA", "GPS_RX", "SD_MISO")
    assert getattr(found, name) == (None if pin else getattr(settings()[0], name))


@pytest.mark.parametrize(
    ("config", "code", "values"),
    [
        ({"BUTTON_PIN": 4}, "pin-twice", ("",)),
        ({"LCD_I2C": 0}, "one-i2c", ("LCD_I2C", 0)),
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


def test_other_names_and_a_whole_card_are_accepted():
    found, error = settings(**CARD, my_note="x", VEHICLE="car", SPEED="wheel", BUTTON_PIN=9)
    assert error is None and not found.leans and found.SD_CS == 17
    assert settings()[0].leans


@pytest.mark.parametrize(
    ("config", "hz"),
    [
        ({}, 100_000),
        ({"DISPLAY": "sh1106"}, 400_000),
        ({"LCD_BUS_HZ": 200_000}, 200_000),
        ({"SENSOR_BUS_HZ": 150_000, "DISPLAY": "ssd1306"}, 150_000),
    ],
)
def test_a_shared_bus_runs_at_the_slower_clock(config, hz):
    found, error = settings(LCD_SDA=4, LCD_SCL=5, **config)
    assert error is None and found.one_bus and found.LCD_I2C == found.SENSOR_I2C
    assert found.SENSOR_BUS_HZ == found.LCD_BUS_HZ == hz
    assert not settings()[0].one_bus


def test_words_of_a_notice_are_found_by_its_code():
    table = "\na|first {}\nab|second {} of {}\nc|third\n"
    assert Notice("ab", 1, 2).words(table) == "second 1 of 2"
    assert Notice("a", 5).words(table) == "first 5"
    assert Refusal("c").words(table) == "third"
    assert Notice("x", 7).words(table, "other {}") == "other 7" and Notice("b").words(table) == ""


def test_a_missing_module_or_memory_is_a_notice(capsys):
    def lacking():
        sys.modules["half_imported"] = types.ModuleType("half_imported")
        raise ImportError("no module")

    def full():
        raise MemoryError("no heap")

    for function, code, text in ((lacking, "incomplete", "no module"), (full, "no-memory", "no heap")):
        found = tried(function)
        assert found and (found.code, found.values) == (code, (text,))
        assert "half_imported" not in sys.modules
    assert tried(len, "x") is None and attempt(len, "x") is None
    assert capsys.readouterr().out == ""
    assert attempt(full) is not None and capsys.readouterr().out != ""
    with pytest.raises(ZeroDivisionError):
        tried(lambda: 1 / 0)


def test_machine_code_with_other_results_is_not_used(capsys):
    def plain(values, n):
        values[0] += n
        return n

    def right(values, n):
        values[0] += n
        return n

    def wrong_result(values, n):
        values[0] += n
        return n + 1

    def wrong_change(values, n):
        return n

    assert checked(right, plain, bytearray(2), 3) is right and capsys.readouterr().out == ""
    for wrong in (wrong_result, wrong_change):
        assert checked(wrong, plain, bytearray(2), 3) is plain
        assert "wrong-code" in capsys.readouterr().out
