"""The whole device on the emulated boards, with MicroPython's own image, file system, floats and drivers.

host_tests/device has all other faults, on the simulated board.
"""

import re
from typing import Any

import pytest
from kickstand_emulator.bench import SampleCount
from kickstand_sim.simulated_board.lcd import shown_lean
from kickstand_sim.simulation.scripted.script import Ride, kickstand, upright
from kickstand_sim.simulation.scripted.sensor_errors import Sensor
from support import device_runs
from support.emulated import CHIPS, calibrated, firmware, leaning, reset_in_a_read, shows

pytestmark = pytest.mark.chip

LEAN_DEG, NEAR_DEG = 20.0, 2.0
SENSOR = 0x68
RECOVERY_S, FAULT_S = 0.5, 0.6
ESP32 = pytest.param("esp32", marks=[pytest.mark.esp32, pytest.mark.long])
SIDES = [[1, 0, 0], [0, 0, -1], [0, 1, 0], [-1, 0, 0], [0, 0, 1], [0, -1, 0], [0.5, 0.6, -0.7]]


@pytest.mark.parametrize("chip", ["pico", ESP32])
def test_two_presses_align_a_new_board_for_good(chip):
    """The main job: two presses, the power off and on, then the lean of a bend."""
    ride = Ride([kickstand(5.5), upright(5.5), upright(1e6, lean_deg=LEAN_DEG)])
    part = Sensor(seed=1, share=0.1)  # a tenth of the usual errors, because no calibration corrects them
    device = CHIPS[chip](part.world(ride.motion), firmware(chip))
    device.power_on()
    shows(device, r"Raw.*\|(Not aligned|On stand: press)", 3.0)
    samples = SampleCount(device.board.sensor)
    samples.begin()
    device.press()
    shows(device, r"Now upright: ", 4.5)
    device.run_until(lambda: ride.truth(device.time_s)[3] == "upright", 4.0)
    device.press()
    tilt = shows(device, r"Aligned! +(\d+\.\d)°", 4.5)
    assert 11.0 < float(tilt[1]) < 13.0
    assert {"kickstand_a.cal", "kickstand_b.cal"} & set(device.files())
    device.run(0.2)
    assert samples.taken() > 1000
    assert samples.lost() == 0, "during poses or flash writes"

    device.power_off()
    device.run_until(lambda: ride.truth(device.time_s)[0] > LEAN_DEG - 1.0, 10.0)
    device.power_on()
    device.run_until(lambda: shown_lean(device.lcd()) is not None, 3.0)
    assert abs((shown_lean(device.lcd()) or 0.0) - LEAN_DEG) < 3.0
    device.power_off()


@pytest.mark.long
@pytest.mark.parametrize("chip", [ESP32])
def test_six_positions_are_saved(chip):
    """Six sides and a slanted pose, begun from the menu by the button."""
    steps = [[0, None]]
    for i, up in enumerate(SIDES):
        steps += [[8.0 + 6.0 * i, up], [13.0 + 6.0 * i, None]]
    world = device_runs.poses_of(3, steps)
    with CHIPS[chip](lambda t_s: tuple(world(t_s)), firmware(chip)) as device:
        for at_s, for_s in ((4, 1.2), (6, 0.15), (7, 1.2)):
            device.press(at_s, for_s)
        shows(device, "any of the six", 9.0)
        shows(device, r"Side \+x done", 8.0)
        shows(device, "Saved, err", 50.0)
        assert {"kickstand_a.cal", "kickstand_b.cal"} & set(device.files())


def lean_is_right(device):
    lean_deg = shown_lean(device.lcd())
    return lean_deg is not None and abs(lean_deg - LEAN_DEG) <= NEAR_DEG


def watch(device, seconds):
    """Advance the time and return every text of the display. Fail if the display shows a wrong lean."""
    texts = set()
    for _ in range(round(seconds / 0.02)):
        device.run(0.02)
        texts.add("|".join(device.lcd()))
        assert shown_lean(device.lcd()) is None or lean_is_right(device), device.lcd()
    return texts


def shows_the_lean_again(device):
    """Erase the display, as a reset does. The correct lean must appear again."""
    device.board.lcd.power_on()
    device.run_until(lambda: lean_is_right(device), 4.0)


