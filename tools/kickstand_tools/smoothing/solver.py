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
    """Blocks without their inner states. gains (B, K - 1, s, s + s + m + 1): each inner state is minus this times the
    next state, the block's first one, its parameters and 1. covariances (B, K - 1, s, s): of what that leaves open.
    left (B, s + s + m, s + s + m + 1): the normal equations of x_K, x_0, p; the last column is the gradient."""

    gains: Array
    covariances: Array
    left: Array


def eliminate(slopes: Array, ends: Array) -> Eliminated:
    """slopes (B, K, r, s + m + 1): derivatives of the residuals of a window by its states, the same for its first and
    its last one, and by the parameters, and the residuals. ends (B, K, s): what the derivative of the first s residuals
    by the last state, each by its own, has in addition, and that by the first state has less."""
    (blocks, count, _, width), s = slopes.shape, ends.shape[2]
    ties = np.empty((blocks, count - 1, s, s + width))  # of a state x_k, which is eliminated, to x_k+1, x_0, p, 1
    gains, covariances = np.empty_like(ties), np.empty((blocks, count - 1, s, s))
    begin, across, last = _window(slopes[:, 0], ends[:, 0])
    own, tied = last[:, :, :s], np.concatenate((across.transpose(0, 2, 1), last[:, :, s:]), axis=2)
    for k in range(1, count):
        first, across, last = _window(slopes[:, k], ends[:, k])
        tie = ties[:, k - 1]
        tie[:, :, :s], tie[:, :, s:] = across, tied
        tie[:, :, 2 * s :] += first[:, :, s:]
        covariances[:, k - 1] = np.linalg.inv(own + first[:, :, :s])
        gain = np.matmul(covariances[:, k - 1], tie, out=gains[:, k - 1])
        passed = np.matmul(tie[:, :, :s].transpose(0, 2, 1), gain)
        own, tied = last[:, :, :s] - passed[:, :, :s], -passed[:, :, s:]
        tied[:, :, s:] += last[:, :, s:]
    # what ties x_0, p and 1 to each other is a sum over the windows: two large products instead of two a window
    left = np.zeros((blocks, s + width, s + width))
    left[:, :s, :s], left[:, :s, s:], left[:, s:, :s] = own, tied, tied.transpose(0, 2, 1)
    left[:, s : 2 * s, s:], left[:, 2 * s :, s : 2 * s] = begin, begin[:, :, s:].transpose(0, 2, 1)
    common, tie, gain = (_in_rows(one)[:, :, s:] for one in (slopes, ties, gains))
    left[:, 2 * s :, 2 * s :] = np.matmul(common.transpose(0, 2, 1), common)
    left[:, s:, s:] -= np.matmul(tie.transpose(0, 2, 1), gain)
    return Eliminated(gains, covariances, left[:, :-1])


def _in_rows(values: Array) -> Array:
    """(B, K, r, w) -> (B, K r, w)"""
    return values.reshape(len(values), -1, values.shape[-1])


def _window(slopes: Array, ends: Array) -> tuple[Array, Array, Array]:
    """Normal equations of one window of each block: of its first state by itself, p, 1 (B, s, s + m + 1), by the last
    state (B, s, s), and of its last state by itself, p, 1."""
    s = ends.shape[1]
    middle = np.matmul(slopes[:, :, :s].transpose(0, 2, 1), slopes)
    change = ends[:, :, None] * slopes[:, :s]
    turned, square = change[:, :, :s].transpose(0, 2, 1), ends[:, :, None] ** 2 * np.eye(s)
    first, last = middle - change, middle + change
    across = first[:, :, :s] + turned - square
    first[:, :, :s] += square - turned
    last[:, :, :s] += square + turned
    return first, across, last


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
    """From block to block: gains (G, s + m, s + m + 1) and inverses (G, s + m, s + m) of each, the normal equations
    (G, s, s + 1) of the last state, and (G): twice the negative logarithm of how likely the ride is, but for a
    constant."""
    blocks, m = len(left), left.shape[1] - 2 * s
    ways, n = len(beliefs.drift), s + m
    known = np.zeros((ways, n, n + 1))  # of x_0, p, 1
    known[:, s:, s:] = beliefs.prior
    inside = np.arange(s, n)
    gains, inverses = [], []
    before, pull = beliefs.prior[:, :, :m], beliefs.prior[:, :, m:]
    unlikely = np.sum(pull * np.linalg.solve(before, pull), axis=(1, 2)) - np.linalg.slogdet(before)[1]
    for b in range(blocks):
        weight, gap = np.zeros((ways, m)), np.zeros(m)  # what ties p to the next block's
        if b < blocks - 1:
            weight, gap = 1.0 / beliefs.drift[:, b], beliefs.between[b]
            unlikely += np.sum(weight * gap**2 - np.log(weight), axis=1)
        whole = known + left[b, s:, s:]
        gradient = whole[:, :, n]
        gradient[:, s:] -= weight * gap
        inner = whole[:, :, :n]
        inner[:, inside, inside] += weight
        inverse = np.linalg.inv(inner)
        by_last = left[b, :s, s:-1]  # of x_K, which is tied to x_0 and p; the next p to p alone, by -weight
        gain = np.empty((ways, n, n + 1))  # by x_K, the next p, 1
        gain[:, :, :s] = inverse @ by_last.T
        gain[:, :, s:n] = -weight[:, None] * inverse[:, :, s:]
        gain[:, :, n] = (inverse @ gradient[:, :, None])[:, :, 0]
        unlikely += np.linalg.slogdet(inner)[1] - np.sum(gradient * gain[:, :, n], axis=1)
        known[:, :s] = -by_last @ gain
        known[:, :s, :s] += left[b, :s, :s]
        known[:, :s, n] += left[b, :s, -1]
        known[:, s:] = weight[:, :, None] * gain[:, s:]
        known[:, inside, inside] += weight
        known[:, s:, n] += weight * gap
        gains.append(gain)
        inverses.append(inverse)
    end = known[:, :s, :s]
    solved = np.linalg.solve(end, known[:, :s, n:])[:, :, 0]
    unlikely += np.linalg.slogdet(end)[1] - np.sum(solved * known[:, :s, n], axis=1)
    return gains, inverses, known[:, :s, [*range(s), n]], unlikely


