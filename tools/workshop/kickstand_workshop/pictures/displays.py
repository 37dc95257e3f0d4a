"""Draws the displays of a simulated device at chosen moments of the demo's ride, as SVG.

The device runs in a separate process, because the firmware uses the simulated board's clock and files. The process
prints JSON: {name: [codes of both lines, character memory]} for a character display, {name: pixels} for an OLED.
draw_demo() draws the demo's screen in the terminal.
"""

import io
import json
import os
import re
import subprocess
import sys
import tempfile
from itertools import groupby
from typing import Any

from kickstand_sim.demo import screen
from kickstand_sim.demo.demo import DeviceProcess
from kickstand_sim.demo.device import KICKSTAND_PRESS_S, LONG_PRESS_S, PART_SEED, PART_SHARE, SCRIPT, UPRIGHT_PRESS_S
from kickstand_sim.demo.score import State
from kickstand_sim.simulated_board.oled import HEIGHT, WIDTH, Oled
from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.script import Ride
from kickstand_sim.simulation.scripted.sensor_errors import Sensor
from kickstand_tools.common import installation
from kickstand_tools.common.markup import drawing, element
from kickstand_tools.web import site
from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console
from rich.terminal_theme import TerminalTheme

# The demo's bike turns to the right from 32 to 39 s, brakes from 50 to 56 s, and then stands. The presses capture the
# pose on the kickstand and the upright pose, then show the page of maxima and the page of braking
PRESSES_S = (KICKSTAND_PRESS_S, UPRIGHT_PRESS_S, 48.0, 51.0)
LONG_PRESS_AT_S = 58.0
MOMENTS_S = {
    "starting": 0.26,
    "on_stand": 3.0,
    "hold_still": 5.5,
    "upright": 9.0,
    "aligned": 16.0,
    "lean": 36.0,
    "maxima": 50.0,
    "brake": 53.0,
    "menu": 60.0,
}
UNPLUGGED_S = 44.0, 0.3  # start and duration of the fault that causes the page "unsure", an unplugged sensor
OLED_MOMENTS_S = {"lean": 36.0, "unsure": 44.9, "maxima": 50.05, "brake": 53.07, "menu": 60.0}
# The characters of the HD44780's ROM A00 (data sheet ADE-207-272, table 4): {code: eight rows, the left dot in bit 4}
ROM = {int(code): rows for code, rows in json.loads((site.PAGE / "font.json").read_text()).items()}
# Sizes in units of 0.1 mm, as on the usual module of 80 x 36 mm
_DOT_WIDTH, _DOT_HEIGHT = 5, 6
_DOT_STEP_X, _DOT_STEP_Y = 6, 7  # distance between dots
_CELL_WIDTH, _CELL_HEIGHT = 36, 62  # distance between characters
_COLUMNS, _LINES = 16, 2
_MARGIN = 34  # width of the glass around the characters
_FRAME = 22  # width of the black metal around the glass
_TEXT_WIDTH, _TEXT_HEIGHT = _COLUMNS * _CELL_WIDTH, _LINES * _CELL_HEIGHT
_GLASS_WIDTH, _GLASS_HEIGHT = _TEXT_WIDTH + 2 * _MARGIN, _TEXT_HEIGHT + 2 * _MARGIN
_WIDTH, _HEIGHT = _GLASS_WIDTH + 2 * _FRAME, _GLASS_HEIGHT + 2 * _FRAME
# Sizes in pixels of the panel. The usual module is 27 mm wide, and its panel 22 mm.
_OLED_MARGIN, _OLED_FRAME = 4, 6
_OLED_SIZE = (WIDTH + 2 * (_OLED_MARGIN + _OLED_FRAME), HEIGHT + 2 * (_OLED_MARGIN + _OLED_FRAME))


def draw() -> dict[str, str]:
    """Run both devices, which takes some seconds. Return {file name: SVG of a page of a display}."""
    pages = {f"lcd_{name}.svg": draw_lcd(*page) for name, page in _device_pages("lcd").items()}
    return pages | {f"oled_{name}.svg": draw_oled(page) for name, page in _device_pages("ssd1306").items()}


def draw_lcd(codes: list[list[int]], cgram: list[int]) -> str:
    """Return the display as SVG.

    codes: two lists of 16 character codes.
    cgram: the 64 bytes of the eight custom characters.
    """
    lit = [
        _dot(column * _CELL_WIDTH + x * _DOT_STEP_X, line * _CELL_HEIGHT + y * _DOT_STEP_Y)
        for line in range(_LINES)
        for column in range(_COLUMNS)
        for y, row in enumerate(_rows(codes[line][column], cgram))
        for x in range(5)
        if row & 0x10 >> x
    ]
    unlit = [_dot(x * _DOT_STEP_X, y * _DOT_STEP_Y) for y in range(8) for x in range(5)]
    cell = element("path", d="".join(unlit), fill="#0d2f8c", fill_opacity=0.28)
    shade = [element("stop", offset=at, stop_color=colour) for at, colour in enumerate(("#2f6bea", "#1b47b8"))]
    size = {"width": _CELL_WIDTH, "height": _CELL_HEIGHT, "patternUnits": "userSpaceOnUse"}
    dots = [
        element("rect", width=_TEXT_WIDTH, height=_TEXT_HEIGHT, fill="url(#cell)"),
        element("path", d="".join(lit), fill="#f4f8ff"),
    ]
    glass = {"x": _FRAME, "y": _FRAME, "width": _GLASS_WIDTH, "height": _GLASS_HEIGHT, "rx": 8}
    return drawing(
        (_WIDTH, _HEIGHT),
        element("linearGradient", *shade, id="glass", x1=0, y1=0, x2=0, y2=1),
        element("pattern", cell, id="cell", **size),
        element("rect", width=_WIDTH, height=_HEIGHT, rx=18, fill="#16181d"),
        element("rect", **glass, fill="url(#glass)"),
        element("g", *dots, transform=f"translate({_FRAME + _MARGIN} {_FRAME + _MARGIN})"),
    )


