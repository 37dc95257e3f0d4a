"""Blocks of windows solved at the same time, against the same least squares solved at once."""

import numpy as np
import pytest
from kickstand_tools.smoothing.solver import back, eliminate, solve_chain, variances

S, M, ROWS = 3, 2, 6


def problem(blocks, length, seed=0):
    """Random residuals: slopes (length, blocks, ROWS, S + S + M + 1), prior and drift of the parameters."""
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(length, blocks, ROWS, 2 * S + M + 1))
    prior = np.column_stack((np.diag([2.0, 3.0]), [0.5, -0.3]))
    return slopes, prior, np.array([0.01, 0.1]), rng.normal(size=(blocks - 1, M))


def at_once(slopes, prior, drift, between):
    """All states in a row, then the parameters of each block: solution and covariance of the normal equations."""
    length, blocks = slopes.shape[:2]
    states = blocks * length + 1
    n = states * S + blocks * M
    normal, gradient = np.zeros((n, n)), np.zeros(n)
    for b in range(blocks):
        own = np.arange(M) + states * S + b * M
        for k in range(length):
            first = (b * length + k) * S
            places = np.concatenate((np.arange(first, first + 2 * S), own))
            slope, residual = slopes[k, b, :, :-1], slopes[k, b, :, -1]
            normal[np.ix_(places, places)] += slope.T @ slope
            gradient[places] += slope.T @ residual
        if b == 0:
            normal[np.ix_(own, own)] += prior[:, :M]
            gradient[own] += prior[:, M]
        else:
            weight = np.diag(1.0 / drift)
            before = own - M
            normal[np.ix_(own, own)] += weight
            normal[np.ix_(before, before)] += weight
            normal[np.ix_(own, before)] -= weight
            normal[np.ix_(before, own)] -= weight
            gradient[own] += weight @ between[b - 1]
            gradient[before] -= weight @ between[b - 1]
    covariance = np.linalg.inv(normal)
    return -covariance @ gradient, np.diag(covariance), states


@pytest.mark.parametrize(("blocks", "length"), [(1, 1), (1, 5), (2, 1), (4, 3), (3, 7)])
def test_blocks_give_the_solution_of_the_whole_chain(blocks, length):
    slopes, prior, drift, between = problem(blocks, length)
    want, want_variances, states = at_once(slopes, prior, drift, between)
    reduced = eliminate(slopes, S)
    chain = solve_chain(reduced.left, S, prior, drift, between)
    found, spread = back(reduced, chain), variances(reduced, chain)
    for b in range(blocks):
        for k in range(length + 1):
            place = slice((b * length + k) * S, (b * length + k + 1) * S)
            assert np.allclose(found[k, b], want[place], atol=1e-9)
            assert np.allclose(spread[k, b], want_variances[place], rtol=1e-6)
    assert np.allclose(chain.parameters.ravel(), want[states * S :], atol=1e-9)
