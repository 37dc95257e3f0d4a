"""What a drive still lacks before it gives the alignment."""

from ..errors import AlignmentError
from .standing import COUNTS_S, MOVED_MPS, SETTLE_S


def not_ready(drive, counted, needed, turned):
    """What a DriveAlignment that has no problem is still waiting for, as an AlignmentError. counted, needed, turned:
    braking events used, needed, and not used because of a turn."""
    if not drive.heard:
        return AlignmentError("no-speed")
    if drive.top_mps < MOVED_MPS:
        return AlignmentError("not-driven", needed)
    if drive.vehicle == "car" and not drive.standing.stops:
        return AlignmentError("not-stopped", SETTLE_S + COUNTS_S)
    if counted < needed:
        return AlignmentError("few-brakings", counted, needed, turned)
    quality = drive.quality
    if not quality.agree and quality.quality_deg < 180.0:
        return AlignmentError("parts-differ", max(quality.parts.forward_deg, quality.halves_deg))
    return AlignmentError("forward-uncertain", min(drive.quality_deg, 180.0), drive.events.brakings)
