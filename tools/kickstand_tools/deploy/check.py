"""Runs `kickstand check`, which measures a board and everything wired to it, and judges the results.

The functions of check_guest.py measure, the functions of the same name here judge. The limits come from three sources:
the product specification PS-MPU-6000A rev 3.4 (here PS), the register map RM-MPU-6000A rev 4.2 (here RM), and the needs
of the firmware.
"""

import ast
import functools
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..common.messages import InputError, Remedy
from . import check_guest
from .connection import UPDATE, Port, connected, describe, last_line, refuse_unfit_firmware, restart

TRANSFERS = 10_000  # number of transfers to the sensor
TEXTS = 20  # number of texts on the display
PRESS_S = 30  # longest time to wait for the press, and then for the release
NOISE_S, CLOCK_S, LOOP_S = 3, 6, 15  # durations of noise(), clock() and loop()
_SILENT_S = 120  # longest time that one measurement may take
_FIFO_MS = 365  # time in which the FIFO of an MPU6050 fills, at 200 samples per second
_LOAD_MS = 150  # if a write to the flash takes longer, nothing is written during the FIFO test
_GENUINE = 0x68  # the only WHO_AM_I with a known self-test

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

# A function that runs a program on the board and returns its output. Raises GuestFailed
Ask = Callable[[str], str]

_SAYS_WHY = Remedy("kickstand status says why", "the status of the board says why")


class GuestFailed(Exception):
    """A program raised an exception on the board. The text is the last line of the exception."""


@dataclass
class Finding:
    """The result of a test."""

    what: str  # the tested part
    verdict: str  # GOOD, LOOK (usable, but outside its limit), BAD or SKIPPED
    words: str  # the figure and its limit; if the figure is not good, also what to do

    @property
    def line(self) -> str:
        return f"{self.verdict:5}{self.what:29}{self.words}"


@dataclass
class Checked:
    port: str
    findings: list[Finding]

    @property
    def faults(self) -> list[Finding]:
        """The findings that are not good."""
        return [finding for finding in self.findings if finding.verdict in (LOOK, BAD)]

    @property
    def verdict(self) -> str:
        """The last line of a check, with the number of faults and their names."""
        faults = [finding.what for finding in self.faults]
        count = sum(finding.verdict != SKIPPED for finding in self.findings)
        if not faults:
            return f"all {count} are as they should be"
        return f"{len(faults)} of {count} are not as they should be: {', '.join(faults)}"


def check(port: Port, say: Callable[[str], None] = lambda text: None) -> Checked:
    """Check a board as measured() does, then restart it. This takes up to two minutes."""
    with connected(port) as (transport, name):
        describe(transport, name)

        def ask(code: str) -> str:
            output, error = transport.exec_raw(code, timeout=_SILENT_S)
            if error:
                raise GuestFailed(last_line(error.decode(errors="replace")))
            return output.decode(errors="replace")

        try:
            return Checked(name, measured(ask, say, name))
        finally:
            restart(transport)


def measured(ask: Ask, say: Callable[[str], None], name: str = "the board") -> list[Finding]:
    """Measure a board and everything wired to it, and judge the results. Raises InputError if it cannot be checked.

    say: called with each finding as a line, and with instructions for the user.
    name: name of the board, for messages.
    """
    try:
        ask(inspect.getsource(check_guest.begin) + "\nparts = begin()\n")
    except GuestFailed as failed:
        refuse_unfit_firmware(str(failed), name)
        if "SettingsError" in str(failed):
            raise InputError(f"{name}: config.py cannot be used", _SAYS_WHY) from failed
        raise InputError(f"the board at {name} cannot be checked ({failed})", UPDATE) from None
    check = _Check(ask, say)
    check.step("board")
    say(f"Press the push button once, within {PRESS_S} s, and release it. Then leave sensor and board at rest.")
    check.step("button", 1000 * PRESS_S)
    chip_name, who_am_i, *_ = check.step("sensor") or ("", 0)
    if chip_name:
        check.step("i2c", TRANSFERS)
    times_ms, _, _, error = check.step("flash", judged_with=(check.lasts_ms,)) or ((), 0, 0, "broken off")
    if chip_name:
        _measure_sensor(check, who_am_i, not error and max(times_ms) < _LOAD_MS)
    check.step("display", TEXTS)
    check.step("speed")
    check.step("loop", LOOP_S, judged_with=(check.lasts_ms,))
    return check.found


