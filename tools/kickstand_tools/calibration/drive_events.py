"""What happens in a drive, for the user who waits for its alignment."""

from collections.abc import Callable
from dataclasses import dataclass

from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand.errors import Refusal

from ..common.messages import Message
from .published import PublishedAlignment
from .refusals import of_firmware

# DriveEvent.what
LOG_BEGINS = "log-begins"
LOG_WITHOUT_EVENTS = "log-without-events"
USED, TURNING = "used", "turning"
PROBLEM = "problem"
READY, NOT_READY = "ready", "not-ready"


@dataclass
class DriveEvent:
    """Something that happened in a drive.

    log: name of the log.
    t_s: seconds since the first sample of this log.
    what: one of these constants:
        USED: a braking event in a straight line, or a start, was counted.
        TURNING: a braking event in a bend was not counted.
        PROBLEM: speed or mount have a fault.
        READY: the alignment is good enough.
        NOT_READY: the alignment is no longer good enough.
        LOG_BEGINS: a log begins.
        LOG_WITHOUT_EVENTS: a log ends, and nothing has happened in it.
    counted, needed: number of counted events, and number of events that are needed.
    quality_deg: standard error of forward.
    refusal: the reason for PROBLEM, or for NOT_READY unless a PROBLEM gives the reason; otherwise None.
    """

    log: str
    t_s: float
    what: str
    counted: int
    needed: int
    quality_deg: float
    refusal: Message | None = None


class DriveWatch:
    """Emits a DriveEvent for each change of an alignment's state."""

    def __init__(
        self, alignment: DriveAlignment | PublishedAlignment, on_event: Callable[[DriveEvent], None] | None
    ) -> None:
        self.events: list[DriveEvent] = []
        self.ready_s = 0.0  # seconds of all logs together until the alignment was first READY
        self._alignment, self._on_event = alignment, on_event
        self._log = ""
        self._used = self._turned = 0  # events so far
        self._ready = False
        self._problem: Refusal | None = None
        self._elapsed_s = 0.0  # duration of the earlier logs

    def begin(self, log: str) -> None:
        """Set the name of the log for the following events, and emit LOG_BEGINS."""
        self._log = log
        self._add(0.0, LOG_BEGINS)

    def end(self, t_s: float) -> None:
        """End a log, whose last sample is at t_s: emit the pending events, or LOG_WITHOUT_EVENTS."""
        self.look(t_s)
        if self.events[-1].what == LOG_BEGINS:
            self._add(t_s, LOG_WITHOUT_EVENTS)
        self._elapsed_s += t_s

    def look(self, t_s: float) -> None:
        """Emit an event for each change since the last call. t_s: the time in this log."""
        alignment = self._alignment
        if alignment.counted > self._used:
            self._add(t_s, USED)
        elif alignment.turned > self._turned:
            self._add(t_s, TURNING)
        self._used, self._turned = alignment.counted, alignment.turned
        problem = alignment.problem
        if problem and not self._problem:
            self._add(t_s, PROBLEM, problem)
        self._problem = problem
        if alignment.ready != self._ready:
            self._ready = alignment.ready
            self._add(t_s, READY if self._ready else NOT_READY, None if self._ready or problem else alignment.reason)
            self.ready_s = self.ready_s or self._elapsed_s + t_s

    def _add(self, t_s: float, what: str, refusal: Refusal | None = None) -> None:
        alignment = self._alignment
        reason = of_firmware(refusal) if refusal else None
        event = DriveEvent(self._log, t_s, what, alignment.counted, alignment.needed, alignment.quality_deg, reason)
        self.events.append(event)
        if self._on_event:
            self._on_event(event)
