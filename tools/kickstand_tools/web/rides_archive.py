"""What rides_guest.py needs to look at a ride: the tools that `kickstand report` and `plot` consist of, the firmware's
mathematics, Jinja, and numpy."""

import io
import tarfile
from pathlib import Path

import jinja2
import markupsafe

from .. import firmware_path
from .zipped import zipped

# The tools' modules and folders that rides_guest.py imports
MODULES = (
    *("__init__.py", "errors.py", "firmware_path.py", "output.py", "refusals.py", "remedies.py", "templates.py"),
    *("analysis", "calibration", "imports", "logs", "replay", "smoothing"),
    *("web/__init__.py", "web/rides_given.py", "web/rides_guest.py"),
)
_NUMPY = "lib/python3.12/site-packages/"  # in the package of conda
# A third of numpy, which is for its developers, for other compilers, and for random numbers
_LEFT_OUT = ("/tests/", "/f2py/", "/random/", "/distutils/", "/testing/", "/include/", "/_pyinstaller/")
_KINDS = (".py", ".js", ".html")
_LICENCES = "info/licenses/"


def archive() -> bytes:
    """A ZIP file of packages to import: kickstand_tools, kickstand, jinja2 and markupsafe, the latter without what is
    compiled: it has all of that in Python, too."""
    tools = firmware_path.TOOLS / "kickstand_tools"
    found = [(path, firmware_path.TOOLS) for name in MODULES for path in _sources(tools / name)]
    packages = [firmware_path.PACKAGE, Path(jinja2.__path__[0]), Path(markupsafe.__path__[0])]
    found += [(path, package.parent) for package in packages for path in _sources(package)]
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
    return sorted(path for path in place.rglob("*") if path.suffix in _KINDS) if place.is_dir() else [place]