def _measure_sensor(check: "_Check", who_am_i: int, writes: bool) -> None:
    """Measure the sensor. writes: True to write to the flash during the test of the FIFO."""
    # The FIFO comes first, because other measurements depend on it
    fault, _, lasts_ms, *_ = check.step("fifo", int(writes)) or ("broken off", 0, 0)
    if who_am_i == _GENUINE:
        check.step("self_test")
    else:
        check.add([Finding("self-test", SKIPPED, "only an MPU6050 (0x68) has this factory trim")])
    if not fault:
        check.lasts_ms = lasts_ms
        check.step("noise", NOISE_S, judged_with=(check.dlpf,))
        check.step("clock", CLOCK_S)


_NAMES = {
    "self_test": "self-test",
    "clock": "sample clock",
    "fifo": "FIFO under load",
    "i2c": "I2C errors",
    "loop": "longest turn",
}


class _Check:
    """Runs the measurements. lasts_ms: time in which the FIFO fills."""

    def __init__(self, ask: Ask, say: Callable[[str], None]) -> None:
        self._ask, self._say = ask, say
        self.found: list[Finding] = []
        self.lasts_ms = _FIFO_MS

    @functools.cached_property
    def dlpf(self) -> int:
        return int(self._ask("print(parts.settings.DLPF)"))

    def step(self, name: str, *arguments: int, judged_with: tuple[int, ...] = ()) -> tuple[Any, ...] | None:
        """Run a measurement on the board and judge its result. Returns the measured values, or None if it failed.

        name: name of the function in check_guest.py, and of its judge in JUDGES.
        judged_with: further arguments of the judge.
        """
        source = inspect.getsource(getattr(check_guest, name))
        call = f"{name}({', '.join(['parts', *map(str, arguments)])})"
        try:
            output = self._ask(f"{source}\nprint(repr({call}))\ndel {name}\n")
            values = ast.literal_eval(output.strip().rpartition("\n")[2].strip())
            findings = JUDGES[name](*values, *judged_with)
        except GuestFailed as failed:
            self.add([Finding(_NAMES.get(name, name), BAD, f"broken off by {failed}")])
            return None
        except (SyntaxError, ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError):
            raise InputError(
                f"the board's answer to {name} makes no sense: plug it in again, then repeat this"
            ) from None
        self.add(findings)
        return values

    def add(self, findings: list[Finding]) -> None:
        for finding in findings:
            self._say(finding.line)
        self.found.extend(findings)


# The judges


def _judged(what: str, words: str, verdict: str, advice: str = "") -> Finding:
    return Finding(what, verdict, words if verdict == GOOD else words + advice)


def _graded(size: float, limit: float, most: float) -> str:
    """GOOD up to the limit, LOOK up to `most`, and BAD beyond, also for NaN."""
    return GOOD if size <= limit else LOOK if size <= most else BAD


def board(version: str, name: str, release: str, settings: str, slow: str) -> list[Finding]:
    used = f"not used for {slow}: slower code runs instead" if slow else "used"
    return [
        Finding("board", GOOD, f"{name}, MicroPython {release}, Kickstand {version}; {settings}"),
        Finding("machine code", LOOK if slow else GOOD, used),
    ]