def _rows(code: int, cgram: list[int]) -> list[int]:
    return cgram[code % 8 * 8 : code % 8 * 8 + 8] if code < 0x10 else ROM[code]


def _dot(x: int, y: int) -> str:
    return f"M{x} {y}h{_DOT_WIDTH}v{_DOT_HEIGHT}h-{_DOT_WIDTH}z"


def draw_oled(pixels: list[int]) -> str:
    """Return the display as SVG. pixels: 64 rows of 128 pixels. A byte has 8 pixels, the leftmost in bit 7."""
    runs = []
    for y in range(HEIGHT):
        x = 0
        for lit, run in groupby(pixels[(y * WIDTH + i) >> 3] >> (7 - i % 8) & 1 for i in range(WIDTH)):
            length = len(list(run))
            if lit:
                runs.append(f"M{x} {y}h{length}v1h-{length}z")
            x += length
    inner = {"x": _OLED_FRAME, "y": _OLED_FRAME, "width": WIDTH + 2 * _OLED_MARGIN, "height": HEIGHT + 2 * _OLED_MARGIN}
    return drawing(
        _OLED_SIZE,
        element("rect", width=_OLED_SIZE[0], height=_OLED_SIZE[1], rx=4, fill="#123a6b"),
        element("rect", **inner, fill="#05070a"),
        element(
            "path",
            d="".join(runs),
            fill="#eaf5ff",
            transform=f"translate({_OLED_FRAME + _OLED_MARGIN} {_OLED_FRAME + _OLED_MARGIN})",
        ),
    )


def _device_pages(display: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as flash:
        process = subprocess.run(
            [sys.executable, "-m", __name__, display],
            env=os.environ | {"PYTHONPATH": installation.search_path()},
            cwd=flash,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    return json.loads(process.stdout.splitlines()[-1])


def _run(display: str) -> dict[str, Any]:
    """Run the device, and return the content of its display at each moment, as the docstring of this module says."""
    ride = Ride(SCRIPT)
    board = Board(Sensor(seed=PART_SEED, share=PART_SHARE).world(ride.motion), display=display)
    for at_s in PRESSES_S:
        board.press(at_s)
    board.press(LONG_PRESS_AT_S, LONG_PRESS_S)
    if display != "lcd":
        board.faults.unplug_sensor(*UNPLUGGED_S)
    pages = {}

    def look(name: str) -> None:
        lcd = board.lcd
        pages[name] = list(lcd.pixels()) if isinstance(lcd, Oled) else (lcd.codes(), list(lcd.cgram))

    for name, at_s in (MOMENTS_S if display == "lcd" else OLED_MOMENTS_S).items():
        board.at(at_s, lambda name=name: look(name))
    with board:
        board.run_firmware(ride.seconds)
    return pages


MOMENT_S = 36.0  # a time in the right turn of the demo's script
_KEYS = "b button  B long press  p pause  q quit"

_FONT = "DejaVu Sans Mono, Menlo, Consolas, monospace"
_COLOURS = [(24, 26, 31), (224, 82, 78), (90, 180, 110), (242, 201, 76), (31, 79, 200), (200, 120, 220), (90, 200, 230)]
_THEME = TerminalTheme((24, 26, 31), (220, 223, 228), [*_COLOURS, (220, 223, 228)], [*_COLOURS, (255, 255, 255)])
# Rich's SVG format without its comment, and without the fonts that a browser would load from another server
_TERMINAL = re.sub(r"@font-face \{\{.*?\}\}\s*|<!--.*?-->\s*", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL)


def draw_demo() -> str:
    """Run the demo's device, and return its screen in the middle of a turn as SVG."""
    console = Console(
        width=screen.WIDTH, file=io.StringIO(), force_terminal=True, color_system="truecolor", record=True
    )
    console.print(screen.screen(_state(), "Kickstand on a simulated board", _KEYS, paused=False))
    drawn = _TERMINAL.replace("Fira Code, monospace", _FONT)
    return console.export_svg(
        title="python3 tools/dev.py demo", theme=_THEME, code_format=drawn, font_aspect_ratio=0.602
    )


def _state() -> State:
    with DeviceProcess("cpython", "script", 0.0) as device:
        while not device.ended:
            for state in device.ticks(1.0):
                if state["t_s"] >= MOMENT_S:
                    return state
    raise RuntimeError("the demo ended early: " + "\n".join(device.console))


if __name__ == "__main__":
    print("\n" + json.dumps(_run(sys.argv[1])))
