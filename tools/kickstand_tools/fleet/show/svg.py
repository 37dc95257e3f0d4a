"""A small panel of a picture in SVG: axes, dots, lines and bars."""

import datetime
import math
from collections.abc import Callable, Sequence
from html import escape

Point = tuple[float, float]


class Panel:
    """x, y, width, height: where it is in the picture. across, along: the values at its left and right edge, and at
    its lower and upper one. words: turns a value of the horizontal axis into text."""

    def __init__(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        across: tuple[float, float],
        along: tuple[float, float],
        title: str,
        unit: str,
        unit_along: str,
        words: Callable[[float], str] | None = None,
    ) -> None:
        self._left, self._top = x + 44.0, y + 22.0
        self._right, self._bottom = x + width - 8.0, y + height - 34.0
        self._across, self._along = across, along
        self._parts: list[str] = []
        self._text(x + 4.0, y + 12.0, title, 'font-weight="600" fill="currentColor"')
        self._text((self._left + self._right) / 2.0, y + height - 4.0, unit, 'text-anchor="middle" fill="#777"')
        self._text(x + 4.0, self._top - 2.0 + 10.0, "", "")
        for value in ticks(*across, 4):
            at = self._x(value)
            self._parts.append(f'<path d="M{at:.1f} {self._top:.1f}V{self._bottom:.1f}" stroke="#8883"/>')
            said = words(value) if words else f"{value:g}"
            self._text(at, self._bottom + 14.0, said, 'text-anchor="middle" fill="#777"')
        for value in ticks(*along, 5):
            at = self._y(value)
            self._parts.append(f'<path d="M{self._left:.1f} {at:.1f}H{self._right:.1f}" stroke="#8883"/>')
            self._text(self._left - 5.0, at + 4.0, f"{value:g}", 'text-anchor="end" fill="#777"')
        middle = (self._top + self._bottom) / 2.0
        turned = f'transform="rotate(-90 {x + 10.0:.1f} {middle:.1f})" text-anchor="middle" fill="#777"'
        self._text(x + 10.0, middle, unit_along, turned)

    def dots(self, points: Sequence[Point], colour: str, radius: float = 2.0) -> None:
        """One for each point."""
        path = "".join(f"M{self._x(x):.1f} {self._y(y):.1f}h0" for x, y in points)
        if path:
            self._parts.append(
                f'<path d="{path}" stroke="{colour}" stroke-opacity="0.55" stroke-width="{2.0 * radius:g}" '
                'stroke-linecap="round"/>'
            )

    def line(self, points: Sequence[Point], colour: str, width: float = 1.5) -> None:
        """From point to point."""
        if len(points) > 1:
            path = "L".join(f"{self._x(x):.1f} {self._y(y):.1f}" for x, y in points)
            self._parts.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="{width:g}"/>')

    def bars(self, edges: Sequence[float], heights: Sequence[float], colour: str) -> None:
        """A bar from edge to edge for each height."""
        for k, height in enumerate(heights):
            left, right, top = self._x(edges[k]) + 0.5, self._x(edges[k + 1]) - 0.5, self._y(height)
            if height > 0.0:
                self._parts.append(
                    f'<rect x="{left:.1f}" y="{top:.1f}" width="{max(0.5, right - left):.1f}" '
                    f'height="{self._bottom - top:.1f}" fill="{colour}"/>'
                )

    def svg(self) -> str:
        return "<g>" + "".join(self._parts) + "</g>"

    def _x(self, value: float) -> float:
        first, last = self._across
        return self._left + (self._right - self._left) * (value - first) / ((last - first) or 1.0)

    def _y(self, value: float) -> float:
        first, last = self._along
        return self._bottom - (self._bottom - self._top) * (value - first) / ((last - first) or 1.0)

    def _text(self, x: float, y: float, text: str, style: str) -> None:
        if text:
            self._parts.append(f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(text)}</text>')


def ticks(first: float, last: float, count: int) -> list[float]:
    """Round values between the two, about so many."""
    rough = (last - first) / count
    if not rough > 0.0:
        return [first]
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * k for k in (1.0, 2.0, 5.0, 10.0) if size * k >= rough)
    begin = math.ceil(first / step - 1e-9)
    return [round(k * step, 10) for k in range(begin, math.floor(last / step + 1e-9) + 1)]


def date_text(utc_s: float) -> str:
    """The day of a time, as 2026-09-30."""
    return datetime.datetime.fromtimestamp(utc_s, datetime.UTC).strftime("%Y-%m-%d")
