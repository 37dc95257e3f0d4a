"""Writes index.html, an overview of a fleet. The page needs no network and no server."""

import heapq
import math
import os
import statistics
from array import array
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from kickstand_tools.common.markup import drawing, element, filled, source_hash
from markupsafe import Markup

from .period import MOVED, PeriodResult, Row
from .plot import Panel, date_text

_WORST, _MOST_MOVED, _MOST_ROWS, _MOST_DOTS, _NAMED_ERRORS = 25, 200, 2000, 3000, 3
_WORDS = {
    "mount-moved": "the mount seems to have moved",
    "speed-unit": "the speed is not in m/s",
    "speed-late": "the speed is over 2 s late",
    "speed-stuck": "the speed is stuck",
    "speed-negative": "the speed is negative",
    "no-speed": "no speed in the logs",
    "few-events": "too little braking in a straight line",
    "not-stopped": "it never stood still",
    "not-driven": "it only stood still",
    "parts-differ": "two parts of the driving differ",
    "uncertain": "forward is not certain enough",
    "left-handed": "axes or rates are mirrored",
    "unreadable": "no log can be read",
    "crashed": "the worker died",
    "timed-out": "it took too long",
    "no-memory": "not enough memory for its logs",
    "fault": "a fault in kickstand",
}
_DAY_S = 86_400.0
_BLUE, _ORANGE = "var(--truth)", "var(--accent)"  # colours of the page


class FleetSummary:
    """A summary of many results for the page. add() takes the results one by one, so memory hardly grows with them.

    count: Number of results.
    driven_s: Length of all logs that were used.
    statuses, reasons: Number of results with each status, and with each pair of status and reason.
    moved_count, errors: Number of rows in the tables of moved mounts and of errors.
    moved_vehicles: Number of mounts that moved, including those with an unknown time of the move.
    first_errors: Pairs of the name of the log or vehicle, and the message.
    test_times, decelerations: Of the brake tests, in s since 1970, or NaN, and in m/s2.
    worst: Rows of the least certain alignments.
    moved: Rows of the largest rotations of mounts, each with the path of the vehicle's picture.
    below: The folder at the start of all names, with its slash. None before the first result.
    """

    def __init__(self) -> None:
        self.count = self.moved_count = self.moved_vehicles = self.errors = 0
        self.driven_s = 0.0
        self.first_errors: list[tuple[str, str]] = []
        self.statuses: Counter[str] = Counter()
        self.reasons: Counter[tuple[str, str]] = Counter()
        self.test_times, self.decelerations = array("d"), array("d")
        self._qualities = array("d")
        self.below: str | None = None
        self.worst: list[Row] = []
        self.moved: list[tuple[Row, str]] = []
        # Rows of the table of vehicles, each with the decelerations of the vehicle. Key True has the aligned vehicles,
        # key False all other vehicles
        self._rows: dict[bool, list[tuple[Row, list[float]]]] = {False: [], True: []}

    def add(self, result: PeriodResult) -> None:
        """Count a result, and keep its rows for the lists of the page."""
        row = result.alignment
        folder = row["vehicle"][: row["vehicle"].rfind("/") + 1]
        common = folder if self.below is None else os.path.commonprefix([self.below, folder])  # noqa: RUF071
        self.below = common[: common.rfind("/") + 1]
        aligned = row["status"] == "aligned"
        self.count += 1
        self.driven_s += row["driven_s"]
        self.statuses[row["status"]] += 1
        if row["reason"]:
            self.reasons[row["status"], row["reason"]] += 1
        self.moved_count += len(result.moved)
        self.moved_vehicles += bool(result.moved) or row["reason"] == MOVED
        self.errors += len(result.errors)
        messages = [(row["log"] or row["vehicle"], row["message"]) for row in result.errors]
        self.first_errors = (self.first_errors + messages)[:_NAMED_ERRORS]
        for test in result.brake_tests:
            self.test_times.append(math.nan if test["utc_s"] is None else test["utc_s"])
            self.decelerations.append(test["mfdd_mps2"])
        if aligned:
            self._qualities.append(row["quality_deg"])
            self.worst = heapq.nlargest(_WORST, [*self.worst, row], key=lambda row: row["quality_deg"])
        moves = [*self.moved, *((move, row["plot"]) for move in result.moved)]
        self.moved = heapq.nlargest(_MOST_MOVED, moves, key=lambda move: move[0]["turned_deg"])
        if len(self._rows[aligned]) < _MOST_ROWS:
            self._rows[aligned].append((row, [test["mfdd_mps2"] for test in result.brake_tests]))

    def page(self, expected: int) -> str:
        """Return the page as HTML. expected: number of results at the end of the run."""
        tests, hours = len(self.decelerations), self.driven_s / 3600.0
        tiles = [
            (self.statuses["aligned"], f"aligned ({_share(self.statuses['aligned'], self.count)})", "good"),
            (self.statuses["refused"], "refused: the drives do not show it", "warn"),
            (self.statuses["error"], "errors: no log could be used", "bad"),
            (self.moved_vehicles, "whose mount seems to have moved", "warn"),
            (tests, "brake tests", ""),
            (round(hours, 1) if hours < 10.0 else round(hours), "hours of driving", ""),
        ]
        return filled(
            _PAGE,
            policy=_POLICY,
            summary=self,
            expected=expected,
            tiles=tiles,
            why=defaultdict(str, _WORDS),
            quality=_quality(self._qualities),
            braking=_braking(self.test_times, self.decelerations),
            rows=(self._rows[False] + self._rows[True])[:_MOST_ROWS],
            spark=_spark,
            median=statistics.median,
            date_text=date_text,
            file_name=lambda log: Path(log).name,
        )


