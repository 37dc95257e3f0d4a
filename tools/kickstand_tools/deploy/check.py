"""Runs `kickstand check`, which measures a board and everything wired to it, and judges the results."""

import ast
import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..common.messages import InputError, Remedy
from . import check_guest
from .check_limits import BAD, JUDGES, LOOK, SKIPPED, Finding
from .connection import UPDATE, Port, connected, describe, last_line, refuse_unfit_firmware, restart

TRANSFERS = 10_000  # number of transfers to the sensor
TEXTS = 20  # number of texts on the display
PRESS_S = 30  # longest time to wait for the press, and then for the release
NOISE_S, CLOCK_S, LOOP_S = 3, 6, 15  # durations of noise(), clock() and loop()
_SILENT_S = 120  # longest time that one measurement may take
_FIFO_MS = 365  # time in which the FIFO of an MPU6050 fills, at 200 samples per second
_LOAD_MS = 150  # if a write to the flash takes longer, nothing is written during the FIFO test
_GENUINE = 0x68  # the only WHO_AM_I with a known self-test

# A function that runs a program on the board and returns its output. Raises GuestFailed
Ask = Callable[[str], str]


_SAYS_WHY = Remedy("kickstand status says why", "the status of the board says why")


class GuestFailed(Exception):
    """A program raised an exception on the board. The text is the last line of the exception."""


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
    sensor = check.step("sensor")
    answers = bool(sensor and sensor[0])
    if answers:
        check.step("i2c", TRANSFERS)
    flash = check.step("flash", judged_with=(check.lasts_ms,))
    if sensor and answers:
        _sensor(check, sensor[1], bool(flash and not flash[3] and max(flash[0]) < _LOAD_MS))
    check.step("display", TEXTS)
    check.step("speed")
    check.step("loop", LOOP_S, judged_with=(check.lasts_ms,))
    return check.found


def _sensor(check: "_Check", who_am_i: int, writes: bool) -> None:
    """Measure the sensor. writes: True to write to the flash during the test of the FIFO."""
    # The FIFO comes first, because other measurements depend on it
    fifo = check.step("fifo", int(writes))
    if who_am_i == _GENUINE:
        check.step("self_test")
    else:
        check.add([Finding("self-test", SKIPPED, "only an MPU6050 (0x68) has this factory trim")])
    if fifo and not fifo[0]:
        check.lasts_ms = fifo[2]
        check.step("noise", NOISE_S, judged_with=(check.dlpf,))
        check.step("clock", CLOCK_S)


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


_NAMES = {
    "self_test": "self-test",
    "clock": "sample clock",
    "fifo": "FIFO under load",
    "i2c": "I2C errors",
    "loop": "longest turn",
}
