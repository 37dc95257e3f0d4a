"""Runs a script on MicroPython's unix port. Firmware, tools and tests are on its import path."""

import subprocess
import tempfile
from pathlib import Path

import pytest
from kickstand_tools.common import installation

HOST_TESTS = Path(__file__).resolve().parents[1]
# Large enough for the models of a board. A larger heap would make each garbage collection slower.
BOARD_HEAP = "4M"
_TESTS = """
import sys
sys.path.insert(0, sys.argv[1])
module = __import__(sys.argv[2])
for name in sorted(dir(module)):
    if name.startswith("test_"):
        print(name)
        getattr(module, name)()
"""


def run_tests(module: Path, heap: str = "64M") -> None:
    """Run all tests of a module that needs only MicroPython, in one process."""
    assert "test_" in run_mpy(_TESTS, str(module.parent), module.stem, heap=heap)


def run_mpy(
    script: str | Path,
    *args: str,
    heap: str = "64M",
    stdin: str = "",
    directory: Path | None = None,
) -> str:
    """Run a script and return its standard output. Skip the test without MicroPython.

    script: the code as text, or the Path of a file.
    directory: the working directory. None: an empty one.

    Raises AssertionError if the script fails.
    """
    if not installation.has_micropython():
        pytest.skip("no MicroPython unix port for this system")
    with tempfile.TemporaryDirectory() as scratch:
        if isinstance(script, str):
            file = Path(scratch) / "script.py"
            file.write_text(script, encoding="utf-8")
        else:
            file = script.resolve()
        command, environment = installation.micropython("-X", f"heapsize={heap}", str(file), *args)
        # Python searches the directory for modules, as a board searches its flash.
        environment["MICROPYPATH"] = f"{HOST_TESTS}:{environment['MICROPYPATH']}:{directory or ''}"
        process = subprocess.run(
            command,
            env=environment,
            cwd=directory or scratch,
            input=stdin,
            capture_output=True,
            text=True,
            timeout=300,
        )
    output = process.stdout + process.stderr
    # The package's main() does not return every exit status. Scripts that take data print JSON at their end. Before
    # that, a board's console may print tracebacks.
    came_to_its_end = process.returncode == 0 and (bool(stdin) or "Traceback (most recent" not in output)
    assert came_to_its_end, f"MicroPython says:\n{output}"
    return process.stdout
