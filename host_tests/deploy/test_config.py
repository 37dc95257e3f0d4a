"""Which config.py a board gets: the check of it in a process that poses as the board, for each kind of board."""

import re
from pathlib import Path

import pytest
from kickstand_sim.simulated_board.fakes import chips
from kickstand_tools.deploy import config_file
from support import command
from support.mpy import run_mpy

judge_in_a_process = config_file.judge  # conftest.py replaces it by one that remembers
PICO = "Raspberry Pi Pico with RP2040"
ESCAPES = "it ends its own check, or does not come to an end: write only settings in it"


@pytest.mark.parametrize(
    ("content", "line", "reason"),
    [
        ('# one\nSIDE = "right\n', 2, "SyntaxError: unterminated string"),
        ("# one\n\nSIDE = right\n", 3, "NameError: name 'right' is not defined"),
        ("def f():\n    return 1 / 0\n\n\nA = f()\n", 2, "ZeroDivisionError: division by zero"),
        ("raise SystemExit(3)\n", 1, "SystemExit: 3"),
        ("import json, logging.handlers\n", 1, "MicroPython has no module logging"),
        ("A = 1\nfrom datetime import date\n", 2, "MicroPython has no module datetime"),
        ("# one\nSIDE = 'left'\nSIDE = 'up'\n", 3, "SIDE = 'up', but it must be one of 'left', 'right'"),
        ('SIDDE = "right"\n', 1, "SIDDE is not a setting"),
        ('Side = "right"\n', 1, "Side is not a setting"),
        ("SAMPLE_HZ = 50\nDLPF = 3\n", 2, "DLPF = 3 lets vibration alias at SAMPLE_HZ = 50: set DLPF"),
        ("BUTTON_PIN = 4\n", None, "a pin is used twice"),
        ("import json, time\nfrom os import path\nprint('hello')\n", None, None),
        ("\ufeffDLPF = 4\n", None, None),
        ("import os\nos._exit(0)\n", None, ESCAPES),
        ("raise KeyboardInterrupt\n", None, ESCAPES),
        ("import atexit\natexit.register(lambda: print('[1, 2, 3]'))\n", 1, "MicroPython has no module atexit"),
        ("import sys\nsys.stdout.close()\n", None, ESCAPES),
        ("class E:\n    def __eq__(self, other):\n        raise OSError\nVEHICLE = E()\n", None, ESCAPES),
        ("while True:\n    pass\n", None, ESCAPES),
        ("input()\n", 1, "EOFError"),
    ],
)  # fmt: skip
def test_fault_of_a_config_has_its_line(tmp_path, monkeypatch, content, line, reason):
    if reason == ESCAPES:
        monkeypatch.setattr(config_file, "LONGEST_S", 3.0)
    path = tmp_path / "config.py"
    path.write_text(content, encoding="utf-8")
    fault = judge_in_a_process(path, "rp2", PICO).fault
    if reason is None:
        assert fault is None
    else:
        assert fault and fault.startswith(f"{path}, line {line}: {reason}" if line else f"{path}: {reason}")
        assert "\n" not in fault


@pytest.mark.parametrize(("port", "esp32"), [("rp2", False), ("esp32", True)])
def test_settings_behind_a_mark_differ_from_the_default(tmp_path, port, esp32):
    """A number in a comment "(15; 4 on an ESP32)" is a default that depends on the board."""
    path = tmp_path / "config.py"
    path.write_text(
        '# SIDE = "right"  # why\n# SIDE = "left"\n# SD_SPI = 5\n# SPEED = "gps"\nDLPF = 3\n# SIDE = up\n'
        "# BUTTON_PIN = 2  # (28; 9)\n"
    )
    machine = chips.MACHINES["esp32"] if esp32 else PICO
    lines = [f'{path}, line 1: SIDE = "right"', f'{path}, line 4: SPEED = "gps"']
    assert judge_in_a_process(path, port, machine).unused == lines + [f"{path}, line 7: BUTTON_PIN = 2"] * (not esp32)


XIAO = "SENSOR_SDA = 6\nSENSOR_SCL = 7\nLCD_SDA = 0\nLCD_SCL = 1\nBUTTON_PIN = 2\n"
SD = "SD_SPI = {}\nSD_SCK = 12\nSD_MOSI = 13\nSD_MISO = 14\nSD_CS = 27\n"
PINS = "BUTTON_PIN = 0\nSENSOR_SDA = 2\nSENSOR_SCL = 4\nLCD_SDA = 5\nLCD_SCL = 14\n"


