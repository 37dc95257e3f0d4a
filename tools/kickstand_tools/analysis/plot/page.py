"""The ride as one HTML page to zoom into. Written to a file it needs no other file."""

import html
from importlib.resources import files
from pathlib import Path

from ..overview import Overview
from . import page_with_map, track_map
from .charts import figure
from .in_script import as_script

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
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
<script>
const CHART = {charts};
const finger = matchMedia("(pointer: coarse)").matches, narrow = matchMedia("(max-width: 600px)").matches;
const layout = narrow ? CHART.narrow : CHART.layout;
if (finger) layout.dragmode = false; // a finger moves the page
Plotly.newPlot("chart", CHART.data, layout, {{ responsive: true }});
</script>
{beside}
</body>
</html>
"""


def draw(path: Path, seen: Overview, tiles: bool = False) -> None:
    """Write it, with a map beside the charts where the log has positions. tiles: with streets in the map, which the
    page then takes from a server."""
    library = files("plotly").joinpath("package_data/plotly.min.js").read_text(encoding="utf-8")
    path.write_text(page(seen, f"<script>{library}</script>", tiles), encoding="utf-8")


def page(seen: Overview, library: str, tiles: bool = False) -> str:
    """The page's HTML. library: the element that loads plotly.js; tiles: of draw()."""
    charts, points = figure(seen), track_map.map_points(seen)
    if points is not None:
        for kind in ("layout", "narrow"):
            charts[kind]["hovermode"] = "x"  # anywhere over a chart, not on a line alone
            for name in page_with_map.time_axes(charts):
                charts[kind][name]["hoverformat"] = ".1f"
    return _PAGE.format(
        title=html.escape(seen.ride.stem),
        library=library,
        style="" if points is None else page_with_map.STYLE,
        charts=as_script(charts),
        beside="" if points is None else page_with_map.beside(charts, points, seen, tiles),
    )
