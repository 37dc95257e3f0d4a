"""The whole device on boards other than a Pico, with their pins and their I2C."""

import sys

import pytest
from kickstand_tools.simulated_board.fakes import chips
from kickstand_tools.simulated_board.simulator import Board
from support import device_plans, device_runs

PINS = {"SENSOR_SDA": 4, "SENSOR_SCL": 5, "LCD_SDA": 6, "LCD_SCL": 7, "BUTTON_PIN": 10}
WIRED = {"sensor_pins": [4, 5], "lcd_pins": [6, 7], "button_pin": 10}
WITH_PINS = ["pico", "pico w", "pico 2", "pico 2 w", "pico lipo", "esp32", "esp32 spiram", "esp32 unicore"]
WITHOUT = sorted(set(chips.MACHINES) - set(WITH_PINS))
LEANING = [[0, 25]]
SENSOR, LCD = 0x68, 0x27
SPEED = {"SPEED": "gps", "GPS_TX": 25, "GPS_RX": 26}
CARD = {"SD_SPI": 2, "SD_SCK": 25, "SD_MOSI": 26, "SD_MISO": 33, "SD_CS": 32}
# pins that are free on other chips than a classic ESP32
FREE = {"SENSOR_SDA": 8, "SENSOR_SCL": 9, "LCD_SDA": 6, "LCD_SCL": 7, "BUTTON_PIN": 10}
WIRED_TO_FREE = {"sensor_pins": [8, 9], "lcd_pins": [6, 7], "button_pin": 10}
ESP32_PINS = [4, 18, 19, 21, 22]


@pytest.mark.parametrize(
    ("machine", "board", "config", "touched"),
    [
        *[(m, {}, {}, ESP32_PINS if "esp32" in m else [4, 5, 6, 7, 15]) for m in WITH_PINS],
        *[(m, WIRED_TO_FREE, FREE, [6, 7, 8, 9, 10]) for m in ("pico", "xiao rp2040", "s2", "s3", "c6")],
        *[("c3", {**WIRED, "i2c_driver": driver}, PINS, [4, 5, 6, 7, 10]) for driver in ("legacy", "new")],
        ("c3", {**WIRED, "one_bus": True}, {**PINS, "LCD_SDA": 4, "LCD_SCL": 5}, [4, 5, 10]),
        # The inputs of the wheel and of a GPS receiver may be on an input-only pin.
        ("esp32", {}, {**SPEED, "GPS_RX": 34}, None),
        ("esp32", {}, {**CARD, "SD_MISO": 39}, None),
    ],
)
def test_other_boards_measure(machine, board, config, touched, tmp_path):
    """The boards use their usual pins or other pins, either driver of an ESP32, and one bus or two. The firmware
    touches no other pin."""
    plan = {"lean": LEANING, "board": {"machine": machine, **board}, "config": config, "until": 3}
    record = device_plans.run("cpython", tmp_path, plan)
    assert record.last[0].startswith("Raw   25°")
    assert not record.too_fast
    assert touched in (None, record.touched)


@pytest.mark.parametrize("machine", WITHOUT)
def test_a_board_without_usual_pins_touches_none(machine, tmp_path, capsys):
    """The message names the missing pins. The message also appears in safe mode, with the button held at power-on."""
    plan = {"board": {"machine": machine, **WIRED}, "presses": [[0, 2]], "until": 3}
    record = device_plans.run("cpython", tmp_path, plan, capsys)
    assert record.ends == ["returned"]
    assert record.touched == []
    names = "BUTTON_PIN, SENSOR_SDA, SENSOR_SCL, LCD_SDA, LCD_SCL"
    assert f"for this board ({chips.MACHINES[machine]}): set {names}" in record.console


@pytest.mark.parametrize(
    ("config", "lines"),
    [
        ({}, ["config.py: set  ", "BUTTON_PIN      "]),
        ({"BUTTON_PIN": 10}, ["config.py: set  ", "SENSOR_SDA      "]),
        ({**PINS, "SIDE": "rigth"}, ["config.py: wrong", "SIDE            "]),
        ({**PINS, "SENSOR_SDA": 18}, ["config.py: wrong", "SENSOR_SDA      "]),
    ],
)
def test_the_refusal_is_shown_where_the_display_s_pins_are_set(config, lines, tmp_path):
    config = {"LCD_SDA": 6, "LCD_SCL": 7, **config}
    record = device_plans.run("cpython", tmp_path, {"board": {"machine": "c3", **WIRED}, "config": config, "until": 3})
    assert list(record.last) == lines
    assert record.touched == [6, 7]


@pytest.mark.parametrize(
    ("machine", "name", "pin"),
    [
        *[
            ("esp32", "BUTTON_PIN", pin) for pin in (1, 6, 11, 34, 39)
        ],  # pins of the console, pins of the flash, and pins that are only inputs
        *[("esp32", name, 6) for name in ("SENSOR_SDA", "SENSOR_SCL", "WHEEL_PIN", "GPS_TX", "SD_CS")],
        ("esp32 unicore", "BUTTON_PIN", 11),
    ],
)
def test_a_classic_esp32_keeps_its_flash_and_its_console(machine, name, pin, tmp_path, capsys):
    """The firmware refuses pins of the console and of the flash, and input-only pins. Driving a pin of the flash would
    crash the board at each start. Input-only pins have no pull-up, so a button on such a pin would always read as
    pressed."""
    config = {**(CARD if name == "SD_CS" else {}), **({"SPEED": "wheel"} if name == "WHEEL_PIN" else {}), name: pin}
    if name == "GPS_TX":
        config = {**SPEED, **config}
    record = device_plans.run(
        "cpython", tmp_path, {"board": {"machine": machine}, "config": config, "until": 3}, capsys
    )
    assert record.ends == ["returned"]
    assert record.last == ("config.py: wrong", f"{name:16}")
    assert f"{name} = {pin}, but it must be a number from 0 to 48, no pin of the chip's own" in record.console
    assert record.touched == [18, 19]


