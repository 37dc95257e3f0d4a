"""index.html: a fleet at one glance. It needs no network and no server."""

import base64
import hashlib
import math
import statistics
from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import numpy as np

from ..files import write_bytes
from ..period import PeriodResult, Row
from .svg import Panel, date_text

_WORST, _MOST_MOVED, _MOST_ROWS, _MOST_DOTS, _SAID = 25, 200, 2000, 3000, 3
_WORDS = {
    "mount-moved": "the mount was turned",
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


class Glance:
    """What the page shows of many results; add() takes them one by one. Memory hardly grows with their number.

    statuses, reasons: how many have each; moved_count, errors: rows of these tables; first_errors: log or vehicle, and
    message, of some of these. decelerations: (s since 1970 or NaN, m/s2) of each brake test.
    """

    def __init__(self) -> None:
        self.count = self.moved_count = self.moved_vehicles = self.errors = 0
        self.driven_s = 0.0
        self.first_errors: list[tuple[str, str]] = []
        self.statuses: Counter[str] = Counter()
        self.reasons: Counter[tuple[str, str]] = Counter()
        self.decelerations: tuple[array[float], array[float]] = array("d"), array("d")
        self._qualities = array("d")
        self._worst: list[Row] = []
        self._moved: list[tuple[Row, str]] = []
        self._rows: dict[bool, list[str]] = {False: [], True: []}  # of the table of vehicles: not aligned, aligned

    def add(self, result: PeriodResult) -> None:
        """The next one."""
        row = result.alignment
        aligned = row["status"] == "aligned"
        self.count += 1
        self.driven_s += row["driven_s"]
        self.statuses[row["status"]] += 1
        if row["reason"]:
            self.reasons[row["status"], row["reason"]] += 1
        self.moved_count += len(result.moved)
        self.moved_vehicles += bool(result.moved)
        self.errors += len(result.errors)
        said = [(row["log"] or row["vehicle"], row["message"]) for row in result.errors]
        self.first_errors = (self.first_errors + said)[:_SAID]
        for test in result.brake_tests:
            self.decelerations[0].append(math.nan if test["utc_s"] is None else test["utc_s"])
            self.decelerations[1].append(test["mfdd_mps2"])
        if aligned:
            self._qualities.append(row["quality_deg"])
            self._worst = _first([*self._worst, row], lambda row: -row["quality_deg"], _WORST)
        found = [*self._moved, *((move, row["plot"]) for move in result.moved)]
        self._moved = _first(found, lambda move: -move[0]["turned_deg"], _MOST_MOVED)
        if len(self._rows[aligned]) < _MOST_ROWS:
            self._rows[aligned].append(_vehicle(result))

    def page(self, expected: int) -> str:
        """The page as HTML. expected: how many results there will be in the end."""
        tests, hours = len(self.decelerations[1]), self.driven_s / 3600.0
        tiles = [
            (self.statuses["aligned"], f"aligned ({_share(self.statuses['aligned'], self.count)})", "good"),
            (self.statuses["refused"], "refused: the drives do not tell", "warn"),
            (self.statuses["error"], "errors: no log could be used", "bad" if self.statuses["error"] else ""),
            (self.moved_vehicles, "with a mount that moved", "warn"),
            (tests, "brake tests", ""),
            (round(hours, 1) if hours < 10.0 else round(hours), "hours of driving", ""),
        ]
        rows = (self._rows[False] + self._rows[True])[:_MOST_ROWS]
        partly = f"The first {_MOST_ROWS:,} of {self.count:,}; all are in alignments.parquet."
        return Template(_PAGE).substitute(
            policy=_POLICY,
            count=f"{self.count:,} of {expected:,} so far" if self.count < expected else f"{expected:,} in all",
            tiles="".join(
                f'<div class="tile {kind}"><b>{number:,}</b><span>{escape(words)}</span></div>'
                for number, words, kind in tiles
            ),
            reasons=_reasons(self.reasons),
            quality=_quality(self._qualities),
            worst=_worst(self._worst),
            moved=_moved(self._moved, self.moved_count),
            braking=_braking(*self.decelerations),
            vehicles="".join(rows),
            shown=partly if len(rows) < self.count else "",
        )


def write_page(path: str, glance: Glance, expected: int) -> None:
    """Write the page, whole or not at all. Raises InputError."""
    write_bytes(path, glance.page(expected).encode())


def _first(rows: list[Any], key: Callable[[Any], float], count: int) -> list[Any]:
    return sorted(rows, key=key)[:count]


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.0f} %" if whole else "--"


