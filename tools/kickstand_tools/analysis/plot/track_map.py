"""Draws the map of a ride: its track in metres, coloured by lean. North is up.

The map uses the Mercator projection, as map tiles do. Angles are true. The scale is exact at the ride's own latitude,
and off by one per cent 50 km further north.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...signals import EARTH_M, Array, Ints
from ..overview import Overview
from ..ride import LogTrack, track
from .charts import LEFT_COLOUR, RIGHT_COLOUR, SPEED_COLOUR, lean_limit, shown_lean_deg
from .interactive import PAPER, plain

POINTS = 20_000  # largest number of points
SHORTEST_S = 0.2  # least time between points
SAME_M = 0.5  # least distance between points, so a standing bike is one point
MOST_LAT_DEG = 85.0  # largest latitude on the map, because Mercator cannot show the poles
_SHAPES = (0.6, 2.2)  # least and largest ratio of width to height
LEAST_LEAN_DEG = 30.0  # smaller leans never have the full colour
# Colours from left lean to right lean, with grey for upright. Colour-blind people can distinguish blue from orange.
_COLOURS = [[0.0, "#0d3a73"], [0.25, LEFT_COLOUR], [0.5, "#c9c9c9"], [0.75, RIGHT_COLOUR], [1.0, "#7a2c05"]]


@dataclass
class MapPoints:
    """m points of a track, sorted by time."""

    t_s: Array  # seconds since the log's first sample, shape (m)
    east_m: Array  # distance from lat_deg, lon_deg, shape (m). Each gap in the positions has one point that is NaN.
    north_m: Array  # as east_m
    lean_deg: Array  # lean, shape (m); NaN where the display shows no lean
    speed_kmh: Array  # speed in km/h, shape (m); NaN if the log has no speed
    lat_deg: float  # position of the map's origin
    lon_deg: float


def map_points(overview: Overview) -> MapPoints | None:
    """Return the track of a ride; None without positions. Points are on straight lines between the log's positions."""
    positions = track(overview.course)
    if len(positions.t_s) < 2:
        return None
    time_s, speed_kmh = overview.course.t_s, 3.6 * overview.course.speed_mps
    t_s = _times(positions, float(time_s[-1]))
    lat, lon = positions.at(t_s)
    lat = np.clip(lat, -MOST_LAT_DEG, MOST_LAT_DEG)
    lat_deg, lon_deg = float(np.nanmedian(lat)), float(lon[0])
    away_deg = (lon - lon_deg + 180.0) % 360.0 - 180.0
    scale_m = EARTH_M * np.cos(np.radians(lat_deg))
    east = scale_m * np.radians(away_deg)
    north = scale_m * (_mercator(lat) - _mercator(np.array([lat_deg])))
    selected = _moved(east, north)
    t_s, east, north = t_s[selected], east[selected], north[selected]
    row = np.minimum(np.searchsorted(time_s, t_s), len(time_s) - 1)
    has_speed = ~np.isnan(speed_kmh)
    no_speed = np.full(len(t_s), np.nan)
    speed = np.interp(t_s, time_s[has_speed], speed_kmh[has_speed]) if np.any(has_speed) else no_speed
    return MapPoints(t_s, east, north, shown_lean_deg(overview)[row], speed, lat_deg, lon_deg)


