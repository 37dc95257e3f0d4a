"""What rides_guest.py needs to look at a ride: the tools that `kickstand report` and `plot` consist of, the firmware's
mathematics, and numpy."""

import io
import tarfile
from pathlib import Path

from .. import firmware_path
from .zipped import zipped

# The tools' modules and folders that rides_guest.py imports
MODULES = (
    *("__init__.py", "errors.py", "firmware_path.py", "output.py", "refusals.py", "remedies.py"),
    *("analysis", "calibration", "imports", "logs", "estimation", "replay"),
    *("web/__init__.py", "web/rides_given.py", "web/rides_guest.py"),
)
_NUMPY = "lib/python3.12/site-packages/"  # in the package of conda
# A third of numpy, which is for its developers, for other compilers, and for random numbers
_LEFT_OUT = ("/tests/", "/f2py/", "/random/", "/distutils/", "/testing/", "/include/", "/_pyinstaller/")
_LICENCES = "info/licenses/"


def archive() -> bytes:
    """A ZIP file of packages to import: kickstand_tools and kickstand."""
    tools = firmware_path.TOOLS / "kickstand_tools"
    found = [(path, firmware_path.TOOLS) for name in MODULES for path in _sources(tools / name)]
    found += [(path, firmware_path.PACKAGE.parent) for path in _sources(firmware_path.PACKAGE)]
    return zipped({path.relative_to(top).as_posix(): path.read_bytes() for path, top in found})


def numpy_archive(conda: bytes) -> tuple[bytes, bytes]:
    """A ZIP file of numpy to import, and the text of its licences. conda: the package of emscripten-forge."""
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


def _sources(place: Path) -> list[Path]:
    """What is in a folder and below it, or the one file that `place` is."""
    return sorted(path for path in place.rglob("*") if path.suffix in (".py", ".js")) if place.is_dir() else [place]
