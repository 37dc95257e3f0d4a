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
