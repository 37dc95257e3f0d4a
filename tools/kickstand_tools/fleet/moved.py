"""Mounts that were turned, by a few degrees or by many, between two logs or during one.

The firmware refuses a drive only where the mount surely moved, by some 7 to 30 degrees. Here all logs of a mount are
compared with one another: for every moment, how the sensor sat before it with how it sits after it. A turn that tilts
the sensor shows in gravity. One about the vertical shows in braking and in turns only, and in the direction in which
the vehicle sways on its springs, which needs neither. The uncertainty comes from a jackknife over blocks of some
seconds, to which is added what lasts longer: slopes of a road and, from one log to another, load and temperature.
"""

from dataclasses import dataclass

import numpy as np

from ..logs.table import Array
from ..signals.rotations import rotation_vector
from . import evidence
from .evidence import Blocks, Intervals, blocks, fits, frames

LEAST_DEG = 3.2  # smaller turns are within what roads, load and temperature do
BETWEEN_SIGMAS, WITHIN_SIGMAS = 3.3, 4.3  # within a log there are many moments to choose from
SUDDEN_SIGMAS = 3.8  # within a log, where the vertical jumps at that moment
SUSPECTED_SHARE = 0.7  # of these sigmas is enough where the firmware suspects the mount, too
# What lasts on each side of the comparison, 1 sigma in degrees: pitch, yaw and roll (about left, up, forward), during a
# log and from one log to another
ROAD_DEG = np.array([0.5, 0.25, 0.35])
OTHER_ROAD_DEG = np.array([0.75, 0.7, 0.5])
REACH = 75  # blocks on each side that are compared: ten minutes
LEAST_BLOCKS = 7
LEAST_VARIED = 0.2  # g^2 s of braking, speeding up and turning on each side, for a forward
# A few blocks that happen to agree make the jackknife optimistic: of yaw this is added, 1 sigma in degrees at 1 g^2 s
YAW_PRIOR_DEG = 0.4
# The direction of sway: what roads do to it on each side, 1 sigma in degrees; where both sides together know it worse
# than SWAY_WORST_DEG, or it contradicts the braking by more than SWAY_SIGMAS, it is not used
SWAY_DEG, SWAY_WORST_DEG, SWAY_SIGMAS = 0.7, 5.0, 3.0
SURELY_DEG = 8.0  # no two slopes of a road differ by more; less has to happen at once if it is during a log
TILT_DEG = 2.2  # a turn about the vertical has no more tilt than this
STEP_S, STEP_GAP_S = 8.0, 1.0  # on each side of the moment, for the change at once
STEP_SHARE = 0.7  # of the tilt that has to be in it


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


def find_moves(logs: list[Intervals], suspected: bool = False) -> list[Move]:
    """Where the mount turned, in the order of time. logs: the intervals of each. suspected: the firmware found parts of
    the drive that differ."""
    return _search(logs, blocks(logs), SUSPECTED_SHARE if suspected else 1.0)


def _search(logs: list[Intervals], whole: Blocks, share: float) -> list[Move]:
    count = len(whole.log)
    best: tuple[float, int, Move] | None = None
    for at in range(LEAST_BLOCKS, count - LEAST_BLOCKS + 1):
        between = whole.log[at] != whole.log[at - 1]
        turned = compare(*_sides(whole, at, between))
        if turned is None:
            continue
        turn, sigma = turned
        move = Move(int(whole.log[at]), None if between else float(whole.t_s[at]), turn, sigma)
        tilted = move.tilt_deg >= TILT_DEG
        score = move.sigmas / share / (BETWEEN_SIGMAS if between else SUDDEN_SIGMAS if tilted else WITHIN_SIGMAS)
        if move.angle_deg < LEAST_DEG or score < 1.0 or (best and score <= best[0]):
            continue
        if not between and tilted and abs(turn[1]) < WITHIN_SIGMAS * sigma[1]:  # a slope of the road has no yaw
            moment = _moment(logs[move.log], move)
            if moment is None:
                continue
            move.at_s = moment
        best = score, at, move
    if best is None:
        return []
    _, at, move = best
    return [*_search(logs, whole.part(slice(0, at)), share), move, *_search(logs, whole.part(slice(at, count)), share)]


def _sides(whole: Blocks, at: int, between: bool) -> tuple[Blocks, Blocks]:
    """What is compared: two logs and those around them or, where it is during a log, nothing but this log."""
    if between:
        return whole.part(slice(max(0, at - REACH), at)), whole.part(slice(at, at + REACH))
    first, last = np.searchsorted(whole.log, [whole.log[at], whole.log[at] + 1])
    # the block in which it happens is on neither side
    return whole.part(slice(max(first, at - REACH), at)), whole.part(slice(at + 1, min(last, at + 1 + REACH)))


def compare(before: Blocks, after: Blocks) -> tuple[Array, Array] | None:
    """How the mount turned from the one to the other, and its sigma (3 each, degrees along left, up, forward). None if
    one of them shows too little."""
    if min(len(before.log), len(after.log)) < LEAST_BLOCKS:
        return None
    one, other = _known(before), _known(after)
    if one is None or other is None:
        return None
    turn = np.degrees(rotation_vector(other.frame @ one.frame.T))
    road = ROAD_DEG if before.log[-1] == after.log[0] else OTHER_ROAD_DEG
    variance = one.variance + other.variance + 2.0 * road**2
    # The frames' errors of yaw show in the direction of the sway, which does not know them: a second opinion
    swayed = one.sway_variance + other.sway_variance + 2.0 * SWAY_DEG**2
    error = (other.sway_deg - one.sway_deg + 90.0) % 180.0 - 90.0
    if swayed < SWAY_WORST_DEG**2 and error**2 < SWAY_SIGMAS**2 * (swayed + variance[1]):
        turn[1] -= error * variance[1] / (variance[1] + swayed)
        variance[1] *= swayed / (variance[1] + swayed)
    return turn, np.sqrt(variance)


@dataclass
class _Known:
    """How the sensor sits, frame (3, 3), with the variance (3, degrees^2) of that; the direction of the sway in it."""

    frame: Array
    variance: Array
    sway_deg: float
    sway_variance: float


def _known(part: Blocks) -> _Known | None:
    """Variances come from leaving out each block in turn."""
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
    sway = np.sum(part.sway, axis=0)
    sway_deg = float(evidence.sway_deg(sway, frame))
    off = (evidence.sway_deg(sway - part.sway, frame) - sway_deg + 90.0) % 180.0 - 90.0
    return _Known(frame, variance, sway_deg, (n - 1) / n * float(off @ off) if np.any(sway) else np.inf)


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
    found, varied = fits(terms[near].T @ terms[near], terms[near].T @ force[near])
    level = (force - terms[:, 1:] @ found[1:]) / terms[:, :1]  # what is left is the vertical
    left, _, forward = frames(found, varied)
    tips = (left * move.turn_deg[2] - forward * move.turn_deg[0]) / tilt  # where up goes as the sensor turns so
    best, moment = 0.0, move.at_s
    for now in time[np.abs(time - move.at_s) < 2.5 * STEP_S]:
        early = (time > now - STEP_GAP_S - STEP_S) & (time < now - STEP_GAP_S)
        late = (time > now + STEP_GAP_S) & (time < now + STEP_GAP_S + STEP_S)
        if np.count_nonzero(early) < 3 or np.count_nonzero(late) < 3:
            continue
        step = np.degrees((np.median(level[late], axis=0) - np.median(level[early], axis=0)) @ tips)
        if step > best:
            best, moment = float(step), float(now)
    return moment if best > STEP_SHARE * tilt or tilt > SURELY_DEG else None
