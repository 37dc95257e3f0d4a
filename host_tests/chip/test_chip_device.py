"""The whole device on the emulated boards, with MicroPython's own image, file system, floats and drivers. The faults in
this file concern I2C, the FIFO's backlog, the watchdog and resets. The tests in host_tests/device cover all other
faults."""

import re
from typing import Any

import pytest
from kickstand_tools.simulated_board.lcd import shown_lean
from kickstand_tools.simulation.scripted.script import Ride, kickstand, upright
from kickstand_tools.simulation.scripted.sensor_errors import Sensor
from kickstand_workshop.bench.sample_count import SampleCount
from support.emulated import CHIPS, calibrated, firmware, leaning, reset_in_a_read, shows

pytestmark = pytest.mark.chip

LEAN_DEG = 20.0
NEAR_DEG = 2.0
SENSOR = 0x68
RECOVERY_S = 0.5
FAULT_S = 0.6
# The ESP32 is tested only in the nightly run
ON_A_PICO = ["pico", pytest.param("esp32", marks=[pytest.mark.esp32, pytest.mark.nightly])]


@pytest.mark.nightly  # takes minutes; the tests in host_tests/device do the same steps on MicroPython for Linux
@pytest.mark.long
@pytest.mark.parametrize("chip", ["pico", pytest.param("esp32", marks=pytest.mark.esp32)])
def test_two_presses_align_a_new_board_for_good(chip):
    """The sensor is not calibrated. After the pose on the kickstand and the upright pose, the power is switched off and
    on. After power-on the display shows the lean of the bike."""
    ride = Ride([kickstand(5.5), upright(5.5), upright(1e6, lean_deg=LEAN_DEG)])
    # a tenth of the usual sensor errors, because no calibration corrects them in this test
    part = Sensor(seed=1, share=0.1)
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
    assert samples.lost() == 0  # no sample was lost, even during the poses and the flash writes

    device.power_off()
    device.run_until(lambda: ride.truth(device.time_s)[0] > LEAN_DEG - 1.0, 10.0)
    device.power_on()
    device.run_until(lambda: shown_lean(device.lcd()) is not None, 3.0)
    assert abs((shown_lean(device.lcd()) or 0.0) - LEAN_DEG) < 3.0
    device.power_off()


def lean_is_right(device):
    """Return True if the display shows a lean and this lean is correct."""
    shown = shown_lean(device.lcd())
    return shown is not None and abs(shown - LEAN_DEG) <= NEAR_DEG


def watch(device, seconds):
    """Advance the time and return every text of the display. Fail if the display shows a wrong lean."""
    texts = set()
    for _ in range(round(seconds / 0.02)):
        device.run(0.02)
        texts.add("|".join(device.lcd()))
        shown = shown_lean(device.lcd())
        assert shown is None or abs(shown - LEAN_DEG) <= NEAR_DEG, device.lcd()
    return texts


def starts_again(device):
    """Erase the display's content, as a reset does. The correct lean must appear again."""
    device.board.lcd.power_on()
    device.run_until(lambda: lean_is_right(device), 4.0)


INJECT = {
    "EIO": lambda faults, at_s: faults.nack_for(SENSOR, at_s, FAULT_S),
    "ETIMEDOUT": lambda faults, at_s: faults.timeout_for(SENSOR, at_s, FAULT_S),
    "SDA held": lambda faults, at_s: faults.stuck_sda(at_s),
}


@pytest.mark.parametrize(
    ("riding", "fault"),
    [
        ("pico", "EIO"),
        ("pico", "SDA held"),
        pytest.param("pico", "ETIMEDOUT", marks=pytest.mark.nightly),
        pytest.param("esp32", "EIO", marks=pytest.mark.esp32),
        *(pytest.param("esp32", fault, marks=[pytest.mark.esp32, pytest.mark.nightly]) for fault in [*INJECT][1:]),
    ],
    indirect=["riding"],
)
def test_bus_errors_are_shown_while_they_last(riding, fault):
    """A brief fault may begin and end between two reads of the display."""
    INJECT[fault](riding.board.faults, riding.time_s + 0.01)
    texts = watch(riding, 0.01 + FAULT_S + RECOVERY_S)
    assert lean_is_right(riding), riding.lcd()
    said = any(re.search(r"No sensor|Sensor lost|Sensor silent", text) for text in texts)
    assert said or fault == "SDA held", texts


@pytest.mark.parametrize("riding", ["pico"], indirect=True)
def test_stalled_processor_keeps_the_lean_right(riding):
    """A stall of 45 ms loses no sample. The erase of a flash block takes 45 ms, during which interrupts are off. A
    stall of seconds overflows the FIFO. The firmware then counts the lost samples, does not restart the sensor, and the
    lean stays correct."""
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


@pytest.mark.parametrize("riding", ON_A_PICO, indirect=True)
def test_watchdog_restarts_a_hung_program(riding):
    """The watchdog resets the board within 8.4 s. An ESP32 needs a second more, because it prints the reason. After the
    reset the display shows the lean again."""
    riding.exec("from time import sleep\nfrom kickstand.board import port")
    riding.send(b"port.start_watchdog()\nwhile True: sleep(10)\x04")
    resets = riding.resets
    riding.run_until(lambda: riding.resets > resets, 9.5, 0.01)
    starts_again(riding)


@pytest.mark.parametrize("riding", ON_A_PICO, indirect=True)
def test_reset_during_a_read_frees_the_bus(riding):
    """The sensor holds SDA until the restarted firmware clocks it free."""
    resets = riding.resets
    reset_in_a_read(riding, riding.time_s + 0.01)
    riding.run(0.05)
    assert riding.resets == resets + 1
    assert riding.board.sensor_bus.sda_level() == 0
    starts_again(riding)


@pytest.mark.parametrize(
    ("chip", "display"),
    [
        ("pico", "ssd1306"),
        pytest.param("esp32", "ssd1306", marks=[pytest.mark.esp32, pytest.mark.nightly]),
    ],
)
def test_oled_is_found_and_shows_the_lean_in_large_digits(chip, display):
    """The boards use MicroPython's own framebuf. A Pico has hardware I2C, and an ESP32 drives the pins in software."""
    with CHIPS[chip](leaning(LEAN_DEG), firmware(chip) | calibrated(), display=display) as device:
        device.run_until(lambda: shown_lean(device.lcd()) == LEAN_DEG, 3.0)
        oled: Any = device.board.lcd
        assert oled.unknown == 0 and not device.board.too_fast
