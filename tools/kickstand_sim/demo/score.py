"""Compares the lean on the LCD with the true lean."""

from math import sqrt
from typing import NamedTuple, NotRequired, TypedDict

from rich.table import Table

from ..simulated_board.lcd import shown_lean

_ROLLING = ("roll in", "roll out", "roll")
_STANDING = ("kickstand", "upright", "moving", "wait")


class State(TypedDict):
    """One tick of the device."""

    t_s: float  # simulated time
    of_s: float | None  # duration of the run. None if the bike is steered by hand.
    lcd: list[str]  # both lines of the display
    lean_deg: float  # True lean, positive to the right
    speed_mps: float  # True speed
    phase: str  # name of the bike's present manoeuvre
    pressed: bool  # True while the button is pressed
    # Pixels of an OLED as hex, 64 rows of 128 pixels. A byte has 8 pixels, the leftmost in bit 7.
    pixels: NotRequired[str]


class Figures(NamedTuple):
    """Shown and true lean in one part of the ride, in degrees. An error is the shown lean minus the true lean."""

    samples: int
    true_mean: float
    shown_mean: float
    rms_error: float
    worst: float


class Score:
    """Collects the true and the shown lean for each part of the ride, in degrees; positive to the right.

    Only ticks at which the display shows a lean count. figures() summarises them.
    """

    def __init__(self) -> None:
        self._pairs: dict[str, list[tuple[float, float]]] = {}  # true and shown lean, by part of the ride
        self._phase = ""
        self._turns = 0

    def add(self, state: State) -> None:
        phase = state["phase"]
        self._turns += phase == "held turn" != self._phase
        self._phase = phase
        lean = shown_lean(state["lcd"])
        if lean is not None:
            self._pairs.setdefault(self._part(phase), []).append((state["lean_deg"], lean))

    def _part(self, phase: str) -> str:
        if phase == "held turn":
            return f"held turn {self._turns}"
        if phase in _ROLLING:
            return "rolling in and out"
        return "standing" if phase in _STANDING else "straight on"

    def figures(self) -> dict[str, Figures]:
        """Return the Figures of each part of the ride, held turns first, and of the whole ride as "all".

        The result is empty if no lean was shown.
        """
        names = sorted(self._pairs, key=lambda name: not name.startswith("held"))
        if not names:
            return {}
        parts = {name: _figures(self._pairs[name]) for name in names}
        return parts | {"all": _figures([pair for name in names for pair in self._pairs[name]])}


def table(figures: dict[str, Figures]) -> Table | str:
    """Format the result of Score.figures() for a terminal.

    The table has one row per part of the ride, then a row for the whole ride.
    """
    if not figures:
        return "The lean was not shown yet."
    table = Table(
        title="Lean in degrees, > 0 to the right: shown on the LCD, and true",
        caption="The LCD shows whole degrees, about 0.1 s late, which is most of the error in a quick roll. "
        "The README's figures compare the lean filter's own values, sample by sample.",
    )
    table.add_column("")
    for name in Figures._fields:
        table.add_column(name.replace("_", " "), justify="right")
    for name, part in figures.items():
        if name == "all":
            table.add_section()
        table.add_row(name, str(part.samples), *(f"{value:.1f}" for value in part[1:-1]), f"{part.worst:+.1f}")
    return table


def _figures(pairs: list[tuple[float, float]]) -> Figures:
    errors = [lean - true for true, lean in pairs]
    count = len(pairs)
    return Figures(
        count,
        sum(true for true, _ in pairs) / count,
        sum(lean for _, lean in pairs) / count,
        sqrt(sum(error * error for error in errors) / count),
        max(errors, key=abs),
    )
