"""Runs recorded drives through the firmware's classes for alignment by driving."""

from collections.abc import Sequence

from kickstand.drive_alignment.alignment import STALE_US, DriveAlignment
from kickstand.drive_alignment.history import BIN_US
from kickstand.drive_alignment.vertical import MOVED_MPS, StandingVertical

from ..errors import InputError
from ..logs.log import Log
from ..logs.source import Progress
from .drive_bins import drive_bins
from .drive_events import DriveWatch
from .file import CalibrationFile
from .published import PublishedAlignment

_CHUNK = 1000  # least number of samples between two calls of progress


def standing(logs: Sequence[Log], calibration: CalibrationFile, steps: "Steps") -> StandingVertical:
    """The StandingVertical of the stops in all logs. Uses nothing else, so it is much faster than an alignment."""
    standing = StandingVertical()
    speed_mps, silent_us = -1.0, 0  # none yet
    for log in logs:
        _end_stop(standing)
        for part in drive_bins(log, calibration, BIN_US):
            length_us = part.first_us + part.last_us
            new = [part.start_mps, *(mps for _, mps in part.speeds), part.end_mps]
            last_mps = next((max(0.0, mps) for mps in reversed(new) if mps is not None), None)
            speed_mps, silent_us = (speed_mps, silent_us + length_us) if last_mps is None else (last_mps, 0)
            if speed_mps >= 0.0 and silent_us <= STALE_US and part.last_us:
                standing.update(part.force, part.rate, speed_mps, length_us * 1e-6)
            steps.more(part.samples)
    return standing


def feed(
    alignment: DriveAlignment | PublishedAlignment,
    logs: Sequence[Log],
    calibration: CalibrationFile,
    steps: "Steps",
    watch: DriveWatch,
) -> None:
    """Run the logs through an alignment; watch.look() is called after each step that may change its state."""
    length_us = BIN_US if isinstance(alignment, DriveAlignment) else 0  # the published one looks at single samples
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
                    _measure(alignment, part.start_mps, 0, end_us - part.first_us - part.last_us, watch)
                if part.first_us:
                    alignment.update(part.force, part.rate, part.first_us)
                for age_us, mps in part.speeds:
                    _measure(alignment, mps, age_us, end_us - part.last_us - age_us, watch)
                if part.last_us:
                    alignment.update(part.force, part.rate, part.last_us)
                if part.end_mps is not None:
                    _measure(alignment, part.end_mps, 0, end_us, watch)
            except ValueError as error:  # of a null vector
                what = f"{log.name}, at {end_us / 1e6:.1f} s: accelerations of nearly 0"
                raise InputError(f"{what}: at rest 1 g is needed, check the sensor") from error
            steps.more(part.samples)
        if log is logs[-1]:
            alignment.finish()
        watch.end(end_us / 1e6)


def _end_stop(standing: StandingVertical) -> None:
    """End a stop at the end of a log: at the beginning of the next one the vehicle stands elsewhere."""
    standing.update((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 2.0 * MOVED_MPS, 0.0)  # as if it had driven


def _measure(
    alignment: DriveAlignment | PublishedAlignment, speed_mps: float, age_us: int, time_us: int, watch: DriveWatch
) -> None:
    alignment.measure_speed(speed_mps, age_us)
    watch.look(time_us / 1e6)


class Steps:
    """Counts samples for a progress callback."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress, self._done, self._said, self._total = progress, 0, 0, total

    def more(self, samples: int) -> None:
        """Count so many more samples."""
        self._done += samples
        if self._progress and (self._done - self._said >= _CHUNK or self._done == self._total):
            self._said = self._done
            self._progress(self._done, self._total)
