"""Display, sensor and button are opened on the pins of config.py. Wrong pins and faults are reported."""

import sys
from types import SimpleNamespace
from typing import Any

import pytest
from support.board_access import on_board


def opened(use, *, config=None, **fitted):
    """Return what use(board, settings) returns on a board with these settings."""
    found = []

    def program(board):
        from kickstand.settings import Settings

        found.append(use(board, Settings(SimpleNamespace(**(config or {})))))

    assert on_board(program, 10.0, **fitted)[0] == "returned"
    return found[0]


@pytest.mark.parametrize(
    ("name", "config", "values"),
    [
        ("SENSOR", {"SENSOR_SDA": 2, "SENSOR_SCL": 5}, ("SENSOR_SDA / SCL", "SENSOR", 2, 5, 0)),
        ("LCD", {"LCD_SDA": 8, "LCD_SCL": 9}, ("LCD_SDA / SCL", "LCD", 8, 9, 1)),
    ],
)
def test_pins_that_no_bus_can_use_are_named(name, config, values):
    def use(board, settings):
        from kickstand.devices import open_bus
        from kickstand.errors import SettingsError

        with pytest.raises(SettingsError) as refused:
            open_bus(settings, name, 400_000)
        return refused.value.code, refused.value.values

    code, found = opened(use, config=config)
    assert code == "i2c-pins" and found[:-1] == values and isinstance(found[-1], str)


def test_a_button_on_a_pin_that_the_board_lacks_is_named():
    def use(board, settings):
        from kickstand.devices import open_button
        from kickstand.errors import SettingsError

        with pytest.raises(SettingsError) as refused:
            open_button(settings)
        return refused.value.code, refused.value.values

    assert opened(use, config={"BUTTON_PIN": 47}) == ("no-such-pin", ("BUTTON_PIN", 47, "invalid pin"))


@pytest.mark.parametrize(("held", "config"), [(False, {}), (True, {}), (True, {"BUTTON_PIN": 20})])
def test_a_button_pulls_its_pin_low(held, config):
    def use(board, settings):
        from kickstand.devices import open_button

        if held:
            board.press(0.0, 5.0)
            board.clock.advance(200_000)
        return open_button(settings).held()

    assert opened(use, config=config, button_pin=config.get("BUTTON_PIN")) is held


def test_the_sensor_has_its_settings():
    config = {"ACCEL_RANGE_G": 4, "GYRO_RANGE_DPS": 1000, "DLPF": 4, "SAMPLE_HZ": 100, "SENSOR_ADDRESS": 0x69}

    def use(board, settings):
        from kickstand.devices import open_sensor

        sensor: Any = open_sensor(settings)
        sensor.set_up()
        chip = sensor.chip
        return chip.address, chip.accel_range_g, chip.accel_lsb_per_g, round(chip.gyro_lsb_per_dps, 1), chip.period_ms

    assert opened(use, config=config, sensor_address=0x69) == (0x69, 4, 8192, 32.8, 10)


@pytest.mark.parametrize(("hz", "too_fast"), [(100_000, False), (400_000, True)])
def test_a_display_has_the_clock_of_its_setting(hz, too_fast):
    """A PCF8574 allows 100 kHz."""

    def use(board, settings):
        from kickstand.devices import open_lcd

        lcd = open_lcd(settings)
        lcd.show("one", "two")
        lcd.flush()
        return board.too_fast, [text.strip() for text in board.lcd.text()], lcd.address

    assert opened(use, config={"LCD_BUS_HZ": hz}) == (too_fast, ["one", "two"], 0x27)


@pytest.mark.parametrize(("chosen", "wiring", "readable"), [(2, None, 2), (1, 3, 3), (3, 1, 1)])
def test_a_wiring_in_the_call_comes_before_the_setting(chosen, wiring, readable, monkeypatch):
    def use(board, settings):
        from kickstand.devices import open_lcd

        board.lcd.wiring = readable
        lcd = open_lcd(settings, wiring)
        lcd.show("one", "two")
        lcd.flush()
        return [text.strip() for text in board.lcd.text()]

    assert opened(use, config={"LCD_WIRING": chosen}) == ["one", "two"]


@pytest.mark.parametrize(
    ("module", "error", "code"),
    [("missing", OSError(5), "no-sensor"), ("missing", None, None), ("failing", OSError(5), "no-sensor")],
)
def test_without_its_diagnosis_a_fault_is_still_a_fault(module, error, code, monkeypatch):
    """The module with the diagnosis may be missing, or the bus may fail while it looks."""

    def use(board, settings):
        from kickstand import devices, diagnosis

        if module == "missing":
            monkeypatch.setitem(sys.modules, "kickstand.diagnosis", None)
        else:

            def fails(*arguments):
                raise OSError(5)

            monkeypatch.setattr(diagnosis, "explain_sensor", fails)
        sensor: Any = devices.open_sensor(settings)
        notice, addresses = sensor.explain(sensor.chip, error)
        return notice and notice.code, addresses

    assert opened(use) == (code, [])


def test_a_fault_is_explained_with_the_addresses_that_answer():
    def use(board, settings):
        from kickstand.devices import open_sensor

        sensor: Any = open_sensor(settings)
        notice, addresses = sensor.explain(sensor.chip, OSError(5))
        return notice.code, notice.values, addresses

    assert opened(use) == ("bus-errors", (0x68,), [0x68])
    assert opened(use, sensor_address=None) == ("no-sensor", (4, 5), [])


def test_a_good_fifo_has_no_fault(monkeypatch):
    def use(board, settings):
        from kickstand.devices import open_sensor

        sensor: Any = open_sensor(settings)
        sensor.set_up()
        return sensor.explain(sensor.chip, None)

    assert list(opened(use)) == [None, []]


@pytest.mark.parametrize(("sda", "scl", "found"), [(5, 4, True), (4, 5, False)])
def test_exchanged_wires_are_found(sda, scl, found):
    def use(board, settings):
        from kickstand.diagnosis import exchanged

        return exchanged(4, 5, (0x68, 0x69)), exchanged(4, 5, (0x6A,))

    assert opened(use, sensor_pins=(sda, scl)) == (found, False)
