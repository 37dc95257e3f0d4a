"""Solves linear least squares over a chain of states, with parameters that follow a random walk from block to block.

The windows of a ride are arranged as B blocks of K windows. A link holds the normal equations of two successive states,
with columns for the parameters of the block and for the right-hand side. Every second state is eliminated by its Schur
complement, in all blocks at the same time, until one link per block remains (cyclic reduction). The blocks then form a
chain. Each state of the chain is a block's first state together with the block's parameters. The same elimination
solves this chain for G hypotheses about the random walk at the same time, and gives the likelihood of each. The result
equals one least-squares solution over the whole chain.
"""

from dataclasses import dataclass

import numpy as np

from ..signals import Array


@dataclass
class Reduced:
    """B chains whose inner states are eliminated. s: number of values of a state; m: number of a chain's parameters.

    gains and covariances have one array per level of the elimination, in order. gains (B, states, s, s + s + m + 1): a
    state's change is minus this, times (the previous state, the next state, the parameters, 1). covariances (B, states,
    s, s): the covariance of a state if these are fixed. left (B, s + s + m, s + s + m + 1): the normal equations of the
    first state, the last one and the parameters; the last column is the gradient. log_determinant (B): the logarithm of
    the determinant of the eliminated states' information matrix. residual (B): the sum of squares at their optimum.
    """

    s: int
    gains: list[Array]
    covariances: list[Array]
    left: Array
    log_determinant: Array
    residual: Array


def reduce_windows(jacobian: Array, states: int) -> Reduced:
    """Eliminate the inner states of B blocks of K windows. jacobian (B, K, r, s + s + m + 1): derivatives of a window's
    r residuals by the state at its start, the state at its end and the parameters, then the residuals themselves.
    states: s. Raises LinAlgError."""
    links = np.matmul(jacobian[..., : 2 * states].transpose(0, 1, 3, 2), jacobian)
    common = _in_rows(jacobian[..., 2 * states :])
    return _reduced(links, np.matmul(common.transpose(0, 2, 1), common))


def _reduced(links: Array, common: Array) -> Reduced:
    """Do the cyclic reduction. links (B, K, s + s, s + s + m + 1): normal equations of both states of each link. common
    (B, m + 1, m + 1): normal equations of the parameters, with their gradient and the residual's sum of squares in the
    last row and column."""
    s = links.shape[2] // 2
    gains, covariances = [], []
    common, log_determinant = common.copy(), np.zeros(len(links))
    while links.shape[1] > 1:
        even = links.shape[1] // 2 * 2
        first, second = links[:, 0:even:2], links[:, 1:even:2]
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
        log_determinant += np.sum(np.linalg.slogdet(inner)[1], axis=1)
        links = np.concatenate((merged, links[:, even:]), axis=1) if links.shape[1] > even else merged
    below = np.concatenate((links[:, 0, :, 2 * s : -1].transpose(0, 2, 1), common[:, :-1]), axis=2)
    return Reduced(
        s, gains, covariances, np.concatenate((links[:, 0], below), axis=1), log_determinant, common[:, -1, -1]
    )


def _in_rows(values: Array) -> Array:
    """(B, K, r, w) -> (B, K r, w)"""
    return values.reshape(len(values), -1, values.shape[3])


def back(reduced: Reduced, ends: Array, parameters: Array) -> Array:
    """Do the back substitution. Returns (B, K + 1, s): the changes of all states. ends (B, 2, s): changes of the first
    and the last state. parameters (B, m): changes of the parameters."""
    states = ends
    for gain in reversed(reduced.gains):
        count = gain.shape[1]
        common = np.concatenate((parameters, np.ones((len(parameters), 1))), axis=1)[:, None]
        known = np.concatenate((states[:, :count], states[:, 1 : count + 1], np.repeat(common, count, axis=1)), axis=2)
        inner = -np.matmul(gain, known[..., None])[..., 0]
        states = np.insert(states, np.arange(1, count + 1), inner, axis=1)
    return states


def covariances(reduced: Reduced, joint: Array) -> Array:
    """(B, K, s + s, s + s + m): covariance of the states at both ends of each link, with each other and with the
    parameters. joint (B, s + s + m, s + s + m): covariance of the first state, the last state and the parameters."""
    s, width = reduced.s, joint.shape[1]
    ends = np.r_[:s, 2 * s : 3 * s]  # rows of the two outer states of two links, which have three states
    all_but_inner = np.r_[ends, 3 * s : width + s]
    found, common = joint[:, None, : 2 * s], joint[:, None, 2 * s :]
    for gain, own in zip(reversed(reduced.gains), reversed(reduced.covariances), strict=True):
        count = gain.shape[1]
        split = found[:, :count]
        below = np.repeat(common, count, axis=1)
        below[..., : 2 * s] = split[..., 2 * s :].transpose(0, 1, 3, 2)
        # covariance of the inner state with the ends and the parameters
        inner = -np.matmul(gain[..., :-1], np.concatenate((split, below), axis=2))
        three = np.empty((len(found), count, 3 * s, width + s))
        three[:, :, ends[:, None], all_but_inner] = split
        three[:, :, s : 2 * s, all_but_inner] = inner
        three[:, :, ends, s : 2 * s] = inner[..., : 2 * s].transpose(0, 1, 3, 2)
        three[:, :, s : 2 * s, s : 2 * s] = own - np.matmul(inner, gain[..., :-1].transpose(0, 1, 3, 2))
        first = np.delete(three[:, :, : 2 * s], np.s_[2 * s : 3 * s], axis=3)
        finer = np.stack((first, three[:, :, s:, s:]), axis=2)
        found = np.concatenate((finer.reshape(len(found), 2 * count, 2 * s, width), found[:, count:]), axis=1)
    return found


