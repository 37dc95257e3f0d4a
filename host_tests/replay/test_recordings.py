"""Real recordings through `kickstand replay`."""

import csv
import gzip

import engines
import numpy as np
import pytest
from command import works, write_cal
from kickstand import rotation
from kickstand.calibration import two_position

UPRIGHT, FIRST_SIDE, OTHER_SIDE = ((0.0, 0.9), (11.0, 12.0)), ((5.0, 6.0),), ((7.4, 7.9),)


def means(t, values, stretches):
    inside = np.any([(t >= start) & (t <= end) for start, end in stretches], axis=0)
    return values[inside].mean(axis=0)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_hand_leaning_is_held_on_both_sides(engine, shared_data, tmp_path):
    """The matrix from the upright stretch and the first held side; gravity tells the true lean in both."""
    path = shared_data / "hand-leaning.csv.gz"
    with gzip.open(path, "rt") as file:
        rows = list(csv.DictReader(file))
    t = np.array([float(row["t_s"]) for row in rows])
    accel = np.array([[float(row[name]) for name in ("ax_g", "ay_g", "az_g")] for row in rows])
    matrix = rotation.matrix()
    tilt = two_position.two_position(matrix, means(t, accel, FIRST_SIDE), means(t, accel, UPRIGHT))
    assert tilt == pytest.approx(45.7, abs=0.2)
    rows = np.array(matrix).reshape(3, 3)
    calibration = write_cal(
        tmp_path / "CAL.json",
        accel_offset_g=[0.0] * 3,
        accel_slope=[1.0] * 3,
        gyro_bias_dps=[0.0] * 3,
        vehicle_from_sensor=rows.tolist(),
    )
    out = tmp_path / "LEAN.csv"
    works("replay", path, "--calibration", calibration, "--out", out, "--engine", engine)
    lean = np.genfromtxt(out, delimiter=",", names=True)["lean_deg"]
    for stretches in (FIRST_SIDE, OTHER_SIDE):
        force = rows @ means(t, accel, stretches)
        gravity_says = np.degrees(np.arctan2(force[0], force[1]))
        assert abs(gravity_says) > 40
        assert means(t, lean, stretches) == pytest.approx(gravity_says, abs=2.0)
