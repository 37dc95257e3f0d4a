"""A config.py judged by the firmware's own settings.py before it is copied.

This runs in a process of its own, which poses as the board: settings.py asks sys and machine. The arguments are the
board's sys.platform, its sys.implementation._machine and the file; the last line that it prints is JSON: null, or line
and reason of the fault.
"""

import ast
import json
import os
import subprocess
import sys
import traceback
import types
from pathlib import Path

from .. import firmware_path
from ..errors import InputError
from ..simulated_board.simulator import Board


def refuse_faulty(path: Path, port: str, machine: str) -> None:
    """Raise InputError, with the line, for what a board would not take. port: its sys.platform.  machine: its
    sys.implementation._machine."""
    done = subprocess.run(
        [sys.executable, "-P", "-m", __name__, port, machine, str(path)],
        env=os.environ | {"PYTHONPATH": firmware_path.search_path()},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
    )
    answer = json.loads(done.stdout.splitlines()[-1])  # config.py may print too
    if answer:
        line, reason = answer
        raise InputError(f"{path}{f', line {line}' if line else ''}: {reason}: mend it, then repeat this")


def _fault(path: Path, port: str, machine: str) -> tuple[int | None, str] | None:
    """Line and reason of the first fault, or None. This process cannot be used for anything else afterwards."""
    Board(lambda t_s: (0, 0, 1, 0, 0, 0), port="esp32" if port == "esp32" else "rp2").install()  # for machine
    sys.platform = port
    vars(sys.implementation)["_machine"] = machine
    from kickstand.console import sentence
    from kickstand.errors import SettingsError
    from kickstand.settings import Settings

    module = types.ModuleType("config")
    source = path.read_bytes()
    try:
        exec(compile(source, path, "exec"), vars(module))
    except SyntaxError as error:
        return error.lineno, f"SyntaxError: {error.msg}"
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        return lines[-1] if lines else None, f"{type(error).__name__}: {error}"
    try:
        Settings(module)
    except SettingsError as error:
        return _line_of(error.values[0], source), sentence(error).removeprefix("config.py: ")
    return None


def _line_of(name: str, source: bytes) -> int | None:
    """The last line that assigns to this name."""
    named = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    return max((node.lineno for node in named if node.id == name), default=None)


if __name__ == "__main__":
    print("\n" + json.dumps(_fault(Path(sys.argv[3]), *sys.argv[1:3])))
