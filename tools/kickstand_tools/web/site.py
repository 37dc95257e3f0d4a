"""Builds the files of the site: our pages, their Python code, the display's characters, and packages from npm."""

import hashlib
import json
import re
from importlib import metadata
from pathlib import Path
from typing import Any

from ..analysis.plot import page
from ..common import installation
from ..common.installation import DISTRIBUTION
from ..common.markup import filled, source_hash
from ..common.output import check_directory, new_directory, whole_file
from . import archives, sample_ride
from .documents import documents

PAGE = Path(__file__).resolve().parent / "page"
# Large files that only visitors with a board or a ride need. The browser fetches them on demand.
LATER = ("esptool/", "firmware.zip", "install.zip", "numpy/", "plotly/", "pyodide/", "rides.zip", "sample/")
_STYLE = "style.css"  # the style sheet is a template too
# The service worker does not store these files. The browser stores the worker itself, and index.html is stored as "./".
_NOT_KEPT = ("service_worker.js", "index.html")
_WHEN_READ = (*LATER, documents.FOLDER)  # the service worker stores these when they are first opened


def python_files() -> dict[str, str]:
    """Return {path for import: source} of the firmware's package and of the tools' modules that the page Try runs."""
    package = installation.PACKAGE
    files = {path.relative_to(package.parent).as_posix(): path for path in sorted(package.rglob("*.py"))}
    return {name: path.read_text(encoding="utf-8") for name, path in (files | archives.tools("web/device.py")).items()}


def site_files() -> dict[str, bytes]:
    """Build the whole site as {path in the site: content}. Raises InputError if a required package cannot be
    downloaded.

    >>> sorted(site_files())[:2]  # doctest: +SKIP
    ['bike.mjs', 'board.mjs']
    """
    files = archives.npm_files()
    files |= {path.relative_to(PAGE).as_posix(): path.read_bytes() for path in sorted(PAGE.rglob("*.*"))}
    files["esptool/licence.txt"] = files.pop("esptool/LICENSE")  # a browser shows a file with the suffix .txt
    values = {"home": home(), "preview": sample_ride.preview()}
    library = files["plotly/plotly.min.js"].decode()
    values["charts"] = " ".join(map(source_hash, (library, *page.SCRIPTS)))  # hashes for the content security policy
    files |= {name: _filled(name, **values) for name in files if name.endswith(".html") or name == _STYLE}
    files |= documents.document_files(values["home"])
    files |= {f"sample/{name}": data for name, data in sample_ride.sample_ride().items()}
    files["python.json"] = json.dumps(python_files()).encode()
    files["install.zip"] = archives.install_archive()
    files["firmware.zip"] = archives.firmware()
    files["rides.zip"] = archives.rides_archive()
    (package,) = (name for name in files if name.startswith("numpy/"))
    files["numpy/numpy.zip"], files["numpy/licence.txt"] = archives.numpy_archive(files.pop(package))
    files["boards.json"] = json.dumps(shop_boards()).encode()
    sizes = {name: len(data) for name, data in files.items() if name.startswith(LATER)}
    files["sizes.json"] = json.dumps(sizes).encode()
    version = hashlib.sha256(b"".join(name.encode() + data for name, data in sorted(files.items()))).hexdigest()[:12]
    stored = sorted(["./", *(name for name in files if name not in _NOT_KEPT and not name.startswith(_WHEN_READ))])
    files["service_worker.js"] = _filled("service_worker.js", files=stored, version=version)
    return files


def home() -> str:
    """Return the project's address, or "" if the package's metadata have no address (see tools/hatch_build.py)."""
    try:
        named = metadata.metadata(DISTRIBUTION).get_all("Project-URL") or []
    except metadata.PackageNotFoundError:
        named = []
    return dict(entry.split(", ", 1) for entry in named).get("Homepage", "")


def shop_boards() -> dict[str, dict[str, str]]:
    """Return {name of a board: {setting: value as a Python literal}} from the table of boards in settings.md.

    >>> shop_boards()["Waveshare RP2040-Zero"]["BUTTON_PIN"]
    '15'
    """
    text = (installation.documents() / "firmware" / "docs" / "settings.md").read_text(encoding="utf-8")
    boards = {}
    for line in re.findall(r"(?m)^\| board \| `SENSOR_SDA`.*\n\|.*\n((?:\|.*\n)+)", text)[0].splitlines():
        name, sensor, display, button, options, _ = (cell.strip() for cell in line.strip("|").split("|"))
        pins = re.findall(r"\d+", re.sub(r"\(.*?\)", "", f"{sensor} {display} {button}"))
        names = "SENSOR_SDA", "SENSOR_SCL", "LCD_SDA", "LCD_SCL", "BUTTON_PIN"
        boards[name] = dict(zip(names, pins, strict=True)) | dict(re.findall(r"`(\w+) = (\w+)`", options))
    return boards


def _filled(name: str, **values: Any) -> bytes:
    return filled(PAGE / name, **values).encode()


def write_site(files: dict[str, bytes], out: Path) -> None:
    """Write the files of site_files() to a directory. Raises InputError if it cannot be written.

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
            with new_directory(path.parent), whole_file(path) as temporary:
                temporary.write_bytes(data)
