"""Writes a ride as a picture, and as one HTML page with charts that you can zoom, which needs no other file.

If the log has positions, the page has a map beside the charts. If you point at a moment in the map or in a chart, the
page marks it in both.
"""

import re
import textwrap
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..common.installation import extra
from ..common.markup import filled, source_hash
from ..common.messages import InputError
from ..common.output import check_directory, new_directory, whole_file
from ..signals import EARTH_M
from . import charts
from .interactive import MapPoints, charts_figure, map_figure, map_points, map_shape, time_axes
from .overview import Overview

_HERE = Path(__file__).parent
# The scripts of the charts and of the map. They contain no data, so they are the same on every page.
SCRIPTS = tuple((_HERE / name).read_text(encoding="utf-8") for name in ("page.js", "map.js"))
# OpenStreetMap's own server refuses a page that was opened as a file, because it requires the page's address.
TILES_HOST = "https://basemaps.cartocdn.com"
TILES_URL = TILES_HOST + "/rastertiles/voyager/{z}/{x}/{y}.png"
MOST_ZOOM = 19

PICTURE_POINTS = 6000
# Fonts with letters of other scripts, if they are installed
_OTHER_LETTERS = re.compile(
    r"CJK|Noto Sans|Gothic|Hei|Ming|Song|YaHei|Arial Unicode|Malgun|Droid|WenQuanYi|Symbola|IPA"
)
_CHARACTERS, _LINE = 180, 0.16  # length of a line of warnings in characters, and height in inches
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
_SIDES: dict[str, Any] = {  # position of the words beside a point
    "above": {"xytext": (0, 4), "ha": "center", "va": "bottom"},
    "below": {"xytext": (0, -4), "ha": "center", "va": "top"},
    "left": {"xytext": (-3, 0), "ha": "right"},
    "right": {"xytext": (3, 0), "ha": "left"},
}


def check_drawing(directory: Path) -> None:
    """Raise InputError if drawing or writing to the directory is impossible."""
    missing = [name for name in ("matplotlib", "plotly") if not find_spec(name)]
    if missing:
        raise InputError(f"pictures need {' and '.join(missing)}: {extra('rides')}")
    if directory.suffix in (".png", ".html"):
        raise InputError(f"{directory}: a picture and a page are written: give the directory for them")
    check_directory(directory)


def draw_ride(overview: Overview, directory: Path, tiles: bool = False) -> list[Path]:
    """Write both files and return their paths. tiles: see draw_page(). Raises InputError."""
    paths = [directory / f"{overview.ride.stem}.png", directory / f"{overview.ride.stem}.html"]
    with new_directory(directory):
        with whole_file(paths[0]) as path:
            draw_picture(path, overview)
        with whole_file(paths[1]) as path:
            draw_page(path, overview, tiles)
    return paths


