"""Draws a 16x2 character display dot by dot as SVG, from the controller's display and character memory."""

from ..common.svg import drawing, element
from .lcd_font import ROM

# Sizes in units of 0.1 mm, as on the usual module of 80 x 36 mm
_DOT = (5, 6)  # width, height
_PITCH = (6, 7)  # distance between dots
_CELL = (36, 62)  # distance between characters
_COLUMNS, _LINES = 16, 2
_MARGIN = 34  # width of the glass around the characters
_FRAME = 22  # width of the black metal around the glass
_GLASS = (_COLUMNS * _CELL[0] + 2 * _MARGIN, _LINES * _CELL[1] + 2 * _MARGIN)
_SIZE = (_GLASS[0] + 2 * _FRAME, _GLASS[1] + 2 * _FRAME)


def draw(codes: list[list[int]], cgram: bytes) -> str:
    """Return the display as SVG.

    codes: two lists of 16 character codes.
    cgram: the 64 bytes of the eight custom characters.
    """
    lit = [
        _dot(column * _CELL[0] + x * _PITCH[0], line * _CELL[1] + y * _PITCH[1])
        for line in range(_LINES)
        for column in range(_COLUMNS)
        for y, row in enumerate(_rows(codes[line][column], cgram))
        for x in range(5)
        if row & 0x10 >> x
    ]
    unlit = [_dot(x * _PITCH[0], y * _PITCH[1]) for y in range(8) for x in range(5)]
    cell = element("path", d="".join(unlit), fill="#0d2f8c", fill_opacity=0.28)
    shade = [element("stop", offset=at, stop_color=colour) for at, colour in enumerate(("#2f6bea", "#1b47b8"))]
    size = {"width": _CELL[0], "height": _CELL[1], "patternUnits": "userSpaceOnUse"}
    dots = [
        element("rect", width=_COLUMNS * _CELL[0], height=_LINES * _CELL[1], fill="url(#cell)"),
        element("path", d="".join(lit), fill="#f4f8ff"),
    ]
    glass = {"x": _FRAME, "y": _FRAME, "width": _GLASS[0], "height": _GLASS[1], "rx": 8}
    return drawing(
        _SIZE,
        element("linearGradient", *shade, id="glass", x1=0, y1=0, x2=0, y2=1),
        element("pattern", cell, id="cell", **size),
        element("rect", width=_SIZE[0], height=_SIZE[1], rx=18, fill="#16181d"),
        element("rect", **glass, fill="url(#glass)"),
        element("g", *dots, transform=f"translate({_FRAME + _MARGIN} {_FRAME + _MARGIN})"),
    )


def _rows(code: int, cgram: bytes) -> bytes:
    return bytes(cgram[code % 8 * 8 : code % 8 * 8 + 8]) if code < 0x10 else ROM[code]


def _dot(x: int, y: int) -> str:
    return f"M{x} {y}h{_DOT[0]}v{_DOT[1]}h-{_DOT[0]}z"
