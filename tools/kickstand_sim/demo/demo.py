"""Runs the firmware on the simulated board, and draws its display in a terminal or prints it frame by frame."""

import contextlib
import io
import subprocess
import sys
import warnings
from pathlib import Path

from kickstand_tools.common import installation
from kickstand_tools.common.messages import InputError
from rich.console import Console
from rich.live import Live

from .device_process import DeviceProcess
from .keyboard import BIKE_KEYS, keyboard
from .score import Score, table
from .screen import lcd_lines, lean_text, oled_lines, screen

SCRIPT_SPEED, HAND_SPEED = 1.5, 1.0  # simulated seconds per second while the display is drawn in a terminal
FRAME_S = 0.25  # least time between two printed frames of the same page
_KEYS = {"b": "short", "B": "long", " ": "long", "p": "pause", "q": "quit"}
_HELP = "b button  B long press  p pause  q quit"
_HAND_HELP = "b button  B long press  a/d lean  k kickstand  u upright  p pause  q quit"


class DeviceStopped(Exception):
    """The device ended too early. The text is the device's console output."""


def _watch(device: DeviceProcess, engine: str, by_hand: bool, score: Score) -> None:
    """Draw until the device ends or the user quits."""
    keys = _HAND_HELP if by_hand else _HELP
    bindings = _KEYS | BIKE_KEYS if by_hand else _KEYS
    state, paused = None, False
    with keyboard() as pressed, Live(screen=True, auto_refresh=False) as live:
        while not device.ended:
            for key in pressed(0.03):
                command = bindings.get(key)
                if command == "quit":
                    return
                if command:
                    device.send(command)
                paused ^= command == "pause"
            for state in device.ticks(0.03):
                score.add(state)
            if state:
                live.update(screen(state, f"Kickstand on a simulated board, {engine}", keys, paused), refresh=True)


def _print(device: DeviceProcess, score: Score, console: bool) -> None:
    """Print each frame of the display when it changes. console: also print the board's console output."""
    printed, said_s = [""], 0.0
    while not device.ended:
        ticks = device.ticks(1.0)
        while console and device.console:
            print(device.console.pop(0), flush=True)
        for state in ticks:
            score.add(state)
            same_page = state["lcd"][0][:4] == printed[0][:4]
            between = state["lcd"][0].startswith("?")  # the new picture of an OLED may be incomplete
            if state["lcd"] == printed or ((same_page or between) and state["t_s"] - said_s < FRAME_S):
                continue
            printed, said_s = state["lcd"], state["t_s"]
            print(f"{said_s:6.2f} s  {state['phase']}, true lean {lean_text(state['lean_deg'])}")
            print("\n".join(oled_lines(state["pixels"]) if "pixels" in state else lcd_lines(printed)), flush=True)


def demo(hand: bool = False, cpython: bool = False, display: str = "lcd", user: Path | None = None) -> None:
    """Run the demo until it ends or the user quits, then print the score.

    Args:
        hand: True if the user steers the bike with keys.
        cpython: True to run on CPython instead of MicroPython.
        display: "lcd", "ssd1306" or "sh1106".
        user: File with the user's code for the board. None for no code. With a file, the board's console is printed
            too.

    Raises:
        InputError: If the user should steer but there is no terminal, and if the user's code is not a program.
        DeviceStopped: If the device ended too early.
    """
    watched = sys.stdin.isatty() and sys.stdout.isatty()
    if hand and not watched:
        raise InputError("you steer the bike with keys: run kickstand demo --hand in a terminal")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # needed by terminals that cannot show block characters
    engine = "CPython" if cpython or not installation.has_micropython() else "MicroPython"
    if not cpython and engine == "CPython":
        print("No MicroPython package for this system: the same firmware runs on CPython instead.")
    if user:
        check_program(user, engine)
    score = Score()
    speed = HAND_SPEED if hand else SCRIPT_SPEED if watched else 0.0
    with DeviceProcess(engine.lower(), "hand" if hand else "script", speed, display, user) as device:
        with contextlib.suppress(KeyboardInterrupt):
            if watched:
                _watch(device, engine, hand, score)
            else:
                _print(device, score, user is not None)
    if user and watched:
        print("\n".join(device.console))
    Console().print(table(score.figures()))
    if device.failed:
        raise DeviceStopped("\n".join(device.console))


# MicroPython runs this code to check the user's program, because MicroPython accepts less syntax than CPython. The code
# prints nothing if the program is right, otherwise "line:fault"
_COMPILE = """
import io, sys
try:
    compile(open(sys.argv[1]).read(), "user.py", "exec")
except Exception as error:
    said = io.StringIO()
    sys.print_exception(error, said)
    lines = said.getvalue().strip().split("\\n")
    line = lines[-2].split("line ")[-1].split(",")[0] if "user.py" in lines[-2] else ""
    print(line + ":" + (str(error) or type(error).__name__))
"""


def check_program(program: Path, engine: str) -> None:
    """Raise InputError if a file is not a program for this engine, "CPython" or "MicroPython".

    Raises OSError if the file cannot be read.
    """
    source = program.read_bytes()
    wrong = _by_micropython(program) if engine == "MicroPython" else _by_cpython(source)
    if wrong:
        line, _, problem = wrong.partition(":")
        location = f"{program}, line {line}" if line else f"{program}"
        raise InputError(f"{location}: {problem}: {engine} cannot run this file: correct it, or give your program")


def _by_micropython(program: Path) -> str:
    command, _ = installation.micropython("-c", _COMPILE, str(program.resolve()))
    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=False).stdout.strip()


def _by_cpython(source: bytes) -> str:
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(source, "user.py", "exec", dont_inherit=True)
    except SyntaxError as error:
        return f"{error.lineno or ''}:{error.msg}"
    except ValueError as error:  # compile() raises it for characters that are not allowed in a source file
        return f":{error}"
    return ""
