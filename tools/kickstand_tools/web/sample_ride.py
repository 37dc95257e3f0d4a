"""Simulates the sample ride of the page Rides, writes it in the format of `kickstand pull`, and draws it."""

import functools
import gzip
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from kickstand_sim.simulation.files import positions, simulate, write_poses, write_ride
from kickstand_sim.simulation.ride import SimulatedRide

from ..calibration.file import write_calibration
from ..calibration.poses import fit_six_positions, fit_two_positions
from ..common.markup import drawing, element, path

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
    """Return {name: content} of the log, with a GPS receiver's values, and of its calibration by six positions and two
    poses.
    """
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
    """Draw the lean during the sample ride, and a map of its road coloured by lean, as an SVG element.

    The style sheet sets the colours of its classes left, right and road.
    """
    ride = _ride()
    step = round(_EACH_S * ride.rate_hz)
    lean = ride.truth["lean_deg"][::step]
    lat, lon, _ = (values[::step] for values in positions(ride))
    across = np.linspace(0.0, _WIDE, len(lean))
    middle = _CHART / 2.0
    high = middle - lean * (middle - _EDGE) / np.max(np.abs(lean))
    sides = {"left": np.minimum, "right": np.maximum}
    areas = []
    for side, clipped in sides.items():
        below = clipped(0.0, middle - high)  # > 0 to the right
        corners = [(0.0, middle), *zip(across.tolist(), (middle - below).tolist()), (_WIDE, middle)]
        areas.append(element("path", d=path(corners), class_=side, fill_opacity=0.5))
    largest = [
        element("text", side, x=across[index], y=text_y, text_anchor="middle")
        for side, index, text_y in (("right", int(np.argmax(lean)), 16.0), ("left", int(np.argmin(lean)), _CHART - 4.0))
    ]
    east, north = (lon - lon[0]) * np.cos(np.radians(lat[0])), lat - lat[0]
    scale = min((_WIDE - 2.0 * _EDGE) / np.ptp(east), (_MAP - 2.0 * _EDGE) / np.ptp(north))
    x = _EDGE + (east - np.min(east)) * scale
    y = _CHART + _MAP - _EDGE - (north - np.min(north)) * scale
    road = [element("path", d=path(list(zip(x.tolist(), y.tolist()))), class_="road")]
    for k, degrees in enumerate(lean[1:].tolist()):
        if abs(degrees) > _UPRIGHT_DEG:
            piece = list(zip(x[k : k + 2].tolist(), y[k : k + 2].tolist()))
            road.append(element("path", d=path(piece), class_=f"road {'left' if degrees < 0.0 else 'right'}"))
    zero = element("path", d=path([(0.0, middle), (_WIDE, middle)]), class_="zero")
    words = "The lean over the sample ride, and its road in the colours of the lean"
    return drawing((_WIDE, _CHART + _MAP), zero, *areas, *largest, *road, role="img", aria_label=words)
