"""Vectors and matrices against numpy, on both engines."""

import engines
import numpy as np
import pytest
from numpy.testing import assert_allclose

FLOAT32 = {"rtol": 0, "atol": 1e-6}


def random_rotation(rng):
    """A rotation matrix, uniformly distributed, as float32 holds it."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return (q * np.linalg.det(q)).astype(np.float32).astype(float)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_products_agree_with_numpy(engine):
    rng = np.random.default_rng(1)
    calls, expected = [], []
    for _ in range(200):
        m, n = random_rotation(rng), random_rotation(rng)
        a, b = rng.normal(size=3), rng.normal(size=3)
        calls += [
            ("cross", (a.tolist(), b.tolist())),
            ("rotate", (m.ravel().tolist(), a.tolist())),
            ("multiply", (m.ravel().tolist(), n.ravel().tolist())),
        ]
        expected += [np.cross(a, b), m @ a, (m @ n).ravel()]
    for (name, _), got, want in zip(calls, engines.run(engine, calls), expected):
        assert_allclose(got, want, err_msg=name, **FLOAT32)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_angle_is_right_at_both_ends(engine):
    angles = [0.0, 1e-3, 0.1, 45.0, 90.0, 135.0, 179.9, 179.999, 180.0]
    calls = [("angle", ([1, 0, 0], [np.cos(np.radians(a)), np.sin(np.radians(a)), 0])) for a in angles]
    assert_allclose(engines.run(engine, calls), angles, rtol=0, atol=1e-4)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_what_is_a_rotation(engine):
    identity = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    mirror = [1, 0, 0, 0, 1, 0, 0, 0, -1]
    stretched = [1.01, 0, 0, 0, 1, 0, 0, 0, 1]
    missing = [float("inf"), 0, 0, 0, 1, 0, 0, 0, 1]
    assert engines.run(engine, [("is_rotation", (m,)) for m in (identity, mirror, stretched)]) == [
        True,
        False,
        False,
    ]
    assert not engines.firmware_calls.call("is_rotation", (missing,))
