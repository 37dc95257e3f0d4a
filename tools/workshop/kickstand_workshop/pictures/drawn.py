"""All drawn pictures by file name."""

from kickstand_tools.pictures import building, lcd, oled, wiring

from . import terminal
from .device_pages import lcd_pages, oled_pages


def drawn() -> dict[str, str]:
    """{file name: SVG}: pages of both displays, wiring of both boards, what is built, the demo. Takes some seconds."""
    pictures = {f"lcd_{name}.svg": lcd.draw(codes, cgram) for name, (codes, cgram) in lcd_pages().items()}
    pictures |= {f"oled_{name}.svg": oled.draw(pixels) for name, pixels in oled_pages().items()}
    return {
        **pictures,
        "wiring_pico.svg": wiring.draw(wiring.PICO, pictures["oled_lean.svg"]),
        "wiring_esp32.svg": wiring.draw(wiring.ESP32, pictures["oled_lean.svg"]),
        "display_5v.svg": building.shifter(wiring.PICO, pictures["lcd_lean.svg"]),
        "supply.svg": building.supply(),
        "six_positions.svg": building.six_positions(),
        "on_the_bike.svg": building.on_the_bike(),
        "demo.svg": terminal.draw(),
    }
