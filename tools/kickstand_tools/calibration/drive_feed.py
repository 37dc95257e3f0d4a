"""Runs recorded drives through the firmware's classes for alignment by driving, and reports what happens in them.

DriveAlignment uses only sums of its samples over 100 ms. This module computes these sums with numpy, and passes them to
DriveAlignment. The results are the same. A drive of ten minutes at 200 Hz takes 0.2 s instead of 0.9 s.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from kickstand.drive_alignment.alignment import MOVED_MPS, STALE_US, DriveAlignment, StandingVertical
from kickstand.drive_alignment.events import BIN_US
from kickstand.errors import Refusal
from kickstand.units import GAP_US

from ..common.messages import InputError, Message
from ..logs.log import Log
from ..logs.source import Progress
from .file import CalibrationFile
from .published import PublishedAlignment
from .refusals import of_firmware

# DriveEvent.what
LOG_BEGINS = "log-begins"
LOG_WITHOUT_EVENTS = "log-without-events"
USED, TURNING = "used", "turning"
PROBLEM = "problem"
READY, NOT_READY = "ready", "not-ready"


@dataclass
class DriveEvent:
    """Something that happened in a drive.

    log: name of the log.
    t_s: seconds since the first sample of this log.
    what: one of these constants:
        USED: a braking event in a straight line, or a start, was counted.
        TURNING: a braking event in a bend was not counted.
        PROBLEM: speed or mount have a fault.
        READY: the alignment is good enough.
        NOT_READY: the alignment is no longer good enough.
        LOG_BEGINS: a log begins.
        LOG_WITHOUT_EVENTS: a log ends, and nothing has happened in it.
    counted, needed: number of counted events, and number of events that are needed.
    quality_deg: standard error of forward.
    refusal: the reason for PROBLEM, or for NOT_READY unless a PROBLEM gives the reason; otherwise None.
    """

    log: str
    t_s: float
    what: str
    counted: int
    needed: int
    quality_deg: float
    refusal: Message | None = None


class DriveWatch:
    """Emits a DriveEvent for each change of an alignment's state.

    events: all events so far.
    ready_s: seconds of all logs together until the alignment was first READY; 0 if never.
    """

    def __init__(
        self, alignment: DriveAlignment | PublishedAlignment, on_event: Callable[[DriveEvent], None] | None
    ) -> None:
        self.events: list[DriveEvent] = []
        self.ready_s = 0.0
        self._alignment, self._on_event = alignment, on_event
        self._log = ""
        self._counts = (0, 0)  # used, turned
        self._ready = False
        self._problem: Refusal | None = None
        self._elapsed_s = 0.0  # duration of the earlier logs

    def begin(self, log: str) -> None:
        """Set the name of the log for the following events, and emit LOG_BEGINS."""
        self._log = log
        self._add(0.0, LOG_BEGINS)

    def end(self, t_s: float) -> None:
        """End a log. Emit the pending events, or LOG_WITHOUT_EVENTS if the log had no event.

        t_s: time of the log's last sample.
        """
        self.look(t_s)
        if self.events[-1].what == LOG_BEGINS:
            self._add(t_s, LOG_WITHOUT_EVENTS)
        self._elapsed_s += t_s

    def look(self, t_s: float) -> None:
        """Emit an event for each change of the alignment's state since the last call. t_s: the time in this log."""
        alignment = self._alignment
        counts = alignment.counted, alignment.turned
        if counts[0] > self._counts[0]:
            self._add(t_s, USED)
        elif counts[1] > self._counts[1]:
            self._add(t_s, TURNING)
        self._counts = counts
        problem = alignment.problem
        if problem and not self._problem:
            self._add(t_s, PROBLEM, problem)
        self._problem = problem
        if alignment.ready != self._ready:
            self._ready = alignment.ready
            self._add(t_s, READY if self._ready else NOT_READY, None if self._ready or problem else alignment.reason)
            self.ready_s = self.ready_s or self._elapsed_s + t_s

    def _add(self, t_s: float, what: str, refusal: Refusal | None = None) -> None:
        alignment = self._alignment
        reason = of_firmware(refusal) if refusal else None
        event = DriveEvent(self._log, t_s, what, alignment.counted, alignment.needed, alignment.quality_deg, reason)
        self.events.append(event)
        if self._on_event:
            self._on_event(event)


_CHUNK = 1000  # least number of samples between two calls of progress


@dataclass
class Bin:
    """Successive samples that are passed to DriveAlignment as sums.

    begins: True if the samples do not continue the previous bin.
    start_mps: if `begins`, the speed at the start of the bin; None without a new speed.
    force: mean force along the sensor's axes, 3 values in g.
    rate: mean rate along the sensor's axes, 3 values in deg/s.
    first_us: duration of all samples but the last.
    last_us: duration of the last sample; 0 if the bin is not full.
    speeds: the speeds during first_us, each as (microseconds before the end of first_us, m/s).
    end_mps: speed of the last sample; None without a new speed.
    end_us: time of the last sample in the log.
    samples: number of samples.
    """

    begins: bool
    start_mps: float | None
    force: list[float]
    rate: list[float]
    first_us: int
    last_us: int
    speeds: list[tuple[int, float]]
    end_mps: float | None
    end_us: int
    samples: int


