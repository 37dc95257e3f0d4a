"""Alignment from recorded drives, by the firmware's own module."""

from array import array
from collections.abc import Callable
from pathlib import Path

from kickstand.drive_alignment import verdict
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE, DriveAlignment
from kickstand.errors import AlignmentError

from kickstand_tools.calibration.published.viriciti import PublishedAlignment

from ..errors import InputError
from ..logs.reader import Log, read_log
from ..progress import Bar
from ..refusals import sentence
from .file import CalibrationFile

METHODS = {"improved": DriveAlignment, "published": PublishedAlignment}
_BETWEEN_US = 3_600_000_000  # logs do not join
_SLOWEST_US = 50_000  # between samples
_CHUNK = 1000

Print = Callable[[str], None]


def drive(
    paths: list[Path], before: CalibrationFile | None, vehicle: str | None, method: str, say: Print
) -> CalibrationFile:
    """Matrix and gyro bias from logs of one mount, with speed; offset and slope as before. Raises InputError.

    vehicle: if None, a motorcycle where before is aligned by two poses, else a car. say: called with each line of the
    summary.
    """
    result = before or CalibrationFile()
    poses = result.aligned and result.vehicle != CAR
    kind = vehicle or (MOTORCYCLE if poses else CAR)
    up = result.matrix[3:6] if kind == MOTORCYCLE and poses else None
    logs = [_read(path, len(paths) > 1) for path in paths]
    names = ", ".join(str(path) for path in paths)
    # the gyro's bias is found at a stop: a first pass looks for one, so that what came before it counts too
    scout = DriveAlignment(kind, up, [0.0] * 3)
    with Bar("looking for stops", sum(len(log.time_us) for log in logs)) as bar:
        _feed(scout, logs, result, bar, None)
    known = scout.standing.stops or before is not None
    alignment = METHODS[method](kind, up, list(scout.standing.bias) if known else None)
    events = _Events(alignment, len(logs) > 1, say)
    with Bar("driving", sum(len(log.time_us) for log in logs)) as bar:
        _feed(alignment, logs, result, bar, events)
    matrix = array("f", [0.0] * 9)
    try:
        alignment.matrix(matrix)
    except AlignmentError as error:
        assumed = " (taken for a car: else --vehicle motorcycle)" if vehicle is None and kind == CAR else ""
        raise InputError(f"{names}: {sentence(error)}{assumed}") from error
    bias = [a + b for a, b in zip(result.bias, alignment.standing.bias, strict=True)]
    say(f"{kind}, method {method}: {alignment.counted} used, {alignment.turned} in turns not used")
    say(f"stops: {alignment.standing.stops}")
    ready = f"ready after {events.ready_s:.0f} s" + (" of all logs" if len(logs) > 1 else "")
    say(f"quality: {alignment.quality_deg:.1f} degrees about the vertical; {ready}")
    if isinstance(alignment, DriveAlignment):
        halves_deg = alignment.quality.halves_deg
        say(f"speed: {alignment.events.lag_s:.1f} s late; two halves of the drive differ by {halves_deg:.1f} degrees")
        if up is not None:
            _compare(alignment, result.matrix, say)
    for name, row in (("left", 0), ("up", 3), ("forward", 6)):
        x, y, z = matrix[row : row + 3]
        say(f"{name:<10} x {x:+.4f}  y {y:+.4f}  z {z:+.4f}")
    if not result.six_done:
        say("warning: no six-position calibration: an offset of 50 mg tilts the vertical by 3 degrees")
    return CalibrationFile(
        result.offset, result.slope, bias, list(matrix), True, result.six_done, result.notes, vehicle=kind
    )


def _read(path: Path, others: bool) -> Log:
    log = read_log(path)
    if all(speed is None for speed in log.speed_mps):
        instead = ", or leave this log out" if others else ""
        raise InputError(f"{path}: no speed: record a column speed_mps, from a GPS or a wheel{instead}")
    step_us = log.time_us[-1] / (len(log.time_us) - 1)
    if step_us > _SLOWEST_US:
        raise InputError(f"{path}: a sample every {step_us / 1e6:.2f} s: at least 20 a second are needed")
    return log


def _feed(alignment, logs: list[Log], result: CalibrationFile, bar: Bar, events: "_Events | None") -> None:
    """Run the logs through an alignment, and events beside it."""
    calibration = result.to_firmware()
    force, rate = [0.0] * 3, [0.0] * 3
    for log in logs:
        previous = -_BETWEEN_US if log is not logs[0] else 0
        if events:
            events.begin(log)
        for i, (now, reading, speed) in enumerate(zip(log.time_us, log.readings, log.speed_mps, strict=True)):
            calibration.apply(reading, force, rate)
            alignment.update(force, rate, now - previous)
            previous = now
            if speed is not None:
                alignment.measure_speed(speed)
                if events:
                    events.look(now / 1e6)
            if i % _CHUNK == 0:
                bar.advance(min(_CHUNK, len(log.time_us) - i))
        if log is logs[-1]:
            alignment.finish()
        if events:
            events.end(log.time_us[-1] / 1e6)


class _Events:
    """Says what was used and what was not, and what became of it, as it happens; of several logs, in which."""

    def __init__(self, alignment, several: bool, say: Print) -> None:
        self._alignment, self._several, self._say = alignment, several, say
        self._before = (0, 0)
        self._ready = False
        self._problem = None
        self._said = 0
        self._elapsed = 0.0  # in the logs before
        self.ready_s = 0.0  # of all logs

    def begin(self, log: Log) -> None:
        """Before the first sample of a log."""
        self._said = 0
        if self._several:
            self._say(f"{log.path}:")

    def end(self, seconds: float) -> None:
        """After the last one."""
        self.look(seconds)
        self._elapsed += seconds
        if self._several and not self._said:
            self._say("           no braking in it")

    def look(self, seconds: float) -> None:
        """seconds: in this log."""
        alignment = self._alignment
        now = alignment.counted, alignment.turned
        if now[0] > self._before[0]:
            needed = f" of {alignment.needed}" if now[0] <= alignment.needed else ""
            self._event(seconds, f"straight: used, {now[0]}{needed}")
        elif now[1] > self._before[1]:
            self._event(seconds, "turning: not counted")
        self._before = now
        problem = alignment.problem
        if problem and not self._problem:
            self._event(seconds, sentence(problem))
        self._problem = problem
        if alignment.ready != self._ready:
            self._ready = alignment.ready
            self._event(seconds, self._state())
            self.ready_s = self.ready_s or self._elapsed + seconds

    def _event(self, seconds: float, what: str) -> None:
        self._said += 1
        self._say(f"{seconds:7.1f} s  {what}")

    def _state(self) -> str:
        if self._ready:
            return f"ready: forward known to {self._alignment.quality_deg:.1f} degrees"
        return "no longer ready" if self._problem else f"no longer ready: {sentence(self._alignment.reason)}"


def _compare(alignment: DriveAlignment, matrix: list[float], say: Print) -> None:
    yaw = verdict.yaw_deg(alignment.quality.fit, matrix)
    found = verdict.compare(alignment, matrix)
    if found == verdict.REVERSED:
        say("warning: the two poses had forward and backward exchanged: the kickstand is on the other side")
    elif found == verdict.MOVED:
        say(f"warning: the mount is {abs(yaw):.0f} degrees from where the two poses saw it: was it moved since?")
    else:
        say(f"the two poses had forward {abs(yaw):.1f} degrees off")
