"""The models' own tests, which import nothing that MicroPython lacks, once more under MicroPython."""

from pathlib import Path

import pytest
from mpy import run_mpy, run_tests

MODULES = sorted(set(Path(__file__).parent.glob("test_board_*.py")) - {Path(__file__)})

HEAP_LOCKED_READ = """
from micropython import heap_lock, heap_unlock
from kickstand_tools.simulated_board.simulator import Board
board = Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
board.install()
import machine

def main():
    i2c = machine.I2C(0, sda=machine.Pin(4), scl=machine.Pin(5), freq=400000)
    machine.Pin(15, machine.Pin.IN, machine.Pin.PULL_UP)
    board.clock.advance(200000)
    i2c.writeto_mem(0x68, 0x6B, b"\\x01")
    board.clock.advance(200000)
    buf = bytearray(14)
    i2c.readfrom_mem_into(0x68, 0x3B, buf)
    assert buf[4] == 0x40, buf
    board.sensor.override("freeze")  # world() itself makes floats
    heap_lock()
    for i in range(100):
        i2c.readfrom_mem_into(0x68, 0x3B, buf)
    heap_unlock()
    print(board.clock.now_us)

print(board.run(main, 10.0))
"""


def test_a_read_through_the_model_allocates_nothing() -> None:
    """So that a test of the driver under heap_lock can use the model."""
    assert run_mpy(HEAP_LOCKED_READ).split()[-1] == "returned"


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.stem)
def test_under_micropython(module: Path) -> None:
    run_tests(module)
