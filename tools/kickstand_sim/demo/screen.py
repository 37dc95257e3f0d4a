"""Draws the demo in a terminal, 78 columns wide: the display, the bike from behind, true and shown lean."""

from collections.abc import Callable
from itertools import groupby, product
from math import cos, radians, sin

from rich import box
from rich.align import Align
from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ..simulated_board.lcd import shown_lean
from .score import State

WIDTH = 78
_BIKE_COLUMNS, _BIKE_ROWS = 38, 11
_LEFT_COLUMNS = 34
_MIDDLE, _GROUND = _BIKE_COLUMNS, 4 * _BIKE_ROWS - 3  # where the tyre touches the ground, in dots of braille
_DOTS_PER_M = 23.0
_LINE_DOTS, _DASH_DOTS = 40, 2  # lengths of the line of the shown lean, and of its dashes and gaps, in dots
_LCD_STYLE, _OLED_STYLE = "bold bright_white on blue", "bright_white on black"
_TRUE, _SHOWN = "cyan", "yellow"
_BRAILLE = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # the bit of each row and column within a cell
_EMPTY = chr(0x2800)  # a cell without dots


def lean_text(lean_deg: float, digits: int = 1) -> str:
    """Return a lean in words, such as "12.3° left"."""
    size = f"{abs(lean_deg):.{digits}f}"
    side = "" if float(size) == 0.0 else "left" if lean_deg < 0.0 else "right"
    return f"{size}° {side}".rstrip()


def lcd_lines(lcd: list[str]) -> list[str]:
    edge = "+" + "-" * 16 + "+"
    return [edge, *(f"|{line:16}|" for line in lcd), edge]


def oled_lines(pixels: str) -> list[str]:
    """Return an OLED's pixels as 16 lines of 64 braille characters. pixels: see score.State."""
    data = bytes.fromhex(pixels)

    def lit(x: int, y: int) -> bool:
        return bool(data[(128 * y + x) >> 3] & 0x80 >> (x & 7))

    return ["".join(_braille(lit, column, row) for column in range(64)) for row in range(16)]


def _braille(lit: Callable[[int, int], bool], column: int, row: int) -> str:
    """Return a cell of 2 x 4 dots as a character. lit: function lit(x, y) that is true for a dot of the picture."""
    return chr(0x2800 + sum(_BRAILLE[y][x] for y in range(4) for x in range(2) if lit(2 * column + x, 4 * row + y)))


def _display(lines: list[str], style: str) -> RenderableType:
    glass = Text("\n".join(lines), style=style, no_wrap=True)
    return Align.center(Panel(glass, box=box.HEAVY, width=len(lines[0]) + 2, padding=0, border_style="grey50"))


def _on_bike(x: float, y: float) -> bool:
    """True if a point is on the bike or the rider, seen from behind.

    x: Distance to the right of the contact point, in m.
    y: Height above the contact point, in m.
    """
    return (
        (abs(x) < 0.08 and 0.0 <= y < 0.62)  # tyre
        or (abs(x) < 0.17 and 0.5 <= y < 0.85)  # tail
        or (abs(x) < 0.42 and 0.92 <= y < 0.98)  # handlebar
        or (abs(x) < 0.24 - 0.1 * (y - 0.85) and 0.85 <= y < 1.28)  # back
        or x * x + (y - 1.45) ** 2 < 0.0225  # helmet
    )


def _bike_dots(lean_deg: float) -> set[tuple[int, int]]:
    c, s = cos(radians(lean_deg)), sin(radians(lean_deg))
    dots = set()
    for column, row in product(range(2 * _BIKE_COLUMNS), range(4 * _BIKE_ROWS)):
        x, y = (column + 0.5 - _MIDDLE) / _DOTS_PER_M, (_GROUND - row) / _DOTS_PER_M
        if _on_bike(x * c - y * s, x * s + y * c):  # turned back by the lean, because _on_bike() has an upright bike
            dots.add((column, row))
    return dots


