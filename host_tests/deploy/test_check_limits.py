"""Each limit of `kickstand check` is tested with values slightly below and above it. The figures in its messages are
tested too."""

import pytest
from kickstand_tools.deploy import check_limits as limits
from kickstand_tools.deploy.check_limits import BAD, GOOD, LOOK, SKIPPED


def one(findings, what):
    """Return the verdict and words of the finding with this name."""
    (found,) = [found for found in findings if found.what == what]
    return found.verdict, found.words


def verdicts(findings):
    return {found.what: found.verdict for found in findings}


@pytest.mark.parametrize(
    ("samples", "verdict", "words"),
    [
        (2000, GOOD, "200.00 samples per second, +0.00 % off 200 (limit 1.5 %)"),
        (2029, GOOD, "202.90 samples per second, +1.45 % off 200 (limit 1.5 %)"),
        (2031, LOOK, "203.10 samples per second, +1.55 % off 200 (limit 1.5 %): a clone, or a faulty chip"),
        (1969, LOOK, "196.90 samples per second, -1.55 % off 200 (limit 1.5 %): a clone, or a faulty chip"),
        (2399, LOOK, "239.90 samples per second, +19.95 % off 200 (limit 1.5 %): a clone, or a faulty chip"),
        (2401, BAD, "240.10 samples per second, +20.05 % off 200 (limit 1.5 %): a clone, or a faulty chip"),
        (0, BAD, "not measured: 0 samples, 0 overflows, 0 failed transfers"),
    ],
)
def test_the_sample_clock_in_percent(samples, verdict, words):
    assert one(limits.clock(samples, 10_000_000, 200, 0, 0), "sample clock") == (verdict, words)


@pytest.mark.parametrize(("overflows", "errors"), [(1, 0), (0, 2)])
def test_a_clock_with_losses_is_not_measured(overflows, errors):
    verdict, words = one(limits.clock(2000, 10_000_000, 200, overflows, errors), "sample clock")
    assert (verdict, words) == (BAD, f"not measured: 2000 samples, {overflows} overflows, {errors} failed transfers")


def rested(force=(0.0, 0.0, 1.0), rate=(0.0, 0.0, 0.0), noise_g=0.005, noise_dps=(0.05,) * 3, **other):
    """Return the findings for a sensor at rest. The sensor has 4096 counts per g and 65.5 counts per deg/s."""
    means = [4096 * value for value in force] + [0.0] + [65.5 * value for value in rate]
    spreads = [4096 * noise_g] * 3 + [0.0] + [65.5 * value for value in noise_dps]
    given = {"samples": 1000, "changes": (900,) * 7, "temperature_c": 25.0, "overflows": 0} | other
    return limits.noise(
        given["samples"],
        tuple(means),
        tuple(spreads),
        given["changes"],
        4096,
        65.5,
        given["temperature_c"],
        given["overflows"],
        dlpf=3,
    )


def test_a_sound_sensor_at_rest_is_good():
    """The messages contain the noise by the data sheet, which is computed from its noise density and the bandwidth. The
    rounding to counts is another noise, of a third of a count. The squares of both noises are added.

    * Accelerometer: 0.0004 g times the root of 1.57 x 44 Hz is 3.325 mg, with the rounding 3.326 mg.
    * Gyro: 0.005 deg/s times the root of 1.57 x 42 Hz is 0.0406 deg/s, with the rounding 0.0409 deg/s.
    """
    found = rested()
    assert set(verdicts(found).values()) == {GOOD}
    assert one(found, "noise, accelerometer x")[1] == "5.0 mg (data sheet 3.3, limit 10.0)"
    assert one(found, "noise, gyro z")[1] == "0.050 deg/s (data sheet 0.041, limit 0.123)"
    assert one(found, "bias, accelerometer")[1] == "1.000 g at rest (limit 1 +- 0.2)"


