"""Today's code reads the files that earlier releases wrote: logs, calibrations and exports."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.calibration.file import read_calibration

RECORDINGS = Path(__file__).parent.parent / "recordings"
RELEASES = ["0.1.0", "0.2.0", "0.4.0"]


@pytest.fixture(params=RELEASES)
def release(request):
    return RECORDINGS / f"release_{request.param}"


def test_a_log_of_an_earlier_release_is_read(release):
    with gzip.open(release / "RIDE.csv.gz", "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    log = api.read_log(release / "RIDE.csv.gz")
    assert len(log.t_s) == 301 and log.start_s == 25.0
    values = log.columns() | {"t_s": log.start_s + log.t_s}
    for name in table.dtype.names or ():
        assert np.array_equal(values[name], table[name], equal_nan=True) or name == "t_s", name
    assert values["t_s"] == pytest.approx(table["t_s"], abs=1e-6)
    assert np.isfinite(log.lat_deg).sum() == (7 if release.name == "release_0.4.0" else 0)


def test_a_calibration_of_an_earlier_release_is_read(release):
    calibration = read_calibration(release / "RIDE.cal.json")
    assert calibration.aligned and calibration.six_done and calibration.trim_deg == 0.0
    assert calibration.gyro_bias_dps.tolist() == [7.59324427, 14.6971565, 12.5657824]
    assert calibration.vehicle_from_sensor[0].tolist() == [0.692076921, -0.7154935, -0.0953864679]
    assert calibration.kickstand_side == ("left" if release.name == "release_0.4.0" else "")
    assert np.array_equal([calibration.accel_matrix, calibration.gyro_matrix], [np.eye(3)] * 2)
    assert calibration.gyro_delay_s is None


@pytest.mark.parametrize("name", ["EXPORT.csv.gz", "RACECHRONO.csv.gz"])
@pytest.mark.parametrize("release", RELEASES[1:], indirect=True)  # the first release had no exports
def test_an_export_of_an_earlier_release_is_imported(tmp_path, release, name):
    """The exported forces and rates are those of the log, calibrated. They point along the vehicle's axes."""
    log = api.read_log(release / "RIDE.csv.gz")
    force_g, rate_dps = read_calibration(release / "RIDE.cal.json").in_vehicle(log.readings)
    (tmp_path / "EXPORT.csv").write_bytes(gzip.decompress((release / name).read_bytes()))
    imported = api.import_recording(tmp_path / "EXPORT.csv")
    assert imported.app == ("Kickstand" if name == "EXPORT.csv.gz" else "RaceChrono") and imported.vehicle_axes
    assert imported.log.accel_g[:300] == pytest.approx(force_g[:300], abs=3e-4)
    assert imported.log.gyro_dps[:300] == pytest.approx(rate_dps[:300], abs=2e-3)
    assert np.nanmax(imported.log.speed_mps) == pytest.approx(np.nanmax(log.speed_mps), abs=0.01)
