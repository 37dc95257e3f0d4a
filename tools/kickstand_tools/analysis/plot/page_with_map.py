"""The page of a ride with its map beside the charts: pointing at one shows the same moment in the other."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from ...logs.axes.course import EARTH_M
from ..overview import Overview
from .track_map import MapPoints, figure

# OpenStreetMap's own server refuses a page that was opened as a file: it wants to know the page's address.
TILES_URL = "https://basemaps.cartocdn.com/rastertiles/voyager/{z}/{x}/{y}.png"
ATTRIBUTION = (
    '© <a href="https://www.openstreetmap.org/copyright">OpenStreetMap</a> contributors, '
    '© <a href="https://carto.com/attributions">CARTO</a>'
)
MOST_ZOOM = 19

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ margin: 0; display: grid; grid-template-columns: minmax(0, 62fr) minmax(0, 38fr); font-family: sans-serif; }}
aside {{ position: sticky; top: 0; height: 100vh; display: flex; flex-direction: column; }}
#map-frame {{ flex: 1; min-height: 0; }}
#here {{ margin: 1em 1em 0; font-variant-numeric: tabular-nums; }}
#tiles {{ margin: 0 1em 0.5em; font-size: 12px; color: #555; }}
@media (max-width: 1000px) {{
  body {{ display: flex; flex-direction: column; }}
  aside {{ order: -1; height: 60vh; z-index: 2; background: white; border-bottom: 1px solid #ccc; }}
}}
</style>
</head>
<body>
<main>{charts}</main>
<aside>
<p id="here"></p>
<div id="map-frame">{map}</div>
<p id="tiles">{attribution}</p>
</aside>
<script>
const CHART_AXES = {axes}, TILES = {tiles};
{script}
</script>
</body>
</html>
"""


def html(charts: Any, points: MapPoints, seen: Overview, tiles: bool) -> str:
    """The whole page. charts: the figure of page.figure(). tiles: with streets, which the page takes from a server."""
    over_time = [name for name in charts.select_xaxes() if name.ticktext is not None]
    axes = [axis.plotly_name.replace("axis", "") for axis in over_time]
    options = {"full_html": False, "config": {"responsive": True, "scrollZoom": False}}
    at_map = options | {"default_height": "100%", "config": {"responsive": True, "scrollZoom": True}}
    return _PAGE.format(
        title=seen.ride.stem,
        charts=charts.to_html(include_plotlyjs=True, div_id="chart", **options),
        map=figure(points, seen).to_html(include_plotlyjs=False, div_id="map", **at_map),
        attribution=ATTRIBUTION if tiles else "",
        axes=json.dumps(axes),
        tiles=json.dumps(_tiles(points)) if tiles else "null",
        script=Path(__file__).with_name("map.js").read_text(encoding="utf-8"),
    )


def _tiles(points: MapPoints) -> dict[str, Any]:
    """Where tiles come from, and where their world lies in the map's metres."""
    lat, lon = np.radians(points.lat_deg), np.radians(points.lon_deg)
    scale_m = EARTH_M * float(np.cos(lat))
    return {
        "url": TILES_URL,
        "most": MOST_ZOOM,
        "world_m": 2.0 * np.pi * scale_m,
        "west_m": scale_m * (np.pi + float(lon)),
        "north_m": scale_m * (np.pi - float(np.arcsinh(np.tan(lat)))),
    }