def _share(part: int, total: int) -> str:
    return f"{100.0 * part / total:.0f} %" if total else "--"


def _quality(values: Sequence[float]) -> Markup:
    if not values:
        return Markup()
    top = 1.6  # right end of the scale in degrees; standard errors of aligned vehicles are under 1.5
    title = f"Standard error of forward, median {statistics.median(values):.2f}°"
    return _histogram(values, top, 26, title, 230, "degrees", "vehicles", _BLUE)


def _braking(utc_s: Sequence[float], values: Sequence[float]) -> list[Markup]:
    """Draw a histogram of the decelerations, and the decelerations over time if the times are known."""
    if not values:
        return []
    hardest = min(12.0, max(values) * 1.05)
    title = f"Mean fully developed deceleration, median {statistics.median(values):.2f} m/s²"
    pictures = [_histogram(values, hardest, 24, title, 260, "m/s²", "brake tests", _ORANGE)]
    dated = [(time, value) for time, value in zip(utc_s, values) if time == time]  # not NaN
    if len(dated) > 1:
        first, last = min(dated)[0], max(dated)[0]
        span = (first - _DAY_S / 4.0, last + _DAY_S / 4.0)
        over = Panel(0, 0, 620, 260, span, (0.0, hardest), "Over time, with the median", "", "MFDD, m/s²", date_text)
        over.dots(dated[:: max(1, len(dated) // _MOST_DOTS)], _ORANGE, 1.2)
        over.line(_medians(dated, max(_DAY_S, (last - first) / 30.0)), "currentColor", 2.0)
        pictures.append(_picture(over))
    return pictures


def _histogram(
    values: Sequence[float], top: float, bins: int, title: str, height: float, unit: str, counted: str, colour: str
) -> Markup:
    counts, edges = np.histogram(np.minimum(values, top), bins, (0.0, top))
    panel = Panel(0, 0, 460, height, (0.0, top), (0.0, max(counts.tolist()) * 1.08), title, unit, counted)
    panel.bars(edges.tolist(), counts.tolist(), colour)
    return _picture(panel)


def _picture(panel: Panel) -> Markup:
    return drawing((panel.width, panel.height), panel.svg(), class_="picture", width=panel.width)


def _medians(dated: Sequence[tuple[float, float]], width_s: float) -> list[tuple[float, float]]:
    groups: dict[int, list[float]] = defaultdict(list)
    for utc_s, value in dated:
        groups[int(utc_s // width_s)].append(value)
    return [((k + 0.5) * width_s, statistics.median(group)) for k, group in sorted(groups.items())]


def _spark(values: Sequence[float]) -> Markup:
    """Draw decelerations in sequence as small bars. A bar of full height is 8 m/s2."""
    width = min(4.0, 100.0 / len(values))
    path = "".join(f"M{(k + 0.5) * width:.1f} 20v{-max(1.0, min(y, 8.0) * 2.4):.1f}" for k, y in enumerate(values))
    bars = element("path", d=path, stroke=_ORANGE, stroke_width=0.7 * width)
    return element("svg", bars, viewBox="0 0 100 20", width=100, height=20)


_PAGE = Path(__file__).parent / "page.html"
_SCRIPT = _PAGE.read_text(encoding="utf-8").partition("<script>")[2].partition("</script>")[0]
# The policy lets the page load nothing and run only its own script. The widths of bars are in style attributes. A
# policy allows either all style attributes or none, so this policy allows all.
_POLICY = (
    "default-src 'none'; base-uri 'none'; form-action 'none'; style-src 'unsafe-inline'; "
    f"script-src {source_hash(_SCRIPT)}"
)
