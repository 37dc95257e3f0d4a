"""Compares the alignment from one ride with known figures. If nearly any number of the model is changed, these figures
change."""

import numpy as np
import pytest
from kickstand_tools.api import Log, fit_ride, simulate_ride

FIGURES = {
    "errors_deg": [0.72768, 0.57542, 0.80954],
    "halves_deg": [0.078476, 0.25688, -1.1755],
    "offset_g": [0.030756, -0.012133, -0.021875],
    "offset_sigma_g": [0.014436, 0.011301, 0.015147],
    "bias_dps": [-3.3652, 16.306, 5.9946],
    "axes": [-0.85736, 0.3226, -0.40108, -0.51366, -0.48628, 0.70688, 0.033006, 0.81207, 0.58262],
    "used_s": [-0.02, 121.14],
    "seconds": [85.2, 35.96],
    "lean_and_lag": [5.1068, 0.33981],
}


def test_the_figures_of_an_alignment_from_a_ride():
    """The log has 25 samples per second, and one speed per second, which is 0.3 s late."""
    ride = simulate_ride("city", seed=3, seconds=120.0)
    readings, hz = ride.readings[::8], ride.rate_hz / 8
    log = Log.from_readings(readings, hz)
    t_s = np.arange(len(readings)) / hz
    late = np.interp(t_s - 0.3, t_s, ride.truth["speed_mps"][::8])
    log.speed_mps[:] = np.where(np.arange(len(t_s)) % 25 == 0, late, np.nan)
    done: list = []
    found = fit_ride(log, progress=lambda *of: done.append(of))
    assert done == [(1, 2), (2, 2)]
    seen = {
        "errors_deg": (found.roll_deg, found.pitch_deg, found.yaw_deg),
        "halves_deg": found.halves_deg,
        "offset_g": found.offset_g,
        "offset_sigma_g": found.offset_sigma_g,
        "bias_dps": found.calibration.gyro_bias_dps,
        "axes": found.calibration.vehicle_from_sensor,
        "used_s": found.used_s,
        "seconds": (found.riding_s, found.standing_s),
        "lean_and_lag": (found.lean_deg, found.lag_s),
    }
    for name, figures in FIGURES.items():
        assert np.ravel(seen[name]) == pytest.approx(figures, rel=1e-3), name
