"""Why driving does not give the alignment: in words, for a console and for the display."""

from ..errors import AlignmentError
from .standing import COUNTS_S, MOVED_MPS, SETTLE_S


def late(lag_s):
    """The speed comes too late."""
    return AlignmentError(
        "the speed is %.1f s late: under 2 s are needed" % lag_s, "Speed %.1f s late" % lag_s, "2 s at most"
    )


def units(slope):
    """The speed does not change as the force says. slope: change of force per change of speed, 1 if all is well."""
    factor = 1.0 / max(slope, 0.01)
    guess = "is it in m/s, and the right vehicle's?"
    if 3.0 < factor < 4.4:
        guess = "it is in km/h, m/s are needed"
    elif 1.8 < factor < 2.5:
        guess = "it is in mph or knots, m/s are needed"
    return AlignmentError(
        "the speed changes %.1f times as much as the force says: %s" % (factor, guess),
        "Speed %.1f times" % min(factor, 99.9),
        "off: its unit?",
    )


def moved(what):
    """The sensor is no longer as it was."""
    return AlignmentError("the mount has moved: " + what, "Mount has moved", "Align again")


def not_ready(drive, counted, needed, turned):
    """What a DriveAlignment that has no problem is still waiting for. counted, needed,
    turned: brakings used, needed, and not used."""
    if not drive.heard:
        return AlignmentError("no speed: it needs a speed, from a GPS or a wheel", "No speed", "GPS or wheel?")
    if drive.top_mps < MOVED_MPS:
        return AlignmentError(
            "it only stood still: drive, and brake in a straight line %d times" % needed,
            "Not driven yet",
            "Brake straight",
        )
    if drive.vehicle == "car" and not drive.standing.stops:
        return AlignmentError(
            "it never stood still: a stop of %.0f s is needed for the vertical" % (SETTLE_S + COUNTS_S),
            "Not stopped yet",
            "Stand for %.0f s" % (SETTLE_S + COUNTS_S),
        )
    if counted < needed:
        return AlignmentError(
            "only %d of %d brakings in a straight line, %d more were not straight: not enough for forward"
            % (counted, needed, turned),
            "Brake straight",
            "%d of %d done" % (counted, needed),
        )
    quality = drive.quality
    if not quality.agree and quality.quality_deg < 180.0:
        degrees = max(quality.parts.forward_deg, quality.halves_deg)
        return AlignmentError(
            "two parts of the drive disagree by %.0f degrees about forward: did the mount move? Else drive on"
            % degrees,
            "Parts differ",
            "by %.0f\xdf: go on" % degrees,
        )
    return AlignmentError(
        "forward is known to %.1f degrees only, after %d brakings: drive on"
        % (drive.quality_deg, drive.events.brakings),
        "Only +-%.1f\xdf yet" % min(drive.quality_deg, 180.0),
        "Brake straight",
    )
