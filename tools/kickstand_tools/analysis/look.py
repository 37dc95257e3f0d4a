"""One pass over a ride: all that its report and its pictures show."""

from collections.abc import Iterator
from dataclasses import dataclass

from .alignment_quality import Quality, quality
from .brake_test import RATE_S, Stop, stops
from .channels import Channels, Ride
from .standstill import standing
from .summary import Summary
from .thin import joined, thinned


@dataclass
class Look:
    """A ride: its statistics of every sample, and its course in means of RATE_S."""

    ride: Ride
    summary: Summary
    course: Channels
    stops: list[Stop]
    quality: Quality

    @property
    def has_speed(self) -> bool:
        """The log has one that is not always 0."""
        return self.summary.speed_mps.time_s is not None


def look(ride: Ride) -> Look:
    """Read the ride through. Raises InputError."""
    summary = Summary()

    def blocks() -> Iterator[Channels]:
        for _, block in ride.blocks("reading"):
            summary.add(block)
            yield block

    course = joined(list(thinned(blocks(), RATE_S)))
    return Look(ride, summary, course, stops(course), quality(course, standing(course)))
