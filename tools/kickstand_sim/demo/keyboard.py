"""Reads single key presses from the terminal, without waiting for Enter, on Linux, macOS and Windows."""

import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterator

# Each key that steers a bike, with its command of hand_bike.HandBike
BIKE_KEYS = {"a": "left", "left": "left", "d": "right", "right": "right", "k": "kickstand", "u": "upright"}

# Codes of the arrow keys. For each key, the last code is the code on Windows
_LEFT, _RIGHT = ("\x1b[D", "\x1bOD", "\xe0K"), ("\x1b[C", "\x1bOC", "\xe0M")


def split(text: str) -> list[str]:
    """Split typed text into keys. Arrow keys become "left" and "right". Other special keys are dropped."""
    keys = []
    while text:
        size = 3 if text[:2] in ("\x1b[", "\x1bO") else 2 if text[0] in "\xe0\0" else 1
        key, text = text[:size], text[size:]
        if key in _LEFT + _RIGHT:
            keys.append("left" if key in _LEFT else "right")
        elif size == 1:
            keys.append(key)
    return keys


if sys.platform == "win32":
    import msvcrt

    @contextlib.contextmanager
    def keyboard() -> Iterator[Callable[[float], list[str]]]:
        """A context that yields a function keys(wait_s), which waits for wait_s and returns the keys pressed."""

        def keys(wait_s: float) -> list[str]:
            time.sleep(wait_s)
            text = ""
            while msvcrt.kbhit():
                text += msvcrt.getwch()
            return split(text)

        yield keys

else:
    import select
    import termios
    import tty

    @contextlib.contextmanager
    def keyboard() -> Iterator[Callable[[float], list[str]]]:
        """A context that yields a function keys(wait_s), which waits up to wait_s for a key, and returns the keys."""
        terminal = sys.stdin.fileno()

        def keys(wait_s: float) -> list[str]:
            pressed = select.select([terminal], [], [], wait_s)[0]
            return split(os.read(terminal, 1024).decode(errors="replace")) if pressed else []

        attributes = termios.tcgetattr(terminal)
        tty.setcbreak(terminal)
        try:
            yield keys
        finally:
            termios.tcsetattr(terminal, termios.TCSADRAIN, attributes)
