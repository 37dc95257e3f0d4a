"""The ride as one picture: lean, speed and g over time, g against g, how long at which lean, the alignment."""

from pathlib import Path
from typing import Any

import numpy as np

from ..overview import Overview
from ..report import clock, judged
from .envelope import GAP_S, SPEED_GAP_S, envelope
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

POINTS = 6000
_STYLE: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "0.6",
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.92",
    "xtick.color": "0.35",
    "ytick.color": "0.35",
}


def draw(path: Path, seen: Overview) -> None:
    """Write a PNG."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    over_time = [] if seen.ride.car else [_lean]
    over_time += [_speed] if seen.has_speed else []
    over_time += [_forces]
    heights = [1.5 if panel is _speed else 2.5 for panel in over_time] + [3.0]  # inches
    with rc_context(_STYLE):
        figure = Figure(figsize=(11, sum(heights)), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title(seen), fontsize=12, x=0.01, ha="left", parse_math=False)  # a name may have $ in it
        rows = figure.add_gridspec(len(heights), 3, height_ratios=heights)
        drawn = traces(seen)
        first = None
        for k, panel in enumerate(over_time):
            axes = figure.add_subplot(rows[k, :], sharex=first)
            first = first or axes
            panel(axes, drawn, seen)
        _gg(figure.add_subplot(rows[-1, 0]), drawn)
        if not seen.ride.car:
            _histogram(figure.add_subplot(rows[-1, 1]), seen)
        _alignment(figure.add_subplot(rows[-1, 2]), seen)
        figure.savefig(path, dpi=100)


def _lean(axes: Any, drawn: Traces, seen: Overview) -> None:
    time, lean = envelope(drawn.time_s, drawn.lean_deg, POINTS, GAP_S)
    axes.fill_between(time, np.minimum(lean, 0.0), 0.0, color=LEFT_COLOUR, alpha=0.85, linewidth=0.3)
    axes.fill_between(time, np.maximum(lean, 0.0), 0.0, color=RIGHT_COLOUR, alpha=0.85, linewidth=0.3)
    for peak, sign in maxima(seen):
        side = "left" if sign < 0 else "right"
        axes.annotate(
            f"{peak.value:.0f}° {side}",
            (peak.time_s, sign * peak.value),
            xytext=(0, 4 * sign),
            textcoords="offset points",
            ha="center",
            va="top" if sign < 0 else "bottom",
            fontsize=9,
            fontweight="bold",
        )
    limit = lean_limit(seen)
    axes.set(title="Lean, degrees (right up, left down)", ylim=(-limit, limit))
    axes.margins(x=0.0)
    axes.tick_params(labelbottom=False)


def _speed(axes: Any, drawn: Traces, seen: Overview) -> None:
    axes.plot(*envelope(drawn.time_s, drawn.speed_kmh, POINTS, SPEED_GAP_S), color=SPEED_COLOUR, linewidth=1.2)
    axes.set(title="Speed, km/h")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)
    axes.tick_params(labelbottom=False)


def _forces(axes: Any, drawn: Traces, seen: Overview) -> None:
    from matplotlib.ticker import MultipleLocator

    for values, colour, name in (
        (drawn.lateral_g, LATERAL_COLOUR, "to the left"),
        (drawn.forward_g, BRAKE_COLOUR, "forward"),
    ):
        axes.plot(*envelope(drawn.time_s, values, POINTS, GAP_S), color=colour, linewidth=0.7, alpha=0.9, label=name)
    shade = [(stop.start_s, stop.duration_s) for stop in seen.stops]
    axes.broken_barh(shade, (0, 1), transform=axes.get_xaxis_transform(), color="0.88", linewidth=0)
    for line in axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, frameon=False).get_lines():
        line.set_linewidth(2.5)
    axes.set(title="Acceleration, g" + (" (grey: stops)" if seen.stops else ""))
    axes.margins(x=0.0)
    axes.xaxis.set_major_locator(MultipleLocator(tick_s(float(drawn.time_s[-1] - drawn.time_s[0]))))
    axes.xaxis.set_major_formatter(lambda value, _: clock(value))


def _gg(axes: Any, drawn: Traces) -> None:
    from matplotlib.colors import LogNorm

    shown = np.ma.masked_equal(drawn.gg_s, 0.0)
    # left turns are drawn on the left, as the rider sees them
    scale = LogNorm(0.2 * float(shown.min()), float(shown.max()))  # so that the rarest is not white
    axes.pcolormesh(-drawn.gg_edges_g, drawn.gg_edges_g, shown, cmap="YlGnBu", norm=scale, rasterized=True)
    reach = float(drawn.gg_edges_g[-1])
    for radius in np.arange(0.5, reach + 0.01, 0.5):
        angle = np.linspace(0.0, 2.0 * np.pi, 100)
        axes.plot(radius * np.cos(angle), radius * np.sin(angle), color="0.8", linewidth=0.6)
    axes.set(title="g against g", xlabel="left turn  ·  right turn", ylabel="braking  ·  acceleration")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")


def _histogram(axes: Any, seen: Overview) -> None:
    middle, share = histogram(seen)
    colours = np.where(middle < 0.0, LEFT_COLOUR, RIGHT_COLOUR)
    axes.bar(middle, share, width=1.0, color=colours.tolist(), linewidth=0)
    leaning = share[np.abs(middle) > 5.0]
    top = max(1.5 * float(np.max(leaning, initial=0.0)), 1.0)
    if np.max(share) > top:
        upright = f"{np.sum(share[np.abs(middle) <= 5.0]):.0f} % upright"
        axes.text(0.98, 0.99, upright, transform=axes.transAxes, ha="right", va="top", fontsize=8)
        axes.set_ylim(0.0, top)
    for peak, sign in maxima(seen):
        axes.axvline(sign * peak.value, color="0.3", linewidth=0.8, linestyle=":")
        # outwards of its line and below the text in the corner, so that small leans do not stand on one another
        place = (sign * peak.value, 0.82 * axes.get_ylim()[1])
        axes.text(*place, f" {peak.value:.0f}° ", ha="right" if sign < 0 else "left")
    limit = lean_limit(seen)
    axes.set(title="How long at which lean, % of the ride", xlabel="left  ·  degrees  ·  right", xlim=(-limit, limit))
    axes.xaxis.set_major_formatter(lambda value, _: f"{abs(value):.0f}")


def _alignment(axes: Any, seen: Overview) -> None:
    quality = seen.quality
    axes.plot(-quality.lateral_g, quality.forward_g, ".", color=LATERAL_COLOUR, markersize=3, alpha=0.5)
    if quality.yaw_deg is not None and judged(seen):
        reach = np.array([-1.0, 1.0]) * float(np.max(np.abs(quality.forward_g)))
        axes.plot(-np.tan(np.radians(quality.yaw_deg)) * reach, reach, color=BRAKE_COLOUR, linewidth=1.2)
    axes.axvline(0.0, color="0.6", linewidth=0.6)
    axes.text(0.02, 0.98, "\n".join(quality_lines(seen)), transform=axes.transAxes, va="top", fontsize=9)
    reach = max(0.5, 1.1 * float(np.max(np.abs(quality.forward_g), initial=0.0)))
    axes.set(title="Alignment: g on the straights", xlabel="left  ·  g  ·  right", ylabel="braking  ·  acceleration")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
