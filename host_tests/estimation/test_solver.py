"""Chains of blocks solved by elimination are compared with one direct least-squares solution."""

import numpy as np
import pytest
from kickstand_tools.estimation import solver

S, M, ROWS = 3, 2, 6


class Problem:
    """Random residuals of blocks of windows, and random walks of the parameters from block to block.

    blocks: number of blocks.
    length: number of windows per block.
    variances: the variances of a step of the M parameters, one row for each hypothesis.
    """

    def __init__(self, blocks, length, variances=([0.01, 0.1],)):
        rng = np.random.default_rng(0)
        self.jacobian = rng.normal(size=(blocks, length, ROWS, 2 * S + M + 1))
        prior = np.column_stack((np.diag([2.0, 3.0]), [0.5, -0.3]))
        steps = np.repeat(np.array(variances)[:, None], blocks - 1, axis=1)
        self.walks = solver.RandomWalks(np.stack([prior] * len(variances)), steps, rng.normal(size=(blocks - 1, M)))
        self.blocks = solver.reduce_windows(self.jacobian, S)

    def at_once(self, g=0):
        """Solve for all states and parameters in one least-squares problem, for hypothesis g.

        Returns:
            solution: (n), all states in order of time, then the parameters of each block.
            covariance: (n, n), the covariance of the solution.
            likelihood: -2 log(likelihood), up to a constant.
        """
        blocks, length = self.jacobian.shape[:2]
        states = blocks * length + 1
        n = states * S + blocks * M
        parameters = [np.arange(M) + states * S + b * M for b in range(blocks)]
        rows = []
        for b in range(blocks):
            for k in range(length):
                first = (b * length + k) * S
                row = np.zeros((ROWS, n + 1))
                row[:, [*range(first, first + 2 * S), *parameters[b], n]] = self.jacobian[b, k]
                rows.append(row)
        prior, variance = self.walks.prior[g], self.walks.variance[g]
        root = np.linalg.cholesky(prior[:, :M]).T
        row = np.zeros((M, n + 1))
        row[:, parameters[0]], row[:, n] = root, np.linalg.solve(root.T, prior[:, M])
        rows.append(row)
        for b in range(blocks - 1):
            row = np.zeros((M, n + 1))
            row[:, parameters[b]], row[:, parameters[b + 1]] = -np.eye(M), np.eye(M)
            row[:, n] = self.walks.between[b]
            rows.append(row / np.sqrt(variance[b])[:, None])
        a = np.concatenate(rows)
        normal = a[:, :n].T @ a[:, :n]
        solution = -np.linalg.solve(normal, a[:, :n].T @ a[:, n])
        misfit = np.sum((a[:, :n] @ solution + a[:, n]) ** 2)
        prior_and_walks = np.linalg.slogdet(prior[:, :M])[1] - np.sum(np.log(variance))
        likelihood = misfit + np.linalg.slogdet(normal)[1] - prior_and_walks
        return solution, np.linalg.inv(normal), likelihood


@pytest.mark.parametrize(("blocks", "length"), [(1, 1), (1, 5), (2, 1), (4, 3), (3, 7)])
def test_blocks_give_the_solution_of_dense_algebra(blocks, length):
    problem = Problem(blocks, length)
    exact, covariance, _ = problem.at_once()
    states, parameters = solver.solve(problem.blocks, problem.walks, np.ones(1))
    joint = solver.posterior_covariance(problem.blocks, problem.walks, np.ones(1))
    spread = solver.covariances(problem.blocks, joint)
    for b in range(blocks):
        block = slice(len(exact) - (blocks - b) * M, len(exact) - (blocks - b - 1) * M)
        assert np.allclose(parameters[b], exact[block])
        assert np.allclose(joint[b, 2 * S :, 2 * S :], covariance[block, block])
        for k in range(length):
            ends = slice((b * length + k) * S, (b * length + k + 2) * S)
            assert np.allclose(states[b, k : k + 2].ravel(), exact[ends])
            assert np.allclose(spread[b, k, :, : 2 * S], covariance[ends, ends])
            assert np.allclose(spread[b, k, :, 2 * S :], covariance[ends, block])


def test_likelihood_is_that_of_dense_algebra():
    problem = Problem(3, 2, ([0.01, 0.1], [0.09, 0.025]))
    likelihood = solver.minus_two_log_likelihood(problem.blocks, problem.walks)
    assert likelihood[1] - likelihood[0] == pytest.approx(problem.at_once(1)[2] - problem.at_once(0)[2])


def test_mean_of_hypotheses_includes_their_difference():
    variances = [0.01, 0.1], [1.0, 10.0]
    firm, loose = (Problem(3, 4, (variance,)) for variance in variances)
    mixed, weight = Problem(3, 4, variances), np.array([0.75, 0.25])
    (first, _), (second, _) = (solver.solve(problem.blocks, problem.walks, np.ones(1)) for problem in (firm, loose))
    mean, parameters = solver.solve(mixed.blocks, mixed.walks, weight)
    assert np.allclose(mean, 0.75 * first + 0.25 * second)
    assert np.allclose(solver.back(mixed.blocks, mean[:, [0, -1]], parameters), mean)
    within = [solver.posterior_covariance(problem.blocks, problem.walks, np.ones(1)) for problem in (firm, loose)]
    apart = np.concatenate((second - first)[:, [0, -1]].transpose(1, 0, 2), axis=1)
    joint = solver.posterior_covariance(mixed.blocks, mixed.walks, weight)[:, : 2 * S, : 2 * S]
    between = 0.75 * 0.25 * apart[:, :, None] * apart[:, None, :]
    assert np.allclose(joint, 0.75 * within[0][:, : 2 * S, : 2 * S] + 0.25 * within[1][:, : 2 * S, : 2 * S] + between)
