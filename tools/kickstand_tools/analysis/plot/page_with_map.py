"""The page of a ride with its map beside the charts: pointing at one shows the same moment in the other."""

from pathlib import Path
from typing import Any

import numpy as np

from ...signals.geography import EARTH_M
from ..overview import Overview
from .in_script import as_script
from .track_map import MapPoints, figure

# OpenStreetMap's own server refuses a page that was opened as a file: it wants to know the page's address.
TILES_HOST = "https://basemaps.cartocdn.com"
TILES_URL = TILES_HOST + "/rastertiles/voyager/{z}/{x}/{y}.png"
ATTRIBUTION = (
    '© <a href="https://www.openstreetmap.org/copyright">OpenStreetMap</a> contributors, '
    '© <a href="https://carto.com/attributions">CARTO</a>'
)
MOST_ZOOM = 19

STYLE = """body { display: grid; grid-template-columns: minmax(0, 62fr) minmax(0, 38fr); }
aside { position: sticky; top: 0; height: min(100vh, 60rem); display: flex; flex-direction: column; }
#map-frame { flex: 1; min-height: 0; }
#map { height: 100%; }
#here { margin: 1em 1em 0; font-variant-numeric: tabular-nums; }
#tiles { margin: 0 1em 0.5em; font-size: 12px; color: var(--quiet); }
@media (max-width: 1000px) {
  body { display: flex; flex-direction: column; }
  aside { order: -1; height: min(60vh, 30rem); z-index: 2; background: var(--paper); border-bottom: 1px solid #888; }
}"""
_BESIDE = """<aside>
<p id="here"></p>
<div id="map-frame"><div id="map" class="drawn"></div></div>
<p id="tiles">{attribution}</p>
</aside>
<script type="application/json" id="map-data">{map}</script>
<script>{script}</script>"""
SCRIPT = """
const { map: MAP, axes: CHART_AXES, tiles: TILES } = JSON.parse(document.getElementById("map-data").textContent);
if (finger) MAP.layout.dragmode = false;
Plotly.newPlot("map", MAP.data, MAP.layout, { responsive: true, scrollZoom: true });
""" + Path(__file__).with_name("map.js").read_text(encoding="utf-8")


def time_axes(charts: dict[str, Any]) -> list[str]:
    """The axes of time in charts.figure(), by their names in its layout."""
    return [name for name, axis in charts["layout"].items() if name.startswith("xaxis") and "ticktext" in axis]


def beside(charts: dict[str, Any], points: MapPoints, seen: Overview, tiles: bool) -> str:
    """What of the page is beside the charts. tiles: with streets, which the page takes from a server."""
    data = {
        "map": figure(points, seen),
        "axes": [name.replace("axis", "") for name in time_axes(charts)],
        "tiles": _tiles(points) if tiles else None,
    }
    return _BESIDE.format(map=as_script(data), attribution=ATTRIBUTION if tiles else "", script=SCRIPT)


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
