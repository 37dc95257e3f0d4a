"""The charts of a ride as data: traces, units, colours and ranges, which page.py and interactive.py draw."""

from dataclasses import dataclass, field

import numpy as np

from ..common.markup import clock, tick_s
from ..signals import Array, smoothed
from .overview import BIN_DEG, BINS_DEG, Overview, Peak
from .report import angles, judged, peak_words
from .ride import spacing_s

LEFT_COLOUR, RIGHT_COLOUR = "#2563a8", "#c2571a"
BRAKE_COLOUR, LATERAL_COLOUR = "#9b2335", "#3d7f6b"
SPEED_COLOUR = "#5b4b8a"
GUIDE_COLOUR = "#bbbbbb"
DOUBT_COLOUR, DOUBT_WIDTH = "#d99a00", 4.0
SMOOTH_S = 0.3
GG_BIN_G = 0.025
GAP_S = 1.0  # a longer time without a value interrupts a line
SPEED_GAP_S = 5.0  # GAP_S for the speed, which has fewer values
_HIGH, _LOW, _SQUARE = 2.5, 1.5, 3.0  # heights of charts in the picture, in inches
_MARKED = 0.82  # height of the lines that mark the maxima, as a share of the chart; higher lines would cross the text
_UPRIGHT_DEG = 5.0  # largest lean whose bars may be cut off, because they would make all other bars too low


@dataclass
class Line:
    """A line through n points, both coordinates of shape (n)."""

    x: Array
    y: Array  # may be NaN
    colour: str
    name: str = ""  # name of the quantity; "" for an auxiliary line
    gap_s: float = np.inf  # longest gap of NaNs that does not interrupt the line
    dotted: bool = False
    width: float = 1.0  # factor on the usual width


@dataclass
class Sides:
    """A Line of n leans. The area between the line and zero is filled in the colour of the side."""

    x: Array
    y: Array
    gap_s: float


@dataclass
class Dots:
    x: Array
    y: Array
    colour: str
    name: str


@dataclass
class Bars:
    """n bars from zero to y, in the colours of left and right lean, each centred on its x and `width` wide."""

    x: Array
    y: Array
    width: float
    name: str


@dataclass
class CellMap:
    """A map of n x n cells. Cells with larger values are darker."""

    edges: Array  # edges of the cells, the same on both axes, shape (n + 1)
    values: Array  # value of each cell, shape (n, n), one row per step along y; 0 for an empty cell
    name: str


Trace = Line | Sides | Dots | Bars | CellMap


@dataclass
class Note:
    """Words beside a point. side: their position, "above", "below", "left" or "right" of the point."""

    x: float
    y: float
    text: str
    side: str


@dataclass
class Chart:
    """One pair of axes with its traces."""

    title: str
    traces: list[Trace]
    height: float  # height in the picture, in inches
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    x_title: str = ""
    y_title: str = ""
    ticks: dict[float, str] | None = None  # positions and words on the x axis; None for the default
    square: bool = False  # True if a unit has the same length on both axes
    notes: list[Note] = field(default_factory=list)  # words at points
    # parts of the x axis as (from, to, words), drawn in grey behind the traces
    spans: list[tuple[float, float, str]] = field(default_factory=list)
    left: str = ""  # words in the upper left corner
    right: str = ""  # words in the upper right corner


@dataclass
class Charts:
    """The charts of a ride."""

    title: str
    over_time: list[Chart]  # charts over the time in s, one above the other
    below: list[Chart]  # all other charts, side by side
    warnings: list[str]  # one sentence for each warning


def charts(overview: Overview) -> Charts:
    """Make the charts of a ride. A car has no chart of the lean, and a log without a speed no chart of the speed."""
    course, car = overview.course, overview.ride.car
    lateral, forward = (smoothed(values, course.t_s, SMOOTH_S) for values in (course.lateral_g, course.forward_g))
    over_time = [] if car else [_lean(overview)]
    over_time += [_speed(overview)] if overview.has_speed else []
    over_time.append(_forces(overview, lateral, forward))
    below = [_g_against_g(overview, lateral, forward), *([] if car else [_shares(overview)]), _alignment(overview)]
    return Charts(title(overview), over_time, below, [f"Warning: {notice.line()}." for notice in overview.notices])


def shown_lean_deg(overview: Overview) -> Array:
    """Return the lean at each sample of the course, shape (n); NaN where the display shows no lean."""
    return np.where(overview.course.trusted, overview.course.lean_deg, np.nan)


