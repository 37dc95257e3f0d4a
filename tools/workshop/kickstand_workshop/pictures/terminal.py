"""Draws the demo's terminal screen as SVG."""

import io
import re

from kickstand_sim.demo.demo import DeviceProcess
from kickstand_sim.demo.score import State
from kickstand_sim.demo.screen import WIDTH, screen
from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console
from rich.terminal_theme import TerminalTheme

MOMENT_S = 36.0  # a time in the right turn of the demo's script
_KEYS = "b button  B long press  p pause  q quit"

_FONT = "DejaVu Sans Mono, Menlo, Consolas, monospace"
_COLOURS = [(24, 26, 31), (224, 82, 78), (90, 180, 110), (242, 201, 76), (31, 79, 200), (200, 120, 220), (90, 200, 230)]
_THEME = TerminalTheme((24, 26, 31), (220, 223, 228), [*_COLOURS, (220, 223, 228)], [*_COLOURS, (255, 255, 255)])
# Rich's SVG format without its comment, and without the fonts that a browser would load from another server
_FORMAT = re.sub(r"@font-face \{\{.*?\}\}\s*|<!--.*?-->\s*", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL)


def draw() -> str:
    """Run the demo's device, and return its screen in the middle of a turn as SVG."""
    console = Console(width=WIDTH, file=io.StringIO(), force_terminal=True, color_system="truecolor", record=True)
    console.print(screen(_state(), "Kickstand on a simulated board", _KEYS, paused=False))
    drawn = _FORMAT.replace("Fira Code, monospace", _FONT)
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