def test_a_board_with_psram_has_no_usual_pins_for_a_gps_receiver(tmp_path, capsys):
    """The board's PSRAM uses the usual pins of a GPS receiver. The display asks the owner to set other pins."""
    plan = {"lean": LEANING, "board": {"machine": "esp32 spiram"}, "config": {"SPEED": "gps"}, "until": 3}
    record = device_plans.run("cpython", tmp_path, plan, capsys)
    assert record.ends == ["returned"]
    assert record.last == ("config.py: set  ", "GPS_TX          ")
    assert "set GPS_TX, GPS_RX" in record.console
    record = device_plans.run("cpython", tmp_path, {**plan, "config": SPEED})
    assert record.last[0].startswith("Raw   25°")


@pytest.mark.parametrize(
    ("machine", "config", "wrong", "touched"),
    [
        ("c3", PINS, {"LCD_SDA": 18}, {6, 7, 10}),
        *[("pico", {"LCD_SDA": 2, "LCD_SCL": 3}, {name: "GP2"}, {2, 3}) for name in ("LCD_SDA", "LCD_SCL")],
    ],
)
def test_a_display_with_wrong_pins_drives_no_other_pin(machine, config, wrong, touched, tmp_path, capsys):
    plan = {"board": {"machine": machine, **WIRED}, "config": {**config, **wrong}, "until": 3}
    record = device_plans.run("cpython", tmp_path, plan, capsys)
    assert record.ends == ["returned"]
    assert "Kickstand stopped. config.py: LCD_S" in record.console
    assert set(record.touched) <= touched


@pytest.mark.parametrize("driver", ["legacy", "new"])
def test_a_bus_that_stalls_never_stops_the_loop_of_an_esp32(driver, tmp_path):
    """A fault holds the sensor's wires for a second, then the display's wires for a moment. Sensor and display work
    again without a reset."""
    faults = [["timeout_for", [SENSOR, 3.0, 1.0]], ["timeout_for", [LCD, 6.0, 0.05]], ["stuck_sda", [7.0]]]
    board = {"machine": "esp32", "i2c_driver": driver}
    plan = {"lean": [[0, 25], [6, 30]], "board": board, "faults": faults, "until": 9}
    record = device_plans.run("cpython", tmp_path, plan)
    assert record.ends == ["off"]
    assert record.first("No sensor|Sensor lost", 3.0) < 3.3
    assert record.first("Raw   25°", 3.5) < 4.8
    assert record.first("Raw   30°", 6.0) < 7.0
    assert record.last[0].startswith("Raw   30°")


@pytest.mark.parametrize("bits", [8, 60])
def test_a_device_that_hangs_on_an_esp32_is_freed(bits, tmp_path):
    """SoftI2C does not notice that a device holds SDA. The clock pulses of SoftI2C free the device. If the clock pulses
    do not help, the firmware rejects the readings."""
    faults = [["stuck_sda", [3.0, bits]], ["stuck_sda", [3.0, bits, True]]]
    plan = {"lean": [[0, 25], [3.2, 35]], "board": {"machine": "esp32"}, "faults": faults, "until": 5}
    record = device_plans.run("cpython", tmp_path, plan)
    assert record.ends == ["off"]
    assert record.first("Raw   3[1-5]°", 3.2) < 4.0
    shown = {int(line[5:8]) for t_s, line, _ in record.frames if t_s > 1.0 and line.startswith("Raw")}
    assert shown <= set(range(25, 36))  # only readings from before and after the fault are used


def on(machine, function, until_s):
    """Run function(board) on a board of this machine, which imports the firmware again. Return (outcome, board)."""
    before = device_runs.take_firmware()
    try:
        with Board(lambda t_s: (0, 0, 1, 0, 0, 0), machine=machine) as board:
            return board.run(lambda: function(board), until_s), board
    finally:
        device_runs.take_firmware()
        sys.modules.update(before)


@pytest.mark.parametrize("machine", ["pico", "esp32", "s3"])
def test_a_stopped_watchdog_allows_an_open_console_for_days(machine):
    """An ESP32's watchdog cannot be stopped, even by a soft reset. So the firmware must feed the watchdog."""

    def use_the_console(board):
        from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

        from kickstand.board import port

        port.start_watchdog()
        port.rest_watchdog()
        for _ in range(5 * 24):
            sleep_ms(3_600_000)

    assert on(machine, use_the_console, 1e6)[0] == "returned"


def test_status_lists_the_missing_pins(tmp_path, monkeypatch, capsys):
    def report(board):
        from kickstand import status_report

        status_report.report()

    monkeypatch.chdir(tmp_path)
    outcome, board = on("s3", report, 5.0)
    assert outcome == "returned"
    names = "BUTTON_PIN, SENSOR_SDA, SENSOR_SCL, LCD_SDA, LCD_SCL"
    said = capsys.readouterr().out
    assert f"Settings     config.py: no usual pins are known for this board ({board.machine}): set {names}" in said
    assert board.touched == set()
