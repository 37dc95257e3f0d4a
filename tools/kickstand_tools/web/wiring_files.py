"""How the parts are wired, for the page Install: the drawings that the README has too, and each as a table."""

from html import escape

from ..pictures import lcd, wiring

_BOARDS = {"pico": wiring.PICO, "esp32": wiring.ESP32}
_SHOWN = ("Kickstand", "starting")  # on the drawn display


def wiring_files() -> dict[str, bytes]:
    """{name in the site: SVG}, wiring_pico.svg and wiring_esp32.svg."""
    display = lcd.draw([list(line.ljust(16).encode("ascii")) for line in _SHOWN], bytes(64))
    return {f"wiring_{name}.svg": wiring.draw(board, display).encode() for name, board in _BOARDS.items()}


def with_tables(page: str) -> str:
    """The HTML of a page with the tables in the place of their marks, as <!-- table wiring_pico -->."""
    for name, board in _BOARDS.items():
        page = page.replace(f"<!-- table wiring_{name} -->", _table(board))
    return page


def _table(board: wiring.Board) -> str:
    rows = [
        f"<tr><th scope=row>{module}</th><td>{escape(one)}</td><td>{escape(other)}</td></tr>"
        for module, pins in wiring.connections(board)
        for one, other in pins.items()
    ]
    head = f"<tr><th scope=col>Part</th><th scope=col>its pin</th><th scope=col>{board.title}</th></tr>"
    return f"<table><thead>{head}</thead><tbody>{''.join(rows)}</tbody></table>"
