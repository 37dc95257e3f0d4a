"""Each fault of the fault script on the emulated Pico: it is shown while it lasts, no wrong lean is, and the right one
soon returns."""

import re

import pytest
from emulated import calibrated, firmware, leaning, pico, reset_in_a_read, shown_lean, shows
from kickstand_workshop.bench.sample_count import SampleCount

pytestmark = pytest.mark.chip

LEAN_DEG = 20.0
NEAR_DEG = 2.0
SENSOR = 0x68
RECOVERY_S = 0.5
DIP_S = 0.1  # the supply is back, and the sensor answers
LCD_PROBE_S = 1.5  # a missing display is looked for every 0.2 s, its bus freed every second
LCD_INIT_S = 11.0  # one that is there is initialised every 10 s
NO_SENSOR = r"No sensor|Sensor lost|Sensor silent"
START_AGAIN = r"Sensor (reset|frozen|silent|lost)"

# Name: what happens at_s for for_s, how long, what the display says meanwhile (None: nothing special)
FAULTS = {
    "single NACK": (lambda f, at, s: f.nack(SENSOR), 0.0, None),
    "no ACK": (lambda f, at, s: f.nack_for(SENSOR, at, s), 0.6, NO_SENSOR),
    "time-outs": (lambda f, at, s: f.timeout_for(SENSOR, at, s), 0.6, NO_SENSOR),
    "stuck SDA": (lambda f, at, s: f.stuck_sda(at), 0.0, None),
    "unplugged": (lambda f, at, s: f.unplug_sensor(at, s), 0.6, NO_SENSOR),
    "supply dip, asleep": (lambda f, at, s: f.supply_dip(at, "asleep"), DIP_S, START_AGAIN),
    "supply dip, frozen": (lambda f, at, s: f.supply_dip(at, "frozen"), DIP_S, START_AGAIN),
    "supply dip, other ranges": (lambda f, at, s: f.supply_dip(at, "default_ranges"), DIP_S, START_AGAIN),
    "frozen data": (lambda f, at, s: f.freeze(at, s), 0.6, START_AGAIN),
    "all zero": (lambda f, at, s: f.all_zero(at, s), 0.6, START_AGAIN),
    "all ones": (lambda f, at, s: f.all_ones(at, s), 0.6, START_AGAIN),
    "a bit slipped": (lambda f, at, s: f.bit_slip(SENSOR), 0.0, None),
}


@pytest.fixture(scope="module")
def device():
    """A calibrated board on a bike that leans to the right."""
    emulated = pico(leaning(LEAN_DEG), firmware() | calibrated())
    emulated.power_on()
    yield emulated
    emulated.power_off()


def lean_is_right(device):
    """The display shows a lean, and it is the bike's."""
    shown = shown_lean(device.lcd())
    return shown is not None and abs(shown - LEAN_DEG) <= NEAR_DEG


def watch(device, seconds):
    """Let time pass. Returns every text of the display; fails if one shows a wrong lean."""
    texts = set()
    for _ in range(round(seconds / 0.02)):
        device.run(0.02)
        texts.add("|".join(device.lcd()))
        shown = shown_lean(device.lcd())
        assert shown is None or abs(shown - LEAN_DEG) <= NEAR_DEG, device.lcd()
    return texts


def starts_again(device):
    """After a reset: on a display that has lost what it showed, the right lean comes back."""
    device.board.lcd.power_on()
    device.run_until(lambda: lean_is_right(device), 2.0)


@pytest.mark.parametrize("name", FAULTS)
def test_fault_of_the_sensor(device, name):
    """It is shown while it lasts. RECOVERY_S after its end the right lean is back and stays. No other was shown."""
    device.run_until(lambda: lean_is_right(device), 3.0)
    inject, for_s, said = FAULTS[name]
    inject(device.board.faults, device.time_s + 0.01, for_s)
    texts = watch(device, 0.01 + for_s + RECOVERY_S)
    assert lean_is_right(device), device.lcd()
    watch(device, 0.1)
    assert lean_is_right(device), device.lcd()
    if said:
        assert any(re.search(said, text) for text in texts), texts


