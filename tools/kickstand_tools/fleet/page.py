"""index.html: a fleet at one glance. It needs no network and no server."""

import statistics
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template
from urllib.parse import quote

from ..output import write_whole
from .period import PeriodResult, Row
from .svg import Panel, date_text

_WORST, _MOST_MOVED, _MOST_ROWS, _MOST_DOTS = 25, 200, 2000, 3000
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
    "fault": "a fault in kickstand",
}
_DAY_S = 86_400.0


def write_page(path: Path, results: Sequence[PeriodResult], expected: int) -> None:
    """Write the page of these results of expected ones. Raises InputError."""
    write_whole(path, lambda temporary: temporary.write_text(draw(results, expected), encoding="utf-8") and None)


def draw(results: Sequence[PeriodResult], expected: int) -> str:
    """The page as HTML."""
    rows = [result.alignment for result in results]
    moved = [row for result in results for row in result.moved]
    tests = [row for result in results for row in result.brake_tests]
    statuses = Counter(row["status"] for row in rows)
    not_yet = f"{len(rows)} of {expected} so far" if len(rows) < expected else f"{expected} in all"
    tiles = [
        (statuses["aligned"], f"aligned ({_share(statuses['aligned'], len(rows))})", "good"),
        (statuses["refused"], "refused: the drives do not tell", "warn"),
        (statuses["error"], "errors: no log could be used", "bad"),
        (len({(row["vehicle"], row["mount"]) for row in moved}), "with a mount that moved", "warn"),
        (len(tests), "brake tests", ""),
        (round(sum(row["driven_s"] for row in rows) / 3600.0), "hours of driving", ""),
    ]
    plots = {(row["vehicle"], row["mount"]): row["plot"] for row in rows}
    return Template(_PAGE).substitute(
        count=escape(not_yet),
        tiles="".join(
            f'<div class="tile {kind}"><b>{number:,}</b><span>{escape(words)}</span></div>'
            for number, words, kind in tiles
        ),
        reasons=_reasons(rows),
        quality=_quality(rows),
        worst=_worst(rows),
        moved=_moved(moved, plots),
        braking=_braking(tests),
        vehicles=_vehicles(results),
        shown=_shown_words(len(rows)),
    )


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.0f} %" if whole else "--"


def _reasons(rows: Sequence[Row]) -> str:
    reasons = Counter((row["status"], row["reason"]) for row in rows if row["reason"])
    if not reasons:
        return "<p>Every vehicle is aligned.</p>"
    most = max(reasons.values())
    lines = [
        f'<tr><td>{escape(_WORDS.get(reason, reason))}</td><td class="n">{count}</td>'
        f'<td class="w"><i class="{status}" style="width:{100.0 * count / most:.1f}%"></i></td></tr>'
        for (status, reason), count in reasons.most_common()
    ]
    return f'<table class="bars">{"".join(lines)}</table>'


def _quality(rows: Sequence[Row]) -> str:
    values = [row["quality_deg"] for row in rows if row["status"] == "aligned"]
    if not values:
        return ""
    edges = [0.1 * k for k in range(27)]
    heights = [sum(edges[k] <= value < edges[k + 1] for value in values) for k in range(26)]
    panel = Panel(
        0, 0, 460, 230, (0.0, 2.6), (0.0, max(heights) * 1.08),
        f"Standard error of forward, median {statistics.median(values):.2f}°", "degrees", "vehicles",
    )
    panel.bars(edges, heights, "#2563eb")
    return _picture(460, 230, panel)


def _worst(rows: Sequence[Row]) -> str:
    aligned = sorted((row for row in rows if row["status"] == "aligned"), key=lambda row: -row["quality_deg"])
    lines = [
        f"<tr><td>{_name(row, row['plot'])}</td><td class=n>{row['quality_deg']:.2f}°</td>"
        f"<td class=n>{row['halves_deg']:.1f}°</td><td class=n>{row['events_used']}</td>"
        f"<td class=n>{row['stops']}</td></tr>"
        for row in aligned[:_WORST]
    ]
    head = "<tr><th>vehicle<th class=n>standard error<th class=n>halves differ<th class=n>events<th class=n>stops</tr>"
    return f'<div class="scroll"><table>{head}{"".join(lines)}</table></div>' if lines else "<p>None is aligned.</p>"


def _moved(moved: Sequence[Row], plots: dict[tuple[str, str], str]) -> str:
    if not moved:
        return "<p>None is known to have moved.</p>"
    lines = []
    for row in sorted(moved, key=lambda row: -row["turned_deg"])[:_MOST_MOVED]:
        when = f"at {row['at_s']:.0f} s in" if row["within_log"] else "before"
        day = date_text(row["utc_s"]) if row["utc_s"] is not None else ""
        turned = f"{row['turned_deg']:.1f}° ± {row['turned_sigma_deg']:.1f}°"
        lines.append(
            f"<tr><td>{_name(row, plots.get((row['vehicle'], row['mount']), ''))}</td><td class=n>{turned}</td>"
            f"<td class=n>{row['sigmas']:.0f} sigma</td><td>{escape(when)} {escape(Path(row['log']).name)}</td>"
            f"<td>{day}</td></tr>"
        )
    more = f"<p>The {_MOST_MOVED} largest of {len(moved)}.</p>" if len(moved) > _MOST_MOVED else ""
    head = "<tr><th>vehicle<th class=n>turned by<th class=n>how sure<th>when<th>day</tr>"
    return f'<div class="scroll"><table>{head}{"".join(lines)}</table></div>{more}'


