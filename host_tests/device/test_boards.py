"""The whole device on boards other than a Pico, with their pins and their I2C."""

import pytest
from kickstand_sim.simulated_board.fakes import chips
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level
from support.device_runs import FreshFirmware

PINS = {"SENSOR_SDA": 4, "SENSOR_SCL": 5, "LCD_SDA": 6, "LCD_SCL": 7, "BUTTON_PIN": 10}
WIRED = {"sensor_pins": [4, 5], "lcd_pins": [6, 7], "button_pin": 10}
NAMES = "BUTTON_PIN, SENSOR_SDA, SENSOR_SCL, LCD_SDA, LCD_SCL"
PICO_PINS, ESP32_PINS = [4, 5, 6, 7, 15], [4, 18, 19, 21, 22]
WITH_PINS = {
    **dict.fromkeys(["pico", "pico w", "pico 2", "pico 2 w", "pico lipo"], PICO_PINS),
    **dict.fromkeys(["esp32", "esp32 spiram", "esp32 unicore"], ESP32_PINS),
}
WITHOUT = sorted(set(chips.MACHINES) - set(WITH_PINS))
GPS = {"SPEED": "gps", "GPS_TX": 25, "GPS_RX": 26}
CARD = {"SD_SPI": 2, "SD_SCK": 25, "SD_MOSI": 26, "SD_MISO": 33, "SD_CS": 32}
# pins that are free on other chips than a classic ESP32
FREE = {"SENSOR_SDA": 8, "SENSOR_SCL": 9, "LCD_SDA": 6, "LCD_SCL": 7, "BUTTON_PIN": 10}
WIRED_TO_FREE = {"sensor_pins": [8, 9], "lcd_pins": [6, 7], "button_pin": 10}
SENSOR, LCD = 0x68, 0x27


def on(machine, config, until_s=3, **board):
    return {"lean": [[0, 25]], "board": {"machine": machine, **board}, "config": config, "until": until_s}


@pytest.mark.parametrize(
    ("machine", "board", "config", "touched"),
    [
        *[(machine, {}, {}, pins) for machine, pins in WITH_PINS.items()],
        *[(machine, WIRED_TO_FREE, FREE, [6, 7, 8, 9, 10]) for machine in ("xiao rp2040", "s2", "s3", "c6")],
        *[("c3", {**WIRED, "i2c_driver": driver}, PINS, [4, 5, 6, 7, 10]) for driver in ("legacy", "new")],
        ("c3", {**WIRED, "one_bus": True}, {**PINS, "LCD_SDA": 4, "LCD_SCL": 5}, [4, 5, 10]),
        # The inputs of the wheel and of a GPS receiver may be on an input-only pin.
        ("esp32", {}, {**GPS, "GPS_RX": 34}, None),
        ("esp32", {}, {**CARD, "SD_MISO": 39}, None),
        ("esp32 spiram", {}, GPS, None),
    ],
)
def test_board_measures_and_touches_its_pins_only(machine, board, config, touched, run):
    record = run(on(machine, config, **board))
    assert record.last[0].startswith("Raw   25°")
    assert not record.too_fast
    assert touched in (None, record.touched)


@pytest.mark.parametrize("machine", WITHOUT)
def test_board_without_usual_pins_touches_none(machine, run):
    """The message names the missing pins, also with the button held at power-on."""
    record = run({**on(machine, {}, **WIRED), "presses": [[0, 2]]})
    assert record.ends == ["returned"] and record.touched == []
    assert f"for this board ({chips.MACHINES[machine]}): set {NAMES}" in record.console


SHOWN = {"LCD_SDA": 6, "LCD_SCL": 7}
KEPT = "but it must be a number from 0 to 48, no pin of the chip's own"


@pytest.mark.parametrize(
    ("machine", "board", "config", "name", "words"),
    [
        ("c3", WIRED, SHOWN, "BUTTON_PIN", "set BUTTON_PIN"),
        ("c3", WIRED, {**SHOWN, "BUTTON_PIN": 10}, "SENSOR_SDA", "set SENSOR_SDA"),
        ("c3", WIRED, {**PINS, "SIDE": "rigth"}, "SIDE", "SIDE = 'rigth'"),
        # pins of the console, pins of the flash, and pins that are only inputs and would always read as pressed
        *[
            ("esp32", {}, {"BUTTON_PIN": pin}, "BUTTON_PIN", f"BUTTON_PIN = {pin}, {KEPT}")
            for pin in (1, 6, 11, 34, 39)
        ],
        ("esp32", {}, {"SENSOR_SDA": 6}, "SENSOR_SDA", f"SENSOR_SDA = 6, {KEPT}"),
        ("esp32", {}, {**CARD, "SD_CS": 6}, "SD_CS", f"SD_CS = 6, {KEPT}"),
        # the PSRAM uses the usual pins of a GPS receiver
        ("esp32 spiram", {}, {"SPEED": "gps"}, "GPS_TX", "set GPS_TX, GPS_RX"),
    ],
)
def test_missing_or_wrong_pin_is_shown(machine, board, config, name, words, run):
    """Only the pins of the display are touched."""
    record = run(on(machine, config, **board))
    assert record.ends == ["returned"]
    line = "config.py: set  " if words.startswith("set") else "config.py: wrong"
    assert record.last == (line, f"{name:16}")
    assert words in record.console
    assert record.touched == ([6, 7] if machine == "c3" else [18, 19])


@pytest.mark.parametrize("driver", ["legacy", "new"])
def test_stalled_bus_never_stops_the_loop_of_an_esp32(driver, run):
    """A fault holds the sensor's wires for a second, then the display's wires for a moment. Sensor and display work
    again without a reset."""
    faults = [["timeout_for", [SENSOR, 2.0, 1.0]], ["timeout_for", [LCD, 5.0, 0.05]], ["stuck_sda", [6.5]]]
    plan = on("esp32", {}, 8, i2c_driver=driver)
    record = run({**plan, "lean": [[0, 25], [5, 30]], "faults": faults})
    assert record.ends == ["off"]
    assert record.first("No sensor|Sensor lost", 2.0) < 2.3
    assert record.first("Raw   25°", 2.5) < 3.8
    assert record.first("Raw   30°", 5.0) < 6.3
    assert record.last[0].startswith("Raw   30°")


@pytest.mark.parametrize("machine", ["pico", "esp32", "s3"])
def test_stopped_watchdog_allows_an_open_console_for_days(machine):
    """An ESP32's watchdog cannot be stopped, even by a soft reset. So the firmware must feed the watchdog."""

    def use_the_console():
        from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

        from kickstand.board import port

        port.start_watchdog()
        port.rest_watchdog()
        for _ in range(5 * 24):
            sleep_ms(3_600_000)

    with FreshFirmware(), Board(level, machine=machine) as board:
        assert board.run(use_the_console, 1e6) == "returned"
