"""Runs a command in a terminal of 80 by 24 characters: sends keys and reads the output."""

import contextlib
import os
import re
import subprocess
import time

SILENT_S = 120.0
DRAWN = 4_000_000  # longest output to wait for, in characters: more than a minute of continuous drawing


class Terminal:
    """A context manager that runs a command, and kills the process at the end."""

    def __init__(self, command: list[str]) -> None:
        import pty  # imported here, because Windows has no pty

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
        """Wait until a matching text appears. Drop the output up to the match's end and return the match.

        The amount of output limits the wait, because times depend on how busy the machine is. A command that draws
        nothing for SILENT_S counts as dead.
        """
        drawn, heard_s = 0, time.monotonic()
        while not (match := re.search(pattern, self._seen)):
            piece = self._read()
            drawn += len(piece)
            heard_s = time.monotonic() if piece else heard_s
            self._seen += piece
            reason = f"{pattern!r} never came: {self._seen[-3000:]}"
            assert drawn < DRAWN and time.monotonic() - heard_s < SILENT_S, reason
            time.sleep(0.05)
        self._seen = ""
        return match

    def end(self) -> int:
        """Return the exit status. Remaining output is read, because the command could not end otherwise."""
        heard_s = time.monotonic()
        while self.process.poll() is None:
            self._read()
            assert time.monotonic() - heard_s < SILENT_S, "it does not end"
            time.sleep(0.05)
        return self.process.returncode

    def _read(self) -> str:
        with contextlib.suppress(OSError):  # OSError: the process never existed, or it has ended
            return os.read(self._master, 1 << 20).decode(errors="replace")
        return ""

    def press(self, keys: str) -> None:
        """Send keys."""
        os.write(self._master, keys.encode())