@pytest.mark.parametrize(
    ("given", "what", "verdict"),
    [
        ({"noise_g": 0.0099}, "noise, accelerometer z", GOOD),
        ({"noise_g": 0.0101}, "noise, accelerometer z", BAD),
        ({"noise_dps": (0.12,) * 3}, "noise, gyro x", GOOD),
        ({"noise_dps": (0.125,) * 3}, "noise, gyro x", BAD),
        # the noise of two gyro axes is over 3 deg/s, which means that the sensor was moved
        ({"noise_dps": (3.1, 3.1, 0.05)}, "noise, gyro x", LOOK),
        ({"noise_dps": (3.1, 2.9, 0.05)}, "noise, gyro x", BAD),
        ({"changes": (19, *[900] * 6)}, "noise, accelerometer x", BAD),
        ({"changes": (20, *[900] * 6)}, "noise, accelerometer x", GOOD),
        ({"changes": (900, 900, 900, 0, 900, 900, 19)}, "noise, gyro z", BAD),  # the fourth column is the temperature
        ({"rate": (0.0, -20.9, 0.0)}, "bias, gyro y", GOOD),
        ({"rate": (0.0, -21.1, 0.0)}, "bias, gyro y", LOOK),
        ({"rate": (0.0, 39.9, 0.0)}, "bias, gyro y", LOOK),
        ({"rate": (0.0, 40.1, 0.0)}, "bias, gyro y", BAD),
        ({"force": (0.0, 0.0, 1.19)}, "bias, accelerometer", GOOD),
        ({"force": (0.0, 0.0, 0.79)}, "bias, accelerometer", LOOK),
        ({"force": (0.0, 0.0, 1.21)}, "bias, accelerometer", LOOK),
        ({"force": (0.0, 0.0, 0.51)}, "bias, accelerometer", LOOK),
        ({"force": (0.0, 0.0, 0.49)}, "bias, accelerometer", BAD),
        ({"force": (0.9, 0.9, 0.9)}, "bias, accelerometer", BAD),
        ({"force": (0.0, -1.51, 0.0)}, "bias, accelerometer y", BAD),
        ({"temperature_c": 60.0}, "temperature", GOOD),
        ({"temperature_c": 60.1}, "temperature", LOOK),
        ({"temperature_c": -10.1}, "temperature", LOOK),
        ({"temperature_c": 84.9}, "temperature", LOOK),
        ({"temperature_c": 85.1}, "temperature", BAD),
        ({"temperature_c": -39.9}, "temperature", LOOK),
        ({"temperature_c": -40.1}, "temperature", BAD),
        ({"overflows": 1}, "readings", LOOK),
        ({"samples": 19}, "readings", BAD),
        ({"samples": 20}, "temperature", GOOD),
        ({"force": (0.0, 1.49, 0.0)}, "bias, accelerometer", LOOK),
        ({"temperature_c": -10.0}, "temperature", GOOD),
    ],
)
def test_each_limit_of_a_sensor_at_rest(given, what, verdict):
    assert verdicts(rested(**given))[what] == verdict


@pytest.mark.parametrize(("off_percent", "verdict"), [(13.9, GOOD), (-13.9, GOOD), (14.1, BAD), (-14.1, BAD)])
def test_the_self_test_is_compared_with_the_factory_trim(off_percent, verdict):
    """The gyro's trim code is 1 on each axis. A code of 1 means a self-test response of 25 x 131 counts. About y the
    self-test response has the opposite sign."""
    trims = [0.0] * 3 + [3275.0, -3275.0, 3275.0]
    on = tuple(100.0 + trim * (1.0 + off_percent / 100.0) for trim in trims)
    found = limits.self_test((1, 1, 1, 0), (100.0,) * 6, on)
    assert [found[k].verdict for k in range(6)] == [SKIPPED] * 3 + [verdict] * 3
    assert found[3].words.startswith(f"{off_percent:+.1f} % off its factory trim (limit 14 %)")
    assert ("damaged" in found[3].words) is (verdict == BAD)


@pytest.mark.parametrize(
    ("given", "verdict", "words"),
    [
        ((False, True, True, 120, 4, 15), GOOD, "pressed for 120 ms and released, on GPIO 15, 4 edges"),
        ((False, True, True, 120, 61, 15), LOOK, "pressed and released on GPIO 15; it bounces: 61 edges (limit 60)"),
        ((False, True, True, 120, 60, 15), GOOD, "pressed for 120 ms and released, on GPIO 15, 60 edges"),
        ((True, True, False, 0, 0, 15), BAD, "GPIO 15 is low all the time"),
        ((False, False, False, 0, 0, 15), BAD, "no press on GPIO 15"),
        ((False, True, False, 0, 0, 15), BAD, "pressed on GPIO 15, but not released"),
    ],
)
def test_the_button(given, verdict, words):
    found = one(limits.button(*given), "button")
    assert found[0] == verdict and found[1].startswith(words)


