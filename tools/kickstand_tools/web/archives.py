"""Packs the tools for the pages in ZIP files. The same content always gives the same ZIP file.

install_archive() has the files that install_guest.py and cable_guest.py need to talk to a board. rides_archive() has
those that rides_guest.py needs to show a ride.
"""

import io
import tarfile
import zipfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from modulefinder import ModuleFinder
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
import mpremote

from ..common import firmware_path
from ..common.errors import InputError, extra
from ..deploy import bytecode
from ..deploy.firmware_files import firmware_files

_DATE = (1980, 1, 1, 0, 0, 0)
# For Pico; Pico 2; ESP32-C3, C6, H2 and the other processor of a Pico 2; all other ESP32
ARCHITECTURES = ("armv6m", "armv7emsp", "rv32imc", "xtensawin")
# Replaces pyserial and a module for terminals: the names that mpremote needs when it is imported
_STANDS_IN = {
    "serial/__init__.py": b"SerialException = OSError\n",
    "serial/tools/__init__.py": b"",
    "serial/tools/list_ports.py": b"",
    "mpremote/console.py": b"VT_ENABLED = False\n",
}
_MPREMOTE = ("__init__.py", "mp_errno.py", "transport.py", "transport_serial.py")
_NUMPY = "lib/python3.12/site-packages/"  # in the conda package
# A third of numpy: parts for its developers, other compilers and random numbers
_LEFT_OUT = ("/tests/", "/f2py/", "/random/", "/distutils/", "/testing/", "/include/", "/_pyinstaller/")
_LICENCES = "info/licenses/"


class _ToolsFinder(ModuleFinder):
    """Finds only modules of kickstand_tools, because an installed one has other packages beside it."""

    def find_module(self, name: str, path: Any, parent: Any = None) -> Any:
        if path is None and name != "kickstand_tools":
            raise ImportError(name)
        return super().find_module(name, path, parent)


def tools(*modules: str) -> dict[str, Path]:
    """{path below the tools: file} of these modules of kickstand_tools, such as "web/device.py", and of everything that
    they import from it, also within functions, with the templates and scripts beside them."""
    finder = _ToolsFinder([str(firmware_path.TOOLS)])
    for name in modules:
        finder.import_hook("kickstand_tools." + name.removesuffix(".py").replace("/", "."))
    found = {Path(path) for module in finder.modules.values() if (path := vars(module)["__file__"])}
    beside = {file for path in found for file in path.parent.iterdir() if file.suffix in (".html", ".js", ".css")}
    return {path.relative_to(firmware_path.TOOLS).as_posix(): path for path in sorted(found | beside)}


def zipped(contents: Mapping[str, bytes]) -> bytes:
    """A ZIP file of {name: content}."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(contents.items()):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return made.getvalue()


def install_archive() -> bytes:
    """The tools of `kickstand flash`, `record` and `pull`, mpremote, and the firmware, as sources and compiled for
    every machine code of a board: tools/ and firmware/ as in a checkout, mpremote/, serial/, compiled/."""
    files = {f"mpremote/{name}": Path(mpremote.__file__).parent / name for name in _MPREMOTE}
    files |= {f"tools/{name}": path for name, path in tools("web/cable_guest.py", "web/install_guest.py").items()}
    files |= {f"firmware{path}": source for path, source in firmware_files().items()}
    return zipped({name: path.read_bytes() for name, path in files.items()} | _STANDS_IN | _compiled())


def firmware() -> bytes:
    """The firmware as a ZIP file, for riders whose browser cannot connect to a board. They copy it with mpremote."""
    return zipped({f"kickstand-firmware{path}": source.read_bytes() for path, source in firmware_files().items()})


def _compiled() -> dict[str, bytes]:
    """compiled/ARCHITECTURE/... .mpy: complete for the first architecture, only the files with machine code for the
    others. Empty without a compiler: then the sources are copied."""
    sources = sorted(firmware_path.PACKAGE.rglob("*.py"))
    first, *others = ARCHITECTURES
    try:
        with ThreadPoolExecutor() as pool:
            made = dict(zip(sources, pool.map(lambda source: bytecode.cross_compiled(source, first), sources)))
            found = {(first, source): data for source, data in made.items()}
            for source in [source for source, data in made.items() if data[2]]:
                found |= {(other, source): bytecode.cross_compiled(source, other) for other in others}
    except bytecode.CannotCompile:
        return {}
    package = firmware_path.PACKAGE
    return {
        f"compiled/{architecture}/{source.relative_to(package).with_suffix('.mpy').as_posix()}": data
        for (architecture, source), data in found.items()
    }


def rides_archive() -> bytes:
    """The packages for `kickstand report` and `plot`: the tools, the firmware's mathematics, readers of GPX and FIT
    files, Jinja, and markupsafe without its compiled module, which also exists in Python. Raises InputError without
    fitdecode or gpxpy."""
    try:
        import fitdecode
        import gpxpy
    except ImportError as error:
        raise InputError("the page Rides needs fitdecode and gpxpy: " + extra("web")) from error
    found = tools("web/rides_guest.py")
    for package in (firmware_path.PACKAGE, *(Path(one.__path__[0]) for one in (fitdecode, gpxpy, jinja2, markupsafe))):
        found |= {path.relative_to(package.parent).as_posix(): path for path in package.rglob("*.py")}
    return zipped({name: path.read_bytes() for name, path in found.items()})


def numpy_archive(conda: bytes) -> tuple[bytes, bytes]:
    """A ZIP file with an importable numpy, and the text of its licences. conda: the package of emscripten-forge."""
    kept, licences = {}, b""
    with tarfile.open(fileobj=io.BytesIO(conda)) as package:
        for entry in package:
            file = package.extractfile(entry) if entry.isfile() else None
            if file is None:
                continue
            if entry.name.startswith(_LICENCES):
                licences += file.read()
            elif entry.name.startswith(f"{_NUMPY}numpy/") and _wanted(entry.name):
                kept[entry.name.removeprefix(_NUMPY)] = file.read()
    return zipped(kept), licences


def _wanted(name: str) -> bool:
    return name.endswith((".py", ".so")) and not any(part in name for part in _LEFT_OUT)
