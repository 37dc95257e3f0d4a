"""How the parts are wired, for the page Install: the drawings that firmware/README.md has too, and each as a table."""

from ..pictures import building, lcd, wiring

_BOARDS = {"pico": wiring.PICO, "esp32": wiring.ESP32}
NARROW = 4  # of the seven poses stand beside each other on a phone
_SHOWN = ("Kickstand", "starting")  # on the drawn display


def wiring_files() -> dict[str, bytes]:
    """{name in the site: SVG}: wiring_pico.svg, wiring_esp32.svg, and what is built."""
    display = lcd.draw([list(line.ljust(16).encode("ascii")) for line in _SHOWN], bytes(64))
    drawn = building.drawings(display, display) | {"six_positions_narrow.svg": building.six_positions(NARROW)}
    return {name: svg.encode() for name, svg in drawn.items()}


def tables() -> dict[str, tuple[str, list[tuple[str, str, str]]]]:
    """{board: (its title, rows of part, its pin and the board's)} of what is drawn."""
    return {
        name: (board.title, [(part, *both) for part, pins in wiring.connections(board) for both in pins.items()])
        for name, board in _BOARDS.items()
    }