@pytest.mark.parametrize(
    ("errors", "wrong", "verdict"), [(0, 0, GOOD), (1, 0, LOOK), (10, 0, LOOK), (11, 0, BAD), (0, 1, BAD), (1, 1, BAD)]
)
def test_errors_on_the_bus(errors, wrong, verdict):
    found, words = one(limits.i2c(10_000, errors, wrong, 4_000_000), "I2C errors")
    assert found == verdict
    assert words.startswith(f"{errors} errors and {wrong} wrong answers in 10000 transfers (limit 0), 400 us each")
    assert ("shorter wires" in words) is (verdict != GOOD)


@pytest.mark.parametrize(
    ("waiting", "noticed", "after", "verdict"),
    [(872, True, 5, GOOD), (871, True, 5, BAD), (1000, False, 5, LOOK), (1000, True, 0, BAD)],
)
def test_the_fifo_may_lose_a_tenth_and_two_frames(waiting, noticed, after, verdict):
    found = limits.fifo("", 1024, 365, waiting, 1000, noticed, after)
    assert one(found, "FIFO under load")[0] == verdict
    assert one(found, "FIFO under load")[1].startswith(f"{waiting} of 1000 bytes after 292 ms without a read")


@pytest.mark.parametrize(
    ("given", "verdict"),
    [
        ({}, (GOOD, GOOD, GOOD)),
        ({"longest_us": 99_900}, (GOOD, GOOD, GOOD)),
        ({"longest_us": 100_100}, (LOOK, GOOD, GOOD)),
        ({"longest_us": 182_400}, (LOOK, GOOD, GOOD)),
        # The longest pass takes more than half of the time in which the FIFO fills
        ({"longest_us": 182_600}, (BAD, GOOD, GOOD)),
        ({"overflows": 1}, (BAD, GOOD, GOOD)),
        ({"lost": 1}, (GOOD, LOOK, GOOD)),
        ({"restarts": 1}, (GOOD, GOOD, GOOD)),
        ({"restarts": 2}, (GOOD, BAD, GOOD)),
        ({"faults": "sensor-lost"}, (GOOD, BAD, GOOD)),
        ({"free": 16 * 1024 - 1}, (GOOD, GOOD, LOOK)),
        ({"free": 6 * 1024}, (GOOD, GOOD, LOOK)),
        ({"free": 6 * 1024 - 1}, (GOOD, GOOD, BAD)),
    ],
)
def test_the_running_lean_meter(given, verdict):
    usual = {"longest_us": 20_000, "places": 60, "overflows": 0, "lost": 0, "restarts": 0, "faults": ""}
    found = limits.loop(**(usual | {"turns": 500, "free": 16 * 1024, "lasts_ms": 365} | given))
    assert tuple(found_one.verdict for found_one in found) == verdict


@pytest.mark.parametrize(
    ("times_ms", "free_kb", "verdict"),
    [((30, 365), 64, (GOOD, GOOD)), ((366,), 64, (BAD, GOOD)), ((5,), 63, (GOOD, LOOK))],
)
def test_the_flash(times_ms, free_kb, verdict):
    found = limits.flash(times_ms, 0, free_kb, "", 365)
    assert tuple(found_one.verdict for found_one in found) == verdict
    assert one(limits.flash((5, 6), 1, 64, "", 365), "flash")[1].startswith("1 of 2 blocks read back differently")
    assert one(limits.flash((), 0, 64, "full", 365), "flash")[0] == BAD


def test_display_speed_and_sensor():
    assert one(limits.display(0x27, False, 9, 9, ""), "display") == (GOOD, "LCD at 0x27, acknowledged in 9 of 9 texts")
    assert one(limits.display(0x3C, True, 8, 9, ""), "display")[0] == BAD
    assert one(limits.display(0, False, 0, 9, "no wire"), "display")[1] == "none answers: no wire"
    assert limits.speed("", "", 0.0) == []
    assert one(limits.speed("GPS", "silent", 0.0), "speed source") == (BAD, "GPS: silent")
    assert one(limits.speed("GPS", "", -1.0), "speed source") == (GOOD, "GPS: nothing yet")
    assert one(limits.speed("GPS", "", 0.0), "speed source") == (GOOD, "GPS: 0.0 m/s")
    assert one(limits.sensor("", 0, 0, 0x68, "no answer", 0), "sensor") == (BAD, "no answer")
    assert one(limits.sensor("MPU6050", 0x68, 0x68, 0x68, "", 0), "sensor") == (GOOD, "MPU6050 (0x68) at 0x68")
    assert "SENSOR_ADDRESS is 0x68" in one(limits.sensor("MPU6050", 0x68, 0x69, 0x68, "", 0), "sensor")[1]
    assert one(limits.sensor("MPU6050", 0x68, 0x68, 0x68, "", 8), "sensor")[0] == BAD


