"""The demo as a terminal shows it, as SVG. Lines, blocks and Braille dots are drawn: not every font has them."""

import io
from itertools import groupby

from kickstand_tools.demo.demo import Device
from kickstand_tools.demo.score import State
from kickstand_tools.demo.screen import WIDTH, screen
from kickstand_tools.svg import drawing, element
from markupsafe import Markup
from rich.console import Console
from rich.segment import Segment
from rich.style import Style
from rich.terminal_theme import TerminalTheme

MOMENT_S = 36.0  # in the right turn of the demo's script
_KEYS = "b button  B long press  p pause  q quit"

_CELL = (10, 21)  # width, height
_MARGIN, _TITLE_HEIGHT = 16, 34
_FONT = "DejaVu Sans Mono, Menlo, Consolas, monospace"
_COLOURS = [(24, 26, 31), (224, 82, 78), (90, 180, 110), (242, 201, 76), (31, 79, 200), (200, 120, 220), (90, 200, 230)]
_THEME = TerminalTheme((24, 26, 31), (220, 223, 228), [*_COLOURS, (220, 223, 228)], [*_COLOURS, (255, 255, 255)])

# How far each box-drawing character goes from the middle of its cell: left, right, up, down; and its strength
_LINES = {
    **{c: (arms, 3) for c, arms in zip("━┃┏┓┗┛╸╺", ("lr", "ud", "rd", "ld", "ru", "lu", "l", "r"))},
    **{c: (arms, 1) for c, arms in zip("─│╭╮╰╯", ("lr", "ud", "rd", "ld", "ru", "lu"))},
}
_ARMS = {"l": (-0.5, 0.0), "r": (0.5, 0.0), "u": (0.0, -0.5), "d": (0.0, 0.5)}  # in cells
# Which part of its cell each block fills: from, to
_BLOCKS = {c: (0.0, 1.0 - k / 8) for k, c in enumerate("█▉▊▋▌▍▎▏")} | {"▐": (0.5, 1.0), "▕": (0.875, 1.0)}
_BRAILLE = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3))  # column and row of each bit


def draw() -> str:
    """The demo's screen in the middle of a turn, from a run of the demo's own device."""
    console = Console(width=WIDTH, file=io.StringIO(), force_terminal=True, color_system="truecolor")
    picture = screen(_state(), "Kickstand on a simulated board", _KEYS, paused=False)
    lines = console.render_lines(picture, console.options, pad=False)
    width = WIDTH * _CELL[0] + 2 * _MARGIN
    height = len(lines) * _CELL[1] + _TITLE_HEIGHT + _MARGIN
    cells = [element for row, line in enumerate(lines) for element in _line(line, row)]
    lights = [
        element("circle", cx=22 + 20 * i, cy=17, r=6, fill=colour)
        for i, colour in enumerate(("#e0524e", "#f2c94c", "#5ab46e"))
    ]
    command = "python3 tools/dev.py demo"
    return drawing(
        (width, height),
        element("rect", width=width, height=height, rx=10, fill="#181a1f"),
        *lights,
        element("text", command, x=width / 2, y=22, text_anchor="middle", fill="#dcdfe4"),
        element("g", *cells, transform=f"translate({_MARGIN} {_TITLE_HEIGHT})"),
        font_family=_FONT,
        font_size=16,
    )


def _state() -> State:
    """The device's tick at MOMENT_S."""
    with Device("cpython", "script", 0.0) as device:
        while not device.ended:
            for state in device.ticks(1.0):
                if state["t_s"] >= MOMENT_S:
                    return state
    raise RuntimeError("the demo ended early: " + "\n".join(device.console))


def _line(segments: list[Segment], row: int) -> list[Markup]:
    """The elements of one line, background first."""
    elements = []
    y = row * _CELL[1]
    column = 0
    for segment in segments:
        style = segment.style or Style()
        if style.bgcolor:
            size = {"width": _CELL[0] * len(segment.text), "height": _CELL[1]}
            colour = style.bgcolor.get_truecolor(_THEME, foreground=False).hex
            place = {"x": column * _CELL[0], "y": y}
            elements.append(element("rect", **place, **size, fill=colour, shape_rendering="crispEdges"))
        colour = style.color.get_truecolor(_THEME).hex if style.color else "#dcdfe4"
        for drawn, group in groupby(segment.text, key=_is_drawn):
            text = "".join(group)
            if drawn:
                elements.extend(_shapes(text, column * _CELL[0], y, colour))
            elif text.strip():
                elements.append(_words(text, column * _CELL[0], y, colour, bool(style.bold)))
            column += len(text)
    return elements


def _is_drawn(character: str) -> bool:
    return character in _LINES or character in _BLOCKS or 0x2800 <= ord(character) < 0x2900


def _words(text: str, x: int, y: int, colour: str, bold: bool) -> Markup:
    """Text with a place for every character, whatever the width of the font."""
    places = " ".join(str(x + i * _CELL[0]) for i in range(len(text)))
    weight = "bold" if bold else None
    return element("text", text, x=places, y=y + 16, font_weight=weight, fill=colour, **{"xml:space": "preserve"})


def _shapes(text: str, x: int, y: int, colour: str) -> list[Markup]:
    """A run of lines, blocks or Braille as one path each."""
    strokes: dict[int, str] = {}
    filled = ""
    for character in text:
        if character in _LINES:
            arms, strength = _LINES[character]
            middle = f"M{x + _CELL[0] / 2:g} {y + _CELL[1] / 2:g}"
            path = "".join(f"{middle}l{_ARMS[a][0] * _CELL[0]:g} {_ARMS[a][1] * _CELL[1]:g}" for a in arms)
            strokes[strength] = strokes.get(strength, "") + path
        elif character in _BLOCKS:
            start, end = (part * _CELL[0] for part in _BLOCKS[character])
            filled += f"M{x + start:g} {y}h{end - start:g}v{_CELL[1]}h{start - end:g}z"
        else:
            for bit, (dx, dy) in enumerate(_BRAILLE):
                if (ord(character) - 0x2800) >> bit & 1:
                    filled += f"M{x + 1 + 5 * dx} {y + 1.2 + 5.25 * dy:g}h3v3h-3z"
        x += _CELL[0]
    lines = [
        element("path", d=path, stroke=colour, stroke_width=strength, stroke_linecap="square")
        for strength, path in strokes.items()
    ]
    return lines + ([element("path", d=filled, fill=colour)] if filled else [])
