"""Draws the picture of one vehicle: how well the aligned axes fit the drive, and the brake tests over time."""

import datetime
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from kickstand_tools.common.markup import drawing, element, path
from markupsafe import Markup

from .files import file_stem
from .period import PeriodResult

Point = tuple[float, float]
_LETTER = 7.0  # largest width of a digit
_QUIET, _RULE = "#777", "#8883"


@dataclass
class Panel:
    """A panel of a picture, with its position and size in the picture."""

    x: float
    y: float
    width: float
    height: float
    across: Point  # values at the left and right edge
    along: Point  # values at the lower and upper edge
    title: str
    unit: str  # label of the horizontal axis
    unit_along: str  # label of the vertical axis
    words: Callable[[float], str] = "{:g}".format  # formats a value of the horizontal axis
    _parts: list[Markup] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._left, self._top = self.x + 44.0, self.y + 22.0
        self._right, self._bottom = self.x + self.width - 8.0, self.y + self.height - 34.0

    def dots(self, points: Sequence[Point], colour: str, radius: float = 2.0) -> None:
        d = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in self._positions(points))
        if d:
            style = {"stroke_opacity": 0.55, "stroke_width": 2.0 * radius, "stroke_linecap": "round"}
            self._parts.append(element("path", d=d, stroke=colour, **style))

    def line(self, points: Sequence[Point], colour: str, width: float = 1.5) -> None:
        if len(points) > 1:
            d = path(self._positions(points))
            self._parts.append(element("path", d=d, fill="none", stroke=colour, stroke_width=width))

    def bars(self, edges: Sequence[float], heights: Sequence[float], colour: str) -> None:
        tops = self._positions(list(zip(edges, heights)))
        ends = self._positions([(edge, 0.0) for edge in edges[1:]])
        for (left, top), (right, bottom) in zip(tops, ends):
            if bottom > top:
                size = {"width": max(0.5, right - left - 1.0), "height": bottom - top}
                self._parts.append(element("rect", x=left + 0.5, y=top, **size, fill=colour))

    def svg(self) -> Markup:
        """Return the panel with its title, its axes and its contents."""
        middle_x, middle_y = (self._left + self._right) / 2.0, (self._top + self._bottom) / 2.0
        at_left, below = self.x + 10.0, self.y + self.height - 4.0
        turned = {"transform": f"rotate(-90 {at_left:.1f} {middle_y:.1f})", "text_anchor": "middle"}
        title = {"font_weight": 600, "fill": "currentColor"}
        axes = [
            element("text", self.title, x=self.x + 4.0, y=self.y + 12.0, **title),
            element("text", self.unit, x=middle_x, y=below, text_anchor="middle", fill=_QUIET),
            element("text", self.unit_along, x=at_left, y=middle_y, **turned, fill=_QUIET),
        ]
        for value in ticks(*self.across, 4):
            ((x, _),) = self._positions([(value, 0.0)])
            axes.append(element("path", d=path([(x, self._top), (x, self._bottom)]), stroke=_RULE))
            words = self.words(value)
            middle = min(x, self.x + self.width - 0.5 * _LETTER * len(words))  # the text must not leave the picture
            axes.append(element("text", words, x=middle, y=self._bottom + 14.0, text_anchor="middle", fill=_QUIET))
        for value in ticks(*self.along, 5):
            ((_, y),) = self._positions([(0.0, value)])
            axes.append(element("path", d=path([(self._left, y), (self._right, y)]), stroke=_RULE))
            axes.append(element("text", f"{value:g}", x=self._left - 5.0, y=y + 4.0, text_anchor="end", fill=_QUIET))
        return element("g", *axes, *self._parts)

    def _positions(self, points: Sequence[Point]) -> list[Point]:
        (x0, x1), (y0, y1) = self.across, self.along
        x_scale = (self._right - self._left) / ((x1 - x0) or 1.0)
        y_scale = (self._bottom - self._top) / ((y1 - y0) or 1.0)
        return [(self._left + x_scale * (x - x0), self._bottom - y_scale * (y - y0)) for x, y in points]