INJECT = {
    "EIO": lambda faults, at_s: faults.nack_for(SENSOR, at_s, FAULT_S),
    "ETIMEDOUT": lambda faults, at_s: faults.timeout_for(SENSOR, at_s, FAULT_S),
    "SDA held": lambda faults, at_s: faults.stuck_sda(at_s),
}
FAULTS = [("pico", "EIO"), *(pytest.param("pico", fault, marks=pytest.mark.long) for fault in [*INJECT][1:])]
FAULTS += [pytest.param("esp32", fault, marks=[pytest.mark.esp32, pytest.mark.long]) for fault in INJECT]


@pytest.mark.parametrize(("riding", "fault"), FAULTS, indirect=["riding"])
def test_bus_errors_are_shown_while_they_last(riding, fault):
    INJECT[fault](riding.board.faults, riding.time_s + 0.01)
    texts = watch(riding, 0.01 + FAULT_S + RECOVERY_S)
    assert lean_is_right(riding), riding.lcd()
    named = any(re.search(r"No sensor|Sensor lost|Sensor silent", text) for text in texts)
    assert named or fault == "SDA held", texts  # a brief fault may begin and end between two reads of the display


@pytest.mark.long
@pytest.mark.parametrize("riding", ["pico"], indirect=True)
def test_stalled_processor_keeps_the_lean_right(riding):
    """The erase of a flash block stalls the processor for 45 ms and loses no sample. A stall of seconds overflows the
    FIFO: the lost samples are counted, and the lean stays correct."""
    samples = SampleCount(riding.board.sensor)
    samples.begin()
    for stall_s in (0.045, 0.3):
        riding.stall(stall_s)
        watch(riding, 0.3)
    assert samples.taken() > 150
    assert samples.lost() == 0
    for stall_s in (0.45, 2.0):  # the lean filter can bridge the first stall, but not the second
        riding.stall(stall_s)
        texts = watch(riding, RECOVERY_S)
        assert lean_is_right(riding), riding.lcd()
        assert not [text for text in texts if "Sensor" in text]
    assert samples.lost() > 200


@pytest.mark.long
@pytest.mark.parametrize("riding", ["pico", ESP32], indirect=True)
def test_watchdog_restarts_a_hung_program(riding):
    """The watchdog resets the board within 8.4 s; an ESP32 needs a second more, because it prints the reason."""
    riding.exec("from time import sleep\nfrom kickstand.board import port")
    riding.send(b"port.start_watchdog()\nwhile True: sleep(10)\x04")
    resets = riding.resets
    riding.run_until(lambda: riding.resets > resets, 9.5, 0.01)
    shows_the_lean_again(riding)


@pytest.mark.long
@pytest.mark.parametrize("riding", ["pico", ESP32], indirect=True)
def test_reset_during_a_read_frees_the_bus(riding):
    """The sensor holds SDA until the restarted firmware clocks it free."""
    resets = riding.resets
    reset_in_a_read(riding, riding.time_s + 0.01)
    riding.run(0.05)
    assert riding.resets == resets + 1
    assert riding.board.sensor_bus.sda_level() == 0
    shows_the_lean_again(riding)


@pytest.mark.long
@pytest.mark.parametrize("chip", ["pico", ESP32])
def test_oled_shows_the_lean_in_large_digits(chip):
    """The boards use MicroPython's own framebuf. A Pico has hardware I2C; an ESP32 drives the pins in software."""
    with CHIPS[chip](leaning(LEAN_DEG), firmware(chip) | calibrated(), display="ssd1306") as device:
        device.run_until(lambda: shown_lean(device.lcd()) == LEAN_DEG, 3.0)
        oled: Any = device.board.lcd
        assert oled.unknown == 0 and not device.board.too_fast


@pytest.mark.esp32
@pytest.mark.long
def test_esp32_has_safe_mode_and_refuses_pins_of_its_flash():
    """A pin that the chip needs for its flash would crash the board at each start."""
    files = firmware("esp32") | calibrated() | {"/config.py": b"SENSOR_SDA = 6\n"}
    with CHIPS["esp32"](leaning(LEAN_DEG), files) as device:
        shows(device, r"SENSOR_SDA", 4.0)
        assert device.resets == 0
        device.power_off()
        device.put_files(firmware("esp32"))
        device.board.button.turn(True, device.board.clock.now_us)
        device.run(0.1)
        device.power_on()
        device.run_until(lambda: b"safe mode" in device.said, 4.0)
