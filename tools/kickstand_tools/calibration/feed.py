"""Passes the samples of drives to a DriveAlignment as sums over 100 ms, computed with numpy."""

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from kickstand.drive_alignment.alignment import MOVED_MPS, STALE_US, DriveAlignment, StandingVertical
from kickstand.drive_alignment.events import BIN_US
from kickstand.units import GAP_US

from ..common.messages import InputError
from ..logs.log import Log
from ..logs.source import Progress
from .drive_events import DriveWatch
from .file import CalibrationFile
from .published import PublishedAlignment

_CHUNK = 1000  # least number of samples between two calls of progress


@dataclass
class _Bin:
    """Successive samples that are passed to DriveAlignment as sums."""

    begins: bool  # True if the samples do not continue the previous bin
    first_us: int  # duration of all samples but the last
    last_us: int  # duration of the last sample; 0 if the bin is not full
    end_us: int  # time of the last sample in the log
    samples: int
    force: list[float]  # mean force along the sensor's axes, 3 values in g
    rate: list[float]  # mean rate along the sensor's axes, 3 values in deg/s
    start_mps: float | None = None  # if `begins`, the speed at the start of the bin; None without a new speed
    # The speeds during first_us, each as (microseconds before the end of first_us, m/s)
    speeds: list[tuple[int, float]] = field(default_factory=list)
    end_mps: float | None = None  # speed of the last sample; None without a new speed


def _bins(log: Log, calibration: CalibrationFile, length_us: int) -> Iterator[_Bin]:
    """Split the samples of a log into the shortest bins that last at least length_us.

    The last bin before a gap or the end may be shorter. If length_us is 0, each bin has one sample, but the first bin
    of each stretch has two.
    """
    time_us = log.time_us
    step_us = np.diff(time_us, prepend=time_us[0])
    is_gap = step_us > GAP_US
    values = np.column_stack(calibration.in_sensor(log.accel_g, log.gyro_dps))
    integral = np.cumsum(values * np.where(is_gap, 0, step_us)[:, None], axis=0)
    times, speeds = time_us.tolist(), log.speed_mps.tolist()
    logged = deque(np.flatnonzero(~np.isnan(log.speed_mps)).tolist())  # samples with a speed
    for first, stop in pairwise([0, *np.flatnonzero(is_gap).tolist(), len(times)]):
        start, full = first, True
        while full:
            end = min(bisect_left(times, times[start] + max(1, length_us), start + 1, stop), stop - 1)
            length = times[end] - times[start]
            full = length >= max(1, length_us)
            first_us = times[end - 1] - times[start] if full else length
            force, rate = np.split((integral[end] - integral[start]) / max(1, length), 2)
            begins = start == first
            samples = end - start + begins
            part = _Bin(begins, first_us, length - first_us, times[end], samples, force.tolist(), rate.tolist())
            while logged and logged[0] <= end:
                sample = logged.popleft()
                if sample == start:
                    part.start_mps = speeds[sample]
                elif sample == end and full:
                    part.end_mps = speeds[sample]
                else:
                    part.speeds.append((times[start] + first_us - times[sample], speeds[sample]))
            yield part
            full, start = full and end < stop - 1, end


def standing_of(logs: Sequence[Log], calibration: CalibrationFile, count: Callable[[int], None]) -> StandingVertical:
    """Return the StandingVertical from the stops in all logs, much faster than by an alignment."""
    standing = StandingVertical()
    speed_mps, silent_us = -1.0, 0  # no speed yet
    for log in logs:
        _end_stop(standing)
        for part in _bins(log, calibration, BIN_US):
            length_us = part.first_us + part.last_us
            speeds = [part.start_mps, *(mps for _, mps in part.speeds), part.end_mps]
            last_mps = next((max(0.0, mps) for mps in reversed(speeds) if mps is not None), None)
            speed_mps, silent_us = (speed_mps, silent_us + length_us) if last_mps is None else (last_mps, 0)
            if speed_mps >= 0.0 and silent_us <= STALE_US and part.last_us:
                try:
                    standing.update(part.force, part.rate, speed_mps, length_us * 1e-6)
                except ValueError as error:  # raised for a null vector
                    raise _no_gravity(log, part.end_us) from error
            count(part.samples)
    return standing


def feed(
    alignment: DriveAlignment | PublishedAlignment,
    logs: Sequence[Log],
    calibration: CalibrationFile,
    count: Callable[[int], None],
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
        for part in _bins(log, calibration, length_us):
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
            count(part.samples)
        if log is logs[-1]:
            alignment.finish()
        watch.end(end_us / 1e6)


def _no_gravity(log: Log, end_us: int) -> InputError:
    what = f"{log.name}, at {end_us / 1e6:.1f} s: accelerations of nearly 0"
    return InputError(f"{what}: at rest 1 g is needed, check the sensor")


def _end_stop(standing: StandingVertical) -> None:
    """End a stop at the end of a log, because the next log may begin at another place."""
    standing.update((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 2.0 * MOVED_MPS, 0.0)  # pretend that the vehicle moves


def counted(progress: Progress | None, total: int) -> Callable[[int], None]:
    """Return a function that counts samples. It calls progress about every _CHUNK samples, and at the total."""
    done = reported = 0

    def add(samples: int) -> None:
        """Count this many more samples."""
        nonlocal done, reported
        done += samples
        if progress and (done - reported >= _CHUNK or done == total):
            reported = done
            progress(done, total)

    return add
