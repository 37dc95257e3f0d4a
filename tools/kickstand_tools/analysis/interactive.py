"""Converts the charts and the map of a ride to figures of plotly.js, which you can zoom.

A figure of charts is {"data": traces, "layout": layout of a wide window, "narrow": layout of a phone}. In a wide
window, the last charts are side by side, below the charts over time.

The map shows the track in metres, coloured by lean. North is up. It uses the Mercator projection, as map tiles do.
Angles are true. The scale is exact at the ride's own latitude, and off by one per cent 50 km further north.
"""

import html
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..signals import EARTH_M, Array, Ints
from .charts import (
    LEFT_COLOUR,
    RIGHT_COLOUR,
    SPEED_COLOUR,
    Bars,
    Chart,
    Charts,
    Dots,
    Line,
    Note,
    Sides,
    Trace,
    envelope,
    lean_limit,
    shown_lean_deg,
)
from .overview import Overview
from .ride import LogTrack, track

LINE_POINTS = 40_000  # largest number of points in a line; with more, a browser does not zoom smoothly
_INCH = 86  # pixels per inch of a chart's height
_GAP, _NARROW_GAP = 62, 96  # pixels between rows of charts; in a narrow window, each row needs room for names of axes
_MARGIN = {"l": 80, "r": 80, "t": 100, "b": 80}
_NARROW_MARGIN = {"l": 52, "r": 12, "t": 160, "b": 60}
_ASIDE = 0.085  # space between charts side by side, as a share of the width of the window
_SMALL = {"font": {"size": 12}}
# Plotly shows no text where the pointer is. page.js finds the trace by its name, and shows a text of its own
_OWN_WORDS: dict[str, Any] = {"hoverinfo": "none"}
_INK = "rgb(36,36,36)"
# Colours from rare to frequent. The first colour is visible on white and, with inverted colours, on a dark background.
_OFTEN = [[0.0, "#5aabab"], [0.35, "#2f93b4"], [0.7, "#235fa5"], [1.0, "#0b1f5c"]]
_AXIS = {
    "automargin": True,
    "linecolor": _INK,
    "showgrid": False,
    "showline": True,
    "ticks": "outside",
    "zeroline": False,
}
PAPER = {
    "autotypenumbers": "strict",
    "bargap": 0,
    "font": {"color": _INK},
    "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "rgb(120,120,120)", "activecolor": _INK},
    "paper_bgcolor": "rgba(0,0,0,0)",  # transparent: the background of the page is visible
    "plot_bgcolor": "rgba(0,0,0,0)",
    "showlegend": False,
}
_SIDES: dict[str, Any] = {  # place of the words beside a point
    "above": {"yanchor": "bottom"},
    "below": {"yanchor": "top"},
    "left": {"xanchor": "right", "xshift": -2},
    "right": {"xanchor": "left", "xshift": 2},
}

TRACK_POINTS = 20_000  # largest number of points
SHORTEST_S = 0.2  # least time between points
SAME_M = 0.5  # least distance between points, so a standing bike is one point
MOST_LAT_DEG = 85.0  # largest latitude on the map, because Mercator cannot show the poles
_SHAPES = (0.6, 2.2)  # least and largest ratio of width to height
LEAST_LEAN_DEG = 30.0  # smaller leans never have the full colour
# Colours from left lean to right lean, with grey for upright. Colour-blind people can distinguish blue from orange.
_COLOURS = [[0.0, "#0d3a73"], [0.25, LEFT_COLOUR], [0.5, "#c9c9c9"], [0.75, RIGHT_COLOUR], [1.0, "#7a2c05"]]


def plain(values: Array, digits: int = 3) -> list[float | None]:
    """Round numbers for JSON, because a page does not need sixteen digits. NaN becomes None."""
    return [None if value != value else value for value in np.round(values, digits).tolist()]


def charts_figure(charts: Charts, linked: bool = False) -> dict[str, Any]:
    """Return the figure for plotly.js, in plain numbers and lists, with None for NaN.

    linked: the mouse selects a moment anywhere in a chart over time, not only at its lines.
    """
    all_charts = [*charts.over_time, *charts.below]
    data = [
        drawn | _axes(k) for k, chart in enumerate(all_charts) for trace in chart.traces for drawn in _traces(trace)
    ]
    layouts = {kind: _layout(charts, kind == "narrow", linked) for kind in ("layout", "narrow")}
    return {"data": data} | layouts


