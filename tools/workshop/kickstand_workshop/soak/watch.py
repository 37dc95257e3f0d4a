"""Watches display and bus during a trip. Records broken invariants and the worst figures."""

import re
from collections.abc import Callable

from kickstand_tools.simulated_board.lcd import shown_lean
from kickstand_tools.simulated_board.simulator import Board

from .trip import QUIET_S, SENSOR, Trip

LOOK_S = 0.1
WRONG_DEG, WRONG_S = 10.0, 5.0  # a lean with an error over WRONG_DEG may be shown for at most WRONG_S
LAG_S = 0.6  # a shown lean is right if it was the true lean at some moment of the last LAG_S seconds
STILL_S = 2.0  # time without a transfer to the sensor after which the program counts as hanging
# Longest time for which a lean may be shown without new readings: half a second, and the time for a page and a check
STALE_S = 0.7
SAYS_WHY = re.compile("No sensor|Sensor |Readings lost|Kickstand|Lean  --")


class Watch:
    """Checks the invariants during a trip.

    found: One line per broken invariant.
    wrong_s: Longest time for which a lean with an error over WRONG_DEG was shown.
    error_deg: Largest error that was shown for a second.
    stale_s: Longest time for which a lean was shown while no sample was read.
    without_s: Longest time without a lean while the bike was riding without a fault.
    changes: Number of changes of the display.
    """

    def __init__(self, board: Board, trip: Trip, readings: Callable[[], int]) -> None:
        self.found: list[str] = []
        self.wrong_s = self.error_deg = self.stale_s = self.without_s = 0.0
        self.changes = 0
        self._board, self._trip, self._readings = board, trip, readings
        self._text = ["", ""]
        self._wrong_since: float | None = None
        self._errors: list[float] = []
        self._read = (0, 0.0)
        self._transfers = (0, 0.0)
        self._why_since: float | None = None
        board.every(LOOK_S, self._look)

    def _report(self, what: str) -> None:
        line = f"{what} at {self._board.clock.now_us / 1e6:.1f} s: {'|'.join(self._text)}"
        if not self.found or self.found[-1].split(" at ")[0] != what:
            self.found.append(line)

    def _look(self) -> None:
        t_s = self._board.clock.now_us / 1e6
        if t_s > self._trip.until_s:
            return
        text = self._board.lcd.text()
        if text != self._text:
            self._text = text
            self.changes += 1
        if text[0].startswith(("Error", "Incomplete", "config.py")):
            self._report("the program has failed")
        busy = self._during_fault(t_s)
        self._alive(t_s, busy)
        lean = shown_lean(text)
        self._accurate(t_s, lean)
        self._fresh(t_s, lean)
        self._explained(t_s, text[0])

    def _during_fault(self, t_s: float) -> bool:
        return any(begin <= t_s < end for _, begin, end in self._trip.faults)

    def _alive(self, t_s: float, busy: bool) -> None:
        count = self._board.sensor_bus.transfers.get(SENSOR, 0)
        if count != self._transfers[0] or busy:
            self._transfers = (count, t_s)
        elif t_s - self._transfers[1] > STILL_S:
            self._report("the program hangs")

    def _accurate(self, t_s: float, lean: float | None) -> None:
        error = 0.0
        if lean is not None:
            error = min(abs(lean - self._trip.ride.truth(max(0.0, t_s - k * LAG_S / 6))[0]) for k in range(7))
        self._errors = [*self._errors[-9:], error]
        self.error_deg = max(self.error_deg, min(self._errors))
        if error <= WRONG_DEG:
            self._wrong_since = None
            return
        self._wrong_since = self._wrong_since if self._wrong_since is not None else t_s
        self.wrong_s = max(self.wrong_s, t_s - self._wrong_since)
        if self.wrong_s > WRONG_S and t_s - self._wrong_since > WRONG_S:
            self._report("a wrong lean is shown as good")

    def _fresh(self, t_s: float, lean: float | None) -> None:
        """Check that a lean disappears when no more readings arrive, unless the display cannot be reached."""
        count = self._readings()
        # The program cannot change the display if the display does not answer or the program gets no processor time
        excused = any(
            begin <= t_s < end + (QUIET_S if "display" in name else 0.0)
            for name, begin, end in self._trip.faults
            if "display" in name or name == "FIFO overflows"
        )
        if count != self._read[0] or lean is None or excused:
            self._read = (count, t_s)
            return
        self.stale_s = max(self.stale_s, t_s - self._read[1])
        if t_s - self._read[1] > STALE_S:
            self._report("an old lean is shown")

    def _explained(self, t_s: float, line: str) -> None:
        """Check that the lean replaces a fault's message when the fault is over."""
        if self._trip.ride.truth(t_s)[1] < 4.0 or self._during_fault(t_s) or not SAYS_WHY.match(line):
            self._why_since = None
            return
        self._why_since = self._why_since if self._why_since is not None else t_s
        self.without_s = max(self.without_s, t_s - self._why_since)
        if t_s - self._why_since > 10.0 and not line.startswith("Lean"):
            self._report("a fault is over and still shown")
