"""Least squares with a chain of states, many stretches of it at the same time.

The windows of a ride are laid side by side as B blocks of K windows. Within each block the states are eliminated from
its begin to its end, for all blocks in one array operation. What is left of a block ties its first state and its
parameters to the first state of the next one: a short chain, which is solved from block to block. The result is that of
the whole chain at once, no block knows less than another, and the loops are short.

Unknowns of a block: its states x_0 ... x_K (s each) and its parameters p (m). x_K is the next block's x_0. Parameters
may drift from block to block. By how much is believed in several ways at once, of which the chain tells how likely
each makes the readings.
"""

from dataclasses import dataclass

import numpy as np

from ..logs.table import Array


@dataclass
class Eliminated:
    """Blocks without their inner states. gains (K - 1, B, s, s + s + m + 1): each inner state is minus this times the
    next state, the block's first one, its parameters and 1. covariances (K - 1, B, s, s): of what that leaves open.
    left (B, s + s + m, s + s + m + 1): the normal equations of x_K, x_0, p; the last column is the gradient."""

    gains: Array
    covariances: Array
    left: Array


def eliminate(slopes: Array, s: int) -> Eliminated:
    """slopes (K, B, r, s + s + m + 1): derivatives of a window's residuals by its first state, its last one and the
    parameters, and the residuals themselves."""
    count, blocks, _, width = slopes.shape
    known = np.zeros((blocks, width, width))  # of x_k, x_0, p, 1: what the windows before k say
    first = np.matmul(slopes[0].transpose(0, 2, 1), slopes[0])
    order = np.r_[s : 2 * s, 0:s, 2 * s : width]  # x_1, x_0, p, 1
    known[:] = first[:, order][:, :, order]
    gains = np.empty((count - 1, blocks, s, width))
    covariances = np.empty((count - 1, blocks, s, s))
    rest = np.r_[0:s, 2 * s : width]  # x_k+1, p, 1 in the order of what is left
    for k in range(1, count):
        normal = np.matmul(slopes[k].transpose(0, 2, 1), slopes[k])
        inner = normal[:, :s, :s] + known[:, :s, :s]
        across = np.empty((blocks, s, width))
        across[:, :, :s] = normal[:, :s, s : 2 * s]
        across[:, :, s:] = known[:, :s, s:]
        across[:, :, 2 * s :] += normal[:, :s, 2 * s :]
        covariance = np.linalg.inv(inner)
        gain = np.matmul(covariance, across)
        after = -np.matmul(across.transpose(0, 2, 1), gain)
        after[:, s:, s:] += known[:, s:, s:]
        after[:, rest[:, None], rest] += normal[:, s:, s:]
        known = after
        gains[k - 1], covariances[k - 1] = gain, covariance
    return Eliminated(gains, covariances, known[:, :-1])


@dataclass
class Chain:
    """first (B + 1, s): change of each block's first state, and of the last state of all. parameters (B, m): their
    changes. joint (B, s + s + m, s + s + m): covariance of each block's x_K, x_0, p."""

    first: Array
    parameters: Array
    joint: Array


@dataclass
class Beliefs:
    """What is believed of the parameters besides the windows, in G ways.

    prior (G, m, m + 1): normal equations of the first block's parameters. drift (G, B - 1, m): variances of their
    change from block to block. between (B - 1, m): how far the parameters about which the equations were linearised
    differ from block to block.
    """

    prior: Array
    drift: Array
    between: Array


def _forward(left: Array, s: int, beliefs: Beliefs) -> tuple[list[Array], list[Array], Array, Array]:
    """From block to block: gains and inverses (G, s + m, ...) of each, the normal equations (G, s, s + 1) of the last
    state, and (G): twice the negative logarithm of how likely the ride is, but for a constant."""
    blocks, m = len(left), left.shape[1] - 2 * s
    ways, n = len(beliefs.drift), s + m
    keep = np.r_[s : 2 * s + m]  # x_0, p
    known = np.zeros((ways, n, n + 1))
    known[:, s:, s:] = beliefs.prior
    inside = np.arange(s, n)
    gains, inverses = [], []
    before, pull = beliefs.prior[:, :, :m], beliefs.prior[:, :, m:]
    unlikely = np.sum(pull * np.linalg.solve(before, pull), axis=(1, 2)) - np.linalg.slogdet(before)[1]
    for b in range(blocks):
        whole = left[b]
        inner = whole[np.ix_(keep, keep)] + known[:, :, :n]
        gradient = whole[keep, -1] + known[:, :, n]
        across = np.zeros((ways, n, n + 1))  # by the next block's x_0, p, and 1
        across[:, :, :s], across[:, :, n] = whole[keep, :s], gradient
        known = np.zeros((ways, n, n + 1))
        known[:, :s, :s], known[:, :s, n] = whole[:s, :s], whole[:s, -1]
        if b < blocks - 1:
            weight, gap = 1.0 / beliefs.drift[:, b], beliefs.between[b]
            inner[:, inside, inside] += weight
            across[:, inside, inside] = -weight
            across[:, inside, n] -= weight * gap
            known[:, inside, inside] = weight
            known[:, inside, n] = weight * gap
            unlikely += np.sum(weight * gap**2 - np.log(weight), axis=1)
        inverse = np.linalg.inv(inner)
        gain = inverse @ across
        gains.append(gain)
        inverses.append(inverse)
        known -= across[:, :, :n].transpose(0, 2, 1) @ gain
        unlikely += np.linalg.slogdet(inner)[1] - np.sum(across[:, :, n] * gain[:, :, n], axis=1)
    end = known[:, :s, :s]
    solved = np.linalg.solve(end, known[:, :s, n:])[:, :, 0]
    unlikely += np.linalg.slogdet(end)[1] - np.sum(solved * known[:, :s, n], axis=1)
    return gains, inverses, known[:, :s], unlikely


