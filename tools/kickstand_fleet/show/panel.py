"""A small panel of a picture in SVG: axes, dots, lines and bars."""

import datetime
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from kickstand_tools.common.svg import element, path
from markupsafe import Markup

Point = tuple[float, float]
_LETTER = 7.0  # largest width of a digit
_QUIET, _RULE = "#777", "#8883"


@dataclass
class Panel:
    """A panel of a picture.

    x, y, width, height: Position and size of the panel in the picture.
    across: Values at the left and right edge.
    along: Values at the lower and upper edge.
    title: Text above the panel.
    unit: Label of the horizontal axis.
    unit_along: Label of the vertical axis.
    words: Function that formats a value of the horizontal axis.
    """

    x: float
    y: float
    width: float
    height: float
    across: Point
    along: Point
    title: str
    unit: str
    unit_along: str
    words: Callable[[float], str] = "{:g}".format
    _parts: list[Markup] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._left, self._top = self.x + 44.0, self.y + 22.0
        self._right, self._bottom = self.x + self.width - 8.0, self.y + self.height - 34.0

    def dots(self, points: Sequence[Point], colour: str, radius: float = 2.0) -> None:
        """Draw a dot at each point."""
        d = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in self._positions(points))
        if d:
            style = {"stroke_opacity": 0.55, "stroke_width": 2.0 * radius, "stroke_linecap": "round"}
            self._parts.append(element("path", d=d, stroke=colour, **style))

    def line(self, points: Sequence[Point], colour: str, width: float = 1.5) -> None:
        """Draw a line from point to point."""
        if len(points) > 1:
            d = path(self._positions(points))
            self._parts.append(element("path", d=d, fill="none", stroke=colour, stroke_width=width))

    def bars(self, edges: Sequence[float], heights: Sequence[float], colour: str) -> None:
        """Draw a bar from edge to edge for each height."""
        tops = self._positions(list(zip(edges, heights)))
        ends = self._positions([(edge, 0.0) for edge in edges[1:]])
        for (left, top), (right, bottom) in zip(tops, ends):
            if bottom > top:
                size = {"width": max(0.5, right - left - 1.0), "height": bottom - top}
                self._parts.append(element("rect", x=left + 0.5, y=top, **size, fill=colour))

    def svg(self) -> Markup:
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
        """The points in the picture's coordinates."""
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
    """Format the day of a time as 2026-09-30. utc_s: s since 1970."""
    return datetime.datetime.fromtimestamp(utc_s, datetime.UTC).strftime("%Y-%m-%d")
