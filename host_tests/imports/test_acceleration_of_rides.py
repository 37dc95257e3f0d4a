"""What a table's accelerations show: gravity in a long bend, and gravity in columns of its own."""

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
