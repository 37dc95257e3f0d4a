"""The power is cut at every flash operation while a calibration is saved, on the emulated Pico's own file system."""

from itertools import pairwise

import pytest
from kickstand.calibration.store import Store

pytestmark = pytest.mark.chip

SAVES = 16  # number of saves: littlefs appends one page per save, and every fifteenth save erases a new block

# Each save stores another gyro bias about x, so a test can tell the calibrations apart.
_TOOLS = """
from kickstand.calibration.store import Store
def bias():
    return Store(0x68, 8).load().gyro_bias[0]
def save(value):
    store = Store(0x68, 8)
    calibration = store.load()
    calibration.gyro_bias[0] = value
    store.save(calibration)
save(0)
save(0)
"""


def torn(before, after, share):
    """Return the flash after the power was cut in an operation. share: the share of the operation that was done."""
    first = next(i for i in range(0, len(before), 256) if before[i : i + 256] != after[i : i + 256])
    last = next(i for i in range(len(before), 0, -256) if before[i - 256 : i] != after[i - 256 : i])
    while before[first] == after[first]:
        first += 1
    middle = first + max(1, round((last - first) * share))
    return before[:first] + after[first:middle] + before[middle:]


def loaded(system, image, directory):
    """Return the gyro bias that the firmware loads from this flash. Fail if the firmware finds no complete
    calibration."""
    for name, content in system.read(image).items():
        if name.endswith(".cal"):
            (directory / name).write_bytes(content)
    return Store(0x68, 8, str(directory)).load().gyro_bias[0]


def test_old_or_new_wherever_a_save_is_cut(at_prompt, tmp_path):
    """The power is cut before, within and after each operation of SAVES saves."""
    at_prompt.exec(_TOOLS)
    operations = 0
    for value in range(1, SAVES + 1):
        states = []
        at_prompt.chip.flash.before_operation = lambda to=states: to.append(at_prompt.file_system)
        at_prompt.exec(f"save({value})")
        at_prompt.chip.flash.before_operation = None
        states.append(at_prompt.file_system)
        operations += len(states) - 1
        halves = [torn(*pair, share) for pair in pairwise(states) for share in (0.05, 0.5, 0.95)]
        found = [loaded(at_prompt.FLASH, state, tmp_path) for state in states + halves]
        assert set(found) == {value - 1, value}
        assert found[0] == value - 1
        assert found[len(states) - 1] == value
    assert operations >= SAVES + 2  # the saves include the erase of at least one block


@pytest.mark.parametrize("operation", [8, *(pytest.param(n, marks=pytest.mark.nightly) for n in (1, 9, 10))])
def test_board_starts_and_saves_after_a_power_cut(at_prompt, operation):
    """The emulated board loses power in the middle of an operation, and gets it back. The eighth operation is an
    erase."""
    at_prompt.exec(_TOOLS)
    at_prompt.chip.flash.cut_power(operation, 0.5)
    del at_prompt.said[:]
    at_prompt.send(b"for i in range(1, 20):\n    save(i)\n    print(i)\n\x04")
    at_prompt.run(2.0)
    assert not at_prompt.powered
    saved = int((at_prompt.said.decode().split() or ["0"])[-1].removeprefix("OK") or 0)
    at_prompt.power_on()
    found = float(at_prompt.exec(_TOOLS.replace("save(0)", "") + "print(bias())"))
    assert found in (saved, saved + 1)
    assert float(at_prompt.exec("save(40)\nprint(bias())")) == 40