def title(overview: Overview) -> str:
    total = overview.summary
    parts = [overview.ride.stem, clock(total.duration_s)]
    if not overview.ride.car:
        lean_name = "smoothed lean" if overview.ride.smoothed else "lean as displayed"
        left, right = peak_words(total.left_deg, "{:.0f}°")[0], peak_words(total.right_deg, "{:.0f}°")[0]
        parts.append(f"{lean_name} {left} left, {right} right")
    brake, accel = peak_words(total.brake_g, "{:.2f} g")[0], peak_words(total.accel_g, "{:.2f} g")[0]
    parts.append(f"braking {brake}, acceleration {accel}")
    return "  ·  ".join(parts)


def lean_limit(overview: Overview) -> float:
    """Return the end of the lean's axis on each side, in degrees."""
    return max(20.0, 1.2 * max(overview.summary.left_deg.value, overview.summary.right_deg.value))


def envelope(time: Array, values: Array, points: int, gap_s: float = np.inf) -> tuple[Array, Array]:
    """Reduce a long line to the smallest and the largest value of each stretch, which looks the same.

    NaNs are left out. Each gap of over gap_s has one NaN in its middle, which interrupts the line.

    points: approximate limit of the number of samples. A shorter line keeps all samples.
    Returns times and values of the samples that are left, in their order.
    """
    valid = ~np.isnan(values)
    time, values = time[valid], values[valid]
    gaps = np.flatnonzero(np.diff(time) > gap_s)
    middles = (time[gaps] + time[gaps + 1]) / 2.0
    if len(values) > points:
        starts = np.arange(0, len(values), -(-len(values) * 2 // points))
        stretch = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(values)))
        order = np.lexsort((values, stretch))  # each stretch from its smallest to its largest value
        selected = np.unique(order[np.concatenate((starts, np.append(starts[1:], len(values)) - 1))])
        time, values = time[selected], values[selected]
    position = np.searchsorted(time, middles)
    return np.insert(time, position, middles), np.insert(values, position, np.nan)


def _maxima(overview: Overview) -> list[tuple[Peak, float]]:
    """Return the largest lean to each side, and its sign in the chart."""
    peaks = ((overview.summary.left_deg, -1.0), (overview.summary.right_deg, 1.0))
    return [(peak, sign) for peak, sign in peaks if peak.time_s is not None]


def _over_time(
    overview: Overview, words: str, traces: list[Trace], height: float, y_range: tuple[float, float]
) -> Chart:
    begin, end = float(overview.course.t_s[0]), float(overview.course.t_s[-1])
    step = tick_s(end - begin)
    ticks = {tick: clock(tick) for tick in np.arange(step * np.ceil(begin / step), end, step).tolist()}
    return Chart(words, traces, height, (begin, max(end, begin + 1e-3)), y_range, ticks=ticks)


def _lean(overview: Overview) -> Chart:
    limit = lean_limit(overview)
    words = "Lean, degrees (right up, left down)"
    traces: list[Trace] = [Sides(overview.course.t_s, shown_lean_deg(overview), GAP_S)]
    doubtful = overview.course.doubtful >= 0.5
    if np.any(doubtful):
        words = "Lean, degrees (right up; yellow: less exact)"  # a phone has no room for more words
        along = np.where(doubtful, -1.05 * limit, np.nan)
        traces.append(Line(overview.course.t_s, along, DOUBT_COLOUR, gap_s=GAP_S, width=DOUBT_WIDTH))
    chart = _over_time(overview, words, traces, _HIGH, ((-1.1 if np.any(doubtful) else -1.0) * limit, limit))
    for peak, sign in _maxima(overview):
        word, side = ("left", "below") if sign < 0 else ("right", "above")
        chart.notes.append(Note(peak.time_s or 0.0, sign * peak.value, f"{peak.value:.0f}° {word}", side))
    return chart


def _speed(overview: Overview) -> Chart:
    speed = Line(overview.course.t_s, 3.6 * overview.course.speed_mps, SPEED_COLOUR, "speed", SPEED_GAP_S)
    return _over_time(overview, "Speed, km/h", [speed], _LOW, (0.0, 1.05 * float(np.nanmax(speed.y))))


