"""The ride as one HTML page to zoom into. Written to a file it needs no other file."""

import html
from importlib.resources import files
from pathlib import Path

from ..overview import Overview
from . import page_with_map, track_map
from .charts import figure
from .in_script import as_script, source_hash

# Its data stand apart from it, so that it is the same on every page
SCRIPT = """
const CHART = JSON.parse(document.getElementById("charts").textContent);
const finger = matchMedia("(pointer: coarse)").matches, narrow = matchMedia("(max-width: 600px)").matches;
const layout = narrow ? CHART.narrow : CHART.layout;
if (finger) layout.dragmode = false; // a finger moves the page
Plotly.newPlot("chart", CHART.data, layout, { responsive: true });
if (parent !== window) {
  const tell = () => parent.postMessage({ height: document.body.scrollHeight }, "*"); // of the frame that it is in
  new ResizeObserver(tell).observe(document.body);
}
"""
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
{library}
<style>
:root {{ color-scheme: light dark; --paper: #fff; --ink: #222; --quiet: #555; }}
body {{ margin: 0; font-family: sans-serif; color: var(--ink); background: var(--paper); }}
@media (prefers-color-scheme: dark) {{
  :root {{ --paper: #1a1a1a; --ink: #eee; --quiet: #bbb; }}
  .drawn {{ filter: invert(0.9) hue-rotate(180deg); }} /* white paper gets dark, and each colour keeps its hue */
}}
{style}
</style>
</head>
<body>
<main><div id="chart" class="drawn"></div></main>
<script type="application/json" id="charts">{charts}</script>
<script>{script}</script>
{beside}
</body>
</html>
"""


def draw(path: Path, seen: Overview, tiles: bool = False) -> None:
    """Write it, with a map beside the charts where the log has positions. tiles: with streets in the map, which the
    page then takes from a server."""
    library = files("plotly").joinpath("package_data/plotly.min.js").read_text(encoding="utf-8")
    path.write_text(page(seen, f"<script>{library}</script>", source_hash(library), tiles), encoding="utf-8")


def page(seen: Overview, library: str, allowed: str, tiles: bool = False) -> str:
    """The page's HTML. library: the element that loads plotly.js; allowed: how the policy names that; tiles: of draw().

    The policy lets the page's own scripts run, and nothing be loaded but the map's tiles. plotly.js makes functions of
    text for its charts of many points, and sets styles.
    """
    charts, points = figure(seen), track_map.map_points(seen)
    if points is not None:
        for kind in ("layout", "narrow"):
            charts[kind]["hovermode"] = "x"  # anywhere over a chart, not on a line alone
            for name in page_with_map.time_axes(charts):
                charts[kind][name]["hoverformat"] = ".1f"
    return _PAGE.format(
        policy="default-src 'none'; base-uri 'none'; form-action 'none'; style-src 'unsafe-inline'; "
        f"img-src data: blob:{' ' + page_with_map.TILES_HOST if tiles else ''}; "
        f"script-src {allowed} {source_hash(SCRIPT)} {source_hash(page_with_map.SCRIPT)} 'unsafe-eval'",
        title=html.escape(seen.ride.stem),
        library=library,
        style="" if points is None else page_with_map.STYLE,
        charts=as_script(charts),
        script=SCRIPT,
        beside="" if points is None else page_with_map.beside(charts, points, seen, tiles),
    )
