"""The lean from forces, by equations 21 to 26, is compared with numpy."""

import numpy as np
import pytest
from bike_motion import force_and_rate
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose
from support import engines


def formula(left, up, yaw_rate):
    """Compute equations 25 and 26 with numpy in double precision."""
    square = left**2 + up**2
    s = np.sign(yaw_rate) * np.sqrt(np.maximum(0, square - 1))
    return np.degrees(np.arcsin(np.clip((left - s * up) / square, -1, 1)))


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_formula_equals_the_corrected_equations(engine):
    rng = np.random.default_rng(5)
    forces = rng.normal([0, 1, 0], [0.7, 0.4, 0.3], size=(2000, 3)).astype(np.float32).astype(float)
    rates = rng.normal(0, 30, size=2000)
    forces = forces[np.hypot(forces[:, 0], forces[:, 1]) > 0.2]
    rates = rates[: len(forces)]
    calls = [("formula_lean", (f.tolist(), r)) for f, r in zip(forces, rates)]
    assert_allclose(engines.run(engine, calls), formula(forces[:, 0], forces[:, 1], rates), rtol=0, atol=1e-3)


@given(lean=st.floats(-60, 60), speed=st.floats(2, 60), forward=st.floats(-1, 1))
def test_formula_finds_the_lean_of_a_balanced_turn(lean, speed, forward):
    force, rate = force_and_rate(lean, speed, forward_mps2=forward)
    assert engines.firmware_calls.call("formula_lean", (force, rate[1])) == pytest.approx(lean, abs=0.01)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_static_lean(engine):
    angles = np.linspace(-75, 75, 31)
    forces = [[np.sin(np.radians(a)), np.cos(np.radians(a)), 0.1] for a in angles]
    assert_allclose(engines.run(engine, [("static_lean", (f,)) for f in forces]), angles, atol=1e-4)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_free_fall_and_huge_forces_give_a_number(engine):
    calls = [("formula_lean", (f, r)) for f in ([0, 0, 0], [0.01, -0.01, 0], [16, 16, 16]) for r in (0, 5, -5)]
    assert all(-90 <= angle <= 90 for angle in engines.run(engine, calls))
