"""The firmware's functions for vectors and matrices give the same results as numpy, on CPython and MicroPython."""

import numpy as np
import pytest
from kickstand import rotation
from numpy.testing import assert_allclose
from support import engines

FLOAT32 = {"rtol": 0, "atol": 1e-6}


def random_rotation(rng):
    """Return a uniformly distributed rotation matrix, rounded to float32."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return (q * np.linalg.det(q)).astype(np.float32).astype(float)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_products_agree_with_numpy(engine):
    rng = np.random.default_rng(1)
    calls, expected = [], []
    for _ in range(200):
        m = random_rotation(rng)
        a, b = rng.normal(size=3), rng.normal(size=3)
        calls += [("cross", (a.tolist(), b.tolist())), ("rotate", (m.ravel().tolist(), a.tolist()))]
        expected += [np.cross(a, b), m @ a]
    for (name, _), got, want in zip(calls, engines.run(engine, calls), expected):
        assert_allclose(got, want, err_msg=name, **FLOAT32)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_angle_is_right_at_both_ends(engine):
    angles = [0.0, 1e-3, 0.1, 45.0, 90.0, 135.0, 179.9, 179.999, 180.0]
    calls = [("angle", ([1, 0, 0], [np.cos(np.radians(a)), np.sin(np.radians(a)), 0])) for a in angles]
    assert_allclose(engines.run(engine, calls), angles, rtol=0, atol=1e-4)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_a_matrix_with_one_wrong_row_or_a_mirror_is_no_rotation(engine):
    rng = np.random.default_rng(7)
    good, bad = [], [np.zeros((3, 3))]
    for _ in range(30):
        truth = random_rotation(rng)
        good.append(truth)
        bad += [-truth, truth[[1, 0, 2]], truth[:, [0, 2, 1]]]
        for k in range(3):
            longer, askew = truth.copy(), truth.copy()
            longer[k] *= 1.0 + 1e-4
            askew[k] += 2e-4 * truth[k - 1]
            bad += [longer, askew]
    answers = engines.run(engine, [("is_rotation", (matrix.ravel().tolist(),)) for matrix in good + bad])
    assert answers == [True] * len(good) + [False] * len(bad)
    for value in (float("nan"), float("inf")):
        assert not rotation.is_rotation([value] * 9)


def test_a_direction_has_length_1_and_a_null_vector_has_none():
    for vector in ([3.0, -4.0, 12.0], [0.0, 0.0, 2e-9]):
        got = rotation.vector(*vector)
        length = rotation.normalize(got)
        assert length == pytest.approx(np.linalg.norm(vector), rel=1e-6)
        assert_allclose(got, np.array(vector) / np.linalg.norm(vector), rtol=1e-6)
        assert rotation.norm(got) == pytest.approx(1.0, abs=1e-6)
    for vector in ([0.0, 0.0, 0.0], [5e-10, 0.0, 0.0], [float("nan"), 0.0, 1.0]):
        with pytest.raises(ValueError, match="no direction"):
            rotation.normalize(rotation.vector(*vector))
