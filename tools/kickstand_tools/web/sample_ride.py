"""Makes the sample ride of the page Rides: a simulated one in the form of `pull`."""

import functools
import gzip
import tempfile
from dataclasses import replace
from pathlib import Path

from ..calibration.file import write_calibration
from ..calibration.poses import fit_six_positions, fit_two_positions
from ..simulation.files import simulate, write_poses, write_ride

LOG, CALIBRATION = "simulated-ride.csv.gz", "simulated-ride.cal.json"
PROFILE, SEED, SECONDS = "street", 2, 180.0
_EACH = 2  # readings of the sensor per row of the log, as on a board that records


@functools.cache
def sample_ride() -> dict[str, bytes]:
    """{name: content} of the log, with values of a GPS receiver, and of the calibration from six and two poses."""
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        made = simulate(PROFILE, SEED, folder, SECONDS)
        seven, stand, upright = write_poses(folder, made)
        six = fit_six_positions(seven)
        write_calibration(folder / CALIBRATION, fit_two_positions(stand, upright, six.calibration).calibration)
        n = len(made.time) // _EACH * _EACH
        means = made.readings[:n].reshape(-1, _EACH, 7).mean(axis=1)
        truth = {name: values[:n:_EACH] for name, values in made.truth.items()}
        rate_hz = made.rate_hz / _EACH
        recorded = replace(made, rate_hz=rate_hz, time=made.time[:n:_EACH], readings=means, truth=truth)
        write_ride(folder / "RIDE.csv", recorded, speed=True)
        packed = gzip.compress((folder / "RIDE.csv").read_bytes(), mtime=0)
        return {LOG: packed, CALIBRATION: (folder / CALIBRATION).read_bytes()}
