"""The page for alignment by driving. The page shows the state, the progress and the result."""

from ..drive_alignment import alignment
from . import messages

_WAITS = {
    alignment.WAITING_FOR_SPEED: "waiting: speed",
    alignment.WAITING_FOR_STOP: "stop needed",
    alignment.WAITING_FOR_BRAKING: "brake straight",
    alignment.BRAKING: "braking...",
    alignment.TURNING: "turn not counted",
}


def lines(background, now_ms):
    """Return the two lines of the page.

    Args:
        background: a BackgroundAlignment.
        now_ms: ticks_ms().
    """
    drive = background.drive
    if drive.problem is not None:
        return messages.lines(drive.problem)
    if background.result and (drive.ready or not drive.counted):
        return messages.lines(background.result)
    state = background.state
    if state == alignment.READY:
        return "Ready:", "stop to save it"
    if state == alignment.WAITING_FOR_SPEED:
        fault = background.speed.source.fault(now_ms)
        return messages.lines(fault) if fault else ("Align by drive", _WAITS[state])
    if drive.counted < drive.needed:
        return "Brakings %3d/%d" % (drive.counted, drive.needed), _WAITS[state]
    return "Brake%3d +-%4.1f%s" % (drive.counted, min(drive.quality_deg, 99.9), messages.DEGREE), _WAITS[state]
