"""What a table's accelerations and positions show: gravity in a long bend, gravity in columns of its own, and exchanged
positions."""

import numpy as np
import pytest
from kickstand_tools.api import import_recording

T_S = np.arange(0.0, 60.0, 0.05)
SHAKE = np.random.default_rng(1).normal(0.0, 0.03, (len(T_S), 3))
AX, GX = "ax_g,ay_g,az_g", "gx_dps,gy_dps,gz_dps"


def imported(path, header, *columns):
    table = path / "ride.csv"
    np.savetxt(table, np.column_stack((T_S, *columns)), delimiter=",", fmt="%.6f", header=header, comments="")
    return import_recording(table)


@pytest.mark.parametrize("lean_deg", [40.0, 50.0])
def test_a_long_bend_is_not_an_acceleration_without_gravity(tmp_path, lean_deg):
    """In balance the force is 1 / cos(lean) in g, all the time. The bike turns by 20 deg/s about the vertical."""
    lean = np.radians(lean_deg)
    force = SHAKE + [0.0, 1.0 / np.cos(lean), 0.0]
    rates = SHAKE + [20.0 * np.sin(lean), 20.0 * np.cos(lean), 0.0]
    log = imported(tmp_path, f"time_s,{AX},{GX}", force, rates).log
    assert np.mean(log.accel_g, axis=0) == pytest.approx(np.mean(force, axis=0), abs=1e-3)


def test_gravity_and_the_acceleration_without_it_are_added(tmp_path):
    names = ",".join(f"{what}.{axis}" for what in ("userAcceleration", "gravity") for axis in "xyz")
    gravity = np.tile([0.0, -1.0, 0.0], (len(T_S), 1))
    log = imported(tmp_path, f"time_s,{names},{GX}", SHAKE, gravity, 30.0 * SHAKE).log
    assert log.accel_g == pytest.approx(SHAKE + gravity, abs=1e-4)


def test_exchanged_latitude_and_longitude_are_put_right(tmp_path):
    """The bike rides in circles at 10 m/s. The speed fits only one order of latitude and longitude."""
    lat = 47.6 + 100.0 * np.sin(0.1 * T_S) / 111_190.0
    lon = 8.0 + 100.0 * np.cos(0.1 * T_S) / (111_190.0 * np.cos(np.radians(47.6)))
    force, rates = SHAKE + [0.0, 1.0, 0.0], SHAKE + [0.0, -5.7, 0.0]
    speed = np.full(len(T_S), 36.0)
    columns = force, rates, lon, lat, speed
    found = imported(tmp_path, f"time_s,{AX},{GX},lat,lon,speed_kmh", *columns)
    assert "import-exchanged" in [notice.code for notice in found.notices]
    assert np.nanmedian(found.log.lat_deg) == pytest.approx(47.6, abs=0.1)