def time_axes(charts: Charts) -> list[str]:
    return [_axes(k)["xaxis"] for k in range(len(charts.over_time))]


def _axes(k: int) -> dict[str, str]:
    """Return plotly's names of the axes of chart k."""
    return {"xaxis": f"x{k + 1 if k else ''}", "yaxis": f"y{k + 1 if k else ''}"}


def _traces(trace: Trace) -> list[dict[str, Any]]:
    """Return a trace for plotly: two traces for Sides, which are filled in two colours, otherwise one."""
    if isinstance(trace, Line):
        x, y = envelope(trace.x, trace.y, LINE_POINTS, trace.gap_s)
        line = {"color": trace.colour, "width": 1.2 * trace.width, "dash": "dot" if trace.dotted else "solid"}
        named = {"type": "scatter", "hoverinfo": "skip"}
        if trace.name:
            named = {"type": "scattergl", "name": trace.name, **_OWN_WORDS}
        return [{"mode": "lines", "line": line, "x": plain(x), "y": plain(y)} | named]
    if isinstance(trace, Sides):
        x, y = envelope(trace.x, trace.y, LINE_POINTS, trace.gap_s)
        # At both ends of a gap, y becomes 0. Otherwise plotly would fill the area across the gap.
        gaps = np.flatnonzero(np.isnan(y))
        x = np.insert(x, np.concatenate((gaps, gaps + 1)), np.concatenate((x[gaps - 1], x[gaps + 1])))
        y = np.insert(y, np.concatenate((gaps, gaps + 1)), 0.0)
        left = _filled("left", x, np.minimum(y, 0.0), LEFT_COLOUR)
        return [left, _filled("right", x, np.maximum(y, 0.0), RIGHT_COLOUR)]
    if isinstance(trace, Dots):
        drawn = _OWN_WORDS | {"type": "scattergl", "mode": "markers", "marker": {"size": 3, "color": trace.colour}}
        return [drawn | {"name": trace.name, "x": plain(trace.x, 5), "y": plain(trace.y, 5)}]
    if isinstance(trace, Bars):
        colours = np.where(trace.x < 0.0, LEFT_COLOUR, RIGHT_COLOUR).tolist()
        drawn = _OWN_WORDS | {"type": "bar", "marker": {"color": colours, "line": {"width": 0}}, "width": trace.width}
        return [drawn | {"name": trace.name, "x": plain(trace.x), "y": plain(trace.y)}]
    centres = plain((trace.edges[1:] + trace.edges[:-1]) / 2.0, 4)
    occupied = trace.values > 0.0
    logs = np.log10(np.where(occupied, trace.values, np.nan))
    drawn: dict[str, Any] = _OWN_WORDS | {"type": "heatmap", "colorscale": _OFTEN, "showscale": False}
    if np.any(occupied):
        drawn |= {"zmin": float(np.nanmin(logs)), "zmax": float(np.nanmax(logs))}
    return [drawn | {"name": f"{trace.name}, log10", "x": centres, "y": centres, "z": [plain(row) for row in logs]}]


def _filled(name: str, x: Array, y: Array, colour: str) -> dict[str, Any]:
    """Return a trace that is filled from zero to y, shape (n). Only the two ends of each run of zeros are kept."""
    leans = y != 0.0
    selected = leans.copy()
    selected[1:] |= leans[:-1]
    selected[:-1] |= leans[1:]
    drawn = _OWN_WORDS | {"type": "scattergl", "mode": "lines", "line": {"color": colour, "width": 1.2}}
    return drawn | {"fill": "tozeroy", "name": name, "x": plain(x[selected]), "y": plain(y[selected])}


