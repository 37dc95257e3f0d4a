"""The page of the alignment by driving. It is imported only with a speed source."""

from ..board.display import DEGREE
from ..drive_alignment import alignment
from .pages import words


def drive(background, now_ms):
    """The page with the state, the progress and the result of alignment by driving.

    Args:
        background: a BackgroundAlignment.
        now_ms: ticks_ms().
    """
    drive, state = background.drive, background.state()
    if drive.problem is not None:
        return words(drive.problem)
    if background.result and (drive.ready or not drive.counted):
        return words(background.result)
    if state == alignment.READY:
        return "Ready:", "stop to save it"
    if state == alignment.WAITING_FOR_SPEED:
        fault = background.speed.source.fault(now_ms)
        return words(fault) if fault else ("Align by drive", "waiting: speed")
    # for the states from WAITING_FOR_STOP to TURNING
    waiting = ("stop needed", "brake straight", "braking...", "turn not counted")[state - alignment.WAITING_FOR_STOP]
    if drive.counted < drive.needed:
        return "Brakings %3d/%d" % (drive.counted, drive.needed), waiting
    return "Brake%3d +-%4.1f%s" % (drive.counted, min(drive.quality_deg, 99.9), DEGREE), waiting
