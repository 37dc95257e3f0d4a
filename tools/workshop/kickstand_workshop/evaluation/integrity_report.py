"""Reports the results of integrity.py for each fault, as tables for a terminal, data for JSON, and a picture.

The picture is a Stanford diagram, which aviation uses. The diagram shows the error against the claimed accuracy.
"""

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table

from .integrity import CLAIMS, ERROR_EDGES, STANDS_S, WRONG_DEG, Outcome

CAPTION = (
    f"misleading: seconds per ride in which an error over {WRONG_DEG:.0f} degrees was shown for over {STANDS_S:.0f} s, "
    "mean and largest; shown: share of the riding time with a lean; hidden, named: median of the seconds from the "
    "start of the fault, and share of the rides; right again: share of the rides whose lean is right 10 s after the "
    "end of the fault"
)
_UNKNOWN = "--"


@dataclass
class FaultSummary:
    """The results of all rides with one fault.

    kind: Kind of the fault, or "none".
    title: Name of the fault.
    rides: Number of rides.
    misleading_s: Mean time with a misleading lean.
    most_s: Largest time with a misleading lean.
    available: Mean share of the riding time in which a lean is shown.
    hidden_s: Median time from the start of the fault until the lean is hidden. NaN if it never is.
    hidden: Share of the rides in which the lean is hidden.
    named_s: Median time from the start of the fault until the display names the fault. NaN if it never does.
    named: Share of the rides in which the display names the fault.
    recovered: Share of the rides in which the lean is right after the fault. NaN for a fault that does not end.
    """

    kind: str
    title: str
    rides: int
    misleading_s: float
    most_s: float
    available: float
    hidden_s: float
    hidden: float
    named_s: float
    named: float
    recovered: float


