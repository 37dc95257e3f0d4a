"""Builds the files of the site: our pages, their Python code, packages from npm, and the sample ride."""

import functools
import gzip
import hashlib
import json
import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from kickstand_sim.simulation.files import positions, simulate, write_poses, write_ride
from kickstand_sim.simulation.ride import SimulatedRide

from ..analysis import page
from ..calibration.file import write_calibration
from ..calibration.poses import fit_six_positions, fit_two_positions
from ..common import installation
from ..common.installation import DISTRIBUTION
from ..common.markup import drawing, element, filled, path as svg_path, source_hash
from ..common.output import check_directory, new_directory, whole_file
from . import archives, documents

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
    """Build the whole site as {path in the site: content}. Raises InputError if a package cannot be downloaded.

    >>> sorted(site_files())[:2]  # doctest: +SKIP
    ['bike.mjs', 'board.mjs']
    """
    files = archives.npm_files()
    files |= {path.relative_to(PAGE).as_posix(): path.read_bytes() for path in sorted(PAGE.rglob("*.*"))}
    files["esptool/licence.txt"] = files.pop("esptool/LICENSE")  # a browser shows a file with the suffix .txt
    values = {"home": home(), "preview": preview()}
    library = files["plotly/plotly.min.js"].decode()
    values["charts"] = " ".join(map(source_hash, (library, *page.SCRIPTS)))  # hashes for the content security policy
    files |= {name: _filled(name, **values) for name in files if name.endswith(".html") or name == _STYLE}
    files |= documents.document_files(values["home"])
    files |= {f"sample/{name}": data for name, data in sample_ride().items()}
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


# The sample ride of the page Rides is simulated, written in the format of `kickstand pull`, and drawn

LOG, CALIBRATION = "simulated-ride.csv.gz", "simulated-ride.cal.json"
PROFILE, SEED, SECONDS = "street", 2, 180.0
_EACH = 2  # sensor readings per row of the log, as in a recording of a board
_WIDE, _CHART, _MAP = 640.0, 190.0, 150.0  # width of the drawing, and heights of its chart and map
_EDGE, _UPRIGHT_DEG, _EACH_S = 24.0, 3.0, 0.5


@functools.cache
def _ride() -> SimulatedRide:
    with tempfile.TemporaryDirectory() as directory:
        return simulate(PROFILE, SEED, Path(directory), SECONDS)


@functools.cache
def sample_ride() -> dict[str, bytes]:
    """Return {name: content} of the log, with a GPS receiver's values, and of its calibration."""
    ride = _ride()
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        seven, stand, upright = write_poses(folder, ride)
        six = fit_six_positions(seven)
        write_calibration(folder / CALIBRATION, fit_two_positions(stand, upright, six.calibration).calibration)
        n = len(ride.time) // _EACH * _EACH
        means = ride.readings[:n].reshape(-1, _EACH, 7).mean(axis=1)
        truth = {name: values[:n:_EACH] for name, values in ride.truth.items()}
        rate_hz = ride.rate_hz / _EACH
        recorded = replace(ride, rate_hz=rate_hz, time=ride.time[:n:_EACH], readings=means, truth=truth)
        write_ride(folder / "RIDE.csv", recorded, speed=True)
        packed = gzip.compress((folder / "RIDE.csv").read_bytes(), mtime=0)
        return {LOG: packed, CALIBRATION: (folder / CALIBRATION).read_bytes()}


def preview() -> str:
    """Draw the lean during the sample ride, and a map of its road. The style sheet colours left, right and road."""
    ride = _ride()
    step = round(_EACH_S * ride.rate_hz)
    lean = ride.truth["lean_deg"][::step]
    lat, lon, _ = (values[::step] for values in positions(ride))
    words = "The lean over the sample ride, and its road in the colours of the lean"
    parts = [*_chart(lean), *_map(lean, lat, lon)]
    return drawing((_WIDE, _CHART + _MAP), *parts, role="img", aria_label=words)


def _chart(lean: np.ndarray) -> Sequence[str]:
    """Draw the lean over time, with right above the line of zero. lean: in degrees, positive to the right."""
    across = np.linspace(0.0, _WIDE, len(lean))
    middle = _CHART / 2.0
    high = middle - lean * (middle - _EDGE) / np.max(np.abs(lean))
    sides = {"left": np.minimum, "right": np.maximum}
    areas = []
    for side, clipped in sides.items():
        below = clipped(0.0, middle - high)  # > 0 to the right
        corners = [(0.0, middle), *zip(across.tolist(), (middle - below).tolist()), (_WIDE, middle)]
        areas.append(element("path", d=svg_path(corners), class_=side, fill_opacity=0.5))
    largest = [
        element("text", side, x=across[index], y=text_y, text_anchor="middle")
        for side, index, text_y in (("right", int(np.argmax(lean)), 16.0), ("left", int(np.argmin(lean)), _CHART - 4.0))
    ]
    zero = element("path", d=svg_path([(0.0, middle), (_WIDE, middle)]), class_="zero")
    return [zero, *areas, *largest]


def _map(lean: np.ndarray, lat: np.ndarray, lon: np.ndarray) -> Sequence[str]:
    """Draw the road below the chart. Pieces with a lean are drawn again over it, in the colour of its side."""
    # In degrees of latitude; a degree of longitude is shorter
    east, north = (lon - lon[0]) * np.cos(np.radians(lat[0])), lat - lat[0]
    scale = min((_WIDE - 2.0 * _EDGE) / np.ptp(east), (_MAP - 2.0 * _EDGE) / np.ptp(north))
    x = _EDGE + (east - np.min(east)) * scale
    y = _CHART + _MAP - _EDGE - (north - np.min(north)) * scale
    road = [element("path", d=svg_path(list(zip(x.tolist(), y.tolist()))), class_="road")]
    for k, degrees in enumerate(lean[1:].tolist()):
        if abs(degrees) > _UPRIGHT_DEG:
            piece = list(zip(x[k : k + 2].tolist(), y[k : k + 2].tolist()))
            road.append(element("path", d=svg_path(piece), class_=f"road {'left' if degrees < 0.0 else 'right'}"))
    return road
