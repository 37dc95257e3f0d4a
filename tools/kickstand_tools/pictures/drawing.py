"""A drawing of boxes, wires and labels as SVG, which can be mirrored left to right."""

from markupsafe import Markup

from ..common.svg import drawing, element, path

RED, BLACK, BLUE, AMBER = "#d1302a", "#2b2b2b", "#2460d8", "#d99000"  # wires for supply, ground, SDA and SCL
_FONT = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"
_MIRRORED = {"start": "end", "end": "start", "middle": "middle"}


class Drawing:
    """A drawing. Sizes are in pixels. x points right, and y points down.

    mirrored: True to count x from the right edge. Text is not mirrored.
    """

    def __init__(self, width: int, height: int, mirrored: bool = False) -> None:
        self._width, self._height, self._mirrored = width, height, mirrored
        self._elements = [element("rect", width=width, height=height, rx=14, fill="#f7f5ef")]

    def _x(self, x: float, width: float = 0) -> float:
        return self._width - x - width if self._mirrored else x

    def box(self, x: float, y: float, width: float, height: float, fill: str, round_by: int = 8) -> None:
        """Draw a filled rectangle."""
        place = {"x": self._x(x, width), "y": y, "width": width, "height": height}
        self._elements.append(element("rect", **place, rx=round_by, fill=fill))

    def disc(self, x: float, y: float, radius: float, fill: str) -> None:
        """Draw a filled circle for a pin, a joint of wires, or the cap of a button."""
        self._elements.append(element("circle", cx=self._x(x), cy=y, r=radius, fill=fill))

    def shape(self, fill: str, *corners: tuple[float, float]) -> None:
        """Draw a filled polygon."""
        self._elements.append(element("path", d=path([(self._x(x), y) for x, y in corners]) + "Z", fill=fill))

    def wire(self, colour: str, *points: tuple[float, float], width: float = 4) -> None:
        """Draw a line through the points."""
        line = path([(self._x(x), y) for x, y in points])
        style = {"stroke_width": width, "stroke_linejoin": "round", "stroke_linecap": "round"}
        self._elements.append(element("path", d=line, fill="none", stroke=colour, **style))

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
        """Write text, vertically centred at y. anchor: the part of the text at x, "start", "middle" or "end"."""
        style = {"font_size": size, "font_weight": "bold" if bold else None}
        style["text_anchor"] = _MIRRORED[anchor] if self._mirrored else anchor
        self._elements.append(element("text", words, x=self._x(x), y=y + 0.35 * size, **style, fill=colour))

    def picture(self, x: float, y: float, width: float, height: float, svg: str) -> None:
        """Add another SVG, scaled to fit into a rectangle."""
        place = f'<svg x="{self._x(x, width)}" y="{y}" width="{width}" height="{height}"'
        self._elements.append(Markup(str(svg).strip().replace("<svg", place, 1)))

    def svg(self) -> str:
        """Return the drawing as SVG."""
        return drawing((self._width, self._height), *self._elements, font_family=_FONT)