def _layout(charts: Charts, narrow: bool, linked: bool) -> dict[str, Any]:
    """Return the layout. The charts over time are one below the other, and below them the others side by side.

    narrow: True to put all charts one below the other. linked: True if the charts over time have one cursor.
    """
    all_charts, rows = [*charts.over_time, *charts.below], len(charts.over_time)
    heights = [round(_INCH * chart.height) for chart in (all_charts if narrow else all_charts[: rows + 1])]
    gap, margin = (_NARROW_GAP, _NARROW_MARGIN) if narrow else (_GAP, _MARGIN)
    inner = sum(heights) + gap * (len(heights) - 1)
    words = html.escape(charts.title).split("  ·  ")  # plotly treats < as the start of a tag
    lines = words if narrow else ["  ·  ".join(words[:2]), "  ·  ".join(words[2:])]
    layout: dict[str, Any] = PAPER | {"height": inner + margin["t"] + margin["b"], "margin": margin}
    layout["title"] = {"text": "<br>".join(filter(None, lines)), "x": 0.05, "font": {"size": 14}}
    layout |= {"annotations": [], "shapes": []} | ({"hovermode": "x"} if linked else {})
    wide = (1.0 - _ASIDE * (len(charts.below) - 1)) / len(charts.below)
    for k, chart in enumerate(all_charts):
        is_over_time = k < rows
        row, column = (k, 0) if narrow else (min(k, rows), max(0, k - rows))
        left, width = (0.0, 1.0) if narrow or is_over_time else (column * (wide + _ASIDE), wide)
        top = (inner - sum(heights[:row]) - gap * row) / inner
        x, y = _axes(k).values()
        across, along = _axes_of(chart, x, y, every_other_tick=narrow and is_over_time)
        across["domain"], along["domain"] = [left, left + width], [top - heights[row] / inner, top]
        if is_over_time:
            across |= ({"matches": "x"} if k else {}) | ({"hoverformat": ".1f"} if linked else {})
        layout[x.replace("x", "xaxis")], layout[y.replace("y", "yaxis")] = across, along
        layout["annotations"] += _annotations(chart, x, y, narrow)
        layout["shapes"] += [
            {"type": "rect", "x0": begin, "x1": end, "y0": 0, "y1": 1, "xref": x, "yref": f"{y} domain"}
            | {"fillcolor": "grey", "opacity": 0.2, "line": {"width": 0}}
            for begin, end, _ in chart.spans
        ]
    return layout