def _forces(overview: Overview, lateral: Array, forward: Array) -> Chart:
    """Return the chart of the accelerations over time, in g, with the stops in grey."""
    words = "Acceleration, g" + (" (grey: stops and their MFDD, m/s²)" if overview.stops else "")
    left_line = Line(overview.course.t_s, lateral, LATERAL_COLOUR, "to the left", GAP_S)
    forward_line = Line(overview.course.t_s, forward, BRAKE_COLOUR, "forward", GAP_S)
    forces = np.concatenate((lateral, forward))
    lowest, highest = float(np.min(forces)), float(np.max(forces))
    margin = max(0.05 * (highest - lowest), 0.01)
    chart = _over_time(overview, words, [left_line, forward_line], _HIGH, (lowest - margin, highest + margin))
    chart.spans = [(stop.start_s, stop.stop_s, f"{stop.mfdd_mps2:.1f}") for stop in overview.stops]
    return chart


def _g_against_g(overview: Overview, lateral: Array, forward: Array) -> Chart:
    """Forward against lateral acceleration, with left bends on the left, as the rider sees them."""
    reach = max(0.5, float(np.percentile(np.abs(np.concatenate((lateral, forward))), 99.99)))
    bins = int(np.ceil(reach / GG_BIN_G)) + 2
    edges = np.arange(-bins, bins + 1, dtype=float) * GG_BIN_G
    moving = overview.course.resting < 0.5
    counts = np.histogram2d(forward[moving], -lateral[moving], bins=(edges, edges))[0]
    cells = CellMap(edges, counts * spacing_s(overview.course), "seconds")
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    rings = [Line(r * np.cos(angle), r * np.sin(angle), GUIDE_COLOUR) for r in np.arange(0.5, edges[-1] + 0.01, 0.5)]
    span = (float(edges[0]), float(edges[-1]))
    chart = Chart("g against g", [cells, *rings], _SQUARE, span, span, square=True)
    chart.x_title, chart.y_title = "left turn  ·  right turn", "braking  ·  acceleration"
    return chart


def _shares(overview: Overview) -> Chart:
    """Histogram of the time at each lean. The bars of small leans are cut off if they are by far the highest."""
    middle, seconds = (BINS_DEG[:-1] + BINS_DEG[1:]) / 2.0, overview.summary.histogram_s
    share = 100.0 * seconds / max(float(np.sum(seconds)), 1e-9)
    leaning = np.abs(middle) > _UPRIGHT_DEG
    most = 1.05 * float(np.max(share))
    top = min(most, max(1.5 * float(np.max(share[leaning], initial=0.0)), 1.0))
    limit = lean_limit(overview)
    bars = Bars(middle, share, BIN_DEG, "share")
    chart = Chart("How long at which lean, %", [bars], _SQUARE, (-limit, limit), (0.0, max(top, 1e-3)))
    chart.right = f"{np.sum(share[~leaning]):.0f} % upright" if top < most else ""
    for peak, sign in _maxima(overview):
        lean_deg = sign * peak.value
        chart.traces.append(
            Line(np.array([lean_deg, lean_deg]), np.array([0.0, _MARKED * top]), "#555555", dotted=True)
        )
        beside = "left" if sign < 0 else "right"  # labels of small leans go to the side, to avoid overlap
        side = "above" if peak.value > 0.3 * limit else beside
        chart.notes.append(Note(lean_deg, _MARKED * top, f"{peak.value:.0f}°", side))
    chart.x_title = "left  ·  degrees  ·  right"
    chart.ticks = {tick: f"{abs(tick):.0f}" for tick in np.arange(-180.0, 181.0, 20.0).tolist() if abs(tick) <= limit}
    return chart


def _alignment(overview: Overview) -> Chart:
    """Forces on the straights, and the line on which they would be with the estimated yaw error."""
    quality, is_judged = overview.quality, judged(overview)
    most = float(np.max(np.abs(quality.forward_g), initial=0.0))
    reach = max(0.5, 1.1 * most)
    traces: list[Trace] = [Line(np.zeros(2), np.array([-reach, reach]), GUIDE_COLOUR)]
    traces.append(Dots(-quality.lateral_g, quality.forward_g, LATERAL_COLOUR, "straights"))
    if quality.yaw_deg is not None and is_judged:
        ends = np.array([-most, most])
        traces.append(Line(-np.tan(np.radians(quality.yaw_deg)) * ends, ends, BRAKE_COLOUR))
    words = ["not judged"]
    if is_judged:
        words = angles(quality) or ["not enough straight riding"]
        words += ["at rest", f"{quality.gravity_g:.3f} g"] if quality.gravity_g is not None else []
    span = (-reach, reach)
    chart = Chart("Alignment: g on the straights", traces, _SQUARE, span, span, square=True, left="\n".join(words))
    chart.x_title, chart.y_title = "left  ·  g  ·  right", "braking  ·  acceleration"
    return chart
