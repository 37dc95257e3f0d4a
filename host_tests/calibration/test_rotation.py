"""The firmware's functions for vectors and matrices give the same results as numpy."""

import numpy as np
from kickstand import rotation
from kickstand.calibration import vectors
from kickstand.calibration.store import is_rotation
from motions import random_rotation
from numpy.testing import assert_allclose


def test_products_agree_with_numpy():
    chance = np.random.default_rng(1)
    for _ in range(50):
        m, a, b = random_rotation(chance), chance.normal(size=3), chance.normal(size=3)
        product = [0.0] * 3
        vectors.cross(product, a.tolist(), b.tolist())
        assert_allclose(product, np.cross(a, b), atol=1e-6)
        rotation.rotate(product, m.ravel().tolist(), a.tolist())
        assert_allclose(product, m @ a, atol=1e-6)


def test_a_matrix_with_one_wrong_row_or_a_mirror_is_no_rotation():
    chance = np.random.default_rng(7)
    for _ in range(10):
        truth = random_rotation(chance)
        assert is_rotation(truth.ravel().tolist())
        wrong = [-truth, truth[[1, 0, 2]], truth[:, [0, 2, 1]], np.zeros((3, 3))]
        for k in range(3):
            longer, askew = truth.copy(), truth.copy()
            longer[k] *= 1.0 + 1e-4
            askew[k] += 2e-4 * truth[k - 1]
            wrong += [longer, askew]
        assert not any(is_rotation(matrix.ravel().tolist()) for matrix in wrong)
    for value in (float("nan"), float("inf")):
        assert not is_rotation([value] * 9)