def _axes_of(chart: Chart, x: str, y: str, every_other_tick: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the axes of a chart. x, y: their names."""
    across = _AXIS | {"anchor": y, "range": chart.x_range, "title": {"text": chart.x_title, "standoff": 15} | _SMALL}
    along = _AXIS | {"anchor": x, "range": chart.y_range, "title": {"text": chart.y_title, "standoff": 5} | _SMALL}
    if chart.ticks is not None:
        ticks = dict(list(chart.ticks.items())[:: 2 if every_other_tick else 1])
        across |= {"tickvals": list(ticks), "ticktext": list(ticks.values())}
    if chart.square:
        along["scaleanchor"] = x
    return across, along


def _annotations(chart: Chart, x: str, y: str, narrow: bool) -> list[dict[str, Any]]:
    """Return the title, the names of the traces in their colours, and the words in corners, at points and in spans."""
    within = {"xref": f"{x} domain", "yref": f"{y} domain"}
    names = [
        f"<span style='color:{trace.colour}'>{trace.name}</span>"
        for trace in chart.traces
        if isinstance(trace, Line) and trace.name
    ]
    title = chart.title.replace(" (", "<br>(") if narrow and len(names) > 1 else chart.title  # else too long
    heading = title + (f":{'<br>' if narrow else ' '}{', '.join(names)}" if len(names) > 1 else "")
    words = [
        within | _note(Note(0.0, 1.0, heading, "above")) | {"xanchor": "left", "align": "left"},
        within
        | _note(Note(0.0, 1.0, chart.left.replace("\n", "<br>"), "below"))
        | {"xanchor": "left", "align": "left", "bgcolor": "rgba(255,255,255,0.75)"},
        within | _note(Note(1.0, 1.0, chart.right, "below")) | {"xanchor": "right"},
    ]
    words += [{"xref": x, "yref": y} | _note(note) for note in chart.notes]
    spans = (Note((begin + end) / 2.0, 1.0, text, "below") for begin, end, text in chart.spans)
    words += [within | {"xref": x} | _note(span) for span in spans]
    return [annotation for annotation in words if annotation["text"]]


def _note(note: Note) -> dict[str, Any]:
    annotation = {"x": note.x, "y": note.y, "text": note.text, "showarrow": False} | _SMALL
    return annotation | _SIDES[note.side]


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
    # The scale is exact at the origin's latitude, so the origin is in the middle of the track
    origin_lat, origin_lon = float(np.nanmedian(lat)), float(lon[0])
    east, north = _metres_from(origin_lat, origin_lon, lat, lon)
    selected = _indexes_of_moves(east, north)
    t_s, east, north = t_s[selected], east[selected], north[selected]
    # The lean is not interpolated, because no point beside a NaN would have a lean
    next_sample = np.minimum(np.searchsorted(time_s, t_s), len(time_s) - 1)
    has_speed = ~np.isnan(speed_kmh)
    no_speed = np.full(len(t_s), np.nan)
    speed = np.interp(t_s, time_s[has_speed], speed_kmh[has_speed]) if np.any(has_speed) else no_speed
    return MapPoints(t_s, east, north, shown_lean_deg(overview)[next_sample], speed, origin_lat, origin_lon)


def _colours_of_lean(limit_deg: float) -> dict[str, Any]:
    """Return the colours of the leans up to a limit, and the bar that explains them."""
    bar = {"title": {"text": "left  ·  lean, °  ·  right", "side": "top"}, "orientation": "h", "thickness": 10}
    bar |= {"x": 1.0, "y": 1.0, "xanchor": "right", "yanchor": "bottom", "ypad": 5, "len": 0.6, "ticks": "outside"}
    ticks = [f"{limit_deg:.0f}", "0", f"{limit_deg:.0f}"]
    bar |= {"tickvals": [-limit_deg, 0.0, limit_deg], "ticktext": ticks, "outlinewidth": 0}
    return {"colorscale": _COLOURS, "cmin": -limit_deg, "cmax": limit_deg, "colorbar": bar}


def map_figure(points: MapPoints, overview: Overview) -> dict[str, Any]:
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
        drawable &= np.isfinite(points.lean_deg)
        limit_deg = max(LEAST_LEAN_DEG, float(round(lean_limit(overview) / 1.2)))
        dots |= {"color": plain(points.lean_deg[drawable], 1)} | _colours_of_lean(limit_deg)
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


def map_shape(points: MapPoints) -> float:
    """Return the width of the map divided by its height, within _SHAPES, so that the track fills the map."""
    east, north = (float(np.nanmax(metres) - np.nanmin(metres)) for metres in (points.east_m, points.north_m))
    return float(np.clip((east or 1.0) / (north or 1.0), *_SHAPES))


def _times(positions: LogTrack, seconds: float) -> Array:
    """Return the times of the points: at most TRACK_POINTS, evenly spaced over the ride."""
    first, last = float(positions.t_s[0]), min(seconds, float(positions.t_s[-1]))
    count = int(np.clip((last - first) / SHORTEST_S, 1, TRACK_POINTS)) + 1
    return np.linspace(first, last, count)


def _metres_from(origin_lat: float, origin_lon: float, lat: Array, lon: Array) -> tuple[Array, Array]:
    """Return how far east and north of the origin positions in degrees are on the map, in m."""
    scale_m = EARTH_M * np.cos(np.radians(origin_lat))
    east = scale_m * np.radians((lon - origin_lon + 180.0) % 360.0 - 180.0)  # correct also across 180 degrees
    return east, scale_m * (_mercator(lat) - _mercator(np.array([origin_lat])))


def _mercator(lat_deg: Array) -> Array:
    return np.arcsinh(np.tan(np.radians(lat_deg)))


def _indexes_of_moves(east: Array, north: Array) -> Ints:
    """Return the indexes of the points over SAME_M from the last one, the first in each gap, and the first after it."""
    selected, (last_x, last_y) = [0], (east[0], north[0])
    for k, (x, y) in enumerate(zip(east.tolist(), north.tolist())):
        begins_or_ends_gap = (x != x) != (last_x != last_x)
        if begins_or_ends_gap or abs(x - last_x) + abs(y - last_y) > SAME_M:
            selected.append(k)
            last_x, last_y = x, y
    return np.array(selected)
