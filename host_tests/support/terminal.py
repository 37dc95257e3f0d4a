"""Runs a command in a terminal of 80 by 24: sends keys and reads what is drawn."""

import contextlib
import os
import subprocess
import time


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

    def wait_for(self, text: str, limit_s: float = 30.0) -> None:
        """Wait until the text appears, and drop the output up to then. Fails after limit_s."""
        began = time.monotonic()
        while text not in self._seen:
            assert time.monotonic() - began < limit_s, f"{text!r} never came: {self._seen[-3000:]}"
            time.sleep(0.05)
            with contextlib.suppress(OSError):  # nothing is there, or it has ended
                self._seen += os.read(self._master, 1 << 20).decode(errors="replace")
        self._seen = ""

    def press(self, keys: str) -> None:
        """Send keys."""
        os.write(self._master, keys.encode())
