"""Solves linear least squares over a chain of states, with parameters that follow a random walk from block to block.

The windows of a ride are arranged as B blocks of K windows. A link holds the normal equations of two successive states,
with columns for the parameters of the block and for the right-hand side. Every second state is eliminated by its Schur
complement, in all blocks at the same time, until one link per block remains (cyclic reduction). The blocks then form a
chain, of which each state is a block's first state together with the block's parameters. The same elimination solves
it, for each of G hypotheses about the random walk, and computes the likelihood of each hypothesis. The result equals
one least-squares solution over the whole ride.

In the shapes below, a state has s values, and a block has m parameters.
"""

from dataclasses import dataclass

import numpy as np

from ..signals import Array


@dataclass
class Reduced:
    """B chains whose inner states are eliminated. gains and covariances have one array per level of the elimination."""

    s: int  # number of values of a state
    # (B, states, s, s + s + m + 1). The change of an eliminated state is minus its gain times the vector (previous
    # state, next state, parameters, 1).
    gains: list[Array]
    covariances: list[Array]  # of an eliminated state if its neighbours and the parameters are fixed, (B, states, s, s)
    # normal equations of the first state, the last state and the parameters, with the gradient as the last column,
    # (B, s + s + m, s + s + m + 1)
    left: Array
    residual: Array  # sum of squares at the optimum of the eliminated states, shape (B)

    def part(self, rows: slice) -> "Reduced":
        gains, covariances = ([level[rows] for level in levels] for levels in (self.gains, self.covariances))
        return Reduced(self.s, gains, covariances, self.left[rows], self.residual[rows])

    @staticmethod
    def joined(parts: "list[Reduced]") -> "Reduced":
        """Join parts that have the same number of states."""
        gains, covariances = (
            [np.concatenate(level) for level in zip(*levels)]
            for levels in ([part.gains for part in parts], [part.covariances for part in parts])
        )
        left, residual = (
            np.concatenate([part.left for part in parts]),
            np.concatenate([part.residual for part in parts]),
        )
        return Reduced(parts[0].s, gains, covariances, left, residual)


def reduce_windows(jacobian: Array, states: int) -> Reduced:
    """Eliminate the states of each of B blocks of K windows except its first and its last one. Raises LinAlgError.

    jacobian: derivatives of each window's r residuals, shape (B, K, r, s + s + m + 1). The columns are the state at the
        window's start, the state at its end, the parameters, and the residual itself.
    states: s, the number of values of a state.
    """
    links = np.matmul(jacobian[..., : 2 * states].transpose(0, 1, 3, 2), jacobian)
    common = _in_rows(jacobian[..., 2 * states :])
    return _reduced(links, np.matmul(common.transpose(0, 2, 1), common))


def _reduced(links: Array, common: Array) -> Reduced:
    """Do the cyclic reduction.

    links: normal equations of both states of each link, shape (B, K, s + s, s + s + m + 1).
    common: normal equations of the parameters, shape (B, m + 1, m + 1). The last row and column hold their gradient and
        the sum of the squared residuals.
    """
    s = links.shape[2] // 2
    gains, covariances, common = [], [], common.copy()
    while links.shape[1] > 1:
        even = links.shape[1] // 2 * 2
        first, second = links[:, 0:even:2], links[:, 1:even:2]
        # normal equations of the state between two links, and its tie to (previous state, next state, parameters, 1)
        inner = first[..., s:, s : 2 * s] + second[..., :s, :s]
        parameters = first[..., s:, 2 * s :] + second[..., :s, 2 * s :]
        tie = np.concatenate((first[..., s:, :s], second[..., :s, s : 2 * s], parameters), axis=3)
        covariances.append(np.linalg.inv(inner))
        gains.append(np.matmul(covariances[-1], tie))
        merged = -np.matmul(tie[..., : 2 * s].transpose(0, 1, 3, 2), gains[-1])
        merged[..., :s, :s] += first[..., :s, :s]
        merged[..., s:, s : 2 * s] += second[..., s:, s : 2 * s]
        merged[..., :s, 2 * s :] += first[..., :s, 2 * s :]
        merged[..., s:, 2 * s :] += second[..., s:, 2 * s :]
        common -= np.matmul(_in_rows(parameters).transpose(0, 2, 1), _in_rows(gains[-1][..., 2 * s :]))
        links = np.concatenate((merged, links[:, even:]), axis=1) if links.shape[1] > even else merged
    below = np.concatenate((links[:, 0, :, 2 * s : -1].transpose(0, 2, 1), common[:, :-1]), axis=2)
    left = np.concatenate((links[:, 0], below), axis=1)
    return Reduced(s, gains, covariances, left, common[:, -1, -1])


