"""Features of the emulated ESP32, and tests that need a board of their own. test_chip_device.py tests both chips."""

import math
import re

import pytest
from kickstand.calibration.store import Store
from kickstand.rides.block import BLOCK
from kickstand.rides.flash_ring import PART_BLOCKS
from kickstand.rides.ride_paths import part_path
from kickstand_tools.simulation.scripted.script import Ride, accelerate, turn, wait
from support import device_runs
from support.emulated import PART, calibrated, esp32, firmware, leaning, modules, shows
from test_chip_recorder import FEED, rides

pytestmark = [pytest.mark.chip, pytest.mark.esp32]

LEAN_DEG = 20.0
LEAN = r"Lean +20.*right"
BOOT_S = 4.0
FILES = calibrated()

_SAVE = """
from kickstand.calibration.store import Store
store = Store(0x68, 8)
calibration = store.load()
def save(value):
    calibration.gyro_bias[0] = value
    store.save(calibration)
save(0)
save(0)
"""


def board(config="", world=None, files=None):
    """Return a calibrated board that is held at LEAN_DEG and is off. config: the text of config.py."""
    own = FILES | ({"/config.py": config.encode()} if config else {})
    return esp32(world or leaning(LEAN_DEG), (files or firmware("esp32")) | own)


@pytest.mark.nightly  # the tests in host_tests/device cause the same faults on MicroPython for Linux
def test_board_survives_ctrl_c_unplugging_and_soft_reset():
    """The owner presses Ctrl-C, unplugs the board and does a soft reset, each while the board is running."""
    with board() as device:
        shows(device, LEAN, BOOT_S)
        faults = device.board.faults
        faults.unplug_sensor(device.time_s + 0.01, 0.3)
        shows(device, r"No sensor|Sensor lost|Sensor silent", 0.8)
        shows(device, LEAN, 2.0)
        faults.unplug_lcd(device.time_s + 0.01, 0.3)
        device.run(0.2)
        assert not device.board.lcd.on
        shows(device, LEAN, 4.0)
        device.send(b"\x03")
        device.run(9.0)  # 9 s is longer than the watchdog's time-out
        assert device.resets == 0
        assert b"Kickstand stopped." in device.said
        status = device.exec("import kickstand\nkickstand.status()", 20.0)
        assert re.search(r"Sensor +MPU6050 \(0x68\), \+-16 g", status)
        assert re.search(r"Display .* at 0x27", status)
        assert re.search(r"Machine code +used\n", status)
        assert re.search(r"aligned: yes", status)
        worst = re.search(
            r"Since start +longest turn (\d+\.\d) ms; places left in the FIFO, at the fewest: (\d+)", status
        )
        assert worst
        assert 5.0 < float(worst[1]) < 600.0
        assert 0 <= int(worst[2]) < 73
        device.soft_reset()
        device.board.lcd.power_on()
        device.run(0.1)
        shows(device, LEAN, BOOT_S)
        assert device.resets == 0


def test_safe_mode_and_refused_pins():
    """In safe mode the button is held at power-on, and the app does not start. The firmware refuses a pin that the chip
    needs for its flash, because using it would crash the board at each start."""
    with board("SENSOR_SDA = 6\n") as device:
        shows(device, r"SENSOR_SDA", BOOT_S)
        assert device.resets == 0
        device.power_off()
        device.put_files(firmware("esp32"))
        device.board.button.turn(True, device.clock.now_us)
        device.run(0.1)
        device.power_on()
        device.run_until(lambda: b"safe mode" in device.said, BOOT_S)


def states_of_flash(device, code):
    """Yield the content of the flash before the code runs, and after each of its flash writes.

    QEMU's flash takes no time, but the program needs tens of microseconds between two writes.
    """
    device.exec("pass")
    device.send(code.encode() + b"\x04")
    del device.said[:]
    states = [device.file_system]
    while not device.said.endswith(b"\x04>"):
        device.run(20e-6)
        now = device.file_system
        if now != states[-1]:
            states.append(now)
    return states


