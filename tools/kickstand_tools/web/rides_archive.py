"""What rides_guest.py needs to look at a ride: the tools that `kickstand report` and `plot` consist of, the firmware's
mathematics, Jinja, what reads GPX and FIT files, and numpy."""

import io
import tarfile
from pathlib import Path

import jinja2
import markupsafe

from .. import firmware_path
from ..errors import InputError, extra
from .zipped import tools, zipped

_NUMPY = "lib/python3.12/site-packages/"  # in the package of conda
# A third of numpy, which is for its developers, for other compilers, and for random numbers
_LEFT_OUT = ("/tests/", "/f2py/", "/random/", "/distutils/", "/testing/", "/include/", "/_pyinstaller/")
_LICENCES = "info/licenses/"


def archive() -> bytes:
    """A ZIP file of packages to import: kickstand_tools, kickstand, fitdecode, gpxpy, jinja2 and markupsafe, the latter
    without its compiled module, which it also has in Python. Raises InputError without fitdecode or gpxpy."""
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