def _in_rows(values: Array) -> Array:
    """Reshape values from (B, K, r, w) to (B, K r, w)."""
    return values.reshape(len(values), -1, values.shape[3])


def back(reduced: Reduced, ends: Array, parameters: Array) -> Array:
    """Do the back substitution. Returns the changes of all states, shape (B, K + 1, s).

    ends: changes of the first and the last state, shape (B, 2, s).
    parameters: changes of the parameters, shape (B, m).
    """
    states = ends
    for gain in reversed(reduced.gains):
        count = gain.shape[1]
        common = np.concatenate((parameters, np.ones((len(parameters), 1))), axis=1)[:, None]
        neighbours = np.concatenate(
            (states[:, :count], states[:, 1 : count + 1], np.repeat(common, count, axis=1)), axis=2
        )
        inner = -np.matmul(gain, neighbours[..., None])[..., 0]
        states = np.insert(states, np.arange(1, count + 1), inner, axis=1)
    return states


def covariances(reduced: Reduced, joint: Array) -> Array:
    """Return for each link the covariance of its two states with them and the parameters, (B, K, s + s, s + s + m)."""
    s, width = reduced.s, joint.shape[1]
    ends = np.r_[:s, 2 * s : 3 * s]  # rows of the two outer states; two neighbouring links have three states
    all_but_inner = np.r_[ends, 3 * s : width + s]
    blocks, common = joint[:, None, : 2 * s], joint[:, None, 2 * s :]
    for gain, conditional in zip(reversed(reduced.gains), reversed(reduced.covariances), strict=True):
        count = gain.shape[1]
        split = blocks[:, :count]
        below = np.repeat(common, count, axis=1)
        below[..., : 2 * s] = split[..., 2 * s :].transpose(0, 1, 3, 2)
        # The covariance of the inner state with the ends and with the parameters.
        inner = -np.matmul(gain[..., :-1], np.concatenate((split, below), axis=2))
        three = np.empty((len(blocks), count, 3 * s, width + s))
        three[:, :, ends[:, None], all_but_inner] = split
        three[:, :, s : 2 * s, all_but_inner] = inner
        three[:, :, ends, s : 2 * s] = inner[..., : 2 * s].transpose(0, 1, 3, 2)
        three[:, :, s : 2 * s, s : 2 * s] = conditional - np.matmul(inner, gain[..., :-1].transpose(0, 1, 3, 2))
        first = np.delete(three[:, :, : 2 * s], np.s_[2 * s : 3 * s], axis=3)
        finer = np.stack((first, three[:, :, s:, s:]), axis=2)
        blocks = np.concatenate((finer.reshape(len(blocks), 2 * count, 2 * s, width), blocks[:, count:]), axis=1)
    return blocks


@dataclass
class RandomWalks:
    """The parameters' random walks under G hypotheses."""

    prior: Array  # normal equations of the first block's parameters, shape (G, m, m + 1)
    variance: Array  # variance of the parameters' change from block to block (process noise), shape (G, B - 1, m)
    # change of the parameters from block to block, where the equations were linearised, shape (B - 1, m)
    between: Array