@pytest.mark.parametrize(
    ("machine", "content", "words"),
    [
        ("pico", "BUTTON_PIN = 4\n", "a pin is used twice"),  # on a Pico pin 4 is the sensor's SDA
        ("pico 2", "BUTTON_PIN = 4\n", "a pin is used twice"),
        ("esp32", "BUTTON_PIN = 4\n", None),
        # the pins that are marked SDA and SCL on a XIAO RP2040 belong to I2C 1
        ("xiao rp2040", XIAO, "line 1: SENSOR_SDA = 6 and SENSOR_SCL = 7 do not belong to I2C 0 (set SENSOR_I2C and"),
        ("xiao rp2040", XIAO + "SENSOR_I2C = 1\n", "SENSOR_I2C and LCD_I2C are both 1"),
        ("xiao rp2040", XIAO + "SENSOR_I2C = 1\nLCD_I2C = 0\n", None),
        ("pico", "SENSOR_SDA = 5\nSENSOR_SCL = 4\n", "SENSOR_SDA = 5 and SENSOR_SCL = 4 do not belong to I2C 0"),
        # on an ESP32 the number is a slot of machine.SDCard; slots 0 and 1 are not SPI
        *(("pico", SD.format(spi), None if spi < 2 else "SD_SPI = 2, but it must be") for spi in (0, 1, 2)),
        *(("esp32", SD.format(spi), None if spi > 1 else "SD_SPI = 1, but it must be") for spi in (1, 2, 3)),
        *((machine, "SIDE = 'left'\n", "no usual pins are known for this board (") for machine in ("s3", "c6")),
        ("xiao rp2040", "SIDE = 'left'\n", "set BUTTON_PIN, SENSOR_SDA, SENSOR_SCL, LCD_SDA, LCD_SCL: correct it"),
        ("s3", PINS, None),
        ("s3", PINS.replace("LCD_SCL = 14", "LCD_SCL = 19"), "LCD_SCL = 19, but it must be a number from 0 to 48, no"),
    ],
)
def test_config_is_checked_for_the_board(machine, content, words, board, config):
    system = board.modules["sys"]
    system.implementation._machine = chips.MACHINES[machine]
    system.platform = "esp32" if "ESP32" in chips.MACHINES[machine] else "rp2"
    config.write_text(content)
    if words:
        command.refused(board.root, "flash", "--config", words=words)
    else:
        command.works("flash", "--config")
        assert board.path("config.py").read_text() == content


SETTINGS = ("SENSOR_SDA", "SENSOR_SCL", "LCD_SDA", "LCD_SCL", "BUTTON_PIN")
# The boards of the table in settings.md, by their names in MicroPython. PICO-D4 and D2WD have their flash on 16 and 17.
SHOPS = {
    "Seeed XIAO RP2040, RP2350": "Seeed XIAO RP2350 with RP2350", "Waveshare RP2040-Zero": "RP2040-Zero with RP2040",
    "Seeed XIAO ESP32C3": "XIAO with ESP32-C3", "Seeed XIAO ESP32C5": "XIAO with ESP32-C5",
    "Seeed XIAO ESP32S3": "XIAO with ESP32-S3", "Waveshare RP2350-Zero": "RP2350-Zero with RP2350",
    "Waveshare RP2040-Plus, RP2350-Plus": "RP2350-Plus with RP2350", "WeAct Studio RP2040": "WeAct with RP2040",
    "SuperMini ESP32-C3": "C3 with ESP32-C3", "SuperMini ESP32-C3 with an OLED of 72x40 on 5 and 6": "C3 with ESP32C3",
    "LOLIN (Wemos) ESP32-S2 mini": "S2 with ESP32-S2", "LILYGO T-Display (ESP32)": "Generic ESP32 module with ESP32",
    "LILYGO T-Display-S3 (ESP32-S3)": "S3 with ESP32-S3", "Heltec WiFi Kit 32 V3 (ESP32-S3)": "S3 with ESP32-S3",
    "M5Stack Atom Lite (ESP32-PICO-D4)": "M5Stack ATOM with ESP32-PICO-D4",
}  # fmt: skip


def test_pins_for_boards_of_shops_are_accepted(tmp_path):
    page = (Path(__file__).resolve().parents[2] / "firmware" / "docs" / "settings.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:-1] for line in page.splitlines() if line.startswith("| ") and line.count("|") == 7]
    pins = {row[0].strip(): row for row in rows if row[0].strip() in SHOPS}
    assert pins.keys() == SHOPS.keys()
    for board, machine in SHOPS.items():
        numbers = re.findall(r"\d+", re.sub(r"\([^)]*\)", "", ",".join(pins[board][1:4])))
        lines = [f"{name} = {number}" for name, number in zip(SETTINGS, numbers, strict=True)]
        path = tmp_path / "config.py"
        path.write_text("\n".join(lines + re.findall(r"\w+_I2C = \d", pins[board][4])))
        assert judge_in_a_process(path, "esp32" if "ESP32" in machine else "rp2", machine).fault is None, board


@pytest.mark.parametrize(
    ("machine", "pins"),
    [("M5Stack ATOM with ESP32-PICO-D4", (16, 17)), ("Generic ESP32 module with ESP32-D2WD", (17, 16)),
     ("ESP32C5 module with ESP32-C5", (13, 14)), ("Generic ESP32P4 module with ESP32-P4", (24, 25))],
)  # fmt: skip
def test_pins_that_the_chip_itself_needs_are_refused(machine, pins, tmp_path):
    path = tmp_path / "config.py"
    for number in pins:
        path.write_text(f"SENSOR_SDA = {number}\nSENSOR_SCL = 21\nLCD_SDA = 22\nLCD_SCL = 19\nBUTTON_PIN = 23\n")
        assert f"line 1: SENSOR_SDA = {number}, but it must be" in str(judge_in_a_process(path, "esp32", machine).fault)
    path.write_text('SPEED = "gps"\n')  # the usual pins of a GPS receiver are 16 and 17
    assert judge_in_a_process(path, "esp32", machine).fault


_LOAD = """
import sys
from kickstand_sim.simulated_board.simulator import Board
Board(lambda t_s: (0, 0, 1, 0, 0, 0)).install()
sys.path.insert(0, DIRECTORY)
from kickstand import settings
from kickstand.console import sentence
from kickstand.errors import SettingsError
try:
    settings.load()
except SettingsError as error:
    print(sentence(error))
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# one\n\nSIDE = = 3\n", "config.py cannot be read (line 3: invalid syntax"),
        ("# one\nSIDE = right\n", "config.py cannot be read (line 2: name 'right' "),
    ],
)
def test_board_also_names_the_line(text, message, tmp_path):
    (tmp_path / "config.py").write_text(text)
    assert run_mpy(_LOAD.replace("DIRECTORY", repr(str(tmp_path)))).startswith(message)
