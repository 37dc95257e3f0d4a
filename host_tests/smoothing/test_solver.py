"""Blocks of windows solved at the same time, against the same least squares solved at once."""

import numpy as np
import pytest
from kickstand_tools.smoothing.solver import Beliefs, back, eliminate, mixed, solve_chains, unlikelihood, variances

S, M, ROWS = 3, 2, 6


def problem(blocks, length, seed=0):
    """Random residuals: slopes and ends as eliminate() takes them, prior and drift of the parameters."""
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(blocks, length, ROWS, S + M + 1))
    ends = rng.uniform(0.5, 1.5, size=(blocks, length, S))
    prior = np.column_stack((np.diag([2.0, 3.0]), [0.5, -0.3]))
    return (slopes, ends), prior, np.array([0.01, 0.1]), rng.normal(size=(blocks - 1, M))


def by_both_ends(slopes, ends):
    """(blocks, length, ROWS, S + S + M + 1): derivatives by the first state, the last one, the parameters, and 1."""
    first, last = slopes[..., :S].copy(), slopes[..., :S].copy()
    for i in range(S):
        first[:, :, i, i] -= ends[:, :, i]
        last[:, :, i, i] += ends[:, :, i]
    return np.concatenate((first, last, slopes[..., S:]), axis=3)


def at_once(slopes, prior, drift, between):
    """All states in a row, then the parameters of each block: solution and covariance of the normal equations."""
    slopes = by_both_ends(*slopes)
    blocks, length = slopes.shape[:2]
    states = blocks * length + 1
    n = states * S + blocks * M
    normal, gradient = np.zeros((n, n)), np.zeros(n)
    for b in range(blocks):
        own = np.arange(M) + states * S + b * M
        for k in range(length):
            first = (b * length + k) * S
            places = np.concatenate((np.arange(first, first + 2 * S), own))
            slope, residual = slopes[b, k, :, :-1], slopes[b, k, :, -1]
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


def in_ways(prior, drift, between, *more):
    """Beliefs with this drift (m), and with others."""
    drifts = np.stack([drift, *more])
    return Beliefs(np.stack([prior] * len(drifts)), np.repeat(drifts[:, None], len(between), axis=1), between)


@pytest.mark.parametrize(("blocks", "length"), [(1, 1), (1, 5), (2, 1), (4, 3), (3, 7)])
def test_blocks_give_the_solution_of_the_whole_chain(blocks, length):
    slopes, prior, drift, between = problem(blocks, length)
    want, want_variances, states = at_once(slopes, prior, drift, between)
    reduced = eliminate(*slopes)
    (chain,) = solve_chains(reduced.left, S, in_ways(prior, drift, between))
    found, spread = back(reduced, chain), variances(reduced, chain)
    for b in range(blocks):
        for k in range(length + 1):
            place = slice((b * length + k) * S, (b * length + k + 1) * S)
            assert np.allclose(found[b, k], want[place], atol=1e-9)
            assert np.allclose(spread[b, k], want_variances[place], rtol=1e-6)
    assert np.allclose(chain.parameters.ravel(), want[states * S :], atol=1e-9)


def test_the_likelihood_is_that_of_the_parameters_as_a_whole():
    """Against the density of what is measured, whose covariance is that of its noise and of all unknowns."""
    slopes, prior, drift, between = problem(3, 2)
    other = drift * [9.0, 0.25]
    left = eliminate(*slopes).left
    found = unlikelihood(left, S, in_ways(prior, drift, between, other))
    want = [by_density(slopes, prior, one, between) for one in (drift, other)]
    assert found[1] - found[0] == pytest.approx(want[1] - want[0], rel=1e-4)


def by_density(slopes, prior, drift, between):
    """Twice the negative logarithm of the density; flat states have a very wide density before."""
    slopes = by_both_ends(*slopes)
    blocks, length = slopes.shape[:2]
    states = blocks * length + 1
    n = states * S + blocks * M
    rows, wide = [], 1e6
    for b in range(blocks):
        for k in range(length):
            row = np.zeros((ROWS, n + 1))
            first = (b * length + k) * S
            row[:, first : first + 2 * S] = slopes[b, k, :, : 2 * S]
            row[:, states * S + b * M : states * S + (b + 1) * M] = slopes[b, k, :, 2 * S : -1]
            row[:, n] = slopes[b, k, :, -1]
            rows.append(row)
    rows = np.concatenate(rows)
    covariance, mean = np.eye(n) * wide, np.zeros(n)
    at_first = np.linalg.inv(prior[:, :M])
    pulled = -at_first @ prior[:, M]
    for a in range(blocks):
        mean[states * S + a * M : states * S + (a + 1) * M] = pulled - np.sum(between[:a], axis=0)
        for b in range(blocks):
            shared = at_first + min(a, b) * np.diag(drift)
            covariance[states * S + a * M : states * S + (a + 1) * M, states * S + b * M : states * S + (b + 1) * M] = (
                shared
            )
    spread = rows[:, :n] @ covariance @ rows[:, :n].T + np.eye(len(rows))
    off = rows[:, n] + rows[:, :n] @ mean
    return np.linalg.slogdet(spread)[1] + off @ np.linalg.solve(spread, off)


def test_what_several_beliefs_find_lies_between_and_is_as_unsure_as_they_differ():
    slopes, prior, drift, between = problem(3, 4)
    reduced = eliminate(*slopes)
    ways = in_ways(prior, drift, between, drift * 100.0)
    chains = solve_chains(reduced.left, S, ways)
    found = mixed(chains, np.array([0.75, 0.25]))
    states = [back(reduced, chain) for chain in (*chains, found)]
    assert np.allclose(states[2], 0.75 * states[0] + 0.25 * states[1])
    spread = [variances(reduced, chain) for chain in (*chains, found)]
    apart = 0.75 * 0.25 * (states[1] - states[0]) ** 2
    assert np.allclose(spread[2], 0.75 * spread[0] + 0.25 * spread[1] + apart)
