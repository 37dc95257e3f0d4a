"""One pass over a ride: all that its report and its pictures show."""

from collections.abc import Iterator
from dataclasses import dataclass

from ..replay.forward_sign import ForwardSign, exchanged_line
from .alignment_quality import Quality, quality
from .channels import Channels, Ride
from .stops.brake_test import RATE_S, Stop, stops
from .stops.standstill import standing
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
    forward: float | None  # how well forward is the way the speed grows: 1, or -1 where it is backward
    exchanged: str  # what to say where forward is backward; its stops are none

    @property
    def has_speed(self) -> bool:
        """The log has one that is not always 0."""
        return self.summary.speed_mps.time_s is not None


def look(ride: Ride) -> Look:
    """Read the ride through. Raises InputError."""
    summary, sign = Summary(), ForwardSign()

    def blocks() -> Iterator[Channels]:
        for _, block in ride.blocks("reading"):
            summary.add(block)
            sign.add(block.t_s, block.forward_g, block.speed_mps)
            yield block

    course = joined(list(thinned(blocks(), RATE_S)))
    found = quality(course, standing(course))
    if not sign.exchanged:
        return Look(ride, summary, course, stops(course), found, sign.correlation, "")
    line = exchanged_line(ride.car, ride.calibration.side, found.roll_deg)
    return Look(ride, summary, course, [], found, sign.correlation, line)
