"""Reads a ride once and keeps the data for its report and its pictures."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..calibration.mount import ForwardExchanged
from ..checks.sensor import FrozenReadings
from ..common.messages import Message
from ..logs.source import Progress
from ..signals import Array, Bools, smoothed
from .alignment_quality import Quality, quality
from .channels import Channels, downsampled, joined, spacing_s
from .ride import Ride
from .standstill import standing
from .stops import RATE_S, Stop, stops_of
from .summary import Summary

# Columns of the course that are not kept. In a long ride, they would use a quarter of the memory.
_NOT_KEPT = ("lean_formula_deg", "roll_rate_dps", "temp_c", "shown_g", "lean_sigma_deg", "utc_s")
# Averaging time of rates and forces that show whether a vehicle has moved. An idling engine at standstill shakes as
# much as a road, but the means over OVER_S hardly change.
OVER_S = 1.0
TURNS_DPS, PUSHES_G = 3.0, 0.05
MOVES_MPS = 1.0


@dataclass
class Overview:
    """The data of a ride for its report and its pictures.

    ride: the log with its calibration.
    summary: summary of all samples.
    course: channels averaged over RATE_S. Columns that neither report nor pictures need are NaN; vehicle_channels() has
        them.
    stops: stops as in a brake test; empty if forward and backward are exchanged.
    quality: how far the aligned axes seem to be off.
    riding_s: time without the standstills of standing(), in s, as shown by `report`.
    notices: remarks about the log, and contradictions to the calibration.
    """

    ride: Ride
    summary: Summary
    course: Channels
    stops: list[Stop]
    quality: Quality
    riding_s: float
    notices: list[Message]

    @property
    def exchanged(self) -> Message | None:
        """The notice that forward and backward are exchanged; None without this notice."""
        return next((notice for notice in self.notices if isinstance(notice, ForwardExchanged)), None)

    @property
    def has_speed(self) -> bool:
        """True if the log has a speed that is not always 0."""
        return self.summary.speed_mps.time_s is not None


def overview(ride: Ride, progress: Progress | None = None, keep: Callable[[Array], None] | None = None) -> Overview:
    """Read a ride of open_ride() part by part, so the memory hardly grows with the ride's length.

    progress: called with (done, total) of the log's samples.
    keep: called with the smoothed lean of successive samples, see Ride.read().
    Raises InputError.

    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log, open_ride
    >>> log = Log(np.arange(251) / 100.0, np.tile([0.0, 1.0, 0.0], (251, 1)), np.zeros((251, 3)))
    >>> seen = overview(open_ride(log, CalibrationFile(aligned=True)))
    >>> seen.summary.duration_s, seen.stops
    (2.5, [])
    """
    total = Summary()
    reading = ride.read(progress, keep)

    def parts() -> Iterator[Channels]:
        for part in reading.parts():
            total.add(part)
            yield replace(part, **dict.fromkeys(_NOT_KEPT, np.full(len(part.t_s), np.nan)))

    course = joined(downsampled(parts(), RATE_S))
    notices = reading.notices()
    # A speed that is always 0 does not prove a standstill, because a broken contact at the wheel also gives 0.
    if total.speed_mps.time_s is None:
        course = replace(course, speed_mps=np.broadcast_to(np.nan, len(course.t_s)))
    frozen_s = sum((notice.seconds for notice in notices if isinstance(notice, FrozenReadings)), 0.0)
    # The notice is about the whole log, even if the ride is a stretch of the log.
    total.frozen_s = min(frozen_s, total.missing_s) if ride.is_stretch else frozen_s
    still = standing(course)
    alignment = quality(course, still)
    moved_s = min(total.riding_s, _riding_s(course, still, whole_ride=not ride.is_stretch))
    notices = [replace(n, roll_deg=alignment.roll_deg) if isinstance(n, ForwardExchanged) else n for n in notices]
    result = Overview(ride, total, course, [], alignment, moved_s, notices)
    if not result.exchanged:
        result.stops = stops_of(course, still)
    return result


def _riding_s(ride: Channels, standing: Bools, whole_ride: bool = True) -> float:
    """Return the time for which a vehicle was moving, in s.

    ride: evenly spaced samples (see downsampled()).
    standing: True where the vehicle stands still, shape (n).
    whole_ride: True for a whole ride. In a stretch of a ride, a vehicle may go straight ahead, or keep the same turn,
        from start to end.
    """
    if whole_ride and not _has_moved(ride):
        return 0.0
    return float(np.count_nonzero(~standing)) * spacing_s(ride)


def _has_moved(ride: Channels) -> bool:
    if np.any(~np.isnan(ride.speed_mps)):
        return bool(np.nanmax(ride.speed_mps) > MOVES_MPS)
    half = round(0.5 * OVER_S / spacing_s(ride))
    if len(ride.t_s) <= 2 * half:
        return False
    inner = slice(half, len(ride.t_s) - half)  # near the ends, a mean contains mostly the first or the last sample
    turns, pushes = (smoothed(values, ride.t_s, OVER_S)[inner] for values in (ride.yaw_rate_dps, ride.forward_g))
    return _changes(turns) > TURNS_DPS or _changes(pushes) > PUSHES_G


def _changes(means: Array) -> float:
    """Return the largest difference of the means from their median.

    The median is the gyro's bias, or the force due to the slope of the ground.
    """
    return float(np.max(np.abs(means - np.median(means))))
