"""Single key presses from the terminal, without waiting for Enter: Linux, macOS and Windows."""

import os
import sys
import time
from types import TracebackType

# Key of a bike that is steered by hand, and the command of hand_bike.HandBike
BIKE_KEYS = {"a": "left", "left": "left", "d": "right", "right": "right", "k": "kickstand", "u": "upright"}

_LEFT, _RIGHT = ("\x1b[D", "\x1bOD", "\xe0K"), ("\x1b[C", "\x1bOC", "\xe0M")  # the last of each: on Windows


def split(text: str) -> list[str]:
    """What was typed, key by key: characters, and "left" and "right" for arrows. Other special keys are dropped."""
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

    class Keyboard:
        """with Keyboard() as keyboard: keyboard.keys(wait_s)"""

        def __enter__(self) -> "Keyboard":
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def keys(self, wait_s: float) -> list[str]:
            """Keys pressed so far; waits for wait_s."""
            time.sleep(wait_s)
            text = ""
            while msvcrt.kbhit():
                text += msvcrt.getwch()
            return split(text)

else:
    import select
    import termios
    import tty

    class Keyboard:
        """with Keyboard() as keyboard: keyboard.keys(wait_s)"""

        def __enter__(self) -> "Keyboard":
            self._fd = sys.stdin.fileno()
            self._before = termios.tcgetattr(self._fd)
            tty.setcbreak(self._fd)
            return self

        def __exit__(
            self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
        ) -> None:
            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._before)

        def keys(self, wait_s: float) -> list[str]:
            """Keys pressed so far; waits for one up to wait_s."""
            if not select.select([self._fd], [], [], wait_s)[0]:
                return []
            return split(os.read(self._fd, 1024).decode(errors="replace"))
