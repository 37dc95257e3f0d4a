"""The emulated Pico as a program sees it: the bus and the flash take time, I2C errors are those of the chip, and the
console is quiet. Also its pins as speed sources, and the machine code that it accepts."""

import os
import subprocess
import sys

import pytest
from kickstand_tools.deploy import firmware_files
from support import emulated
from support.emulated import pico

pytestmark = pytest.mark.chip

_TOOLS = """
from time import ticks_us, ticks_diff, sleep_ms
from machine import I2C, SoftI2C, Pin
sensor = I2C(0, sda=Pin(4), scl=Pin(5), freq=400000, timeout=5000)
lcd = I2C(1, sda=Pin(6), scl=Pin(7), freq=100000, timeout=20000)
def timed(f, *a):
    t = ticks_us()
    try:
        r = f(*a)
    except OSError as e:
        r = e.errno
    return ticks_diff(ticks_us(), t), r
"""


@pytest.fixture(scope="module")
def board():
    """Return a Pico without files. The code of _TOOLS has run on it."""
    with pico() as emulated:
        emulated.exec(_TOOLS)
        yield emulated


# Code that removes the import hook for modules that are compiled for this Python.
_WHEELS_OWN = """
import sys, kickstand_emulator
del sys.meta_path[0]
from support import emulated
print(emulated.begun(0.003))
"""


@pytest.mark.long
def test_chip_runs_the_same_on_every_host():
    """Cycles and memory are the same with modules compiled for this Python, with the wheel's modules, and on a slow
    host."""
    pico()  # skips the test without the emulator
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    other = subprocess.run([sys.executable, "-c", _WHEELS_OWN], env=environment, capture_output=True, text=True)
    assert other.stdout == f"{emulated.begun(0.0)}\n", other.stderr


def ask(board, expression):
    """Evaluate an expression on the board and return its value."""
    return eval(board.exec(f"print(repr(({expression})))"))


def test_i2c_bits_take_time(board):
    """The sensor's bus has 400 kHz: 156 bits take 390 us plus MicroPython's overhead. The display's bus has 100 kHz: 69
    bytes take 6.2 ms."""
    us, _ = ask(board, "timed(sensor.readfrom_mem, 0x68, 0x3B, 14)")
    assert 390 < us < 500
    us, _ = ask(board, "timed(lcd.writeto, 0x27, bytes(68))")
    assert 6210 < us < 6500


def test_absent_device_fails_fast_and_harms_no_transfer(board):
    for call in ("readfrom, 0x55, 1", "writeto, 0x55, b'1'"):
        us, number = ask(board, f"timed(sensor.{call})")
        assert number == 5
        assert us < 400
        assert ask(board, "timed(sensor.readfrom_mem, 0x68, 0x75, 1)")[1] == b"h"


def test_held_wires_time_out_until_freed(board):
    """A transfer ends after the set time-out of 5 ms. After nine manual clock pulses the chip answers again."""
    board.board.sensor_bus.hang()
    us, number = ask(board, "timed(sensor.readfrom_mem, 0x68, 0x75, 1)")
    assert number == 110
    assert 5000 < us < 5500
    board.exec(
        "scl, sda = Pin(5, Pin.OPEN_DRAIN, value=1), Pin(4, Pin.OPEN_DRAIN, value=1)\n"
        "assert not sda.value()\n"
        "for _ in range(9):\n    scl(0)\n    scl(1)\n"
        "assert sda.value()\n"
        "sensor = I2C(0, sda=Pin(4), scl=Pin(5), freq=400000, timeout=5000)"
    )
    assert ask(board, "sensor.readfrom_mem(0x68, 0x75, 1)") == b"h"


def test_devices_answer_bit_banged_pins(board):
    """MicroPython drives the pins in software for SoftI2C, and for scan(), which writes 0 bytes."""
    assert ask(board, "sensor.scan(), lcd.scan()") == ([0x68], [0x27])
    board.exec("soft = SoftI2C(sda=Pin(4), scl=Pin(5), freq=100000)\nsoft.writeto_mem(0x68, 0x6B, b'\\x01')")
    assert ask(board, "soft.readfrom_mem(0x68, 0x6B, 1), soft.readfrom_mem(0x68, 0x75, 1)") == (b"\x01", b"h")
    board.exec("sensor = I2C(0, sda=Pin(4), scl=Pin(5), freq=400000, timeout=5000)")


def test_flash_operations_take_time(board):
    us, _ = ask(board, "timed(__import__('rp2').Flash().writeblocks, 300, bytes(4096))")
    assert 45_000 + 16 * 500 < us < 62_000
    us, _ = ask(board, "timed(__import__('rp2').Flash().writeblocks, 301, bytes(256), 0)")
    assert 500 < us < 1000


def test_image_accepts_the_compiled_files(board):
    assert board.exec("import sys\nprint(sys.implementation._mpy)") == f"{firmware_files.PICO}\n"