def _reasons(reasons: Counter[tuple[str, str]]) -> str:
    if not reasons:
        return "<p>Every vehicle is aligned.</p>"
    most = max(reasons.values())
    lines = [
        f'<tr><td>{escape(_WORDS.get(reason, reason))}</td><td class="n">{count}</td>'
        f'<td class="w"><i class="{status}" style="width:{100.0 * count / most:.1f}%"></i></td></tr>'
        for (status, reason), count in reasons.most_common()
    ]
    return f'<table class="bars">{"".join(lines)}</table>'


def _quality(values: Sequence[float]) -> str:
    if not values:
        return ""
    top = 1.6  # what is aligned is within 1.5 degrees
    edges, heights = _histogram(values, top, 26)
    title = f"Standard error of forward, median {statistics.median(values):.2f}°"
    panel = Panel(0, 0, 460, 230, (0.0, top), (0.0, max(heights) * 1.08), title, "degrees", "vehicles")
    panel.bars(edges, heights, "#2563eb")
    return _picture(460, 230, panel)


def _worst(rows: Sequence[Row]) -> str:
    lines = [
        f"<tr><td>{_name(row, row['plot'])}</td><td class=n>{row['quality_deg']:.2f}°</td>"
        f"<td class=n>{row['halves_deg']:.1f}°</td><td class=n>{row['events_used']}</td>"
        f"<td class=n>{row['stops']}</td></tr>"
        for row in rows
    ]
    head = "<tr><th>vehicle<th class=n>standard error<th class=n>halves differ<th class=n>events<th class=n>stops</tr>"
    return f'<div class="scroll"><table>{head}{"".join(lines)}</table></div>' if lines else "<p>None is aligned.</p>"


def _moved(moved: Sequence[tuple[Row, str]], count: int) -> str:
    if not moved:
        return "<p>None is known to have moved.</p>"
    lines = []
    for row, plot in moved:
        when = f"at {row['at_s']:.0f} s in" if row["within_log"] else "before"
        day = f" ({date_text(row['utc_s'])})" if row["utc_s"] is not None else ""
        turned = f"{row['turned_deg']:.1f}° ± {row['turned_sigma_deg']:.1f}°"
        lines.append(
            f"<tr><td>{_name(row, plot)}</td><td class=n>{turned}</td><td class=n>{row['sigmas']:.0f} sigma</td>"
            f"<td class=when>{escape(when)} {escape(Path(row['log']).name)}{day}</td></tr>"
        )
    more = f"<p>The {_MOST_MOVED} largest of {count}.</p>" if count > _MOST_MOVED else ""
    head = "<tr><th>vehicle<th class=n>turned by<th class=n>how sure<th>when</tr>"
    return f'<div class="scroll"><table>{head}{"".join(lines)}</table></div>{more}'