@pytest.mark.parametrize("for_s", [0.02, 0.4])
def test_lcd_unplugged_and_back(device, for_s):
    """The loop goes on. The display is found again, or found to have lost its settings."""
    device.run_until(lambda: lean_is_right(device), 3.0)
    device.board.faults.unplug_lcd(device.time_s + 0.01, for_s)
    device.run(for_s)
    assert device.lcd() == [" " * 16] * 2
    device.run_until(lambda: lean_is_right(device), LCD_PROBE_S)


def test_lcd_out_of_step_is_readable_again(device):
    """A spike on E: what is written next is garbled, at most until the next initialisation."""
    device.stall(7.0)  # most of the time to the next initialisation
    device.run(1.0)
    device.run_until(lambda: lean_is_right(device), 3.0)
    device.board.faults.lcd_slip(device.time_s + 0.01)
    device.press(device.time_s + 0.05)
    device.run(0.5)
    assert not device.lcd()[0].startswith("Max left")
    shows(device, r"^Max left .*\|Max right ", LCD_INIT_S)
    while not lean_is_right(device):
        device.press()
        device.run(0.5)


def sensor_info(device):
    """The second line of that page while it counts gaps and starts; back to the lean after it. While the menu
    that was just opened loads its parts, a press of 0.1 s may pass unseen."""
    for press_s, after_s in ((0.85, 0.6), (0.1, 0.2), (0.1, 0.2), (0.1, 0.2), (0.85, 0.1)):
        device.press(for_s=press_s)
        device.run(press_s + after_s)
    found = shows(device, r"\d+ gaps \d+ starts", 4.5)[0]
    device.press()
    device.run_until(lambda: lean_is_right(device), 1.0)
    return found


@pytest.mark.parametrize("who_am_i", [0x68, 0x70], ids=["1024 bytes", "512 bytes"])
def test_a_stalled_processor(who_am_i):
    """45 ms, as a flash erase takes with interrupts off, and more lose no sample. Seconds overflow any FIFO: that is
    counted, the sensor is not restarted, and the lean stays right."""
    with pico(leaning(LEAN_DEG), firmware() | calibrated(who_am_i), who_am_i=who_am_i) as device:
        device.run_until(lambda: lean_is_right(device), 2.0)
        samples = SampleCount(device.board.sensor)
        samples.begin()
        for stall_s in (0.045, 0.15, 0.3 if who_am_i == 0x68 else 0.15):
            device.stall(stall_s)
            watch(device, 0.3)
        assert samples.taken() > 200
        assert samples.lost() == 0
        for stall_s in (0.45, 2.0):  # shorter and longer than what the filter bridges
            device.stall(stall_s)
            texts = watch(device, RECOVERY_S)
            assert lean_is_right(device), device.lcd()
            assert not [text for text in texts if "Sensor" in text]
        assert samples.lost() > 200
        assert sensor_info(device) == "2 gaps 2 starts"  # 2 s without a reading begin anew


def test_a_hung_program_is_restarted_by_the_watchdog(device):
    """Within 8.4 s; and then the lean is there again."""
    device.run_until(lambda: lean_is_right(device), 3.0)
    before = device.chip.resets
    device.exec("from time import sleep\nfrom kickstand.board import port")
    device.console.send(b"port.start_watchdog()\nwhile True: sleep(10)\x04")
    device.run_until(lambda: device.chip.resets > before, 8.5, 0.01)
    starts_again(device)


def test_a_reset_in_mid_read_frees_the_bus(device):
    """The sensor holds SDA; the restarted firmware clocks it free."""
    device.run_until(lambda: lean_is_right(device), 3.0)
    before = device.chip.resets
    reset_in_a_read(device, device.time_s + 0.01)
    device.run(0.05)
    assert device.chip.resets == before + 1
    assert device.board.sensor_bus.sda_level() == 0
    starts_again(device)


@pytest.mark.parametrize("spoil", [b"", b"\xff" * 90, b"KSTD" + bytes(86)], ids=["empty", "erased", "zeros"])
def test_corrupt_files(spoil):
    """With both spoilt it runs uncalibrated; with one spoilt the other is used."""
    good = calibrated()
    names = sorted(good)
    both = {"kickstand_a.cal": spoil, "kickstand_b.cal": spoil}
    device = pico(leaning(LEAN_DEG), firmware() | both)
    device.power_on()
    shows(device, r"Raw", 2.0)
    device.power_off()
    device.put_files(firmware() | both | {names[0]: good[names[0]]})
    device.power_on()
    device.run_until(lambda: lean_is_right(device), 2.0)