def drive_bins(log: Log, calibration: CalibrationFile, length_us: int) -> Iterator[Bin]:
    """Split the samples of a log into the shortest bins that last at least length_us.

    The last bin before a gap or before the end of the log may be shorter. If length_us is 0, each bin has one sample,
    but the first bin of each stretch has two samples.
    """
    time_us = log.time_us
    step_us = np.diff(time_us, prepend=time_us[0])
    is_gap = step_us > GAP_US
    values = np.column_stack(calibration.in_sensor(log.accel_g, log.gyro_dps))
    integral = np.cumsum(values * np.where(is_gap, 0, step_us)[:, None], axis=0)
    times, speeds = time_us.tolist(), log.speed_mps.tolist()
    logged = np.flatnonzero(~np.isnan(log.speed_mps)).tolist()
    begins = [0, *np.flatnonzero(is_gap).tolist(), len(times)]
    next_speed = 0
    for first, stop in pairwise(begins):
        start = first
        while start == first or start < stop - 1:
            end = min(bisect_left(times, times[start] + max(1, length_us), start + 1, stop), stop - 1)
            full = times[end] - times[start] >= max(1, length_us)
            whole_us = times[end] - times[start]
            first_us = (times[end - 1] if end > start else times[start]) - times[start] if full else whole_us
            inside: list[tuple[int, float]] = []
            start_mps = end_mps = None
            while next_speed < len(logged) and logged[next_speed] <= end:
                k = logged[next_speed]
                next_speed += 1
                if k == start:
                    start_mps = speeds[k]
                elif k == end and full:
                    end_mps = speeds[k]
                else:
                    inside.append((times[start] + first_us - times[k], speeds[k]))
            means = ((integral[end] - integral[start]) / max(1, whole_us)).tolist()
            yield Bin(
                start == first,
                start_mps,
                means[:3],
                means[3:],
                first_us,
                whole_us - first_us,
                inside,
                end_mps,
                times[end],
                end - start + (start == first),
            )
            start = end
            if not full:
                break


def standing(logs: Sequence[Log], calibration: CalibrationFile, steps: "Steps") -> StandingVertical:
    """Return the StandingVertical from the stops in all logs.

    Only stops are computed, so this is much faster than an alignment.
    """
    standing = StandingVertical()
    speed_mps, silent_us = -1.0, 0  # no speed yet
    for log in logs:
        _end_stop(standing)
        for part in drive_bins(log, calibration, BIN_US):
            length_us = part.first_us + part.last_us
            speeds = [part.start_mps, *(mps for _, mps in part.speeds), part.end_mps]
            last_mps = next((max(0.0, mps) for mps in reversed(speeds) if mps is not None), None)
            speed_mps, silent_us = (speed_mps, silent_us + length_us) if last_mps is None else (last_mps, 0)
            if speed_mps >= 0.0 and silent_us <= STALE_US and part.last_us:
                try:
                    standing.update(part.force, part.rate, speed_mps, length_us * 1e-6)
                except ValueError as error:  # raised for a null vector
                    raise _no_gravity(log, part.end_us) from error
            steps.more(part.samples)
    return standing


def feed(
    alignment: DriveAlignment | PublishedAlignment,
    logs: Sequence[Log],
    calibration: CalibrationFile,
    steps: "Steps",
    watch: DriveWatch,
) -> None:
    """Run the logs through an alignment. Call watch.look() after each step that may change its state."""

    def measure(speed_mps: float, age_us: int, time_us: int) -> None:
        alignment.measure_speed(speed_mps, age_us)
        watch.look(time_us / 1e6)

    length_us = BIN_US if isinstance(alignment, DriveAlignment) else 0  # the published method uses single samples
    for log in logs:
        watch.begin(log.name)
        end_us = 0
        for part in drive_bins(log, calibration, length_us):
            if part.begins and (end_us or log is not logs[0]):
                alignment.interrupt()
                if end_us == 0:
                    _end_stop(alignment.standing)
            try:
                end_us = part.end_us
                if part.start_mps is not None:
                    measure(part.start_mps, 0, end_us - part.first_us - part.last_us)
                if part.first_us:
                    alignment.update(part.force, part.rate, part.first_us)
                for age_us, mps in part.speeds:
                    measure(mps, age_us, end_us - part.last_us - age_us)
                if part.last_us:
                    alignment.update(part.force, part.rate, part.last_us)
                if part.end_mps is not None:
                    measure(part.end_mps, 0, end_us)
            except ValueError as error:  # raised for a null vector
                raise _no_gravity(log, end_us) from error
            steps.more(part.samples)
        if log is logs[-1]:
            alignment.finish()
        watch.end(end_us / 1e6)


def _no_gravity(log: Log, end_us: int) -> InputError:
    what = f"{log.name}, at {end_us / 1e6:.1f} s: accelerations of nearly 0"
    return InputError(f"{what}: at rest 1 g is needed, check the sensor")


def _end_stop(standing: StandingVertical) -> None:
    """End a stop at the end of a log, because the next log may begin at another place."""
    standing.update((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 2.0 * MOVED_MPS, 0.0)  # pretend that the vehicle moves


class Steps:
    """Counts samples for a progress callback."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress, self._done, self._said, self._total = progress, 0, 0, total

    def more(self, samples: int) -> None:
        """Add samples to the count, and call the callback if enough of them are new."""
        self._done += samples
        if self._progress and (self._done - self._said >= _CHUNK or self._done == self._total):
            self._said = self._done
            self._progress(self._done, self._total)
