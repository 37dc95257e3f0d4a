"""Draws an OLED of 128x64 pixels as SVG."""

from itertools import groupby

from ..common.svg import drawing, element
from ..simulated_board.oled import HEIGHT, WIDTH

# Sizes in pixels of the panel. The usual module is 27 mm wide, and its panel 22 mm.
_MARGIN, _FRAME = 4, 6
_SIZE = (WIDTH + 2 * (_MARGIN + _FRAME), HEIGHT + 2 * (_MARGIN + _FRAME))


def draw(pixels: bytes) -> str:
    """Return the display as SVG. pixels: 64 rows of 128 pixels. A byte has 8 pixels, the leftmost in bit 7."""
    runs = []
    for y in range(HEIGHT):
        x = 0
        for lit, run in groupby(pixels[(y * WIDTH + i) >> 3] >> (7 - i % 8) & 1 for i in range(WIDTH)):
            length = len(list(run))
            if lit:
                runs.append(f"M{x} {y}h{length}v1h-{length}z")
            x += length
    inner = {"x": _FRAME, "y": _FRAME, "width": WIDTH + 2 * _MARGIN, "height": HEIGHT + 2 * _MARGIN}
    return drawing(
        _SIZE,
        element("rect", width=_SIZE[0], height=_SIZE[1], rx=4, fill="#123a6b"),
        element("rect", **inner, fill="#05070a"),
        element("path", d="".join(runs), fill="#eaf5ff", transform=f"translate({_FRAME + _MARGIN} {_FRAME + _MARGIN})"),
    )