def summaries(outcomes: list[Outcome]) -> list[FaultSummary]:
    """Return one FaultSummary per fault, in the order in which the faults first appear."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in outcomes:
        fault = outcome.job.fault
        groups.setdefault((fault.kind if fault else "none", outcome.job.title), []).append(outcome)
    return [_summary(kind, title, rides) for (kind, title), rides in groups.items()]


def _summary(kind: str, title: str, rides: list[Outcome]) -> FaultSummary:
    misleading = np.array([o.misleading_s for o in rides])
    hidden, named = (np.array([getattr(o, f"{name}_after_s") for o in rides]) for name in ("hidden", "named"))
    recovered = [o.recovered for o in rides if o.recovered is not None]
    return FaultSummary(
        kind,
        title,
        len(rides),
        float(misleading.mean()),
        float(misleading.max()),
        float(np.mean([o.available for o in rides])),
        _median(hidden),
        float(np.mean(np.isfinite(hidden))),
        _median(named),
        float(np.mean(np.isfinite(named))),
        float(np.mean(recovered)) if recovered else float("nan"),
    )


def _median(values: NDArray[np.float64]) -> float:
    there = values[np.isfinite(values)]
    return float(np.median(there)) if len(there) else float("nan")


def diagram(outcomes: list[Outcome], faulty: bool) -> NDArray[np.float64]:
    """Return the shares of the riding time, with a row for each of CLAIMS and a column for each class of ERROR_EDGES.

    faulty: True for the rides with a fault, False for the rides without a fault.
    """
    total = sum((o.diagram for o in outcomes if bool(o.job.fault) == faulty), np.zeros_like(outcomes[0].diagram))
    return total / max(float(total.sum()), 1e-9)


def fault_table(outcomes: list[Outcome]) -> Table:
    """Return a table with one line per fault, and one block of lines per kind of fault."""
    made = Table(title="Rides with a fault of the sensor", caption=CAPTION, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    made.add_column("fault", overflow="fold")
    for head in (
        "mis-\nleading",
        "most",
        "shown",
        "hidden\nafter",
        "of\nrides",
        "named\nafter",
        "of\nrides",
        "right\nagain",
    ):
        made.add_column(head, justify="right")
    kind = ""
    for s in summaries(outcomes):
        if s.kind != kind:
            made.add_row(s.kind, style="cyan")
            kind = s.kind
        made.add_row(
            "  " + s.title,
            f"{s.misleading_s:.1f}",
            f"{s.most_s:.1f}",
            f"{100.0 * s.available:.1f} %",
            _shown(s.hidden_s, ".1f"),
            f"{100.0 * s.hidden:.0f} %",
            _shown(s.named_s, ".1f"),
            f"{100.0 * s.named:.0f} %",
            _shown(100.0 * s.recovered, ".0f") + (" %" if np.isfinite(s.recovered) else ""),
        )
    return made


def diagram_table(outcomes: list[Outcome]) -> Table:
    """Return a table of the results of diagram(), for rides without a fault and for rides with a fault."""
    made = Table(title="Error against claim, % of the riding", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    made.add_column("claimed sigma")
    for low, high in pairwise(ERROR_EDGES):
        made.add_column(f"{low:.0f}-{high:.0f}", justify="right")
    for faulty in (False, True):
        shares = diagram(outcomes, faulty)
        if not shares.any():
            continue
        made.add_row("with a fault, error in degrees:" if faulty else "no fault, error in degrees:", style="cyan")
        for k, row in enumerate(shares):
            shown = [f"{100.0 * share:.2f}" for share in row]
            made.add_row("  " + CLAIMS[k], *shown, end_section=k == len(shares) - 1)
    return made


def document(outcomes: list[Outcome]) -> dict[str, Any]:
    """Return all figures for a JSON file. A figure that is NaN becomes null."""
    rides = [
        {
            "fault": o.job.title,
            "seed": o.job.seed,
            "misleading_s": o.misleading_s,
            "longest_s": o.longest_s,
            "available": o.available,
            "hidden_after_s": o.hidden_after_s,
            "named_after_s": o.named_after_s,
            "recovered": o.recovered,
        }
        for o in outcomes
    ]
    found = {
        "faults": [vars(s) for s in summaries(outcomes)],
        "claims": CLAIMS,
        "error_edges_deg": ERROR_EDGES.tolist(),
        "diagram": {"no fault": diagram(outcomes, False).tolist(), "fault": diagram(outcomes, True).tolist()},
        "rides": rides,
    }
    return json.loads(json.dumps(found), parse_constant=lambda _: None)


def draw(path: Path, outcomes: list[Outcome]) -> None:
    """Write a PNG with the diagrams of rides without and with a fault. Needs matplotlib (see picture.check())."""
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 5), layout="constrained")
    axes = figure.subplots(1, 2, squeeze=False)[0]
    errors = [f"{low:g}-{high:g}" for low, high in pairwise(ERROR_EDGES)]
    wrong = int(np.searchsorted(ERROR_EDGES, WRONG_DEG))
    for axis, faulty in zip(axes, (False, True)):
        shares = 100.0 * diagram(outcomes, faulty)
        axis.pcolormesh(np.where(shares > 0.0, shares, np.nan), norm=LogNorm(1e-3, 100.0), cmap="Blues")
        for (row, column), share in np.ndenumerate(shares):
            if share > 0.0:
                colour = "white" if share > 3.0 else "black"
                axis.text(column + 0.5, row + 0.5, f"{share:.2g}", ha="center", va="center", fontsize=8, color=colour)
        hidden = len(CLAIMS) - 1
        axis.axhline(hidden, color="black", linewidth=1.0)
        axis.plot([wrong, wrong], [0, hidden], color="tab:red", linewidth=2.0)
        axis.text(len(errors) - 0.1, hidden - 0.1, "misleading", ha="right", va="top", color="tab:red")
        axis.text(0.1, hidden - 0.1, "good", va="top", color="tab:green")
        axis.set_xticks(np.arange(len(errors)) + 0.5, errors)
        axis.set_yticks(np.arange(len(CLAIMS)) + 0.5, CLAIMS)
        title = "with a fault" if faulty else "without a fault"
        axis.set(
            title=f"{title}, % of the riding", xlabel="error of the lean, degrees", ylabel="claimed sigma, degrees"
        )
    figure.colorbar(axes[0].collections[0], ax=axes)
    figure.savefig(path, dpi=100)


def write(outcomes: list[Outcome], directory: Path) -> tuple[Path, Path]:
    """Write faults.json and faults.png, and return their paths."""
    figures, drawing = directory / "faults.json", directory / "faults.png"
    figures.write_text(json.dumps(document(outcomes), indent=2) + "\n", encoding="ascii")
    draw(drawing, outcomes)
    return figures, drawing


def _shown(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else _UNKNOWN
