"""kickstand demo: the firmware on the simulated board, watched in a terminal or printed frame by frame."""

import contextlib
import io
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from rich.console import Console
from rich.live import Live

from .. import firmware_path, unix_port
from ..errors import InputError
from .keyboard import Keyboard
from .score import Score, State
from .screen import lcd_lines, lean_text, screen

SCRIPT_SPEED, HAND_SPEED = 1.5, 1.0  # simulated seconds per second, watched in a terminal
FRAME_S = 0.25  # printed: between two frames of a page that changes all the time
_KEYS = {"b": "short", "B": "long", " ": "long", "p": "pause", "q": "quit"}
_BIKE_KEYS = {"a": "left", "left": "left", "d": "right", "right": "right", "k": "kickstand", "u": "upright"}
_HELP = "b button  B long press  p pause  q quit"
_HAND_HELP = "b button  B long press  a/d lean  k kickstand  u upright  p pause  q quit"


class Device:
    """The firmware in a process of its own. with Device(...) as device: ticks() until ended."""

    def __init__(self, engine: str, kind: str, speed: float) -> None:
        self._lines: queue.Queue[str | None] = queue.Queue()
        self.ended = False
        self._outcome = ""
        self.console: list[str] = []  # what the device said that is no tick
        self._directory = tempfile.TemporaryDirectory()  # the board's flash
        if engine == "micropython":
            script = Path(__file__).resolve().parent / "device.py"
            command, environment = unix_port.command(str(script), kind, str(speed)), unix_port.environment()
        else:
            command = [sys.executable, "-m", "kickstand_tools.demo.device", kind, str(speed)]
            path = os.pathsep.join(filter(None, [firmware_path.search_path(), os.environ.get("PYTHONPATH")]))
            environment = os.environ | {"PYTHONPATH": path}
        self._process = subprocess.Popen(
            command,
            env=environment,
            cwd=self._directory.name,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,  # Ctrl-C is for the one who draws
        )
        threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self) -> "Device":
        return self

    def __exit__(self, *_: object) -> None:
        self.hang_up()
        try:
            self._process.wait(3.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._directory.cleanup()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put(None)

    def hang_up(self) -> None:
        """No more commands, which the device takes for "quit"."""
        assert self._process.stdin
        with contextlib.suppress(OSError):
            self._process.stdin.close()

    def send(self, command: str) -> None:
        """One of demo_device's commands."""
        assert self._process.stdin
        with contextlib.suppress(OSError):
            self._process.stdin.write(command + "\n")
            self._process.stdin.flush()

    @property
    def failed(self) -> bool:
        """It ended, and not because time was up."""
        return self.ended and self._outcome != "off"

    def ticks(self, wait_s: float) -> list[State]:
        """The ticks that have come; waits up to wait_s for one. Sets ended with the last."""
        ticks = []
        with contextlib.suppress(queue.Empty):
            line = self._lines.get(timeout=wait_s)
            while line is not None:
                try:
                    message = json.loads(line)
                except ValueError:
                    self.console.append(line.rstrip())
                else:
                    if "ended" in message:
                        self._outcome = message["ended"]
                    else:
                        ticks.append(message)
                line = self._lines.get_nowait()
            self.ended = True
        return ticks


def _watch(device: Device, engine: str, by_hand: bool, score: Score) -> None:
    """Draw until the device ends or the user quits."""
    keys = _HAND_HELP if by_hand else _HELP
    known = _KEYS | _BIKE_KEYS if by_hand else _KEYS
    state, paused = None, False
    with Keyboard() as keyboard, Live(screen=True, auto_refresh=False) as live:
        while not device.ended:
            for key in keyboard.keys(0.03):
                command = known.get(key)
                if command == "quit":
                    return
                if command:
                    device.send(command)
                paused ^= command == "pause"
            for state in device.ticks(0.03):
                score.add(state)
            if state:
                live.update(screen(state, f"Kickstand on a simulated board, {engine}", keys, paused), refresh=True)


def _print(device: Device, score: Score) -> None:
    """Print each frame of the LCD as it changes."""
    said, said_s = [""], 0.0
    while not device.ended:
        for state in device.ticks(1.0):
            score.add(state)
            live_page = state["lcd"][0][:4] == said[0][:4]
            if state["lcd"] == said or (live_page and state["t_s"] - said_s < FRAME_S):
                continue
            said, said_s = state["lcd"], state["t_s"]
            print(f"{said_s:6.2f} s  {state['phase']}, true lean {lean_text(state['lean_deg'])}")
            print("\n".join(lcd_lines(said)), flush=True)


def demo(hand: bool = False, cpython: bool = False) -> None:
    """Run the demo. hand: the bike is steered with keys. cpython: not on MicroPython.

    Raises InputError where there is no terminal to steer in, SystemExit(1) if the device stopped early.
    """
    watched = sys.stdin.isatty() and sys.stdout.isatty()
    if hand and not watched:
        raise InputError("the bike is steered with keys: run kickstand demo --hand in a terminal")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without block characters
    engine = "CPython" if cpython or not unix_port.available() else "MicroPython"
    if not cpython and engine == "CPython":
        print("No MicroPython package for this system: the same firmware runs on CPython instead.")
    score = Score()
    speed = HAND_SPEED if hand else SCRIPT_SPEED if watched else 0.0
    with Device(engine.lower(), "hand" if hand else "script", speed) as device:
        with contextlib.suppress(KeyboardInterrupt):
            if watched:
                _watch(device, engine, hand, score)
            else:
                _print(device, score)
    Console().print(score.table())
    if device.failed:
        print("\n".join(device.console), file=sys.stderr)
        raise SystemExit(1)