@dataclass
class RandomWalks:
    """The parameters' random walks under G hypotheses.

    prior (G, m, m + 1): normal equations of the first block's parameters. variance (G, B - 1, m): process noise, the
    variance of the parameters' change from block to block. between (B - 1, m): the change from block to block in the
    values at which the equations were linearised.
    """

    prior: Array
    variance: Array
    between: Array


def _chains(blocks: Reduced, walks: RandomWalks) -> tuple[Reduced, Array, Array]:
    """Build G chains of blocks. The n = s + m values of a state are a block's first state and its parameters. The
    values after the last block are a copy.

    Returns the chains, the normal equations (G, 2 n, 2 n + 1) of both ends of each chain, and minus twice the
    log-likelihood (G), up to a constant common to all hypotheses.
    """
    (count, width), s = blocks.left.shape[:2], blocks.s
    hypotheses, n = len(walks.prior), width - s
    links = np.zeros((hypotheses, count, 2 * n, 2 * n + 1))
    place = np.r_[:s, n : n + s, s:n]
    links[:, :, place[:, None], np.r_[place, 2 * n]] = blocks.left
    weight, change = np.ones((hypotheses, count, n - s)), np.zeros((count, n - s))
    weight[:, :-1], change[:-1] = 1.0 / walks.variance, walks.between
    before, after = np.arange(s, n), np.arange(n + s, 2 * n)
    for one, other, sign in ((before, after, -1.0), (after, before, 1.0)):
        links[:, :, one, one] += weight
        links[:, :, one, other] -= weight
        links[:, :, one, -1] += sign * weight * change
    reduced = _reduced(links, np.sum(weight * change**2, axis=(1, 2))[:, None, None])
    ends, prior = reduced.left, walks.prior[..., :-1]
    ends[:, s:n, s:n] += prior
    ends[:, s:n, -1] += walks.prior[..., -1]
    misfit = reduced.residual + _squared(prior, walks.prior[..., -1:]) - _squared(ends[..., :-1], ends[..., -1:])
    log_determinant = reduced.log_determinant + np.linalg.slogdet(ends[..., :-1])[1] - np.linalg.slogdet(prior)[1]
    return reduced, ends, misfit + log_determinant - np.sum(np.log(weight), axis=(1, 2))


def _squared(information: Array, gradient: Array) -> Array:
    """(G): the gradients (G, k, 1) squared, in the metric of the covariance."""
    return np.sum(gradient * np.linalg.solve(information, gradient), axis=(1, 2))


def minus_two_log_likelihood(blocks: Reduced, walks: RandomWalks) -> Array:
    """(G): minus twice the log-likelihood of the readings under each hypothesis, up to a constant common to all."""
    return _chains(blocks, walks)[2]


def solve(blocks: Reduced, walks: RandomWalks, weight: Array) -> tuple[Array, Array]:
    """The posterior mean over the hypotheses with these weights (G): changes of the states (B, K + 1, s), in which the
    state between two blocks appears twice, and of the parameters (B, m). Raises LinAlgError."""
    reduced, ends, _ = _chains(blocks, walks)
    mean = np.einsum("g,gbi->bi", weight, _first_states(reduced, ends))
    states, parameters = mean[:, : blocks.s], mean[:-1, blocks.s :]
    return back(blocks, np.stack((states[:-1], states[1:]), axis=1), parameters), parameters


def posterior_covariance(blocks: Reduced, walks: RandomWalks, weight: Array) -> Array:
    """(B, s + s + m, s + s + m): covariance of each block's first state, its last state and its parameters. It is
    the covariance within the hypotheses plus the covariance between their means."""
    reduced, ends, _ = _chains(blocks, walks)
    s, n = blocks.s, reduced.s
    states = _first_states(reduced, ends)
    off = np.concatenate((states[:, :-1], states[:, 1:]), axis=2)
    off -= np.einsum("g,gbi->bi", weight, off)
    within = covariances(reduced, np.linalg.inv(ends[..., :-1]).astype(float))
    whole = np.einsum("g,gbij->bij", weight, within + off[..., :, None] * off[..., None, :])
    kept = np.r_[:s, n : n + s, s:n]
    return whole[:, kept[:, None], kept]


def _first_states(reduced: Reduced, ends: Array) -> Array:
    """(G, B + 1, n): the changes of all states of the chains, from the normal equations of their ends."""
    change = np.linalg.solve(ends[..., :-1], -ends[..., -1:]).astype(float)
    return back(reduced, change.reshape(len(ends), 2, reduced.s), np.zeros((len(ends), 0)))