def draw_page(path: Path, overview: Overview, tiles: bool = False) -> None:
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
    tiles: see draw_page().
    warnings: show the warnings above the charts.
    """
    ride_charts, points = charts.charts(overview), map_points(overview)
    map_data = None
    if points is not None:
        map_data = {"map": map_figure(points, overview), "axes": time_axes(ride_charts)}
        map_data["shape"] = map_shape(points)
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
        charts=charts_figure(ride_charts, linked=points is not None),
        map=map_data,
        scripts=SCRIPTS,
    )


def tiles_at(points: MapPoints) -> dict[str, Any]:
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


def draw_picture(path: Path, overview: Overview) -> None:
    figure_of(overview).savefig(path, dpi=100)


def figure_of(overview: Overview) -> Any:
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    ride_charts = charts.charts(overview)
    warning_lines = [line for words in ride_charts.warnings for line in textwrap.wrap(words, _CHARACTERS)]
    heights = [chart.height for chart in ride_charts.over_time] + [ride_charts.below[0].height]
    families, title = _fonts(ride_charts.title)
    with rc_context(_STYLE | {"font.family": families}):
        figure = Figure(figsize=(11, sum(heights) + _LINE * len(warning_lines)), layout="constrained")
        FigureCanvasAgg(figure)
        aside: Any = {"x": 0.01, "ha": "left", "parse_math": False}  # a name may contain $
        figure.suptitle(title, fontsize=12, **aside)
        if warning_lines:
            figure.supxlabel("\n".join(warning_lines), fontsize=8, color=charts.BRAKE_COLOUR, **aside)
        rows = figure.add_gridspec(len(heights), len(ride_charts.below), height_ratios=heights)
        first = None
        for k, chart in enumerate(ride_charts.over_time):
            axes = figure.add_subplot(rows[k, :], sharex=first)
            first = first or axes
            draw_chart(axes, chart)
            axes.tick_params(labelbottom=chart is ride_charts.over_time[-1])
        for k, chart in enumerate(ride_charts.below):
            draw_chart(figure.add_subplot(rows[-1, k]), chart)
        figure.canvas.draw()
    return figure


def _fonts(text: str) -> tuple[list[str], str]:
    """Return the font families for a text, and the text in which a code replaces each letter that no font has."""
    from matplotlib import font_manager

    families = ["DejaVu Sans"]
    installed = {font.name: font.fname for font in font_manager.fontManager.ttflist}
    fonts = [font_manager.get_font(installed["DejaVu Sans"])]
    for family in (name for name in sorted(installed) if _OTHER_LETTERS.search(name)):
        if all(any(font.get_char_index(ord(c)) for font in fonts) for c in text):
            break
        font = font_manager.get_font(installed[family])
        if any(font.get_char_index(ord(c)) and not any(f.get_char_index(ord(c)) for f in fonts) for c in text):
            families.append(family)
            fonts.append(font)
    drawable = [any(font.get_char_index(ord(c)) for font in fonts) for c in text]
    return families, "".join(c if has_glyph else ascii(c)[1:-1] for c, has_glyph in zip(text, drawable))


def draw_chart(axes: Any, chart: charts.Chart) -> None:
    axes.set(title=chart.title, xlabel=chart.x_title, ylabel=chart.y_title, xlim=chart.x_range, ylim=chart.y_range)
    if chart.square:
        axes.set_aspect("equal")
    if chart.ticks is not None:
        axes.set_xticks(list(chart.ticks), list(chart.ticks.values()))
    for trace in chart.traces:
        _draw_trace(axes, trace)
    handles, _ = axes.get_legend_handles_labels()
    if len(handles) > 1:
        for line in axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, frameon=False).get_lines():
            line.set_linewidth(2.5)
    for begin, end, words in chart.spans:
        axes.axvspan(begin, end, color="0.88", linewidth=0)
        _words(axes, charts.Note((begin + end) / 2.0, 1.0, words, "below"), xycoords=axes.get_xaxis_transform())
    for note in chart.notes:
        _words(axes, note, fontweight="bold")
    axes.text(0.02, 0.98, chart.left, transform=axes.transAxes, va="top")
    axes.text(0.98, 0.99, chart.right, transform=axes.transAxes, ha="right", va="top", fontsize=8)


def _words(axes: Any, note: charts.Note, **more: Any) -> None:
    axes.annotate(note.text, (note.x, note.y), textcoords="offset points", **_SIDES[note.side], **more)


def _draw_trace(axes: Any, trace: charts.Trace) -> None:
    from matplotlib.colors import LogNorm

    if isinstance(trace, charts.Line):
        style = {"color": trace.colour, "linewidth": 0.9 * trace.width, "linestyle": ":" if trace.dotted else "-"}
        axes.plot(*charts.envelope(trace.x, trace.y, PICTURE_POINTS, trace.gap_s), label=trace.name or None, **style)
    elif isinstance(trace, charts.Sides):
        x, y = charts.envelope(trace.x, trace.y, PICTURE_POINTS, trace.gap_s)
        for clip, colour in ((np.minimum, charts.LEFT_COLOUR), (np.maximum, charts.RIGHT_COLOUR)):
            axes.fill_between(x, clip(y, 0.0), 0.0, color=colour, alpha=0.85, linewidth=0.3)
    elif isinstance(trace, charts.Dots):
        axes.plot(trace.x, trace.y, ".", color=trace.colour, markersize=3, alpha=0.5)
    elif isinstance(trace, charts.Bars):
        colours = np.where(trace.x < 0.0, charts.LEFT_COLOUR, charts.RIGHT_COLOUR).tolist()
        axes.bar(trace.x, trace.y, width=trace.width, color=colours, linewidth=0)
    else:
        seconds = np.ma.masked_equal(trace.values, 0.0)
        scale = LogNorm(0.2 * float(seconds.min()), float(seconds.max()))  # the lowest value must not be white
        axes.pcolormesh(trace.edges, trace.edges, seconds, cmap="YlGnBu", norm=scale, rasterized=True)
