"""The covariance's sparse arithmetic against the textbook's matrices."""

import numpy as np
import pytest
from kickstand.lean.kalman import Covariance

N = 12
RATES = [(2, 0.7), (4, -1.3), (0, 0.2), (11, 2.1), (7, -0.4)]  # of state 5, by others
H = [(0, 0.8), (3, -0.5), (5, 2.0), (8, 0.1), (11, -0.3)]


def spread(terms):
    row = np.zeros(N)
    for state, value in terms:
        row[state] = value
    return row


def some(seed=0):
    """A Covariance with correlations, made by measuring sums of states, and its matrix."""
    chance = np.random.default_rng(seed)
    p = Covariance([1.0 + i for i in range(N)])
    matrix = np.diag(np.arange(1.0, N + 1.0))
    for _ in range(6):
        h = chance.normal(size=N)
        list(p.update(tuple(enumerate(h.tolist())), 0.0, 0.5))
        matrix -= np.outer(matrix @ h, matrix @ h) / (h @ matrix @ h + 0.5)
    for i in range(N):
        p.take_correction(i)
    np.testing.assert_allclose(p.rows, matrix, rtol=0, atol=1e-12)
    return p, matrix


@pytest.mark.parametrize("terms", [1, 2, 3, 4, 5])
def test_motion_is_F_P_F_transposed_and_its_noise(terms):
    p, matrix = some()
    list(p.propagate_row(5, tuple(RATES[:terms]), 0.2, 0.03))
    f = np.eye(N)
    f[5] += 0.2 * spread(RATES[:terms])
    expected = f @ matrix @ f.T
    expected[5, 5] += 0.03
    np.testing.assert_allclose(p.rows, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("terms", [1, 2, 3, 4, 5])
def test_sequential_measurements_give_the_textbooks_gain(terms):
    p, matrix = some()
    x = np.zeros(N)
    for measured, h in ((0.4, H[:terms]), (-0.3, RATES[:terms])):
        list(p.update(tuple(h), measured, 0.09))
        h = spread(h)
        gain = matrix @ h / (h @ matrix @ h + 0.09)
        x += gain * (measured - h @ x)
        matrix = matrix - np.outer(gain, h @ matrix)
        np.testing.assert_allclose(p.rows, matrix, rtol=0, atol=1e-12)
    np.testing.assert_allclose([p.take_correction(i) for i in range(N)], x, rtol=0, atol=1e-12)
    assert [p.take_correction(i) for i in range(N)] == [0.0] * N  # taken once


@pytest.mark.parametrize(("innovation", "variance"), [(4.9, 1.0), (-4.9, 1.0), (10.0, 4.0), (-50.0, 100.0)])
def test_beyond_five_sigma_an_innovation_counts_for_less(innovation, variance):
    """Where 1 is expected: as if its variance were such that it is five sigma from there."""
    p = Covariance([0.5])
    list(p.update(((0, 1.0),), innovation, 0.5))
    assert p.correction[0] == pytest.approx(innovation * 0.5 / variance)
    assert p.rows[0][0] == pytest.approx(0.5 - 0.25 / variance)


def test_a_state_that_is_set_has_no_correlation_left():
    p, matrix = some()
    p.set_variance(4, 0.25)
    matrix[4] = matrix[:, 4] = 0.0
    matrix[4, 4] = 0.25
    np.testing.assert_allclose(p.rows, matrix, rtol=0, atol=1e-12)


def test_a_variance_never_reaches_zero():
    p = Covariance([1.0, 1.0])
    for _ in range(3):
        list(p.update(((1, 1.0),), 0.0, 0.0))
    assert p.rows[1][1] == 1e-10
    assert p.rows[0][0] == 1.0


def test_noise_is_added_to_one_state():
    p, matrix = some()
    p.add_noise(3, 0.25)
    matrix[3, 3] += 0.25
    np.testing.assert_allclose(p.rows, matrix, rtol=0, atol=1e-12)