def unlikelihood(left: Array, s: int, beliefs: Beliefs) -> Array:
    """(G): twice the negative logarithm of how likely the ride is by each of the beliefs, but for what they share."""
    return _forward(left, s, beliefs)[3]


def solve_chains(left: Array, s: int, beliefs: Beliefs) -> list[Chain]:
    """What is found by each of the beliefs. left: of eliminate()."""
    gains, inverses, last, _ = _forward(left, s, beliefs)
    return [
        _backward([one[g] for one in gains], [one[g] for one in inverses], last[g], s) for g in range(len(last))
    ]


def _backward(gains: list[Array], inverses: list[Array], last: Array, s: int) -> Chain:
    blocks, n = len(gains), len(gains[0])
    end = np.linalg.inv(last[:, :s])
    first, parameters = np.empty((blocks + 1, s)), np.empty((blocks, n - s))
    joint = np.empty((blocks, s + n, s + n))
    first[blocks] = -end @ last[:, -1]
    following = np.concatenate((first[blocks], np.zeros(n - s)))
    spread = np.zeros((n, n))
    spread[:s, :s] = end
    for b in range(blocks - 1, -1, -1):
        gain = gains[b][:, :n]
        here = -gain @ following - gains[b][:, n]
        cross = -gain @ spread
        covariance = inverses[b] - cross @ gain.T
        joint[b, :s, :s], joint[b, s:, :s], joint[b, :s, s:] = spread[:s, :s], cross[:, :s], cross[:, :s].T
        joint[b, s:, s:] = covariance
        first[b], parameters[b] = here[:s], here[s:]
        following, spread = here, covariance
    return Chain(first, parameters, joint)


def mixed(chains: list[Chain], share: Array) -> Chain:
    """The chains put together by their shares, whose sum is 1: their mean, as unsure as they are and differ."""
    first = np.einsum("g,gbi->bi", share, [one.first for one in chains])
    parameters = np.einsum("g,gbi->bi", share, [one.parameters for one in chains])
    joint = np.zeros_like(chains[0].joint)
    for weight, one in zip(share, chains):
        off_first, off_parameters = one.first - first, one.parameters - parameters
        off = np.concatenate((off_first[1:], off_first[:-1], off_parameters), axis=1)
        joint += weight * (one.joint + off[:, :, None] * off[:, None, :])
    return Chain(first, parameters, joint)


def back(eliminated: Eliminated, chain: Chain) -> Array:
    """(K + 1, B, s): the changes of all states of each block."""
    gains, s = eliminated.gains, chain.first.shape[1]
    states = np.empty((len(gains) + 2, len(chain.parameters), s))
    states[0], states[-1] = chain.first[:-1], chain.first[1:]
    common = np.concatenate((chain.first[:-1], chain.parameters, np.ones((len(chain.parameters), 1))), axis=1)
    fixed = np.einsum("kbij,bj->kbi", gains[:, :, :, s:], common)
    for k in range(len(gains), 0, -1):
        states[k] = -np.matmul(gains[k - 1, :, :, :s], states[k + 1][:, :, None])[:, :, 0] - fixed[k - 1]
    return states


def variances(eliminated: Eliminated, chain: Chain) -> Array:
    """(K + 1, B, s): of all states of each block."""
    gains, joint, s = eliminated.gains, chain.joint, chain.first.shape[1]
    found = np.empty((len(gains) + 2, len(joint), s))
    found[0] = np.einsum("bii->bi", joint[:, s : 2 * s, s : 2 * s])
    found[-1] = np.einsum("bii->bi", joint[:, :s, :s])
    common = joint[:, s:, s:]
    spread = joint.copy()  # of x_k+1, x_0, p
    for k in range(len(gains), 0, -1):
        gain = gains[k - 1, :, :, :-1]
        row = -np.matmul(gain, spread)  # x_k with x_k+1, x_0, p
        own = eliminated.covariances[k - 1] - np.matmul(row, gain.transpose(0, 2, 1))
        found[k] = np.einsum("bii->bi", own)
        spread = np.empty_like(joint)
        spread[:, :s, :s], spread[:, :s, s:] = own, row[:, :, s:]
        spread[:, s:, :s], spread[:, s:, s:] = row[:, :, s:].transpose(0, 2, 1), common
    return found
