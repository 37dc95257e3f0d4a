"""Runs a command in a terminal of 80 by 24 characters, sends keys and reads the output."""

import contextlib
import os
import re
import subprocess
import time

SILENT_S = 120.0
DRAWN = 4_000_000  # characters: more than a minute of continuous drawing


class Terminal:
    """A context; the process is killed at its end."""

    def __init__(self, command: list[str]) -> None:
        import pty  # not on Windows

        self._master, slave = pty.openpty()
        environment = os.environ | {"TERM": "xterm", "COLUMNS": "80", "LINES": "24"}
        self.process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, env=environment)
        os.close(slave)
        os.set_blocking(self._master, False)
        self._seen = ""

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self._master)

    def wait_for(self, pattern: str) -> re.Match:
        """Wait until a text that matches appears; drop the output up to then and return the match.

        The amount of output limits the wait, because the time depends on the computer's load. A command without output
        for SILENT_S is treated as dead.
        """
        drawn, heard_s = 0, time.monotonic()
        while not (found := re.search(pattern, self._seen)):
            piece = self._read()
            drawn += len(piece)
            heard_s = time.monotonic() if piece else heard_s
            self._seen += piece
            why = f"{pattern!r} never came: {self._seen[-3000:]}"
            assert drawn < DRAWN and time.monotonic() - heard_s < SILENT_S, why
            time.sleep(0.05)
        self._seen = ""
        return found

    def end(self) -> int:
        """Wait for the end and return the exit status. Read the remaining output, because a full buffer would block the
        command."""
        heard_s = time.monotonic()
        while self.process.poll() is None:
            self._read()
            assert time.monotonic() - heard_s < SILENT_S, "it does not end"
            time.sleep(0.05)
        return self.process.returncode

    def _read(self) -> str:
        with contextlib.suppress(OSError):  # nothing is there, or it has ended
            return os.read(self._master, 1 << 20).decode(errors="replace")
        return ""

    def press(self, keys: str) -> None:
        """Send keys."""
        os.write(self._master, keys.encode())
