"""The limits of `kickstand check`, from the data sheets of the MPU6050, and the figures in its messages."""

import pytest
from kickstand_tools.deploy import check_limits as limits
from kickstand_tools.deploy.check_limits import BAD, GOOD, LOOK


def finding(findings, what):
    """Return the verdict and words of the finding with this name."""
    (match,) = [finding for finding in findings if finding.what == what]
    return match.verdict, match.words


def at_rest(force=(0.0, 0.0, 1.0), rate=(0.0, 0.0, 0.0), noise_g=0.005, noise_dps=(0.05,) * 3, dlpf=3, **other):
    """Return the findings for a sensor at rest. The sensor has 4096 counts per g and 65.5 counts per deg/s."""
    means = [4096 * value for value in force] + [0.0] + [65.5 * value for value in rate]
    spreads = [4096 * noise_g] * 3 + [0.0] + [65.5 * value for value in noise_dps]
    samples, changes = other.get("samples", 1000), other.get("changes", (900,) * 7)
    temperature_c, overflows = other.get("temperature_c", 25.0), other.get("overflows", 0)
    return limits.noise(samples, tuple(means), tuple(spreads), changes, 4096, 65.5, temperature_c, overflows, dlpf)


@pytest.mark.parametrize(
    ("sensor", "what", "verdict", "words"),
    [
        ({}, "noise, accelerometer x", GOOD, "5.0 mg (data sheet 3.3, limit 10.0)"),
        ({}, "noise, gyro z", GOOD, "0.050 deg/s (data sheet 0.041, limit 0.123)"),
        ({}, "bias, accelerometer", GOOD, "1.000 g at rest (limit 1 +- 0.2)"),
        ({"noise_g": 0.0099}, "noise, accelerometer z", GOOD, ""),
        ({"noise_g": 0.0101}, "noise, accelerometer z", BAD, ": this axis is faulty, or it vibrates"),
        ({"noise_dps": (0.125,) * 3}, "noise, gyro x", BAD, ""),
        ({"noise_dps": (3.1, 3.1, 0.05)}, "noise, gyro x", LOOK, "it was moved, repeat with the sensor at rest"),
        ({"changes": (19, *[900] * 6)}, "noise, accelerometer x", BAD, "this axis is dead or in standby"),
        ({"changes": (900, 900, 900, 0, 900, 900, 19)}, "noise, gyro z", BAD, ""),  # the fourth is the temperature
        ({"rate": (0.0, 22.0, 0.0)}, "bias, gyro y", LOOK, "+22.00 deg/s (data sheet 20, limit 40): beyond"),
        ({"rate": (0.0, 40.1, 0.0)}, "bias, gyro y", BAD, ""),
        ({"force": (0.0, 0.0, 0.79)}, "bias, accelerometer", LOOK, ": do the six positions"),
        ({"force": (0.0, 0.0, 0.49)}, "bias, accelerometer", BAD, "0.490 g at rest (limit 1 +- 0.2)"),
        ({"force": (0.0, -1.51, 0.0)}, "bias, accelerometer y", BAD, "-1.51 g at rest"),
        ({"temperature_c": 60.1}, "temperature", LOOK, "60.1 C (limits -10 and 60): a chip at room temperature"),
        ({"temperature_c": 85.1}, "temperature", BAD, ""),
        ({"overflows": 1}, "readings", LOOK, "1 overflows of the FIFO while they were read"),
        ({"samples": 19}, "readings", BAD, "19 samples came: the FIFO or the chip has stopped"),
    ],
)
def test_sensor_at_rest(sensor, what, verdict, words):
    findings = at_rest(**sensor)
    assert finding(findings, what)[0] == verdict and words in finding(findings, what)[1]
    assert sensor or {one.verdict for one in findings} == {GOOD}


SENSOR = ("MPU6050", 0x68, 0x68, 0x68, "", 0)
NOT_MEASURED = "not measured: %d samples, %d overflows, %d failed transfers"


