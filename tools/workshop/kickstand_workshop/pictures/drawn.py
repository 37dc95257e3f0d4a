"""Collects all pictures that are drawn as SVG."""

from kickstand_tools.pictures import building, lcd, oled

from . import explained, terminal
from .device_pages import lcd_pages, oled_pages


def drawn() -> dict[str, str]:
    """Return {file name: SVG}. This takes some seconds.

    The pictures show pages of both displays, the wiring of both boards, the parts to build, the demo, and the forces in
    a bend.
    """
    pictures = {f"lcd_{name}.svg": lcd.draw(codes, cgram) for name, (codes, cgram) in lcd_pages().items()}
    pictures |= {f"oled_{name}.svg": oled.draw(pixels) for name, pixels in oled_pages().items()}
    return (
        pictures
        | building.drawings(pictures["oled_lean.svg"], pictures["lcd_lean.svg"])
        | {"demo.svg": terminal.draw(), "forces.svg": explained.forces()}
    )