def ticks(first: float, last: float, count: int) -> list[float]:
    """Return about `count` round values between first and last."""
    rough = (last - first) / count
    if not rough > 0.0:
        return [first]
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * k for k in (1.0, 2.0, 5.0, 10.0) if size * k >= rough)
    begin = math.ceil(first / step - 1e-9)
    return [round(k * step, 10) for k in range(begin, math.floor(last / step + 1e-9) + 1)]


def date_text(utc_s: float) -> str:
    return datetime.datetime.fromtimestamp(utc_s, datetime.UTC).strftime("%Y-%m-%d")


_WIDTH, _HEIGHT = 960, 380


def file_name(vehicle: str, mount: str) -> str:
    return file_stem(f"{vehicle} {mount}".strip(), vehicle, mount) + ".svg"


def draw(result: PeriodResult) -> str:
    """Return the picture of a period as SVG: forces against the motion of the vehicle, and the brake tests."""
    row = result.alignment
    name = row["vehicle"] + (f", mount {row['mount']}" if row["mount"] else "")
    subtitle = row["message"] or (
        f"forward known to {row['quality_deg']:.1f}°, the whole alignment to {row['attitude_deg']:.1f}°, "
        f"{row['events_used']} events, {row['stops']} stops, speed {row['speed_lag_s']:.1f} s late"
    )
    points = result.picture  # see PeriodResult
    parts = [
        element("rect", width=_WIDTH, height=_HEIGHT, fill="#fff"),
        element("text", name, x=20, y=26, font_size=16, font_weight=600),
        element("text", subtitle, x=20, y=45, fill="#555"),
        _agreement("forward: measured against dv/dt", "dv/dt, g", [(dv, forward) for dv, forward, _, _ in points], 20),
    ]
    if row["kind"] == "motorcycle":  # a motorcycle leans into bends, so its force to the left is about zero
        side = [(dv, left) for dv, _, _, left in points]
        parts.append(_agreement("left: measured against dv/dt, should be flat", "dv/dt, g", side, 335, flat=True))
    else:
        side = [(centripetal, left) for _, _, centripetal, left in points]
        parts.append(_agreement("left: measured against v times yaw rate", "v times yaw rate, g", side, 335))
    parts.append(_braking(result, 650))
    return drawing((_WIDTH, _HEIGHT), *parts, width=_WIDTH, font_family="system-ui, sans-serif", font_size=12)


def _agreement(title: str, unit: str, points: Sequence[tuple[float, float]], x: float, flat: bool = False) -> Markup:
    reach = max([0.2, *(abs(value) for point in points for value in point)]) * 1.05
    panel = Panel(x, 60, 290, 300, (-reach, reach), (-reach, reach), title, unit, "measured, g")
    panel.line([(-reach, 0.0 if flat else -reach), (reach, 0.0 if flat else reach)], "#bbb")
    panel.dots(points, "#2563eb")
    return panel.svg()


def _braking(result: PeriodResult, x: float) -> Markup:
    """Return the panel with the decelerations of the brake tests, over time if all times are known."""
    tests = result.brake_tests
    dated = bool(tests) and all(test["utc_s"] is not None for test in tests)
    times = [test["utc_s"] if dated else float(k + 1) for k, test in enumerate(tests)]
    hardest = max([3.0, *(test["mfdd_mps2"] for test in tests)]) * 1.1
    first, last = (min(times), max(times)) if times else (0.0, 1.0)
    margin = 0.05 * max(last - first, 3600.0 if dated else 1.0)
    span = (first - margin, last + margin)
    title, unit = f"{len(tests)} brake tests", "day" if dated else "test"
    panel = Panel(x, 60, 290, 300, span, (0.0, hardest), title, unit, "MFDD, m/s²")
    panel.words = date_text if dated else panel.words
    panel.dots(list(zip(times, (test["mfdd_mps2"] for test in tests))), "#c2410c", 3.0)
    return panel.svg()