def unlikelihood(left: Array, s: int, beliefs: Beliefs) -> Array:
    """(G): twice the negative logarithm of how likely the ride is by each of the beliefs, but for what they share."""
    return _forward(left, s, beliefs)[3]


def solve_chains(left: Array, s: int, beliefs: Beliefs) -> list[Chain]:
    """What is found by each of the beliefs. left: of eliminate()."""
    gains, inverses, last, _ = _forward(left, s, beliefs)
    blocks, (ways, n, _) = len(gains), gains[0].shape
    first, parameters = np.empty((ways, blocks + 1, s)), np.empty((ways, blocks, n - s))
    joint = np.empty((ways, blocks, s + n, s + n))
    following, spread = np.zeros((ways, n, 1)), np.zeros((ways, n, n))  # of the next x_0, p
    spread[:, :s, :s] = np.linalg.inv(last[:, :, :s])
    following[:, :s] = -spread[:, :s, :s] @ last[:, :, s:]
    first[:, blocks] = following[:, :s, 0]
    for b in range(blocks - 1, -1, -1):
        gain = gains[b][:, :, :n]
        cross = -gain @ spread
        joint[:, b, :s, :s], joint[:, b, s:, :s] = spread[:, :s, :s], cross[:, :, :s]
        joint[:, b, :s, s:] = cross[:, :, :s].transpose(0, 2, 1)
        following = -gain @ following - gains[b][:, :, n:]
        spread = joint[:, b, s:, s:] = inverses[b] - cross @ gain.transpose(0, 2, 1)
        first[:, b], parameters[:, b] = following[:, :s, 0], following[:, s:, 0]
    return [Chain(*one) for one in zip(first, parameters, joint)]


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
    """(B, K + 1, s): the changes of all states of each block."""
    gains, s = eliminated.gains, chain.first.shape[1]
    states = np.empty((len(gains), gains.shape[1] + 2, s))
    states[:, 0], states[:, -1] = chain.first[:-1], chain.first[1:]
    common = np.concatenate((chain.first[:-1], chain.parameters, np.ones((len(gains), 1))), axis=1)
    fixed = np.matmul(_in_rows(gains)[:, :, s:], common[:, :, None]).reshape(gains.shape[:3])
    for k in range(gains.shape[1], 0, -1):
        following = states[:, k + 1, :, None]
        states[:, k] = -np.matmul(gains[:, k - 1, :, :s], following)[:, :, 0] - fixed[:, k - 1]
    return states


def variances(eliminated: Eliminated, chain: Chain) -> Array:
    """(B, K + 1, s): of all states of each block."""
    gains, joint, s = eliminated.gains, chain.joint, chain.first.shape[1]
    found = np.empty((len(gains), gains.shape[1] + 2, s))
    found[:, 0] = np.einsum("bii->bi", joint[:, s : 2 * s, s : 2 * s])
    found[:, -1] = np.einsum("bii->bi", joint[:, :s, :s])
    common = joint[:, s:, s:]
    spread = joint.copy()  # of x_k+1, x_0, p
    for k in range(gains.shape[1], 0, -1):
        gain = gains[:, k - 1, :, :-1]
        row = -np.matmul(gain, spread)  # x_k with x_k+1, x_0, p
        own = eliminated.covariances[:, k - 1] - np.matmul(row, gain.transpose(0, 2, 1))
        found[:, k] = np.einsum("bii->bi", own)
        spread = np.empty_like(joint)
        spread[:, :s, :s], spread[:, :s, s:] = own, row[:, :, s:]
        spread[:, s:, :s], spread[:, s:, s:] = row[:, :, s:].transpose(0, 2, 1), common
    return found
