"""Compiles rp2040py for the running Python version, which makes it 2.3 times as fast.

The modules in rp2040py's wheel use the limited API, so they work with any Python version, but look up each attribute by
name, which is slow. The wheel also contains the C sources. From these, build() compiles the five modules that use most
of the time, once per Python version and user. install() makes Python import the compiled modules instead of the
wheel's. Emulated cycles and memory stay the same.
"""

import contextlib
import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec
from pathlib import Path

_PACKAGE = "rp2040py.native"
# The module that takes longest to compile is first
_MODULES = ("_rp2040", "_cortex_m0_core", "_bit", "_simulator", "_simulation_clock")
_CHECK = "from kickstand_emulator import native; native.install({!r}); import rp2040py; rp2040py.RP2040()"


def folder() -> Path:
    """Return the folder of the compiled modules for this user, rp2040py and Python. It may not exist yet."""
    version = importlib.metadata.version("rp2040py")
    return Path.home() / ".cache" / "kickstand" / f"rp2040py-{version}-{sysconfig.get_config_var('SOABI')}"


def install(directory: str | Path | None = None) -> None:
    """Make Python import the compiled modules that exist. directory: their folder. None uses folder()."""
    sys.meta_path.insert(0, _Finder(directory))


class _Finder:
    def __init__(self, directory: str | Path | None) -> None:
        self._directory = directory

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        package, _, module = name.rpartition(".")
        if package != _PACKAGE or module not in _MODULES:
            return None
        file = Path(self._directory or folder(), module + EXTENSION_SUFFIXES[0])
        return importlib.util.spec_from_file_location(name, file) if file.is_file() else None


def build() -> bool:
    """Compile the modules unless they are already compiled. This takes 20 s.

    Returns False if the compiler or Python's headers are missing. The wheel's modules are then used.
    """
    if not importlib.util.find_spec("rp2040py"):
        return False
    target, compiler = folder(), shutil.which("cc")
    if target.is_dir():
        return True
    if sys.platform != "linux" or not compiler or not Path(sysconfig.get_path("include"), "Python.h").is_file():
        return False
    # OSError: the disk is full, the home is read-only, or another process was faster
    with contextlib.suppress(OSError):
        target.parent.mkdir(parents=True, exist_ok=True)
        # The folder is renamed at the end, so the context cannot remove it
        with tempfile.TemporaryDirectory(dir=target.parent, ignore_cleanup_errors=True) as scratch:
            if _compile(compiler, Path(scratch)):
                Path(scratch).rename(target)
    return target.is_dir()


def _compile(compiler: str, directory: Path) -> bool:
    spec = importlib.util.find_spec("rp2040py")
    assert spec and spec.origin
    sources = Path(spec.origin).parent / "native"

    def compiled(module: str) -> bool:
        out = directory / (module + EXTENSION_SUFFIXES[0])
        options = ["-O2", "-w", "-shared", "-fPIC", "-I" + sysconfig.get_path("include")]
        return _runs([compiler, *options, str(sources / (module + ".c")), "-o", str(out)])

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return all(pool.map(compiled, _MODULES)) and _runs([sys.executable, "-c", _CHECK.format(str(directory))])


def _runs(command: list[str]) -> bool:
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