def _chain(blocks: Reduced, walks: RandomWalks, hypothesis: int) -> tuple[Reduced, Array]:
    """Build the chain of the blocks for one hypothesis. All chains at once would need much memory.

    A state of a chain has n = s + m values: a block's first state and its parameters. After the last block the
    parameters stay the same. Returns the chain, and the normal equations of both its ends, shape (2 n, 2 n + 1).
    """
    (count, width), s = blocks.left.shape[:2], blocks.s
    n = width - s
    links = np.zeros((count, 2 * n, 2 * n + 1))
    columns = np.r_[:s, n : n + s, s:n]  # a block's first state, last state and parameters, in a link
    links[:, columns[:, None], np.r_[columns, 2 * n]] = blocks.left
    weight, change = np.ones((count, n - s)), np.zeros((count, n - s))
    weight[:-1], change[:-1] = 1.0 / walks.variance[hypothesis], walks.between
    earlier, later = np.arange(s, n), np.arange(n + s, 2 * n)
    for rows, cross, sign in ((earlier, later, -1.0), (later, earlier, 1.0)):
        links[:, rows, rows] += weight
        links[:, rows, cross] -= weight
        links[:, rows, -1] += sign * weight * change
    reduced = _reduced(links[None], np.reshape(np.sum(weight * change**2), (1, 1, 1)))
    ends = reduced.left[0]
    ends[s:n, s:n] += walks.prior[hypothesis, :, :-1]
    ends[s:n, -1] += walks.prior[hypothesis, :, -1]
    return reduced, ends


def _squared(equations: Array) -> float:
    """Return the square of the gradient in the metric of the covariance. equations: shape (k, k + 1)."""
    return float(equations[:, -1] @ np.linalg.solve(equations[:, :-1], equations[:, -1]))


def minus_two_log_likelihood(blocks: Reduced, walks: RandomWalks) -> Array:
    """Return minus twice the log-likelihood of the readings under each hypothesis, up to a common constant."""
    minus_two_log = []
    for g, (prior, variance) in enumerate(zip(walks.prior, walks.variance)):
        reduced, ends = _chain(blocks, walks, g)
        misfit = reduced.residual[0] + _squared(prior) - _squared(ends)
        eliminated = sum(float(np.sum(np.linalg.slogdet(level)[1])) for level in reduced.covariances)
        log_determinant = np.linalg.slogdet(ends[:, :-1])[1] - np.linalg.slogdet(prior[:, :-1])[1] - eliminated
        minus_two_log.append(misfit + log_determinant + np.sum(np.log(variance)))
    return np.array(minus_two_log)


def solve(blocks: Reduced, walks: RandomWalks, weight: Array) -> tuple[Array, Array]:
    """Compute the posterior mean over the hypotheses, whose weights have the shape (G). Raises LinAlgError.

    Returns the changes of the states, shape (B, K + 1, s), and of the parameters, shape (B, m).
    """
    mean = np.zeros(1)
    for g, share in enumerate(weight):
        mean = mean + share * _first_states(*_chain(blocks, walks, g))
    states, parameters = mean[:, : blocks.s], mean[:-1, blocks.s :]
    return back(blocks, np.stack((states[:-1], states[1:]), axis=1), parameters), parameters


def posterior_covariance(blocks: Reduced, walks: RandomWalks, weight: Array) -> Array:
    """Return the covariance of each block's first state, last state and parameters, shape (B, s + s + m, s + s + m).

    It is the mean covariance within the hypotheses plus the covariance between their means.
    """
    states, joint = [], np.zeros(1)
    for g, share in enumerate(weight):
        reduced, ends = _chain(blocks, walks, g)
        states.append(_first_states(reduced, ends))
        joint = joint + share * covariances(reduced, np.linalg.inv(ends[None, :, :-1]).astype(float))[0]
    deviation = np.stack([np.concatenate((state[:-1], state[1:]), axis=1) for state in states])
    deviation -= np.einsum("g,gbi->bi", weight, deviation)
    joint = joint + np.einsum("g,gbi,gbj->bij", weight, deviation, deviation)
    s, n = blocks.s, states[0].shape[1]
    order = np.r_[:s, n : n + s, s:n]  # first state, last state, parameters
    return joint[:, order[:, None], order]


def _first_states(reduced: Reduced, ends: Array) -> Array:
    """Return the changes of all states of a chain, shape (B + 1, n), from the normal equations of its ends."""
    change = np.linalg.solve(ends[:, :-1], -ends[:, -1:]).astype(float)
    return back(reduced, change.reshape(1, 2, reduced.s), np.zeros((1, 0)))[0]
