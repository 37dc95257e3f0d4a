"""The page of alignment by driving: what it waits for, how far it is, what came of it."""

from ..drive_alignment.alignment import (
    BRAKING,
    READY,
    TURNING,
    WAITING_FOR_BRAKING,
    WAITING_FOR_SPEED,
    WAITING_FOR_STOP,
)
from . import messages

_WAITS = {
    WAITING_FOR_SPEED: "waiting: speed",
    WAITING_FOR_STOP: "stop needed",
    WAITING_FOR_BRAKING: "brake straight",
    BRAKING: "braking...",
    TURNING: "turn not counted",
}


def lines(background, now_ms):
    """Two lines of 16 characters. background: a BackgroundAlignment, of which this reads drive, state, result and the
    fault of its speed."""
    drive = background.drive
    if drive.problem is not None:
        return messages.lines(drive.problem)
    if background.result and (drive.ready or not drive.counted):
        return messages.lines(background.result)
    state = background.state
    if state == READY:
        return "Ready:", "stop to save it"
    if state == WAITING_FOR_SPEED:
        fault = background.speed.fault(now_ms)
        return messages.lines(fault) if fault else ("Align by drive", _WAITS[state])
    if drive.counted < drive.needed:
        return "Brakings %3d/%d" % (drive.counted, drive.needed), _WAITS[state]
    return "Brake%3d +-%4.1f%s" % (drive.counted, min(drive.quality_deg, 99.9), messages.DEGREE), _WAITS[state]
