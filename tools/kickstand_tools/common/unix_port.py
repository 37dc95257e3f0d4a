"""Runs the firmware's files on the host with MicroPython's unix port, a package from PyPI."""

import importlib.util
import os
import sys

from . import firmware_path


def available() -> bool:
    """True if the package is installed. PyPI has it for Linux on x86-64 and for macOS on Apple silicon."""
    return importlib.util.find_spec("micropython_unix") is not None


def command(script: str, *arguments: str) -> list[str]:
    """Return the command line that runs a script under MicroPython."""
    # `python -m micropython_unix` does not return the exit status, so its function is called.
    start = "import sys, micropython_unix; sys.exit(micropython_unix.main())"
    return [sys.executable, "-c", start, script, *arguments]


def environment() -> dict[str, str]:
    """Return the environment for command(). It puts firmware and tools on MicroPython's path."""
    return os.environ | {"MICROPYPATH": f"{firmware_path.search_path()}:.frozen"}
