"""Shown against true lean, from what the LCD said."""

import re
from math import sqrt
from typing import TypedDict

from rich.table import Table

_LEAN_PAGE = re.compile(r"Lean +(\d+)° *(left|right)?")
_ROLLING = ("roll in", "roll out", "roll")
_STANDING = ("kickstand", "upright", "moving", "wait")


class State(TypedDict):
    """One of the device's ticks. of_s: how long it takes in all, None where nobody knows; lcd: both
    lines; lean_deg: the true one, > 0 to the right; phase: what the bike does; pressed: the button is."""

    t_s: float
    of_s: float | None
    lcd: list[str]
    lean_deg: float
    speed_mps: float
    phase: str
    pressed: bool


def shown_lean(lcd: list[str]) -> float | None:
    """The lean an LCD shows in degrees, > 0 to the right; None when it shows something else."""
    found = _LEAN_PAGE.match(lcd[0])
    if not found:
        return None
    return -float(found[1]) if found[2] == "left" else float(found[1])


class Score:
    """Collects the device's ticks while the lean page is shown."""

    def __init__(self) -> None:
        self._pairs: dict[str, list[tuple[float, float]]] = {}  # stretch: (true, shown)
        self._phase = ""
        self._turns = 0

    def add(self, state: State) -> None:
        """Take one tick."""
        phase = state["phase"]
        self._turns += phase == "held turn" != self._phase
        self._phase = phase
        shown = shown_lean(state["lcd"])
        if shown is not None:
            self._pairs.setdefault(self._stretch(phase), []).append((state["lean_deg"], shown))

    def _stretch(self, phase: str) -> str:
        if phase == "held turn":
            return f"held turn {self._turns}"
        if phase in _ROLLING:
            return "rolling in and out"
        return "standing" if phase in _STANDING else "straight on"

    def table(self) -> Table | str:
        """One row a held turn, then the other stretches, then the whole."""
        if not self._pairs:
            return "The lean was not shown yet."
        table = Table(title="Lean in degrees, > 0 to the right: shown on the LCD against true")
        table.add_column("")
        for name in ("samples", "true mean", "shown mean", "rms error", "worst"):
            table.add_column(name, justify="right")
        names = sorted(self._pairs, key=lambda name: not name.startswith("held"))
        for name in names:
            table.add_row(name, *_figures(self._pairs[name]))
        table.add_section()
        table.add_row("all", *_figures([pair for name in names for pair in self._pairs[name]]))
        return table


def _figures(pairs: list[tuple[float, float]]) -> list[str]:
    errors = [shown - true for true, shown in pairs]
    count = len(pairs)
    true_mean = sum(true for true, _ in pairs) / count
    shown_mean = sum(shown for _, shown in pairs) / count
    rms = sqrt(sum(error * error for error in errors) / count)
    worst = max(errors, key=abs)
    return [str(count), f"{true_mean:.1f}", f"{shown_mean:.1f}", f"{rms:.1f}", f"{worst:+.1f}"]
