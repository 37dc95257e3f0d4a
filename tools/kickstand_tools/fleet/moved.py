"""Mounts that were turned, by a few degrees or by many, between two logs or during one.

The firmware refuses a drive only where the mount surely moved, by some 7 to 30 degrees. Here all logs of a mount are
compared with one another: for every moment, how the sensor sat before it with how it sits after it. The uncertainty
comes from a jackknife over blocks of some seconds, to which is added what roads do: a slope that lasts through a log
looks like a pitch of the sensor.
"""

from dataclasses import dataclass

import numpy as np

from ..logs.table import Array
from .evidence import Blocks, Intervals, blocks, fits, frames

LEAST_DEG = 3.4  # smaller turns are within what roads do
BETWEEN_SIGMAS, WITHIN_SIGMAS = 3.6, 4.5  # within a log there are many moments to choose from
SUDDEN_SIGMAS = 3.9  # within a log, where the vertical jumps at that moment
DOUBTED_SHARE = 0.7  # of these sigmas is enough where the firmware has its doubts about the mount, too
# What roads do to each side of the comparison, 1 sigma in degrees: pitch, yaw and roll (about left, up, forward)
ROAD_DEG = np.array([0.75, 0.45, 0.5])
REACH = 75  # blocks on each side that are compared: ten minutes
LEAST_BLOCKS = 7
LEAST_VARIED = 0.2  # g^2 s of braking, speeding up and turning on each side, for a forward
# A few blocks that happen to agree make the jackknife optimistic: of yaw this is added, 1 sigma in degrees at 1 g^2 s
YAW_PRIOR_DEG = 1.5
SURELY_DEG = 8.0  # no two slopes of a road differ by more; less has to happen at once if it is during a log
TILT_DEG = 2.2  # a turn about the vertical has no more tilt than this
STEP_S, STEP_GAP_S = 8.0, 1.0  # on each side of the moment, for the change at once
STEP_SHARE = 0.5  # of the tilt that has to be in it


@dataclass
class Move:
    """log: index of the log; at_s: seconds from its beginning, None where it happened before the log. turn_deg (3):
    how the sensor turned, a rotation vector along the vehicle's left, up and forward; sigma_deg (3)."""

    log: int
    at_s: float | None
    turn_deg: Array
    sigma_deg: Array

    @property
    def angle_deg(self) -> float:
        return float(np.linalg.norm(self.turn_deg))

    @property
    def angle_sigma_deg(self) -> float:
        """Standard deviation of angle_deg."""
        return float(np.linalg.norm(self.turn_deg * self.sigma_deg) / max(self.angle_deg, 1e-9))

    @property
    def tilt_deg(self) -> float:
        """By how much the vertical turned."""
        return float(np.hypot(self.turn_deg[0], self.turn_deg[2]))

    @property
    def sigmas(self) -> float:
        return float(np.linalg.norm(self.turn_deg / self.sigma_deg))


def find_moves(logs: list[Intervals], doubted: bool = False) -> list[Move]:
    """Where the mount turned, in the order of time. logs: the intervals of each. doubted: the firmware found parts of
    the drive that differ."""
    return _search(logs, blocks(logs), DOUBTED_SHARE if doubted else 1.0)


def _search(logs: list[Intervals], whole: Blocks, share: float) -> list[Move]:
    count = len(whole.log)
    best: tuple[float, int, Move] | None = None
    for at in range(LEAST_BLOCKS, count - LEAST_BLOCKS + 1):
        turned = compare(whole.part(slice(max(0, at - REACH), at)), whole.part(slice(at, at + REACH)))
        if turned is None:
            continue
        turn, sigma = turned
        between = whole.log[at] != whole.log[at - 1]
        move = Move(int(whole.log[at]), None if between else float(whole.t_s[at]), turn, sigma)
        tilted = move.tilt_deg >= TILT_DEG
        score = move.sigmas / share / (BETWEEN_SIGMAS if between else SUDDEN_SIGMAS if tilted else WITHIN_SIGMAS)
        if move.angle_deg < LEAST_DEG or score < 1.0 or (best and score <= best[0]):
            continue
        if not between and tilted:
            moment = _moment(logs[move.log], move)
            if moment is None:
                continue
            move.at_s = moment
        best = score, at, move
    if best is None:
        return []
    _, at, move = best
    return [*_search(logs, whole.part(slice(0, at)), share), move, *_search(logs, whole.part(slice(at, count)), share)]


def compare(before: Blocks, after: Blocks) -> tuple[Array, Array] | None:
    """How the mount turned from the one to the other, and its sigma (3 each, degrees along left, up, forward). None if
    one of them tells too little."""
    one, other = _known(before), _known(after)
    if one is None or other is None:
        return None
    turn = np.degrees(rotation_vector(other[0] @ one[0].T))
    return turn, np.sqrt(one[1] + other[1] + 2.0 * ROAD_DEG**2)


def _known(part: Blocks) -> tuple[Array, Array] | None:
    """How the sensor sits (3, 3), and the variance (3, degrees^2) of that by leaving out each block in turn."""
    square, product = np.sum(part.square, axis=0), np.sum(part.product, axis=0)
    found, varied = fits(square, product)
    if np.sum(varied) < LEAST_VARIED:
        return None
    frame = frames(found, varied)
    others = frames(*fits(square - part.square, product - part.product))
    off = np.degrees(rotation_vector(others @ frame.T))
    n = len(off)
    variance = (n - 1) / n * np.sum(off * off, axis=0)
    variance[1] += YAW_PRIOR_DEG**2 / float(np.sum(varied))
    return frame, variance


def _moment(log: Intervals, move: Move) -> float | None:
    """When in the log the vertical jumped, in s. None if it did not, and a slope of the road may be the reason."""
    tilt = move.tilt_deg
    if move.at_s is None:
        return None
    used = log.weight > 0.0
    time, terms, force = log.t_s[used], log.terms[used], log.force[used]
    near = np.abs(time - move.at_s) < 60.0
    if np.count_nonzero(near) < 10:
        return None
    found, _ = fits(terms[near].T @ terms[near], terms[near].T @ force[near])
    level = (force - terms[:, 1:] @ found[1:]) / terms[:, :1]  # what is left is the vertical
    best, moment = 0.0, move.at_s
    for now in time[np.abs(time - move.at_s) < 2.5 * STEP_S]:
        early = (time > now - STEP_GAP_S - STEP_S) & (time < now - STEP_GAP_S)
        late = (time > now + STEP_GAP_S) & (time < now + STEP_GAP_S + STEP_S)
        if np.count_nonzero(early) < 3 or np.count_nonzero(late) < 3:
            continue
        step = np.degrees(np.linalg.norm(np.median(level[late], axis=0) - np.median(level[early], axis=0)))
        if step > best:
            best, moment = float(step), float(now)
    return moment if best > STEP_SHARE * tilt or tilt > SURELY_DEG else None


def rotation_vector(turn: Array) -> Array:
    """(..., 3) rad of rotations (..., 3, 3), each under 180 degrees."""
    axis = np.stack(
        (turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]), -1
    )
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(sine, np.trace(turn, axis1=-2, axis2=-1)[..., None] - 1.0)
    return axis / np.maximum(sine, 1e-12) * angle
