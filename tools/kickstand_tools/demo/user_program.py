"""Checks that the user's code for the simulated board is a program, before the demo's ride starts."""

import subprocess
import warnings
from pathlib import Path

from ..common import unix_port
from ..common.errors import InputError

# MicroPython runs this code to check the user's program, because MicroPython accepts less syntax than CPython. The code
# prints nothing if the program is right, otherwise "line:fault"
_COMPILE = """
import io, sys
try:
    compile(open(sys.argv[1]).read(), "user.py", "exec")
except Exception as error:
    said = io.StringIO()
    sys.print_exception(error, said)
    lines = said.getvalue().strip().split("\\n")
    line = lines[-2].split("line ")[-1].split(",")[0] if "user.py" in lines[-2] else ""
    print(line + ":" + (str(error) or type(error).__name__))
"""


def check(program: Path, engine: str) -> None:
    """Raise InputError if a file is not a program for this engine, "CPython" or "MicroPython".

    Raises OSError if the file cannot be read.
    """
    source = program.read_bytes()
    wrong = _by_micropython(program) if engine == "MicroPython" else _by_cpython(source)
    if wrong:
        line, _, problem = wrong.partition(":")
        location = f"{program}, line {line}" if line else f"{program}"
        raise InputError(f"{location}: {problem}: {engine} cannot run this file: correct it, or give your program")


def _by_micropython(program: Path) -> str:
    command = unix_port.command("-c", _COMPILE, str(program.resolve()))
    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=False).stdout.strip()


def _by_cpython(source: bytes) -> str:
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(source, "user.py", "exec", dont_inherit=True)
    except SyntaxError as error:
        return f"{error.lineno or ''}:{error.msg}"
    except ValueError as error:  # compile() raises it for characters that are not allowed in a source file
        return f":{error}"
    return ""