def _braking(utc_s: Sequence[float], values: Sequence[float]) -> str:
    if not values:
        return "<p>No stops from over 10 km/h.</p>"
    hardest = min(12.0, max(values) * 1.05)
    edges, heights = _histogram(values, hardest, 24)
    title = f"Mean fully developed deceleration, median {statistics.median(values):.2f} m/s²"
    spread = Panel(0, 0, 460, 260, (0.0, hardest), (0.0, max(heights) * 1.08), title, "m/s²", "brake tests")
    spread.bars(edges, heights, "#c2410c")
    pictures = _picture(460, 260, spread)
    dated = [(time, value) for time, value in zip(utc_s, values) if time == time]  # not NaN
    if len(dated) > 1:
        first, last = min(dated)[0], max(dated)[0]
        span = (first - _DAY_S / 4.0, last + _DAY_S / 4.0)
        over = Panel(0, 0, 620, 260, span, (0.0, hardest), "Over time, with the median", "", "MFDD, m/s²", date_text)
        over.dots(dated[:: max(1, len(dated) // _MOST_DOTS)], "#c2410c", 1.2)
        over.line(_medians(dated, max(_DAY_S, (last - first) / 30.0)), "currentColor", 2.0)
        pictures += _picture(620, 260, over)
    return f'<div class="row">{pictures}</div>'


def _histogram(values: Sequence[float], top: float, bins: int) -> tuple[list[float], list[float]]:
    heights, edges = np.histogram(np.minimum(values, top), bins, (0.0, top))
    return edges.tolist(), heights.astype(float).tolist()


def _medians(dated: Iterable[tuple[float, float]], width_s: float) -> list[tuple[float, float]]:
    groups: dict[int, list[float]] = defaultdict(list)
    for utc_s, value in dated:
        groups[int(utc_s // width_s)].append(value)
    return [((k + 0.5) * width_s, statistics.median(group)) for k, group in sorted(groups.items())]


def _vehicle(result: PeriodResult) -> str:
    """A row of the table of vehicles."""
    row = result.alignment
    values = [test["mfdd_mps2"] for test in result.brake_tests]
    why = str(_WORDS.get(row["reason"], row["reason"]))
    quality = f"{row['quality_deg']:.2f}°" if row["quality_deg"] is not None else ""
    median = f"{statistics.median(values):.2f}" if values else ""
    left_out = f"+{row['logs_left_out']}" if row["logs_left_out"] else ""
    return (
        f"<tr><td>{_name(row, row['plot'])}</td>"
        f'<td title="{escape(row["message"])}"><em class="{row["status"]}">{row["status"]}</em> {escape(why)}</td>'
        f"<td class=n>{quality}</td><td class=n>{row['events_used']}</td><td class=n>{row['stops']}</td>"
        f"<td class=n>{row['logs']}{left_out}</td><td class=n>{len(values) or ''}</td><td class=n>{median}</td>"
        f"<td>{_spark(values)}</td></tr>\n"
    )


def _spark(values: Sequence[float]) -> str:
    """Decelerations, one after the other, as small bars of up to 8 m/s2."""
    width = min(4.0, 100.0 / max(1, len(values)))
    path = "".join(f"M{(k + 0.5) * width:.1f} 20v{-max(1.0, min(y, 8.0) * 2.4):.1f}" for k, y in enumerate(values))
    return (
        f'<svg viewBox="0 0 100 20" width="100" height="20"><path d="{path}" stroke="#c2410c" '
        f'stroke-width="{0.7 * width:.1f}"/></svg>'
        if values
        else ""
    )


def _name(row: Row, plot: str) -> str:
    name = escape(row["vehicle"] + (f" / {row['mount']}" if row["mount"] else ""))
    return f'<a href="{quote(plot)}">{name}</a>' if plot else name


def _picture(width: float, height: float, panel: Panel) -> str:
    return f'<svg class="picture" viewBox="0 0 {width} {height}" width="{width}">{panel.svg()}</svg>'


_PAGE = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
_SCRIPT = _PAGE.partition("<script>")[2].partition("</script>")[0]
# Nothing is loaded, and of scripts only the page's own runs. Bars have their widths in style attributes, which a policy
# can only allow all together.
_POLICY = (
    "default-src 'none'; base-uri 'none'; form-action 'none'; style-src 'unsafe-inline'; "
    f"script-src 'sha256-{base64.b64encode(hashlib.sha256(_SCRIPT.encode()).digest()).decode()}'"
)
