"""Runs the firmware's files on the host with MicroPython's unix port, a package from PyPI."""

import importlib.util
import os
import sys

from . import firmware_path


def available() -> bool:
    """True if the package is installed. It has wheels for Linux on x86-64 and macOS on Apple silicon."""
    return importlib.util.find_spec("micropython_unix") is not None


def command(script: str, *arguments: str) -> list[str]:
    """The command line that runs a script under MicroPython."""
    # because `python -m micropython_unix` does not return the exit status
    start = "import sys, micropython_unix; sys.exit(micropython_unix.main())"
    return [sys.executable, "-c", start, script, *arguments]


def environment() -> dict[str, str]:
    """The environment for command(): puts firmware and tools on MicroPython's path."""
    path = f"{firmware_path.search_path()}:.frozen"
    return os.environ | {"MICROPYPATH": path}
