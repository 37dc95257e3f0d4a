"""The supply is cut at every flash operation of saving a calibration, on the emulated Pico's own file system."""

from itertools import pairwise

import pytest
from emulated import calibrated, modules, pico

pytestmark = pytest.mark.chip

SAVES = 16  # littlefs writes a page at a time, and goes on to a block that it erases at every fifteenth save

# The gyro bias about x tells the calibrations apart
_TOOLS = """
import os, rp2
from kickstand.calibration.store import Store
def bias():
    return Store(0x68, 8).load().gyro_bias[0]
def save(value):
    store = Store(0x68, 8)
    calibration = store.load()
    calibration.gyro_bias[0] = value
    store.save(calibration)
def mount():
    os.umount("/")
    os.mount(os.VfsLfs2(rp2.Flash(), progsize=256), "/")
save(0)
save(0)
"""


@pytest.fixture
def board():
    """A Pico with both records written, each with a bias of 0."""
    with pico(files=modules() | calibrated()) as emulated:
        emulated.exec(_TOOLS)
        yield emulated


def torn(before, after, share):
    """The flash when only a share of what one operation changes was done."""
    first = next(i for i in range(0, len(before), 256) if before[i : i + 256] != after[i : i + 256])
    last = next(i for i in range(len(before), 0, -256) if before[i - 256 : i] != after[i - 256 : i])
    while before[first] == after[first]:
        first += 1
    middle = first + max(1, round((last - first) * share))
    return before[:first] + after[first:middle] + before[middle:]


@pytest.mark.long
def test_old_or_new_wherever_a_save_is_cut(board):
    """Before, within and after each operation of SAVES saves: it mounts, holds one of the two, and takes another."""
    operations = 0
    for value in range(1, SAVES + 1):
        states = []
        board.chip.flash.before_operation = lambda to=states: to.append(board.file_system)
        board.exec(f"save({value})")
        board.chip.flash.before_operation = None
        states.append(board.file_system)
        operations += len(states) - 1
        halves = [torn(*pair, share) for pair in pairwise(states) for share in (0.05, 0.5, 0.95)]
        found = []
        for state in states + halves:
            board.file_system = state
            found.append(float(board.exec("mount()\nprint(bias())")))
            assert float(board.exec("save(40)\nprint(bias())")) == 40
        assert set(found) == {value - 1, value}
        assert found[0] == value - 1
        assert found[len(states) - 1] == value
        board.file_system = states[-1]
        board.exec("mount()")
    assert operations >= SAVES + 2  # a block was erased on the way


@pytest.mark.parametrize("operation", [1, 8, 9, 10])
def test_a_board_starts_after_a_cut(board, operation):
    """The power really goes in the middle of an operation, and comes back. An erase is among these."""
    board.chip.flash.cut_power(operation, 0.5)
    del board.said[:]
    board.console.send(b"for i in range(1, 20):\n    save(i)\n    print(i)\n\x04")
    board.run(2.0)
    assert not board.powered
    saved = int((board.said.decode().split() or ["0"])[-1].removeprefix("OK") or 0)
    board.power_on()
    found = float(board.exec(_TOOLS.replace("save(0)", "") + "print(bias())"))
    assert found in (saved, saved + 1)
