"""Writes the ride as one HTML page with charts that you can zoom, which needs no other file, and as a picture.

If the log has positions, a map is beside the charts. If you point at a moment in the map or in a chart, the page marks
it in both.
"""

from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ...common.installation import extra
from ...common.markup import filled, source_hash
from ...common.messages import InputError
from ...common.output import check_directory, new_directory, whole_file
from ...signals import EARTH_M
from ..overview import Overview
from . import interactive, picture, track_map
from .charts import charts

_HERE = Path(__file__).parent
# The scripts of the charts and of the map. They contain no data, so they are the same on every page.
SCRIPTS = tuple((_HERE / name).read_text(encoding="utf-8") for name in ("page.js", "map.js"))
# OpenStreetMap's own server refuses a page that was opened as a file, because it requires the page's address.
TILES_HOST = "https://basemaps.cartocdn.com"
TILES_URL = TILES_HOST + "/rastertiles/voyager/{z}/{x}/{y}.png"
MOST_ZOOM = 19


def check_drawing(directory: Path) -> None:
    """Raise InputError if drawing or writing to the directory is impossible."""
    missing = [name for name in ("matplotlib", "plotly") if not find_spec(name)]
    if missing:
        raise InputError(f"pictures need {' and '.join(missing)}: {extra('rides')}")
    if directory.suffix in (".png", ".html"):
        raise InputError(f"{directory}: a picture and a page are written: give the directory for them")
    check_directory(directory)


def draw_ride(overview: Overview, directory: Path, tiles: bool = False) -> list[Path]:
    """Write both files and return their paths. tiles: see draw(). Raises InputError."""
    paths = [directory / f"{overview.ride.stem}.png", directory / f"{overview.ride.stem}.html"]
    with new_directory(directory):
        with whole_file(paths[0]) as path:
            picture.draw(path, overview)
        with whole_file(paths[1]) as path:
            draw(path, overview, tiles)
    return paths


def draw(path: Path, overview: Overview, tiles: bool = False) -> None:
    """Write the page. tiles: show streets in the map, which the page loads from a server."""
    library = files("plotly").joinpath("package_data/plotly.min.js").read_text(encoding="utf-8")
    text = page(overview, f"<script>{library}</script>", source_hash(library), tiles, warnings=True)
    path.write_text(text, encoding="utf-8")


def page(overview: Overview, library: str, allowed: str, tiles: bool = False, warnings: bool = False) -> str:
    """Return the page's HTML.

    The content security policy allows only the page's own scripts, and images of the map's tiles. It also allows
    'unsafe-eval' and inline styles, because plotly.js compiles functions from text for charts with many points, and
    sets styles.

    library: the element that loads plotly.js.
    allowed: the source of plotly.js in the policy.
    tiles: see draw().
    warnings: show the warnings above the charts.
    """
    ride_charts, points = charts(overview), track_map.map_points(overview)
    map_data = None
    if points is not None:
        map_data = {"map": track_map.figure(points, overview), "axes": interactive.time_axes(ride_charts)}
        map_data["shape"] = track_map.shape(points)
        map_data["tiles"] = tiles_at(points) if tiles else None
    policy = (
        "default-src 'none'; base-uri 'none'; form-action 'none'; style-src 'unsafe-inline'; "
        f"img-src data: blob:{' ' + TILES_HOST if tiles else ''}; "
        f"script-src {' '.join((allowed, *map(source_hash, SCRIPTS)))} 'unsafe-eval'"
    )
    return filled(
        _HERE / "page.html",
        policy=policy,
        title=overview.ride.stem,
        library=library,
        warnings=ride_charts.warnings if warnings else [],
        charts=interactive.figure(ride_charts, linked=points is not None),
        map=map_data,
        scripts=SCRIPTS,
    )


def tiles_at(points: track_map.MapPoints) -> dict[str, Any]:
    """Return the address of the tiles' server, and the position of the server's world map, in metres of this map."""
    lat, lon = np.radians(points.lat_deg), np.radians(points.lon_deg)
    scale_m = EARTH_M * float(np.cos(lat))
    return {
        "url": TILES_URL,
        "most": MOST_ZOOM,
        "world_m": 2.0 * np.pi * scale_m,
        "west_m": scale_m * (np.pi + float(lon)),
        "north_m": scale_m * (np.pi - float(np.arcsinh(np.tan(lat)))),
    }