@pytest.mark.parametrize(
    ("dlpf", "accel_mg", "gyro_dps"),
    [(1, "6.8", "0.086"), (2, "4.9", "0.062"), (3, "3.3", "0.041"), (4, "2.3", "0.028"), (5, "1.6", "0.020"),
     (6, "1.1", "0.015")],
)  # fmt: skip
def test_the_noise_by_the_data_sheet_at_each_bandwidth(dlpf, accel_mg, gyro_dps):
    """The noise density times the root of 1.57 times the bandwidth, with the rounding to 0.3 counts."""
    found = limits.noise(100, (0.0, 0.0, 4096.0) + (0.0,) * 4, (0.0,) * 7, (9,) * 7, 4096, 65.5, 25.0, 0, dlpf)
    assert one(found, "noise, accelerometer y")[1].startswith(f"0.0 mg (data sheet {accel_mg},")
    assert one(found, "noise, gyro x")[1].startswith(f"0.000 deg/s (data sheet {gyro_dps},")


def test_words_of_a_board_and_its_chip():
    assert one(limits.board("1", "Pico", "1.24", "defaults", ""), "machine code") == (GOOD, "used")
    found = limits.board("1", "Pico", "1.24", "defaults", "x.py")
    assert one(found, "board") == (GOOD, "Pico, MicroPython 1.24, Kickstand 1; defaults")
    assert one(found, "machine code") == (LOOK, "not used for x.py: slower code runs instead")
    assert one(limits.fifo("stays empty", 0, 0, 0, 0, True, 1), "FIFO")[0] == BAD
    assert one(limits.display(0x3C, True, 9, 9, ""), "display")[1].startswith("OLED at 0x3c, acknowledged in 9")
    assert one(limits.display(0, True, 0, 9, ""), "display")[1].endswith("check its wires and LCD_ADDRESSES")
    assert "PWR_MGMT_2 reads 0x08" in one(limits.sensor("MPU6050", 0x68, 0x68, 0x68, "", 8), "sensor")[1]
    high = rested(force=(0.0, 0.0, -1.6), rate=(0.0, 22.0, 0.0), temperature_c=70.0)
    assert one(high, "bias, accelerometer z") == (BAD, "-1.60 g at rest")
    assert one(high, "bias, accelerometer")[1] == "1.600 g at rest (limit 1 +- 0.2)"
    assert one(high, "bias, gyro y")[1] == "+22.00 deg/s (data sheet 20, limit 40): beyond the data sheet"
    assert one(high, "temperature")[1].startswith("70.0 C (limits -10 and 60): a chip at room temperature")
    assert one(rested(force=(0.0, 0.0, 1.3)), "bias, accelerometer")[1].endswith(": do the six positions")
    assert not [found for found in rested(force=(0.0, 0.0, 1.49)) if found.what == "bias, accelerometer z"]


def test_the_factory_trim_by_hand():
    """The accelerometer's code has three bits from its own register and two from register 0x10. Code 1 is 0.34 g, and
    code 31 is 0.92 g. The gyro's code 2 is 4.6 % more than 25 deg/s."""
    found = limits.factory_trims((0b000_00010, 0b111_00010, 0b000_00000, 0b01_11_00))
    assert found == pytest.approx([4096 * 0.34, 4096 * 0.92, 0.0, 3275 * 1.046, -3275 * 1.046, 0.0])
    found = limits.factory_trims((0b001_00000, 0, 0b000_00000, 0b00_00_10))
    assert found[:3] == pytest.approx(
        [4096 * 0.34 * (0.92 / 0.34) ** 0.1, 0.0, 4096 * 0.34 * (0.92 / 0.34) ** (1 / 30)]
    )