def button(at_first: bool, pressed: bool, released: bool, took_ms: int, edges: int, pin: int) -> list[Finding]:
    """took_ms: time from the press to the release. edges: number of changes of the level during both."""
    verdict = BAD
    if at_first and not released:
        words = f"GPIO {pin} is low all the time: the button is stuck, or its wire touches GND"
    elif not pressed:
        words = f"no press on GPIO {pin}: press it when asked to; if you did, its wires or BUTTON_PIN are wrong"
    elif not released:
        words = f"pressed on GPIO {pin}, but not released"
    elif edges > BOUNCE_EDGES:
        verdict = LOOK
        words = f"pressed and released on GPIO {pin}; it bounces: {edges} edges (limit {BOUNCE_EDGES})"
    else:
        verdict, words = GOOD, f"pressed for {took_ms} ms and released, on GPIO {pin}, {edges} edges"
    return [Finding("button", verdict, words)]


def sensor(name: str, who_am_i: int, address: int, wanted: int, fault: str, standby: int) -> list[Finding]:
    words = f"{name} (0x{who_am_i:02x}) at 0x{address:02x}" if name else fault
    if standby:
        words += f": axes are in standby (PWR_MGMT_2 reads 0x{standby:02x}): it does not keep its settings"
    elif name and address != wanted:
        words += f" (AD0; SENSOR_ADDRESS is 0x{wanted:02x})"
    return [Finding("sensor", GOOD if name and not standby else BAD, words)]


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
    """off, on: means of the six axes without and with the self-test, in counts at +-8 g and +-250 deg/s."""
    findings = []
    for axis, trim, without, with_it in zip(AXES, factory_trims(registers), off, on, strict=True):
        if not trim:
            findings.append(Finding(f"self-test, {axis}", SKIPPED, "no factory trim in this chip: a clone"))
            continue
        percent = 100 * ((with_it - without) / trim - 1)
        words = f"{percent:+.1f} % off its factory trim (limit {SELF_TEST_PERCENT:.0f} %)"
        verdict = _graded(abs(percent), SELF_TEST_PERCENT, SELF_TEST_PERCENT)
        advice = ": the axis is damaged, or the chip is a clone"
        findings.append(_judged(f"self-test, {axis}", words, verdict, advice))
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
    """means, spreads, changes: of the chip's seven channels, in counts. changes: how often a count changed."""
    if samples < 20:
        return [Finding("readings", BAD, f"{samples} samples came: the FIFO or the chip has stopped")]
    channels, lsb = (0, 1, 2, 4, 5, 6), [lsb_per_g] * 3 + [lsb_per_dps] * 3  # channel 3 is the temperature
    values, noises = ([counts[c] / unit for c, unit in zip(channels, lsb)] for counts in (means, spreads))
    moved = sum(dps > MOVED_DPS for dps in noises[3:]) >= 2
    accel_hz, gyro_hz = BANDWIDTH_HZ[dlpf]
    findings = []
    for axis, channel, counts_per_unit, spread in zip(AXES, channels, lsb, noises):
        is_accel = axis in AXES[:3]
        bandwidth_hz = accel_hz if is_accel else gyro_hz
        density = ACCEL_NOISE_G if is_accel else GYRO_NOISE_DPS
        # Rounding to whole counts adds noise of 0.3 counts
        sheet = math.hypot(density * math.sqrt(1.57 * bandwidth_hz), 0.3 / counts_per_unit)
        if changes[channel] < DEAD_SHARE * samples:
            words = "its count does not change: this axis is dead or in standby"
            findings.append(Finding(f"noise, {axis}", BAD, words))
        else:
            findings.append(_noise_of_axis(axis, is_accel, spread, sheet, moved))
    findings += _biases(values)
    (low, high), (least, most) = TEMPERATURE_C, MOST_TEMPERATURE_C
    words = f"{temperature_c:.1f} C (limits {low:.0f} and {high:.0f})"
    verdict = GOOD if low <= temperature_c <= high else LOOK if least <= temperature_c <= most else BAD
    findings.append(_judged("temperature", words, verdict, ": a chip at room temperature should not say that"))
    if overflows:
        findings.append(Finding("readings", LOOK, f"{overflows} overflows of the FIFO while they were read"))
    return findings


