"""A drawing of boxes, wires and labels as SVG, which can be drawn mirrored left to right."""

from html import escape

_FONT = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"
_MIRRORED = {"start": "end", "end": "start", "middle": "middle"}


class Drawing:
    """Width and height in pixels, x to the right, y down. mirrored: x is counted from the right; text stays legible."""

    def __init__(self, width: int, height: int, mirrored: bool = False) -> None:
        self._width, self._height, self._mirrored = width, height, mirrored
        self._elements: list[str] = []

    def _x(self, x: float, width: float = 0) -> float:
        return self._width - x - width if self._mirrored else x

    def box(self, x: float, y: float, width: float, height: float, fill: str, round_by: int = 8) -> None:
        """A filled rectangle."""
        self._elements.append(
            f'<rect x="{self._x(x, width)}" y="{y}" width="{width}" height="{height}" rx="{round_by}" fill="{fill}"/>'
        )

    def disc(self, x: float, y: float, radius: float, fill: str) -> None:
        """A filled circle: a pin, a joint of wires, the cap of a button."""
        self._elements.append(f'<circle cx="{self._x(x)}" cy="{y}" r="{radius}" fill="{fill}"/>')

    def wire(self, colour: str, *points: tuple[float, float]) -> None:
        """A line from point to point."""
        path = "L".join(f"{self._x(x)} {y}" for x, y in points)
        self._elements.append(
            f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="4" stroke-linejoin="round" '
            'stroke-linecap="round"/>'
        )

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: int = 13,
        anchor: str = "start",
        colour: str = "#1d1f24",
        bold: bool = False,
    ) -> None:
        """Words around the height y. anchor: which end of them is at x, "start", "middle" or "end"."""
        anchor = _MIRRORED[anchor] if self._mirrored else anchor
        weight = ' font-weight="bold"' if bold else ""
        self._elements.append(
            f'<text x="{self._x(x)}" y="{y + 0.35 * size:.1f}" font-size="{size}"{weight} text-anchor="{anchor}" '
            f'fill="{colour}">{escape(words)}</text>'
        )

    def picture(self, x: float, y: float, width: float, height: float, svg: str) -> None:
        """Another SVG, fitted into a rectangle."""
        place = f'<svg x="{self._x(x, width)}" y="{y}" width="{width}" height="{height}"'
        self._elements.append(svg.strip().replace("<svg", place, 1))

    def svg(self) -> str:
        """All that was drawn."""
        elements = "\n".join(self._elements)
        size = f'viewBox="0 0 {self._width} {self._height}"'
        return f"""<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{_FONT}">
<rect width="{self._width}" height="{self._height}" rx="14" fill="#f7f5ef"/>
{elements}
</svg>
"""
