"""The values of a ride that the gauge shows at each moment: interpolation, gaps, maxima, trust."""

import math

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.overlay.overlay import Shown, shown

NAN = math.nan


def values_at(times_s, at_s, **columns) -> Shown:
    """Return the values at at_s of a ride with these times and columns. Missing columns are unknown."""
    unknown = np.full(len(times_s), NAN)
    names = ("lean_deg", "forward_g", "left_g", "speed_mps", "left_deg", "right_deg")
    columns_at = {name: np.array(columns.get(name, unknown), dtype=float) for name in names}
    return Shown(np.array(times_s, dtype=float), **columns_at).at(np.array(at_s, dtype=float))


def test_a_lean_is_shown_up_to_a_gap_of_200_ms():
    values = values_at(
        [0.0, 0.2, 0.41, 0.5],
        [-0.11, -0.09, 0.1, 0.3, 0.5, 0.54, 0.56],
        lean_deg=[0.0, 2.0, 4.0, 5.0],
        left_g=[0.0, 0.2, 0.4, 0.5],
        left_deg=[1.0, 2.0, 3.0, 4.0],
    )
    assert values.lean_deg == pytest.approx([NAN, -0.9, 1.0, NAN, 5.0, 5.0 + 4 / 9, NAN], nan_ok=True)
    assert values.left_g == pytest.approx(values.lean_deg / 10.0, nan_ok=True)
    assert values.left_deg.tolist() == [0.0, 0.0, 1.0, 2.0, 4.0, 4.0, 4.0]  # the largest so far
    assert not values.has_speed


def test_a_speed_is_shown_between_speeds_up_to_3_s_apart():
    """The speeds are at 0, 3 and 6.5 s. Half a step after the last speed, nothing is shown."""
    times_s, speed = np.arange(0.0, 8.0, 0.5), np.full(16, NAN)
    speed[[0, 6, 13]] = 10.0, 16.0, 20.0
    at_s = [-1.6, -1.4, 0.0, 1.5, 3.0, 5.0]
    assert values_at(times_s, at_s, speed_mps=speed).speed_mps == pytest.approx(
        [NAN, 7.2, 10.0, 13.0, NAN, NAN], nan_ok=True
    )
    speed[3:] = NAN
    assert np.isnan(values_at(times_s, times_s, speed_mps=speed).speed_mps).all()  # one speed has no neighbour


def test_shown_values_are_those_of_the_display(ride):
    values, lean = shown(api.open_ride(ride).read()), api.vehicle_channels(ride)
    assert np.array_equal(values.t_s, lean.t_s) and values.has_speed
    assert np.array_equal(values.lean_deg, np.where(lean.trusted, lean.lean_deg, NAN), equal_nan=True)
    assert values.right_deg[-1] == pytest.approx(np.nanmax(values.lean_deg), abs=0.5)
    assert values.at(values.t_s[-1:] - 6.0).forward_g[0] < -0.2  # it brakes
    turning = np.abs(values.lean_deg) > 25.0
    assert np.all(np.sign(values.left_g[turning]) == -np.sign(values.lean_deg[turning]))
    smoothed = shown(api.open_ride(ride, smoothed=True).read())
    assert np.nanmax(np.abs(smoothed.lean_deg - values.lean_deg)) > 0.5  # only smoothing uses later readings


def test_contradicted_calibration_is_noticed(ride):
    turned_deg = api.CalibrationFile(vehicle_from_sensor=np.diag([-1.0, 1.0, -1.0]), aligned=True)
    for calibration, codes in ((api.CalibrationFile(aligned=True), []), (turned_deg, ["forward-exchanged"])):
        reading = api.open_ride(ride, calibration).read()
        shown(reading)
        assert [notice.code for notice in reading.notices()] == codes
