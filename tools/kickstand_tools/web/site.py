"""The files of the site: ours, the Python that the page runs, the display's characters, and what comes from npm."""

import hashlib
import json
from pathlib import Path

from .. import firmware_path
from ..analysis.plot import page, page_with_map
from ..analysis.plot.in_script import source_hash
from ..output import check_directory, new_directory, write_whole
from ..pictures.lcd_font import ROM
from . import install_archive, npm_packages, rides_archive, wiring_files

PAGE = Path(__file__).resolve().parent / "page"
# The tools' modules and folders that device.py imports
MODULES = (
    "__init__.py",
    "demo/__init__.py",
    "demo/hand_bike.py",
    "simulated_board",
    "simulation/__init__.py",
    "simulation/scripted",
    "web/__init__.py",
    "web/device.py",
)
# Large, and only for those who have a board or a ride: fetched when they ask for it
LATER = ("esptool/", "install.zip", "numpy/", "plotly/", "pyodide/", "rides.zip")
_NOT_KEPT = ("service_worker.js", "index.html")  # the browser keeps the first by itself, the second as "./"
_LISTED = "__FILES__", "__VERSION__"  # in service_worker.js


def python_files() -> dict[str, str]:
    """{path as imported: source} of the firmware's package, and of the tools' modules that the page runs."""
    tools = firmware_path.TOOLS / "kickstand_tools"
    found = [(path, firmware_path.PACKAGE.parent) for path in _modules(firmware_path.PACKAGE)]
    found += [(path, firmware_path.TOOLS) for name in MODULES for path in _modules(tools / name)]
    return {path.relative_to(top).as_posix(): path.read_text(encoding="utf-8") for path, top in found}


def _chart_scripts(library: bytes) -> bytes:
    """The scripts of the charts of a ride as the policy of the page that frames them names them, the library first."""
    return " ".join(map(source_hash, (library.decode(), page.SCRIPT, page_with_map.SCRIPT))).encode()


def site_files() -> dict[str, bytes]:
    """{path in the site: content} of the whole site. Raises InputError if what they carry cannot be fetched.

    >>> sorted(site_files())[:2]  # doctest: +SKIP
    ['bike.mjs', 'board.mjs']
    """
    files = npm_packages.find()
    files |= {path.relative_to(PAGE).as_posix(): path.read_bytes() for path in sorted(PAGE.rglob("*.*"))}
    files["esptool/licence.txt"] = files.pop("esptool/LICENSE")  # as a text a browser shows
    files |= wiring_files.wiring_files()
    files["install.html"] = wiring_files.with_tables(files["install.html"].decode()).encode()
    files["rides.html"] = files["rides.html"].replace(b"__CHARTS__", _chart_scripts(files["plotly/plotly.min.js"]))
    files["python.json"] = json.dumps(python_files()).encode()
    files["install.zip"] = install_archive.archive()
    files["rides.zip"] = rides_archive.archive()
    (package,) = (name for name in files if name.startswith("numpy/"))
    files["numpy/numpy.zip"], files["numpy/licence.txt"] = rides_archive.numpy_archive(files.pop(package))
    files["font.json"] = json.dumps({code: list(rows) for code, rows in ROM.items()}).encode()
    version = hashlib.sha256(b"".join(name.encode() + data for name, data in sorted(files.items()))).hexdigest()[:12]
    worker = files["service_worker.js"].decode()
    kept = sorted(["./", *(name for name in files if name not in _NOT_KEPT and not name.startswith(LATER))])
    for mark, text in zip(_LISTED, (json.dumps(kept), version)):
        worker = worker.replace(f'"{mark}"', text if text.startswith("[") else f'"{text}"')
    files["service_worker.js"] = worker.encode()
    return files


def write_site(files: dict[str, bytes], out: Path) -> None:
    """Write site_files() to a directory. Raises InputError if that is not possible.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as made:
    ...     write_site({"index.html": b"a page"}, Path(made) / "site")
    ...     print((Path(made) / "site" / "index.html").read_text())
    a page
    """
    check_directory(out)
    with new_directory(out):
        for name, data in files.items():
            path = out / name
            with new_directory(path.parent):
                write_whole(path, lambda temporary, data=data: _write(temporary, data))


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)


def _modules(place: Path) -> list[Path]:
    """The modules in a folder and below it, or the one module that `place` is."""
    return sorted(place.rglob("*.py")) if place.is_dir() else [place]
