"""The messages for the firmware's refusals of a drive.

Each code of kickstand.drive_alignment has a class. of_firmware() converts a refusal to its message.
"""

from kickstand.errors import Refusal

from ..checks.units import SpeedStuck, SpeedUnit
from ..common.messages import Message, Remedy, by_code, defined_in

_MOVED = {
    "between-stops": "two stops differ by over {angle_deg:.0f} degrees; those of a motorcycle on its kickstand do: is "
    "it one?",
    "vertical": "the vertical changed by {angle_deg:.0f} degrees during the drive",
    "parts": "the vertical is no longer where it was",
    "since-standing": "standing and driving differ by {angle_deg:.0f} degrees",
    "since-upright": "the upright pose and driving differ by {angle_deg:.0f} degrees",
    "forward": "forward is no longer where it was",
    "since-alignment": "it is no longer as it was aligned",
}


class MountMoved(Message):
    """The mount has moved.

    how: a key of _MOVED.
    angle_deg: angle by which the mount moved; None if unknown.
    """

    how: str
    angle_deg: float | None = None

    code = "mount-moved"

    def sentence(self) -> str:
        """See Message."""
        return "the mount has moved: " + _MOVED[self.how].format(angle_deg=self.angle_deg)


class SpeedNegative(Message):
    """The speed is below 0."""

    speed_mps: float

    code = "speed-negative"
    text = "the speed is {speed_mps:.1f} m/s: it must not be negative"


class SpeedLate(Message):
    """The speed is delayed too much relative to the force."""

    late_s: float

    code = "speed-late"
    text = "the speed is {late_s:.1f} s late"
    todo = Remedy("under 2 s are needed")


class NoSpeed(Message):
    """There is no speed."""

    code = "no-speed"
    text = "no speed"
    todo = Remedy("it needs a speed, from a GPS or a wheel")


class NotDriven(Message):
    """The vehicle did not move. needed: number of braking events that are needed."""

    needed: int

    code = "not-driven"
    text = "it only stood still"
    todo = Remedy("drive, and brake in a straight line {needed} times")


class NotStopped(Message):
    """The vehicle did not stop."""

    stop_s: float

    code = "not-stopped"
    text = "it never stood still"
    todo = Remedy("a stop of {stop_s:.0f} s is needed for the vertical")


class FewEvents(Message):
    """There are too few braking events.

    used: number of braking events that count.
    needed: number of braking events that are needed.
    turned: number of braking events in bends, which do not count.
    """

    used: int
    needed: int
    turned: int

    code = "few-events"
    text = (
        "only {used} of {needed} braking events in a straight line, {turned} more were not straight: not enough for "
        "forward"
    )


class PartsDiffer(Message):
    """Two parts of the drive give two directions of forward."""

    differ_deg: float

    code = "parts-differ"
    text = "two parts of the drive disagree by {differ_deg:.0f} degrees about forward"
    todo = Remedy("did the mount move? Else drive on")


class Uncertain(Message):
    """The standard error of forward is too large."""

    sigma_deg: float
    used: int

    code = "uncertain"
    text = "forward is known to {sigma_deg:.1f} degrees only, after {used} braking events"
    todo = Remedy("drive on")


CODES = by_code(*defined_in(__name__), SpeedStuck, SpeedUnit)


def of_firmware(refusal: Refusal) -> Message:
    """Return the message for an AlignmentError of a drive."""
    return CODES[refusal.code](*refusal.values)