def figure(points: MapPoints, overview: Overview) -> dict[str, Any]:
    """Return the map for plotly.js: {"data": traces, "layout": ...}, in plain numbers and lists, with None for NaN.

    The first trace is the track as a line. Its customdata are time (s), lean (degrees) and speed (km/h), None if
    missing. The second trace has the coloured points, with their times (s) as customdata. The first shape marks a
    place, the second shape is the scale bar, and the first annotation names the length of the bar. map.js moves all
    three.
    """
    x, y = plain(points.east_m, 1), plain(points.north_m, 1)
    rows = [plain(row, 1) for row in np.column_stack((points.t_s, points.lean_deg, points.speed_kmh))]
    line = {"type": "scattergl", "mode": "lines", "line": {"width": 1.5, "color": "#8a8a8a"}, "hoverinfo": "skip"}
    dots: dict[str, Any] = {"size": 6, "color": SPEED_COLOUR}
    drawable = np.isfinite(points.east_m)
    if not overview.ride.car:
        limit = max(LEAST_LEAN_DEG, float(round(lean_limit(overview) / 1.2)))
        drawable &= np.isfinite(points.lean_deg)
        lean = plain(points.lean_deg[drawable], 1)
        dots |= {"color": lean, "colorscale": _COLOURS, "cmin": -limit, "cmax": limit}
        bar = {"title": {"text": "left  ·  lean, °  ·  right", "side": "top"}, "orientation": "h", "thickness": 10}
        bar |= {"x": 1.0, "y": 1.0, "xanchor": "right", "yanchor": "bottom", "ypad": 5, "len": 0.6, "ticks": "outside"}
        ticks = [f"{limit:.0f}", "0", f"{limit:.0f}"]
        dots["colorbar"] = bar | {"tickvals": [-limit, 0.0, limit], "ticktext": ticks, "outlinewidth": 0}
    points_trace = {"x": plain(points.east_m[drawable], 1), "y": plain(points.north_m[drawable], 1)}
    points_trace |= {"customdata": plain(points.t_s[drawable], 1), "marker": dots}
    paper = {"xref": "paper", "yref": "paper", "showarrow": False}
    thin = {"arrowhead": 0, "arrowwidth": 1}
    layout = PAPER | {
        "margin": {"l": 5, "r": 5, "t": 85, "b": 5},  # the top has room for plotly's buttons and the legend
        "hovermode": "closest",
        "dragmode": "pan",
        "xaxis": {"visible": False},
        "yaxis": {"visible": False, "scaleanchor": "x"},
        "shapes": [
            {"type": "circle", "xsizemode": "pixel", "ysizemode": "pixel", "xanchor": x[0], "yanchor": y[0], "x0": -8}
            | {"x1": 8, "y0": -8, "y1": 8, "line": {"width": 3, "color": "#111111"}}
            | {"fillcolor": "#ffe14a", "opacity": 1.0},
            {"type": "line", "xref": "paper", "yref": "paper", "x0": 0.02, "x1": 0.02, "y0": 0.02, "y1": 0.02}
            | {"line": {"width": 4, "color": "#111111"}, "opacity": 1.0},
        ],
        "annotations": [
            paper | {"x": 0.02, "y": 0.025, "xanchor": "left", "yanchor": "bottom", "text": ""},
            paper
            | {"x": 0.02, "y": 1.0, "xanchor": "left", "yanchor": "bottom", "text": "<b>N</b><br>↑"}
            | {"font": {"size": 18}},
            thin | {"x": x[0], "y": y[0], "text": "start", "ax": -25, "ay": -25},
            thin | {"x": x[-1], "y": y[-1], "text": "end", "ax": 25, "ay": 25},
        ],
    }
    track_line = line | {"x": x, "y": y, "customdata": rows}
    return {
        "data": [track_line, {"type": "scattergl", "mode": "markers", "hoverinfo": "none"} | points_trace],
        "layout": layout,
    }


def shape(points: MapPoints) -> float:
    """Return the width of the map divided by its height, within _SHAPES, so that the track fills the map."""
    east, north = (float(np.nanmax(metres) - np.nanmin(metres)) for metres in (points.east_m, points.north_m))
    return float(np.clip((east or 1.0) / (north or 1.0), *_SHAPES))


def _times(positions: LogTrack, seconds: float) -> Array:
    """Return the times of the points: at most POINTS, evenly spaced over the ride."""
    first, last = float(positions.t_s[0]), min(seconds, float(positions.t_s[-1]))
    count = int(np.clip((last - first) / SHORTEST_S, 1, POINTS)) + 1
    return np.linspace(first, last, count)


def _mercator(lat_deg: Array) -> Array:
    return np.arcsinh(np.tan(np.radians(lat_deg)))


def _moved(east: Array, north: Array) -> Ints:
    """Return the indexes of the points over SAME_M from the last one, the first in each gap, and the first after it."""
    selected, (last_x, last_y) = [0], (east[0], north[0])
    for k, (x, y) in enumerate(zip(east.tolist(), north.tolist())):
        begins_or_ends_gap = (x != x) != (last_x != last_x)
        if begins_or_ends_gap or abs(x - last_x) + abs(y - last_y) > SAME_M:
            selected.append(k)
            last_x, last_y = x, y
    return np.array(selected)