def _braking(tests: Sequence[Row]) -> str:
    if not tests:
        return "<p>No stops from over 10 km/h.</p>"
    values = [test["mfdd_mps2"] for test in tests]
    hardest = min(12.0, max(values) * 1.05)
    edges = [hardest * k / 24.0 for k in range(25)]
    heights = [sum(edges[k] <= value < edges[k + 1] for value in values) for k in range(24)]
    title = f"Mean fully developed deceleration, median {statistics.median(values):.2f} m/s²"
    spread = Panel(0, 0, 460, 260, (0.0, hardest), (0.0, max(heights) * 1.08), title, "m/s²", "brake tests")
    spread.bars(edges, heights, "#c2410c")
    pictures = _picture(460, 260, spread)
    dated = [(test["utc_s"], test["mfdd_mps2"]) for test in tests if test["utc_s"] is not None]
    if len(dated) > 1:
        first, last = min(dated)[0], max(dated)[0]
        span = (first - _DAY_S / 4.0, last + _DAY_S / 4.0)
        over = Panel(0, 0, 620, 260, span, (0.0, hardest), "Over time, with the median", "", "MFDD, m/s²", date_text)
        over.dots(dated[:: max(1, len(dated) // _MOST_DOTS)], "#c2410c", 1.2)
        over.line(_medians(dated, max(_DAY_S, (last - first) / 30.0)), "#111827", 2.0)
        pictures += _picture(620, 260, over)
    return f'<div class="row">{pictures}</div>'


def _medians(dated: Iterable[tuple[float, float]], width_s: float) -> list[tuple[float, float]]:
    groups: dict[int, list[float]] = defaultdict(list)
    for utc_s, value in dated:
        groups[int(utc_s // width_s)].append(value)
    return [((k + 0.5) * width_s, statistics.median(group)) for k, group in sorted(groups.items())]


def _vehicles(results: Sequence[PeriodResult]) -> str:
    lines = []
    order = sorted(results, key=lambda result: (result.alignment["status"] == "aligned", result.alignment["vehicle"]))
    for result in order[:_MOST_ROWS]:
        row = result.alignment
        values = [test["mfdd_mps2"] for test in result.brake_tests]
        why = _WORDS.get(row["reason"], row["reason"])
        quality = f"{row['quality_deg']:.2f}°" if row["quality_deg"] is not None else ""
        median = f"{statistics.median(values):.2f}" if values else ""
        lines.append(
            f"<tr><td>{_name(row, row['plot'])}</td><td>{row['kind']}</td>"
            f'<td title="{escape(row["message"])}"><em class="{row["status"]}">{row["status"]}</em> {escape(why)}</td>'
            f"<td class=n>{quality}</td><td class=n>{row['events_used']}</td><td class=n>{row['stops']}</td>"
            f"<td class=n>{row['logs']}{'+' + str(row['logs_left_out']) if row['logs_left_out'] else ''}</td>"
            f"<td class=n>{len(values) or ''}</td><td class=n>{median}</td><td>{_spark(result.brake_tests)}</td></tr>"
        )
    return "".join(lines)


def _spark(tests: Sequence[Row]) -> str:
    """Decelerations over time as a small line."""
    if len(tests) < 2:
        return ""
    dated = all(test["utc_s"] is not None for test in tests)
    points = sorted((test["utc_s"] if dated else float(k), test["mfdd_mps2"]) for k, test in enumerate(tests))
    first, span = points[0][0], (points[-1][0] - points[0][0]) or 1.0
    dots = "".join(f"M{2.0 + 96.0 * (x - first) / span:.1f} {20.0 - min(y, 8.0) * 2.3:.1f}h0" for x, y in points)
    return (
        f'<svg viewBox="0 0 100 22" width="100" height="22"><path d="{dots}" stroke="#c2410c" stroke-width="3" '
        'stroke-linecap="round"/></svg>'
    )


def _name(row: Row, plot: str) -> str:
    name = escape(row["vehicle"] + (f" / {row['mount']}" if row["mount"] else ""))
    return f'<a href="{quote(plot)}">{name}</a>' if plot else name


def _picture(width: float, height: float, panel: Panel) -> str:
    return f'<svg class="picture" viewBox="0 0 {width} {height}" width="{width}">{panel.svg()}</svg>'


def _shown_words(count: int) -> str:
    return f"The first {_MOST_ROWS:,} of {count:,}; all are in alignments.parquet." if count > _MOST_ROWS else ""


_PAGE = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
