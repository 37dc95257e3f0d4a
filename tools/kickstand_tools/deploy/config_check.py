"""Checks a config.py with the firmware's own settings.py before it is copied.

The check runs in a separate process that poses as the board, because settings.py uses sys and machine. The arguments of
the process are the board's sys.platform, its sys.implementation._machine, and the path of the file. The last line of
its output is a JSON list with the results of fault() and unused().
"""

import ast
import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import traceback
import types
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kickstand_sim.simulated_board.simulator import Board

from ..common import installation
from ..common.messages import InputError, Remedy
from . import bytecode
from .config_text import cleaned

if TYPE_CHECKING:
    from kickstand.settings import Settings


# Standard modules that MicroPython has on a Pico and on an ESP32
_MODULES = set(
    "array asyncio binascii builtins cmath collections errno gc hashlib heapq io json math os platform random re "
    "select socket ssl struct sys time zlib __future__".split()
)
CORRECT = Remedy("correct it and run this command again", "correct it, then install again")
LONGEST_S = 60.0  # longest run time of a config.py, on a busy computer


@dataclass(frozen=True)
class Judged:
    """The result of a check of a config.py.

    fault: the reason why a board would refuse the file, with its line, or None.
    unused: settings behind a '#' although their values differ from the defaults, each with its line.
    """

    fault: str | None
    unused: list[str]


def judge(path: Path, port: str, machine: str) -> Judged:
    """Check a config.py for a board. port, machine: the board's sys.platform and sys.implementation._machine."""
    try:
        process = subprocess.run(
            [sys.executable, "-P", "-m", __name__, port, machine, str(path)],
            env=os.environ | {"PYTHONPATH": installation.search_path()},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            check=True,
            timeout=LONGEST_S,
        )
        fault, unused = json.loads(process.stdout.splitlines()[-1])  # config.py may also print
        return in_words(path, fault or _syntax(path), unused)
    except (subprocess.SubprocessError, ValueError, TypeError, IndexError):
        reason = "it ends its own check, or does not come to an end: write only settings in it"
        return in_words(path, (None, reason), [])


def in_words(path: Path, fault: tuple[int | None, str] | None, unused: list[tuple[int, str]]) -> Judged:
    """Convert the results of fault() and unused() to sentences."""
    said = None
    if fault:
        line, reason = fault
        said = f"{path}{f', line {line}' if line else ''}: {reason}"
    return Judged(said, [f"{path}, line {line}: {text}" for line, text in unused])


def fault(path: Path) -> tuple[int | None, str] | None:
    """Find the first fault in a config.py. Returns its line and the reason, or None. Call this within posed()."""
    from kickstand.console import sentence
    from kickstand.errors import SettingsError
    from kickstand.settings import Settings

    module = types.ModuleType("config")
    try:
        source = cleaned(path.read_bytes()).decode()
    except InputError as error:
        return None, str(error).removeprefix("config.py ")
    try:
        if missing := _missing_module(ast.parse(source)):
            return missing
        exec(compile(source, str(path), "exec"), vars(module))
    except SyntaxError as error:
        return error.lineno, f"SyntaxError: {error.msg}"
    except (Exception, SystemExit) as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        return lines[-1] if lines else None, f"{type(error).__name__}: {error}"
    try:
        Settings(module)
    except SettingsError as error:
        return _line_of(error.values[0], source), sentence(error).removeprefix("config.py: ")
    return None


def _missing_module(parsed: ast.Module) -> tuple[int, str] | None:
    """Find an import of a module that CPython has but MicroPython does not. Returns its line and a reason, or None."""
    for node in ast.walk(parsed):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [node.module or ""]
        for name in names:
            top = name.partition(".")[0]
            if top in sys.stdlib_module_names and top not in _MODULES:
                return node.lineno, f"MicroPython has no module {top}"  # pyright: ignore[reportAttributeAccessIssue]
    return None


def _syntax(path: Path) -> tuple[int | None, str] | None:
    """Find syntax that CPython accepts but MicroPython does not. Returns (None, reason), or None without a fault or
    mpy-cross.
    """
    with tempfile.TemporaryDirectory() as directory:
        config = Path(directory) / path.name
        with contextlib.suppress(InputError):
            config.write_bytes(cleaned(path.read_bytes()))
            try:
                bytecode.cross_compiled(config)
            except bytecode.CannotCompile as error:
                reason = str(error)
                if "Error: " in reason:
                    return None, f"MicroPython does not take it: {reason.partition(': ')[2]}"
    return None


def default_settings() -> "Settings":
    """Return the default settings. Pins are None on a board without default pins. Call this within posed()."""
    from kickstand.errors import SettingsError
    from kickstand.settings import Settings

    try:
        return Settings(None)
    except SettingsError as error:
        settings: Any = error.settings
        return settings


def unused(path: Path, port: str) -> list[tuple[int, str]]:
    """Find lines "# NAME = value" whose value is not the default. The '#' was probably left in them by mistake.

    Returns the number and the text of each line. Call this within posed(). port: the board's sys.platform.
    """
    defaults = default_settings()
    names = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        match = re.match(r"#\s*([A-Z_0-9]+) = (.*)", line)
        # Skip a setting whose default depends on the board
        if not match or (port != "rp2" and re.search(r"# \(\d+[;)]", line)):
            continue
        name, value = match[1], match[2].split("#")[0].strip()
        with contextlib.suppress(ValueError, SyntaxError, AttributeError):
            chosen, default = ast.literal_eval(value), getattr(defaults, name)
            # A number in place of the default None is only an example of a pin
            if chosen != default and not (default is None and isinstance(chosen, int)):
                names.append((number, f"{name} = {value}"))
    return names


def _line_of(name: str, source: str) -> int | None:
    """Return the number of the last line that assigns to this name, or None."""
    named = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    return max((node.lineno for node in named if node.id == name), default=None)


@contextlib.contextmanager
def posed(port: str, machine: str) -> Iterator[None]:
    """A context in which this process poses as a board. It cannot pose as another board later, because settings.py is
    imported once.
    """
    platform = sys.platform
    vars(sys.implementation)["_machine"] = machine
    # The simulated board provides the module `machine`
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0), port="esp32" if port == "esp32" else "rp2"):
        sys.platform = port
        try:
            yield
        finally:
            sys.platform = platform


if __name__ == "__main__":
    with posed(sys.argv[1], sys.argv[2]):
        judged = fault(Path(sys.argv[3])), unused(Path(sys.argv[3]), sys.argv[1])
    print("\n" + json.dumps(judged))