@pytest.mark.nightly  # test_chip_power_cut.py has the same test on the Pico
def test_old_or_new_wherever_a_save_is_cut(tmp_path):
    """The power is cut after each write of four saves. A board that then starts has the old or the new calibration."""
    with board(files=modules("esp32")) as device:
        device.exec(_SAVE)
        states, writes = [], 0
        for value in range(1, 5):
            states = states_of_flash(device, f"save({value})")
            writes += len(states) - 1
            found = []
            for state in states:
                for name, content in device.FLASH.read(state).items():
                    if name.endswith(".cal"):
                        (tmp_path / name).write_bytes(content)
                found.append(Store(0x68, 8, str(tmp_path)).load().gyro_bias[0])
            assert set(found) == {value - 1, value}
            assert found == sorted(found)
        assert writes >= 8
        torn = states[len(states) // 2]
        device.power_off()
        device.file_system = torn
        device.power_on()
        device.run(1.6)
        bias = float(device.exec(_SAVE.replace("save(0)\n", "") + "print(calibration.gyro_bias[0])").splitlines()[-1])
        assert bias in (3.0, 4.0)
        device.exec("save(9)")
        assert float(device.exec("print(store.load().gyro_bias[0])")) == 9.0


_SIDES = [[1, 0, 0], [0, 0, -1], [0, 1, 0], [-1, 0, 0], [0, 0, 1], [0, -1, 0], [0.5, 0.6, -0.7]]


@pytest.mark.nightly
def test_six_positions_by_the_button():
    """The rider begins in the menu. After the six sides comes a last pose, which is free. At the end the calibration is
    in flash."""
    steps = [[0, None]]
    for i, up in enumerate(_SIDES):
        steps += [[8.0 + 6.0 * i, up], [13.0 + 6.0 * i, None]]
    world = device_runs.poses_of(3, steps)
    with esp32(lambda t_s: tuple(world(t_s)), firmware("esp32")) as device:
        for at_s, for_s in ((4, 1.2), (6, 0.15), (7, 1.2)):
            device.press(at_s, for_s)
        shows(device, "any of the six", 9.0)
        shows(device, r"Side \+x done", 8.0)
        shows(device, "Saved, err", 50.0)
        files = device.files()
    assert {"kickstand_a.cal", "kickstand_b.cal"} & set(files)


@pytest.mark.nightly
def test_power_cut_loses_only_the_last_block_of_a_ride():
    """The power is cut after each write to the flash. The calibration always survives."""
    with board(files=modules("esp32")) as device:
        device.exec(FEED + "recorder.start(Chip(), Calibration())")
        states = states_of_flash(device, "feed(3)\nrecorder.stop()")
    assert len(states) > 10
    seen = 0
    for state in states:
        files = device.FLASH.read(state)
        assert files.items() >= FILES.items()
        blocks = [block.sequence for block in rides(files).get(1, [])]
        assert blocks == list(range(len(blocks)))
        assert len(blocks) >= seen - 1
        seen = max(seen, len(blocks))
    assert seen >= 3


@pytest.mark.nightly  # host_tests/rides/test_ring.py tests the same on the host
def test_ride_removes_the_oldest_parts_first():
    """The flash is full of rides. The new ride removes no more parts than it needs room for."""
    parts = [part_path("rides", ride, number) for ride in (1, 2) for number in range(11)]
    full = dict.fromkeys(parts, bytes(PART_BLOCKS * BLOCK))
    with board(files=modules("esp32") | full) as device:
        free = "print(flash_ring.free_bytes('/'), recorder.keeper.needed)"
        before, needed = map(int, device.exec(FEED + "from kickstand.rides import flash_ring\n" + free).split())
        device.exec("recorder.start(Chip(), Calibration())\nfeed(2)\nrecorder.stop()", 30.0)
        files = device.files()
    gone = [path for path in parts if path not in files]
    short = needed - (before - 2 * BLOCK)  # bytes that must be freed after the ride has created its directory
    assert short > 0
    assert gone == parts[: math.ceil(short / (PART_BLOCKS * BLOCK))]
    assert FILES.items() <= files.items()
    assert [block.sequence for block in rides({"rides/3": files[part_path("rides", 3, 0)]})[3]] == [0, 1]


_MINUTES = 10
_HEAP = """
import gc
from time import ticks_add, ticks_diff, ticks_ms
from kickstand import app, devices, settings
class Config:
    RECORD = True
    SPEED = "wheel"
    WATCHDOG = False
class Measured(app.App):
    due_ms, left = ticks_add(ticks_ms(), 15000), 4 * MINUTES
    def turn(self):
        app.App.turn(self)
        if ticks_diff(ticks_ms(), self.due_ms) >= 0:
            gc.collect()
            print(gc.mem_alloc())
            if not self.left:
                raise KeyboardInterrupt
            self.due_ms, self.left = ticks_add(self.due_ms, 15000), self.left - 1
chosen = settings.Settings(Config)
try:
    Measured(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen)).run()
except KeyboardInterrupt:
    pass
"""


@pytest.mark.nightly
def test_the_heap_does_not_grow():
    """The ride has minutes of bends and is recorded with a wheel's speed."""
    ride = Ride([wait(2.0), accelerate(15.0, 3.0)] + [turn(-30.0, 3.0), turn(35.0, 3.0)] * 10 * _MINUTES)
    with board(world=PART.world(ride.motion), files=modules("esp32")) as device:
        device.fit_wheel(lambda t_s: ride.truth(t_s)[1])
        heap = [*map(int, device.exec(_HEAP.replace("MINUTES", str(_MINUTES)), 60.0 * _MINUTES + 30.0).split())]
    print("bytes of heap in use every 15 s:", heap)
    assert len(heap) == 4 * _MINUTES + 1
    assert max(heap) - heap[0] < 2000