def _noise_of_axis(axis: str, is_accel: bool, spread: float, sheet: float, moved: bool) -> Finding:
    """Judge the standard deviation of an axis, in g or deg/s. sheet: of the data sheet."""
    unit, digits, factor = ("mg", 1, 1e3) if is_accel else ("deg/s", 3, 1.0)
    measured, expected, limit = (f"{factor * value:.{digits}f}" for value in (spread, sheet, NOISE_TIMES * sheet))
    cause = ": it was moved, repeat with the sensor at rest" if moved else ": this axis is faulty, or it vibrates"
    verdict = _graded(spread, NOISE_TIMES * sheet, math.inf if moved else 0.0)
    words = f"{measured} {unit} (data sheet {expected}, limit {limit})"
    return _judged(f"noise, {axis}", words, verdict, cause)


def _biases(values: list[float]) -> list[Finding]:
    """values: means of the six axes at rest, in g and deg/s."""
    findings = []
    for axis, dps in zip(AXES[3:], values[3:]):
        words = f"{dps:+.2f} deg/s (data sheet 20, limit {MOST_GYRO_BIAS_DPS:.0f})"
        verdict = _graded(abs(dps), GYRO_BIAS_DPS, MOST_GYRO_BIAS_DPS)
        findings.append(_judged(f"bias, {axis}", words, verdict, ": beyond the data sheet"))
    force = math.hypot(*values[:3])
    verdict = _graded(abs(force - 1.0), FORCE_OFF_G, MOST_FORCE_OFF_G)
    advice = ": do the six positions" if verdict == LOOK else ""
    words = f"{force:.3f} g at rest (limit 1 +- {FORCE_OFF_G})"
    findings.append(_judged("bias, accelerometer", words, verdict, advice))
    for axis, g in zip(AXES[:3], values[:3]):  # at rest, no axis can read more than the total force of 1 g
        if abs(g) > 1.0 + MOST_FORCE_OFF_G:
            findings.append(Finding(f"bias, {axis}", BAD, f"{g:+.2f} g at rest"))
    return findings


def clock(samples: int, us: int, rate_hz: int, overflows: int, errors: int, in_step: bool) -> list[Finding]:
    """in_step: True if a sample arrived, and was the last one in the FIFO, where the time begins and where it ends."""
    if overflows or errors or not samples:
        words = f"not measured: {samples} samples, {overflows} overflows, {errors} failed transfers"
        return [Finding("sample clock", BAD, words)]
    if not in_step:
        return [Finding("sample clock", BAD, "not measured: the samples stopped, or the FIFO was never empty")]
    hz = samples / (us / 1e6)
    percent = 100 * (hz / rate_hz - 1)
    words = f"{hz:.2f} samples per second, {percent:+.2f} % off {rate_hz} (limit {CLOCK_PERCENT} %)"
    verdict = _graded(abs(percent), CLOCK_PERCENT, MOST_CLOCK_PERCENT)
    return [_judged("sample clock", words, verdict, ": a clone, or a faulty chip")]


def fifo(fault: str, size: int, lasts_ms: int, waiting: int, expected: int, noticed: bool, after: int) -> list[Finding]:
    """size, waiting, expected: bytes; the last two after 80 % of lasts_ms. after: samples read after an overflow."""
    if fault:
        return [Finding("FIFO", BAD, f"it {fault}, though the chip measures: a clone that cannot be used")]
    words = f"{waiting} of {expected} bytes after {0.8 * lasts_ms:.0f} ms without a read (it has {size})"
    verdict, advice = GOOD, ""
    if waiting < 0.9 * expected - 28:
        verdict, advice = BAD, ": it loses samples"
    elif not noticed:
        verdict, advice = LOOK, "; an overflow is not noticed: it is larger than known"
    elif not after:
        verdict, advice = BAD, ": no sample came after an overflow"
    return [Finding("FIFO under load", verdict, words + advice)]


