"""The ride as one HTML page to zoom into. The page needs no other file."""

from pathlib import Path
from typing import Any

import numpy as np

from ..overview import Overview
from ..report import clock
from ..stops.brake_test import Stop
from . import page_with_map, track_map
from .envelope import GAP_S, SPEED_GAP_S, envelope
from .traces import (
    BRAKE_COLOUR,
    LATERAL_COLOUR,
    LEFT_COLOUR,
    RIGHT_COLOUR,
    SPEED_COLOUR,
    histogram,
    lean_limit,
    maxima,
    quality_lines,
    tick_s,
    title,
    traces,
)

POINTS = 40_000  # of a line: with more, a browser no longer zooms smoothly


def draw(path: Path, seen: Overview, tiles: bool = False) -> None:
    """Write it, with a map beside the charts where the log has positions. tiles: with streets in the map, which the
    page then takes from a server."""
    charts, points = figure(seen), track_map.map_points(seen)
    if points is None:
        charts.write_html(path, include_plotlyjs=True, full_html=True)
        return
    charts.update_layout(hovermode="x")  # anywhere over a chart, not on a line alone
    charts.update_xaxes(hoverformat=".1f")
    path.write_text(page_with_map.html(charts, points, seen, tiles), encoding="utf-8")


def figure(seen: Overview) -> Any:
    """The plotly figure."""
    from plotly.graph_objects import Bar, Heatmap, Scatter, Scattergl
    from plotly.subplots import make_subplots

    drawn, quality = traces(seen), seen.quality
    lean = ("lean", "Lean, degrees (right > 0)", drawn.lean_deg, RIGHT_COLOUR)
    speed = ("speed", "Speed, km/h", drawn.speed_kmh, SPEED_COLOUR)
    lines = ([] if seen.ride.car else [lean]) + ([speed] if seen.has_speed else [])
    forces = len(lines) + 1  # row of the acceleration, and number of its axes; below it g, share and straights
    axes, below = str(forces) if forces > 1 else "", forces + 1
    made: Any = make_subplots(
        rows=below,
        cols=3,
        specs=[*[[{"colspan": 3}, None, None]] * forces, [{}, {}, {}]],
        row_heights=[*[0.18 if line is speed else 0.3 for line in lines], 0.3, 0.4],
        vertical_spacing=0.07,
        subplot_titles=(
            *[line[1] for line in lines],
            f"Acceleration, g: <span style='color:{BRAKE_COLOUR}'>forward</span> and "
            f"<span style='color:{LATERAL_COLOUR}'>to the left</span>; grey: stops and their MFDD, m/s²",
            "g against g",
            "" if seen.ride.car else "How long at which lean, %",
            "Alignment: g on the straights",
        ),
    )
    for row, (name, _, values, colour) in enumerate(lines, 1):
        x, y = envelope(drawn.time_s, values, POINTS, SPEED_GAP_S if name == "speed" else GAP_S)
        made.add_trace(Scatter(x=x, y=_short(y), name=name, line={"width": 1, "color": colour}), row, 1)
    for peak, sign in maxima(seen):
        text = f"{peak.value:.0f}° {'left' if sign < 0 else 'right'}"
        made.add_annotation(x=peak.time_s, y=sign * peak.value, text=text, row=1, col=1, ay=-20 * sign)
    for values, colour, name in (
        (drawn.lateral_g, LATERAL_COLOUR, "to the left"),
        (drawn.forward_g, BRAKE_COLOUR, "forward"),
    ):
        x, y = envelope(drawn.time_s, values, POINTS, GAP_S)
        made.add_trace(Scatter(x=x, y=_short(y), name=name, line={"width": 1, "color": colour}), forces, 1)
    centres = (drawn.gg_edges_g[1:] + drawn.gg_edges_g[:-1]) / 2.0
    logs = np.log10(np.where(drawn.gg_s > 0.0, drawn.gg_s, np.nan))
    colours = {"colorscale": "YlGnBu", "reversescale": False, "showscale": False}
    made.add_trace(Heatmap(x=-centres, y=centres, z=logs, name="seconds, log10", **colours), below, 1)
    middle, share = histogram(seen)
    sides = np.where(middle < 0.0, LEFT_COLOUR, RIGHT_COLOUR).tolist()
    made.add_trace(Bar(x=middle, y=share, marker={"color": sides}, name="share"), below, 2)
    dots = {"size": 3, "color": "grey"}
    made.add_trace(
        Scattergl(x=-quality.lateral_g, y=quality.forward_g, mode="markers", marker=dots, name="straights"), below, 3
    )
    if quality.yaw_deg is not None:
        reach = np.array([-1.0, 1.0]) * float(np.max(np.abs(quality.forward_g)))
        line = {"width": 1.5, "color": BRAKE_COLOUR}
        across = -np.tan(np.radians(quality.yaw_deg)) * reach
        made.add_trace(Scatter(x=across, y=reach, mode="lines", line=line), below, 3)
    box = {"text": "<br>".join(quality_lines(seen)), "showarrow": False, "align": "left"}
    corner = {"xref": f"x{below + 2} domain", "yref": f"y{below + 2} domain", "xanchor": "left", "yanchor": "top"}
    made.add_annotation(x=0.02, y=0.98, **corner, **box)
    limit = lean_limit(seen)
    leaning = float(np.max(share[np.abs(middle) > 5.0], initial=0.0))
    made.update_yaxes(range=[0.0, max(1.0, 1.5 * leaning)], row=below, col=2)
    if not seen.ride.car:
        made.update_yaxes(range=[-limit, limit], row=1, col=1)
    for row in range(2, below):
        made.update_xaxes(matches="x", row=row, col=1)
    seconds = float(drawn.time_s[-1])
    ticks = np.arange(0.0, seconds, tick_s(seconds))
    for row in range(1, below):
        made.update_xaxes(tickvals=ticks, ticktext=[clock(tick) for tick in ticks], row=row, col=1)
    made.update_xaxes(title_text="left turn  ·  right turn", row=below, col=1)
    made.update_yaxes(title_text="braking  ·  acceleration", scaleanchor=f"x{below}", row=below, col=1)
    made.update_xaxes(title_text="left  ·  degrees  ·  right", range=[-limit, limit], row=below, col=2)
    made.update_xaxes(title_text="left  ·  g  ·  right", row=below, col=3)
    made.update_yaxes(scaleanchor=f"x{below + 2}", row=below, col=3)
    made.update_layout(shapes=[_shade(stop, axes) for stop in seen.stops])  # one by one takes minutes for hundreds
    made.update_layout(annotations=[*made.layout.annotations, *[_label(stop, axes) for stop in seen.stops]])
    made.update_annotations(font_size=12, selector={"showarrow": False})
    height = 1000 if below == 3 else 1150
    made.update_layout(template="simple_white", title=title(seen), showlegend=False, height=height, bargap=0)
    return made


def _shade(stop: Stop, axes: str) -> dict[str, Any]:
    """A grey field behind the acceleration."""
    place = {"x0": stop.start_s, "x1": stop.stop_s, "y0": 0, "y1": 1, "xref": f"x{axes}", "yref": f"y{axes} domain"}
    return place | {"type": "rect", "fillcolor": "grey", "opacity": 0.2, "line": {"width": 0}}


def _label(stop: Stop, axes: str) -> dict[str, Any]:
    """Its MFDD."""
    place = {"x": (stop.start_s + stop.stop_s) / 2.0, "y": 1, "xref": f"x{axes}", "yref": f"y{axes} domain"}
    return place | {"text": f"{stop.mfdd_mps2:.1f}", "showarrow": False, "yanchor": "top"}


def _short(values: np.ndarray) -> np.ndarray:
    """Three digits: a page need not hold sixteen."""
    return np.round(values, 3)
