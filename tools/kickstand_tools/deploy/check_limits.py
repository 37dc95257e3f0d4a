"""Judges the measurements of check_guest.py. Each finding has a figure with its limit, in words.

The limits come from three sources: the product specification PS-MPU-6000A rev 3.4 (here PS), the register map
RM-MPU-6000A rev 4.2 (here RM), and the needs of the firmware.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

GOOD, LOOK, BAD, SKIPPED = "ok", "look", "BAD", "--"
AXES = ("accelerometer x", "accelerometer y", "accelerometer z", "gyro x", "gyro y", "gyro z")

SELF_TEST_PERCENT = 14.0  # largest change from the factory trim (PS 6.1 and 6.2)
GYRO_BIAS_DPS, MOST_GYRO_BIAS_DPS = 21.0, 40.0  # PS 6.1 allows 20 deg/s at 25 C, and 20 more over temperature
FORCE_OFF_G, MOST_FORCE_OFF_G = 0.2, 0.5  # PS 6.2 allows offsets of 50, 50 and 80 mg, and a scale error of 3 %
ACCEL_NOISE_G, GYRO_NOISE_DPS = 0.0004, 0.005  # noise per square root of Hz (PS 6.1 and 6.2)
NOISE_TIMES = 3.0  # limit of the noise, as a multiple of the data sheet's noise
# Bandwidths of accelerometer and gyro, by the setting DLPF (RM p. 13)
BANDWIDTH_HZ = {1: (184, 188), 2: (94, 98), 3: (44, 42), 4: (21, 20), 5: (10, 10), 6: (5, 5)}
MOVED_DPS = 3.0  # if at least two gyro axes are noisier than this, the sensor was moved
DEAD_SHARE = 0.02  # an axis is dead if its count changes in a smaller share of the samples
CLOCK_PERCENT, MOST_CLOCK_PERCENT = 1.5, 20.0  # PS 6.6 allows 1 % with the gyro's clock. The firmware can follow 20 %
ERRORS = 10  # largest number of errors in 10,000 transfers that is still usable
BOUNCE_EDGES = 60
# Limits of the longest turn of the app's loop, in ms and as a share of the time in which the FIFO fills
TURN_MS, MOST_TURN_SHARE = 100.0, 0.5
LITTLE_HEAP_KB, LEAST_HEAP_KB = 16, 6
LITTLE_FLASH_KB = 64
TEMPERATURE_C, MOST_TEMPERATURE_C = (-10.0, 60.0), (-40.0, 85.0)  # the second range is from PS 6.4


@dataclass
class Finding:
    """The result of a test.

    what: The tested part.
    verdict: GOOD, LOOK (usable, but outside its limit), BAD or SKIPPED.
    words: The figure and its limit. If the figure is not good, also what to do.
    """

    what: str
    verdict: str
    words: str


def _advised(what: str, verdict: str, words: str, advice: str) -> Finding:
    """Return a Finding. If it is not good, the advice follows its words."""
    return Finding(what, verdict, words if verdict == GOOD else words + advice)


def board(version: str, name: str, release: str, settings: str, slow: str) -> list[Finding]:
    used = f"not used for {slow}: slower code runs instead" if slow else "used"
    return [
        Finding("board", GOOD, f"{name}, MicroPython {release}, Kickstand {version}; {settings}"),
        Finding("machine code", LOOK if slow else GOOD, used),
    ]


def button(at_first: bool, pressed: bool, released: bool, took_ms: int, edges: int, pin: int) -> list[Finding]:
    pin_name = f"GPIO {pin}"
    if at_first and not released:
        words = f"{pin_name} is low all the time: the button is stuck, or its wire touches GND"
    elif not pressed:
        words = f"no press on {pin_name}: press it when asked to; if you did, its wires or BUTTON_PIN are wrong"
    elif not released:
        words = f"pressed on {pin_name}, but not released"
    elif edges > BOUNCE_EDGES:
        words = f"pressed and released on {pin_name}; it bounces: {edges} edges (limit {BOUNCE_EDGES})"
        return [Finding("button", LOOK, words)]
    else:
        return [Finding("button", GOOD, f"pressed for {took_ms} ms and released, on {pin_name}, {edges} edges")]
    return [Finding("button", BAD, words)]


def sensor(name: str, who_am_i: int, address: int, wanted: int, fault: str, standby: int) -> list[Finding]:
    if not name:
        return [Finding("sensor", BAD, fault)]
    words = f"{name} (0x{who_am_i:02x}) at 0x{address:02x}"
    if standby:
        words += f": axes are in standby (PWR_MGMT_2 reads 0x{standby:02x}): it does not keep its settings"
        return [Finding("sensor", BAD, words)]
    if address != wanted:
        return [Finding("sensor", GOOD, words + f" (AD0; SENSOR_ADDRESS is 0x{wanted:02x})")]
    return [Finding("sensor", GOOD, words)]


def factory_trims(registers: tuple[int, ...]) -> list[float]:
    """Return the factory trims of the six axes, in counts at +-8 g and +-250 deg/s (RM p. 11).

    An axis without a factory trim has the trim 0. registers: the values of the registers 0x0D to 0x10.
    """
    accel = [registers[k] >> 5 << 2 | registers[3] >> (4 - 2 * k) & 3 for k in range(3)]
    gyro = [registers[k] & 0x1F for k in range(3)]
    trims = [4096 * 0.34 * (0.92 / 0.34) ** ((code - 1) / 30) if code else 0.0 for code in accel]
    signs = (1, -1, 1)
    return trims + [signs[k] * 25 * 131 * 1.046 ** (code - 1) if code else 0.0 for k, code in enumerate(gyro)]


def self_test(registers: tuple[int, ...], off: tuple[float, ...], on: tuple[float, ...]) -> list[Finding]:
    findings = []
    for axis, trim, without, with_it in zip(AXES, factory_trims(registers), off, on, strict=True):
        name = f"self-test, {axis}"
        if not trim:
            findings.append(Finding(name, SKIPPED, "no factory trim in this chip: a clone"))
            continue
        percent = 100 * ((with_it - without) / trim - 1)
        words = f"{percent:+.1f} % off its factory trim (limit {SELF_TEST_PERCENT:.0f} %)"
        verdict = GOOD if abs(percent) <= SELF_TEST_PERCENT else BAD  # BAD for NaN
        findings.append(_advised(name, verdict, words, ": the axis is damaged, or the chip is a clone"))
    return findings


def noise(
    samples: int,
    means: tuple[float, ...],
    spreads: tuple[float, ...],
    changes: tuple[int, ...],
    lsb_per_g: int,
    lsb_per_dps: float,
    temperature_c: float,
    overflows: int,
    dlpf: int,
) -> list[Finding]:
    if samples < 20:
        return [Finding("readings", BAD, f"{samples} samples came: the FIFO or the chip has stopped")]
    lsb = [lsb_per_g] * 3 + [lsb_per_dps] * 3
    channels = [0, 1, 2, 4, 5, 6]
    values = [means[c] / unit for c, unit in zip(channels, lsb, strict=True)]
    noises = [spreads[c] / unit for c, unit in zip(channels, lsb, strict=True)]
    dead = [changes[c] < DEAD_SHARE * samples for c in channels]
    findings = []
    moved = sum(dps > MOVED_DPS for dps in noises[3:]) >= 2
    cause = "it was moved, repeat with the sensor at rest" if moved else "this axis is faulty, or it vibrates"
    bands = BANDWIDTH_HZ[dlpf]
    for k, axis in enumerate(AXES):
        unit, digits = ("mg", 1) if k < 3 else ("deg/s", 3)
        factor = 1000.0 if k < 3 else 1.0
        sheet = (ACCEL_NOISE_G if k < 3 else GYRO_NOISE_DPS) * math.sqrt(1.57 * bands[k // 3])
        sheet = math.hypot(sheet, 0.3 / lsb[k])  # rounding to whole counts adds noise of 0.3 counts
        words = f"{factor * noises[k]:.{digits}f} {unit} (data sheet {factor * sheet:.{digits}f}, "
        words += f"limit {factor * NOISE_TIMES * sheet:.{digits}f})"
        if dead[k]:
            findings.append(
                Finding(f"noise, {axis}", BAD, "its count does not change: this axis is dead or in standby")
            )
        elif noises[k] > NOISE_TIMES * sheet:
            findings.append(Finding(f"noise, {axis}", LOOK if moved else BAD, f"{words}: {cause}"))
        else:
            findings.append(Finding(f"noise, {axis}", GOOD, words))
    for k in range(3, 6):
        words = f"{values[k]:+.2f} deg/s (data sheet 20, limit {MOST_GYRO_BIAS_DPS:.0f})"
        size = abs(values[k])
        verdict = BAD if size > MOST_GYRO_BIAS_DPS else LOOK if size > GYRO_BIAS_DPS else GOOD
        findings.append(_advised(f"bias, {AXES[k]}", verdict, words, ": beyond the data sheet"))
    force = math.hypot(*values[:3])
    words = f"{force:.3f} g at rest (limit 1 +- {FORCE_OFF_G})"
    off = abs(force - 1.0)
    verdict = BAD if off > MOST_FORCE_OFF_G else LOOK if off > FORCE_OFF_G else GOOD
    findings.append(
        Finding("bias, accelerometer", verdict, words + (": do the six positions" if verdict == LOOK else ""))
    )
    for k in range(3):  # at rest, no axis can read more than the total force of 1 g
        if abs(values[k]) > 1.0 + MOST_FORCE_OFF_G:
            findings.append(Finding(f"bias, {AXES[k]}", BAD, f"{values[k]:+.2f} g at rest"))
    low, high = TEMPERATURE_C
    least, highest = MOST_TEMPERATURE_C
    words = f"{temperature_c:.1f} C (limits {low:.0f} and {high:.0f})"
    verdict = GOOD if low <= temperature_c <= high else LOOK if least <= temperature_c <= highest else BAD
    findings.append(_advised("temperature", verdict, words, ": a chip at room temperature should not say that"))
    if overflows:
        findings.append(Finding("readings", LOOK, f"{overflows} overflows of the FIFO while they were read"))
    return findings


def clock(samples: int, us: int, rate_hz: int, overflows: int, errors: int) -> list[Finding]:
    if overflows or errors or not samples:
        words = f"not measured: {samples} samples, {overflows} overflows, {errors} failed transfers"
        return [Finding("sample clock", BAD, words)]
    percent = 100 * (samples / (us / 1e6) / rate_hz - 1)
    words = f"{samples / (us / 1e6):.2f} samples per second, {percent:+.2f} % off {rate_hz} (limit {CLOCK_PERCENT} %)"
    size = abs(percent)
    verdict = BAD if size > MOST_CLOCK_PERCENT else LOOK if size > CLOCK_PERCENT else GOOD
    return [_advised("sample clock", verdict, words, ": a clone, or a faulty chip")]


def fifo(fault: str, size: int, lasts_ms: int, waiting: int, expected: int, noticed: bool, after: int) -> list[Finding]:
    if fault:
        return [Finding("FIFO", BAD, f"it {fault}, though the chip measures: a clone that cannot be used")]
    words = f"{waiting} of {expected} bytes after {0.8 * lasts_ms:.0f} ms without a read (it has {size})"
    if waiting < 0.9 * expected - 28:
        words += ": it loses samples"
    elif not noticed:
        return [Finding("FIFO under load", LOOK, words + "; an overflow is not noticed: it is larger than known")]
    elif not after:
        words += ": no sample came after an overflow"
    else:
        return [Finding("FIFO under load", GOOD, words)]
    return [Finding("FIFO under load", BAD, words)]


def i2c(transfers: int, errors: int, wrong: int, us: int) -> list[Finding]:
    count = f"{errors} errors and {wrong} wrong answers in {transfers} transfers"
    words = f"{count} (limit 0), {us / transfers:.0f} us each"
    verdict = GOOD if not errors and not wrong else LOOK if errors <= ERRORS and not wrong else BAD
    advice = ": shorter wires, SENSOR_BUS_HZ = 100_000, away from ignition and motor"
    return [_advised("I2C errors", verdict, words, advice)]


def display(address: int, draws: bool, there: int, rounds: int, fault: str) -> list[Finding]:
    if not there:
        return [Finding("display", BAD, f"none answers: {fault or 'check its wires and LCD_ADDRESSES'}")]
    words = f"{'OLED' if draws else 'LCD'} at 0x{address:02x}, acknowledged in {there} of {rounds} texts"
    if there < rounds:
        return [Finding("display", BAD, words + ": check its wires")]
    return [Finding("display", GOOD, words)]


def flash(times_ms: tuple[int, ...], wrong: int, free_kb: int, error: str, lasts_ms: int) -> list[Finding]:
    if error:
        return [Finding("flash", BAD, f"cannot be written: {error}: pull and remove rides, or erase the flash")]
    if wrong:
        return [Finding("flash", BAD, f"{wrong} of {len(times_ms)} blocks read back differently: it is worn out")]
    longest = max(times_ms)
    words = f"writing a block of 4 KB takes at most {longest} ms (limit {lasts_ms}, when the FIFO is full)"
    room = f"{free_kb} KB free (limit {LITTLE_FLASH_KB})"
    return [
        _advised("flash", BAD if longest > lasts_ms else GOOD, words, ": readings get lost"),
        _advised("room in flash", LOOK if free_kb < LITTLE_FLASH_KB else GOOD, room, ": pull and remove rides"),
    ]


def speed(source: str, fault: str, mps: float) -> list[Finding]:
    if not source:
        return []
    if fault:
        return [Finding("speed source", BAD, f"{source}: {fault}")]
    return [Finding("speed source", GOOD, f"{source}: " + ("nothing yet" if mps < 0 else f"{mps:.1f} m/s"))]


def loop(
    longest_us: int,
    places: int,
    overflows: int,
    lost: int,
    restarts: int,
    faults: str,
    turns: int,
    free: int,
    lasts_ms: int,
) -> list[Finding]:
    longest = longest_us / 1000
    limit_ms = MOST_TURN_SHARE * lasts_ms
    words = f"{longest:.1f} ms in {turns} turns (limit {TURN_MS:.0f}); places left in the FIFO: {places}"
    verdict = BAD if longest > limit_ms or overflows else LOOK if longest > TURN_MS else GOOD
    findings = [_advised("longest turn", verdict, words, f"; {lost} samples lost: something takes the board's time")]
    if faults or restarts > 1:
        words = f"faults while the lean meter ran: {faults or 'none'}; set up {restarts} times (limit 1): a loose wire"
        findings.append(Finding("sensor while running", BAD, words))
    elif lost:
        findings.append(Finding("sensor while running", LOOK, f"{lost} samples lost (limit 0)"))
    else:
        findings.append(Finding("sensor while running", GOOD, "no fault"))
    free_kb = free // 1024
    words = f"{free_kb} KB free while the lean meter runs (limit {LITTLE_HEAP_KB})"
    verdict = BAD if free_kb < LEAST_HEAP_KB else LOOK if free_kb < LITTLE_HEAP_KB else GOOD
    return [*findings, _advised("memory", verdict, words, ": do less in user.py, or switch LIVE or SPEED off")]


# The function that judges each measurement, by the name of the function in check_guest.py that measures
JUDGES: dict[str, Callable[..., Any]] = {
    judge.__name__: judge
    for judge in (board, button, sensor, self_test, noise, clock, fifo, i2c, display, flash, speed, loop)
}