def _dashes(shown_deg: float | None) -> set[tuple[int, int]]:
    if shown_deg is None:
        return set()
    # A column c is from c to c + 1, as in _bike_dots(), but the row r is at the height r
    return {
        (int(_MIDDLE + r * sin(radians(shown_deg))), round(_GROUND - r * cos(radians(shown_deg))))
        for r in range(_LINE_DOTS)
        if r % (2 * _DASH_DOTS) < _DASH_DOTS
    }


def bike(lean_deg: float, shown_deg: float | None) -> Text:
    """Draw the bike from behind at its true lean, with a dashed line at the shown lean."""
    picture = Text(no_wrap=True)
    dots, line = _bike_dots(lean_deg), _dashes(shown_deg)

    def lit(x: int, y: int) -> bool:
        return y == _GROUND + 1 or (x, y) in dots or (x, y) in line

    for row in range(_BIKE_ROWS):
        cells = []
        for column in range(_BIKE_COLUMNS):
            cell = {(2 * column + x, 4 * row + y) for x in range(2) for y in range(4)}
            style = _TRUE if cell & dots else _SHOWN if cell & line else "grey50"
            cells.append((_braille(lit, column, row).replace(_EMPTY, " "), style))
        for style, run in groupby(cells, key=lambda cell: cell[1]):
            picture.append("".join(character for character, _ in run), style)
        picture.append("\n" if row + 1 < _BIKE_ROWS else "")
    return picture


def _figures(state: State) -> Table:
    lean = shown_lean(state["lcd"])
    table = Table.grid(padding=(0, 1))
    table.add_column(width=12, justify="right", style="grey70")
    table.add_column(width=_LEFT_COLUMNS - 14, no_wrap=True)
    table.add_row("true lean", Text(lean_text(state["lean_deg"]), style=_TRUE))
    table.add_row("shown lean", Text("-" if lean is None else lean_text(lean, digits=0), style=_SHOWN))
    table.add_row("error", "-" if lean is None else f"{lean - state['lean_deg']:+.1f}°")
    table.add_row("speed", f"{3.6 * state['speed_mps']:.0f} km/h")
    table.add_row("bike", state["phase"])
    table.add_row("button", Text("● pressed", style="bold red") if state["pressed"] else "○")
    return table


def screen(state: State, title: str, keys: str, paused: bool) -> RenderableType:
    """Draw the whole picture for one tick of the device, with a title above and an explanation of the keys below."""
    of_s = state["of_s"]
    head = Table.grid(expand=True)
    head.add_column(no_wrap=True)
    head.add_column(justify="right", no_wrap=True)
    clock = f"{state['t_s']:.1f} s" if of_s is None else f"{state['t_s']:.1f} of {of_s:.0f} s"
    head.add_row(Text(title, style="bold"), "paused" if paused else clock)
    body: RenderableType = _beside_the_bike(state)
    if "pixels" in state:  # an OLED leaves no room for the bike
        body = Group(_display(oled_lines(state["pixels"]), _OLED_STYLE), Align.center(_figures(state)))
    frame = Table.grid()
    frame.add_column(width=WIDTH)
    frame.add_row(head)
    frame.add_row(body)
    if of_s is not None:
        frame.add_row(ProgressBar(total=of_s, completed=state["t_s"], width=WIDTH))
    frame.add_row(Text(keys, style="grey70", no_wrap=True))
    return frame


def _beside_the_bike(state: State) -> RenderableType:
    body = Table.grid(padding=0)
    body.add_column(width=_LEFT_COLUMNS)
    body.add_column(width=WIDTH - _LEFT_COLUMNS)
    picture = bike(state["lean_deg"], shown_lean(state["lcd"]))
    body.add_row(
        Group(_display([f" {line:16} " for line in ("", *state["lcd"], "")], _LCD_STYLE), "", _figures(state)),
        Panel(Align.center(picture), title="from behind", box=box.ROUNDED, border_style="grey50"),
    )
    return body
