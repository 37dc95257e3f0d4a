"""The charts of a ride as plotly.js takes them: {"data": traces, "layout": of a wide window, "narrow": of a phone}."""

import html
from typing import Any

import numpy as np

from ...logs.table import Array
from ..overview import Overview
from ..report import clock, judged
from ..stops.brake_test import Stop
from .envelope import GAP_S, SPEED_GAP_S, envelope
from .in_script import plain
from .layout import AXIS, PAPER, arranged
from .traces import (
    BRAKE_COLOUR,
    LATERAL_COLOUR,
    LEFT_COLOUR,
    RIGHT_COLOUR,
    SPEED_COLOUR,
    Traces,
    histogram,
    lean_limit,
    maxima,
    quality_lines,
    tick_s,
    title,
    traces,
)

POINTS = 40_000  # of a line: with more, a browser no longer zooms smoothly
_HIGH, _LOW, _SQUARE = 210, 125, 280  # heights of charts, pixels


def figure(seen: Overview) -> dict[str, Any]:
    """All that is drawn, in plain numbers, lists and None for NaN."""
    drawn = traces(seen)
    over_time = [] if seen.ride.car else ["lean"]
    over_time += ["speed"] if seen.has_speed else []
    forces = len(over_time) + 1  # number of the acceleration's axes; after it g against g, share and straights
    made = {"data": _data(seen, drawn, over_time, forces)}
    for kind in ("layout", "narrow"):
        made[kind] = _layout(seen, drawn, over_time, forces, kind == "narrow")
    return made


def _data(seen: Overview, drawn: Traces, over_time: list[str], forces: int) -> Any:
    made = []
    for k, name in enumerate(over_time, 1):
        lean = name == "lean"
        values, colour = (drawn.lean_deg, RIGHT_COLOUR) if lean else (drawn.speed_kmh, SPEED_COLOUR)
        made.append(_line(name, drawn.time_s, values, colour, k, GAP_S if lean else SPEED_GAP_S))
    made.append(_line("to the left", drawn.time_s, drawn.lateral_g, LATERAL_COLOUR, forces, GAP_S))
    made.append(_line("forward", drawn.time_s, drawn.forward_g, BRAKE_COLOUR, forces, GAP_S))
    centres = (drawn.gg_edges_g[1:] + drawn.gg_edges_g[:-1]) / 2.0
    logs = np.log10(np.where(drawn.gg_s > 0.0, drawn.gg_s, np.nan))
    seconds = {"type": "heatmap", "name": "seconds, log10", "colorscale": "YlGnBu", "showscale": False}
    seconds |= {"reversescale": True, "x": plain(-centres), "y": plain(centres), "z": [plain(row) for row in logs]}
    middle, share = histogram(seen)
    sides = np.where(middle < 0.0, LEFT_COLOUR, RIGHT_COLOUR).tolist()
    bars = {"type": "bar", "name": "share", "x": plain(middle), "y": plain(share)}
    bars |= {"marker": {"color": sides, "line": {"width": 0.5, "color": "white"}}}
    straights = {"type": "scattergl", "name": "straights", "mode": "markers", "marker": {"size": 3, "color": "grey"}}
    straights |= {"x": plain(-seen.quality.lateral_g, 5), "y": plain(seen.quality.forward_g, 5)}
    made += [one | _axes(forces + k) for k, one in enumerate((seconds, bars, straights), 1)]
    if seen.quality.yaw_deg is not None and judged(seen):
        reach = np.array([-1.0, 1.0]) * float(np.max(np.abs(seen.quality.forward_g)))
        across = -np.tan(np.radians(seen.quality.yaw_deg)) * reach
        line = {"type": "scatter", "mode": "lines", "line": {"width": 1.5, "color": BRAKE_COLOUR}}
        made.append(line | {"x": plain(across, 5), "y": plain(reach, 5)} | _axes(forces + 3))
    return made