def i2c(transfers: int, errors: int, wrong: int, us: int) -> list[Finding]:
    count = f"{errors} errors and {wrong} wrong answers in {transfers} transfers"
    words = f"{count} (limit 0), {us / transfers:.0f} us each"
    advice = ": shorter wires, SENSOR_BUS_HZ = 100_000, away from ignition and motor"
    return [_judged("I2C errors", words, BAD if wrong else _graded(errors, 0, ERRORS), advice)]


def display(address: int, draws: bool, acknowledged: int, rounds: int, fault: str) -> list[Finding]:
    if not acknowledged:
        return [Finding("display", BAD, f"none answers: {fault or 'check its wires and LCD_ADDRESSES'}")]
    words = f"{'OLED' if draws else 'LCD'} at 0x{address:02x}, acknowledged in {acknowledged} of {rounds} texts"
    return [_judged("display", words, BAD if acknowledged < rounds else GOOD, ": check its wires")]


def flash(times_ms: tuple[int, ...], wrong: int, free_kb: int, error: str, lasts_ms: int) -> list[Finding]:
    if error:
        return [Finding("flash", BAD, f"cannot be written: {error}: pull and remove rides, or erase the flash")]
    if wrong:
        return [Finding("flash", BAD, f"{wrong} of {len(times_ms)} blocks read back differently: it is worn out")]
    words = f"writing a block of 4 KB takes at most {max(times_ms)} ms (limit {lasts_ms}, when the FIFO is full)"
    room = f"{free_kb} KB free (limit {LITTLE_FLASH_KB})"
    return [
        _judged("flash", words, _graded(max(times_ms), lasts_ms, lasts_ms), ": readings get lost"),
        _judged("room in flash", room, LOOK if free_kb < LITTLE_FLASH_KB else GOOD, ": pull and remove rides"),
    ]


def speed(source: str, fault: str, mps: float) -> list[Finding]:
    words = f"{source}: " + (fault or ("nothing yet" if mps < 0 else f"{mps:.1f} m/s"))
    return [Finding("speed source", BAD if fault else GOOD, words)] if source else []


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
    """longest_us: the longest turn of the app's loop. places: fewest free places in the FIFO. free: heap in bytes."""
    words = f"{longest_us / 1000:.1f} ms in {turns} turns (limit {TURN_MS:.0f}); places left in the FIFO: {places}"
    verdict = BAD if overflows else _graded(longest_us / 1000, TURN_MS, MOST_TURN_SHARE * lasts_ms)
    findings = [_judged("longest turn", words, verdict, f"; {lost} samples lost: something takes the board's time")]
    verdict, words = (LOOK, f"{lost} samples lost (limit 0)") if lost else (GOOD, "no fault")
    if faults or restarts > 1:
        verdict = BAD
        words = f"faults while the lean meter ran: {faults or 'none'}; set up {restarts} times (limit 1): a loose wire"
    findings.append(Finding("sensor while running", verdict, words))
    free_kb = free // 1024
    words = f"{free_kb} KB free while the lean meter runs (limit {LITTLE_HEAP_KB})"
    verdict = BAD if free_kb < LEAST_HEAP_KB else LOOK if free_kb < LITTLE_HEAP_KB else GOOD
    return [*findings, _judged("memory", words, verdict, ": do less in user.py, or switch LIVE or SPEED off")]


# The function that judges each measurement, by the name of the function in check_guest.py that measures
JUDGES: dict[str, Callable[..., Any]] = {
    judge.__name__: judge
    for judge in (board, button, sensor, self_test, noise, clock, fifo, i2c, display, flash, speed, loop)
}
