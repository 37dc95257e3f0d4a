"""The covariance's sparse arithmetic is compared with the textbook's matrices, and its machine code with exact sums."""

from math import inf, nan

import numpy as np
import pytest
from kickstand.lean.kalman import Covariance
from support.mpy import run_mpy

N = 12
# Partial derivatives of the rate of state 5: (other state, derivative)
RATES = [(2, 0.7), (4, -1.3), (0, 0.2), (11, 2.1), (7, -0.4)]
H = [(0, 0.8), (3, -0.5), (5, 2.0), (8, 0.1), (11, -0.3)]


def spread(terms):
    row = np.zeros(N)
    for state, value in terms:
        row[state] = value
    return row


def some(seed=0):
    """Return a Covariance with correlations, and its matrix. Measured sums of states cause the correlations."""
    chance = np.random.default_rng(seed)
    p = Covariance([1.0 + i for i in range(N)])
    matrix = np.diag(np.arange(1.0, N + 1.0))
    for _ in range(6):
        h = chance.normal(size=N)
        list(p.update(tuple(enumerate(h.tolist())), 0.0, 0.5))
        matrix -= np.outer(matrix @ h, matrix @ h) / (h @ matrix @ h + 0.5)
    for i in range(N):
        p.correction[i] = 0.0
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
    np.testing.assert_allclose(p.correction, x, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("innovation", "variance"), [(4.9, 1.0), (-4.9, 1.0), (10.0, 4.0), (-50.0, 100.0)])
def test_beyond_five_sigma_an_innovation_counts_for_less(innovation, variance):
    """The variance of a larger innovation is raised until the innovation is five standard deviations. For all other
    innovations the variance is 1."""
    p = Covariance([0.5])
    list(p.update(((0, 1.0),), innovation, 0.5))
    assert p.correction[0] == pytest.approx(innovation * 0.5 / variance)
    assert p.rows[0][0] == pytest.approx(0.5 - 0.25 / variance)


def test_a_variance_never_reaches_zero():
    p = Covariance([1.0, 1.0])
    for _ in range(3):
        list(p.update(((1, 1.0),), 0.0, 0.0))
    assert p.rows[1][1] == 1e-10
    assert p.rows[0][0] == 1.0


def added(cases):
    """Run the machine code for each case (out, factors, source, rows). Return the changed `out` of each case."""
    script = (
        "from array import array\n"
        "from math import inf, nan\n"
        "from kickstand.quick_viper import add_products\n"
        f"for out, factors, source, rows in {cases}:\n"
        "    out = array('f', out)\n"
        "    add_products(out, array('f', factors), array('f', source), len(source), rows)\n"
        "    print(list(out))\n"
    )
    return [eval(line, {"inf": inf, "nan": nan}) for line in run_mpy(script).splitlines()]


@pytest.mark.parametrize("decades", [0, 3, 12])
def test_machine_code_rounds_a_sum_once(decades):
    """The sum is rounded to the nearest float. The larger term is computed with 30 bits, so finer parts may be lost."""
    chance = np.random.default_rng(decades)
    size = chance.normal(size=(3, 400)) * 10.0 ** chance.uniform(-decades, decades, (3, 400))
    size[0, ::3] = -size[1, ::3] * size[2, ::3] * (1.0 + 1e-3 * chance.normal(size=134))  # nearly cancelled
    out, factors, source = size.astype(np.float32).astype(float)
    sums = np.array(added([([c], [a], [b], 1) for c, a, b in size.astype(np.float32).T.tolist()]))
    exact = out + factors * source
    finest = np.maximum(np.abs(out), np.abs(factors * source)) * 2.0**-28
    assert np.all(np.abs(sums[:, 0] - exact) <= np.spacing(np.abs(exact).astype(np.float32)) / 2 + finest)