def _layout(seen: Overview, drawn: Traces, over_time: list[str], forces: int, narrow: bool) -> dict[str, Any]:
    titles = {"lean": "Lean, degrees (right > 0)", "speed": "Speed, km/h"}
    said = (
        f"Acceleration, g: <span style='color:{BRAKE_COLOUR}'>forward</span> and "
        f"<span style='color:{LATERAL_COLOUR}'>to the left</span>; grey: stops and their MFDD, m/s²"
    )
    names = [*(titles[name] for name in over_time), said, "g against g"]
    names += ["" if seen.ride.car else "How long at which lean, %", "Alignment: g on the straights"]
    rows = [*(_HIGH if name == "lean" else _LOW for name in over_time), _HIGH, _SQUARE]
    made = arranged(rows, names, html.escape(title(seen)), narrow)  # plotly takes < for the beginning of a tag
    begin, end = float(drawn.time_s[0]), float(drawn.time_s[-1])
    step = tick_s(end - begin) * (2 if narrow else 1)
    ticks = np.arange(step * np.ceil(begin / step), end, step)
    at_times = {"tickvals": ticks.tolist(), "ticktext": [clock(tick) for tick in ticks]}
    for k in range(1, forces + 1):
        made[f"xaxis{_number(k)}"] |= at_times | ({"matches": "x"} if k > 1 else {})
    limit = lean_limit(seen)
    if not seen.ride.car:
        made["yaxis"]["range"] = [-1.2 * limit, 1.2 * limit]  # with room for what stands at the maxima
    middle, share = histogram(seen)
    leaning = float(np.max(share[np.abs(middle) > 5.0], initial=0.0))
    gg, lean, straights = forces + 1, forces + 2, forces + 3
    below = {
        f"xaxis{gg}": {"title": {"text": "left turn  ·  right turn"}},
        f"yaxis{gg}": {"title": {"text": "braking  ·  acceleration"}, "scaleanchor": f"x{gg}"},
        f"xaxis{lean}": {"title": {"text": "left  ·  degrees  ·  right"}, "range": [-limit, limit]},
        f"yaxis{lean}": {"range": [0.0, max(1.0, 1.5 * leaning)]},
        f"xaxis{straights}": {"title": {"text": "left  ·  g  ·  right"}},
        f"yaxis{straights}": {"scaleanchor": f"x{straights}"},
    }
    for name in [name for name in made if name[1:].startswith("axis")]:
        one = AXIS | made[name] | below.get(name, {})
        made[name] = one | {"title": AXIS["title"] | one["title"]}
    for peak, sign in maxima(seen):
        text = f"{peak.value:.0f}° {'left' if sign < 0 else 'right'}"
        place = {"x": peak.time_s, "y": sign * peak.value, "xref": "x", "yref": "y"}
        made["annotations"].append(place | {"text": text, "ax": 0, "ay": -20 * sign, "arrowhead": 0, "arrowwidth": 1})
    corner = {"xref": f"x{straights} domain", "yref": f"y{straights} domain", "xanchor": "left", "yanchor": "top"}
    box = {"text": "<br>".join(quality_lines(seen)), "showarrow": False, "align": "left", "font": {"size": 12}}
    made["annotations"] += [corner | box | {"x": 0.02, "y": 0.98}, *[_label(stop, forces) for stop in seen.stops]]
    return PAPER | made | {"hovermode": "closest", "shapes": [_shade(stop, forces) for stop in seen.stops]}


def _line(name: str, time: Array, values: Array, colour: str, axes: int, gap_s: float) -> dict[str, Any]:
    x, y = envelope(time, values, POINTS, gap_s)
    made = {"type": "scatter", "mode": "lines", "name": name, "line": {"width": 1, "color": colour}}
    return made | {"x": plain(x), "y": plain(y)} | _axes(axes)


def _axes(k: int) -> dict[str, str]:
    return {"xaxis": f"x{_number(k)}", "yaxis": f"y{_number(k)}"}


def _number(k: int) -> str:
    """As plotly counts axes."""
    return str(k) if k > 1 else ""


def _shade(stop: Stop, axes: int) -> dict[str, Any]:
    """A grey field behind the acceleration."""
    place = {"x0": stop.start_s, "x1": stop.stop_s, "y0": 0, "y1": 1}
    place |= {"xref": f"x{_number(axes)}", "yref": f"y{_number(axes)} domain"}
    return place | {"type": "rect", "fillcolor": "grey", "opacity": 0.2, "line": {"width": 0}}


def _label(stop: Stop, axes: int) -> dict[str, Any]:
    """Its MFDD."""
    place = {"x": (stop.start_s + stop.stop_s) / 2.0, "y": 1, "yanchor": "top", "font": {"size": 12}}
    place |= {"xref": f"x{_number(axes)}", "yref": f"y{_number(axes)} domain"}
    return place | {"text": f"{stop.mfdd_mps2:.1f}", "showarrow": False}
