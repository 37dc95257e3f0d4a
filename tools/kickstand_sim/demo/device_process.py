"""Runs the demo's device (device.py) in a separate process, on MicroPython or CPython."""

import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from kickstand_tools.common import installation

from .score import State


class DeviceProcess:
    """The process that runs the firmware on the simulated board.

    Use it in a `with` statement, and call ticks() until `ended` is true.

    engine: "micropython" or "cpython".
    kind, speed, display: Arguments of device.py.
    user: File that becomes the board's user.py, or None.
    """

    def __init__(self, engine: str, kind: str, speed: float, display: str = "lcd", user: Path | None = None) -> None:
        self._lines: queue.Queue[str | None] = queue.Queue()
        self.ended = False
        self._outcome = ""
        self.console: list[str] = []  # lines of the device's console, without the JSON lines
        self._directory = tempfile.TemporaryDirectory()  # the board's flash
        if user:
            Path(self._directory.name, "user.py").write_bytes(user.read_bytes())
        arguments = [kind, str(speed), display]
        if engine == "micropython":
            script = Path(__file__).resolve().parent / "device.py"
            command, environment = installation.micropython(str(script), *arguments)
            environment["MICROPYPATH"] += ":" + self._directory.name
        else:
            command = [sys.executable, "-m", "kickstand_sim.demo.device", *arguments]
            folders = [installation.search_path(), self._directory.name, os.environ.get("PYTHONPATH")]
            path = os.pathsep.join(filter(None, folders))
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
            start_new_session=True,  # so that Ctrl-C does not reach the device's process
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> "DeviceProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.hang_up()
        try:
            self._process.wait(3.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._directory.cleanup()

    def _read(self) -> None:
        assert self._process.stdout
        with self._process.stdout as output:
            for line in output:
                self._lines.put(line)
        self._lines.put(None)

    def hang_up(self) -> None:
        """Close the device's standard input, which makes it quit."""
        assert self._process.stdin
        with contextlib.suppress(OSError):
            self._process.stdin.close()

    def send(self, command: str) -> None:
        """Send one of the commands of device.py."""
        assert self._process.stdin
        with contextlib.suppress(OSError):
            self._process.stdin.write(command + "\n")
            self._process.stdin.flush()

    @property
    def failed(self) -> bool:
        """True if the device ended too early."""
        return self.ended and self._outcome != "off"

    def ticks(self, wait_s: float) -> list[State]:
        """Return the ticks that have arrived. Wait up to wait_s for the first tick. Set `ended` after the last tick."""
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