@pytest.mark.parametrize(
    ("judge", "values", "what", "verdict", "words"),
    [
        ("clock", (2000, 10**7, 200, 0, 0), "sample clock", GOOD, "200.00 samples per second, +0.00 % off 200 (limit"),
        ("clock", (1969, 10**7, 200, 0, 0), "sample clock", LOOK, "196.90 samples per second, -1.55 % off 200"),
        ("clock", (2401, 10**7, 200, 0, 0), "sample clock", BAD, "240.10 samples per second, +20.05 %"),
        ("clock", (2000, 10**7, 200, 0, 2), "sample clock", BAD, NOT_MEASURED % (2000, 0, 2)),
        ("button", (False, True, True, 120, 61, 15), "button", LOOK, "pressed and released on GPIO 15; it bounces: 61"),
        ("button", (True, True, False, 0, 0, 15), "button", BAD, "GPIO 15 is low all the time: the button is stuck"),
        ("button", (False, False, False, 0, 0, 15), "button", BAD, "no press on GPIO 15: press it when asked to"),
        ("button", (False, True, False, 0, 0, 15), "button", BAD, "pressed on GPIO 15, but not released"),
        ("i2c", (10_000, 0, 0, 4_000_000), "I2C errors", GOOD, "0 errors and 0 wrong answers in 10000 transfers (limi"),
        ("i2c", (10_000, 11, 0, 0), "I2C errors", BAD, "11 errors"),
        ("i2c", (10_000, 0, 1, 0), "I2C errors", BAD, "0 errors and 1 wrong answers"),
        # the FIFO may lose a tenth and two frames
        ("fifo", ("", 1024, 365, 872, 1000, True, 5), "FIFO under load", GOOD, "872 of 1000 bytes after 292 ms witho"),
        ("fifo", ("", 1024, 365, 871, 1000, True, 5), "FIFO under load", BAD, "871 of 1000 bytes after 292 ms"),
        ("fifo", ("", 1024, 365, 1000, 1000, False, 5), "FIFO under load", LOOK, "1000 of 1000 bytes"),
        ("fifo", ("stays empty", 0, 0, 0, 0, True, 1), "FIFO", BAD, "it stays empty, though the chip measures"),
        ("flash", ((30, 365), 0, 64, "", 365), "flash", GOOD, "writing a block of 4 KB takes at most 365 ms (limit 3"),
        ("flash", ((366,), 0, 64, "", 365), "flash", BAD, "writing a block of 4 KB takes at most 366 ms"),
        ("flash", ((5,), 0, 63, "", 365), "room in flash", LOOK, "63 KB free (limit 64): pull and remove rides"),
        ("flash", ((5, 6), 1, 64, "", 365), "flash", BAD, "1 of 2 blocks read back differently: it is worn out"),
        ("flash", ((), 0, 64, "full", 365), "flash", BAD, "cannot be written: full"),
        ("display", (0x27, False, 9, 9, ""), "display", GOOD, "LCD at 0x27, acknowledged in 9 of 9 texts"),
        ("display", (0x3C, True, 8, 9, ""), "display", BAD, "OLED at 0x3c, acknowledged in 8 of 9 texts: check its w"),
        ("display", (0, False, 0, 9, "no wire"), "display", BAD, "none answers: no wire"),
        ("speed", ("GPS", "silent", 0.0), "speed source", BAD, "GPS: silent"),
        ("sensor", SENSOR, "sensor", GOOD, "MPU6050 (0x68) at 0x68"),
        ("sensor", ("", 0, 0, 0x68, "no answer", 0), "sensor", BAD, "no answer"),
        ("sensor", (*SENSOR[:2], 0x68, 0x69, "", 0), "sensor", GOOD, "MPU6050 (0x68) at 0x68 (AD0; SENSOR_ADDRESS is"),
        ("sensor", (*SENSOR[:5], 8), "sensor", BAD, "MPU6050 (0x68) at 0x68: axes are in standby (PWR_MGMT_2 reads 0"),
        ("board", ("1", "Pico", "1.24", "own", ""), "board", GOOD, "Pico, MicroPython 1.24, Kickstand 1; own"),
        ("board", ("1", "Pico", "1.24", "own", ""), "machine code", GOOD, "used"),
        ("board", ("1", "Pico", "1.24", "own", "x.py"), "machine code", LOOK, "not used for x.py: slower code runs i"),
    ],
)  # fmt: skip
def test_limit_of_each_measurement(judge, values, what, verdict, words):
    observed = finding(limits.JUDGES[judge](*values), what)
    assert observed[0] == verdict and observed[1].startswith(words)
