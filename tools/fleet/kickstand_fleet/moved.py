"""Finds mounts that rotated by a few degrees or more, between two logs or during a log.

The firmware refuses a drive only if the mount moved by some 7 to 30 degrees. The module also finds smaller rotations.
At every moment in all logs of a mount, the module compares the alignment before that moment with the alignment after
it.

A rotation that tilts the sensor shows in gravity. A rotation about the vertical shows only in three things: in braking,
in bends, and in the direction in which the vehicle sways on its springs. The sway also shows on a straight road without
braking.

The variance of a rotation comes from a jackknife over blocks of some seconds. This variance does not contain errors
that last longer: slopes of a road and, between two logs, changes of load and temperature. Their variances are added.
"""

from dataclasses import dataclass

import numpy as np
from kickstand_tools.signals import Array, rotation_vector

from . import evidence
from .evidence import Blocks, Intervals, alignment, blocks, fits, frames

LEAST_DEG = 3.2  # smallest rotation that is reported. Roads, load and temperature can look like smaller rotations
# Smallest rotation that is reported, in standard deviations. The limit is higher within a log than between two logs,
# because a log has many moments, and one of them may exceed a low limit by chance
BETWEEN_SIGMAS, WITHIN_SIGMAS = 3.3, 4.3
SUDDEN_SIGMAS = 3.8  # the limit within a log for a moment at which the vertical jumps
# BETWEEN_SIGMAS, WITHIN_SIGMAS and SUDDEN_SIGMAS are multiplied by this value if the firmware suspects that the mount
# moved
SUSPECTED_SHARE = 0.7
# Standard deviations, in degrees, of the errors that are constant before the moment or after it. The three values are
# for pitch, yaw and roll (about left, up and forward). ROAD_DEG is for two parts of one log, OTHER_ROAD_DEG for two
# logs
ROAD_DEG = np.array([0.5, 0.25, 0.35])
OTHER_ROAD_DEG = np.array([0.75, 0.7, 0.5])
REACH = 75  # number of blocks compared on each side of a moment, about ten minutes
LEAST_BLOCKS = 7
# Forward is computed on one side of a moment if braking, speeding up and bends vary by at least this much, in g^2 s
LEAST_VARIED = 0.2
# The jackknife underestimates the variance if a few blocks agree by chance. So the yaw gets an additional standard
# deviation. YAW_PRIOR_DEG is this standard deviation at a variation of 1 g^2 s
YAW_PRIOR_DEG = 0.4
# SWAY_DEG is the standard deviation, in degrees, of the direction of sway on each side of a moment, caused by the
# roads. The sway is not used if its standard deviation over both sides is above SWAY_WORST_DEG. The sway is also not
# used if it contradicts the braking by more than SWAY_SIGMAS standard deviations
SWAY_DEG, SWAY_WORST_DEG, SWAY_SIGMAS = 0.7, 5.0, 3.0
# A tilt larger than this within a log, in degrees, is reported even if it is gradual. The slopes of roads differ by
# less than SURELY_DEG
SURELY_DEG = 8.0
TILT_DEG = 2.2  # a rotation with a smaller tilt, in degrees, counts as a rotation about the vertical
# To find a jump, the vertical during the STEP_S before a moment is compared with the vertical during the STEP_S after
# it. The readings within STEP_GAP_S of the moment are left out
STEP_S, STEP_GAP_S = 8.0, 1.0
STEP_SHARE = 0.7  # a tilt is sudden if more than this share of the tilt happens at one moment


@dataclass
class Move:
    log: int  # index of the log in which the mount rotated, or of the first log after the rotation
    # Time of the rotation from the beginning of that log. None if the mount rotated before that log.
    at_s: float | None
    turn_deg: Array  # rotation vector along the vehicle's left, up and forward, shape (3)
    sigma_deg: Array  # standard deviations of turn_deg, shape (3)

    @property
    def angle_deg(self) -> float:
        return float(np.linalg.norm(self.turn_deg))

    @property
    def angle_sigma_deg(self) -> float:
        return float(np.linalg.norm(self.turn_deg * self.sigma_deg) / max(self.angle_deg, 1e-9))

    @property
    def tilt_deg(self) -> float:
        """The angle by which the vertical changed."""
        return float(np.hypot(self.turn_deg[0], self.turn_deg[2]))

    @property
    def sigmas(self) -> float:
        return float(np.linalg.norm(self.turn_deg / self.sigma_deg))


def find_moves(logs: list[Intervals], suspected: bool = False) -> list[Move]:
    """Find the rotations of the mount in the intervals of each log, in chronological order.

    suspected: True if the firmware found that two parts of the drive differ.
    """
    return _search(logs, blocks(logs), SUSPECTED_SHARE if suspected else 1.0)


def _search(logs: list[Intervals], driving: Blocks, share: float) -> list[Move]:
    """Find the surest move, and then those before it and after it. share: of the limits, see SUSPECTED_SHARE."""
    count = len(driving.log)
    best_index, best_score, best = 0, 0.0, None
    for index in range(LEAST_BLOCKS, count - LEAST_BLOCKS + 1):
        move = _move_at(driving, index)
        if move is None or move.angle_deg < LEAST_DEG:
            continue
        tilted = move.tilt_deg >= TILT_DEG
        limit = BETWEEN_SIGMAS if move.at_s is None else SUDDEN_SIGMAS if tilted else WITHIN_SIGMAS
        score = move.sigmas / share / limit
        if score < 1.0 or score <= best_score:
            continue
        # A slope of the road looks like a tilt without a change of yaw. So a tilt without a change of yaw is reported
        # only if it is sudden
        _, yaw_deg, _ = np.abs(move.turn_deg)
        if move.at_s is not None and tilted and yaw_deg < WITHIN_SIGMAS * move.sigma_deg[1]:
            move.at_s = _moment_of_jump(logs[move.log], move, move.at_s)
            if move.at_s is None:
                continue
        best_index, best_score, best = index, score, move
    if best is None:
        return []
    earlier, later = driving.part(slice(0, best_index)), driving.part(slice(best_index, count))
    return [*_search(logs, earlier, share), best, *_search(logs, later, share)]


def _move_at(driving: Blocks, index: int) -> Move | None:
    """Compare the blocks before block number `index` with those after it. None if a side shows no alignment."""
    between = driving.log[index] != driving.log[index - 1]
    turned = turn_between(*_sides(driving, index, between))
    return turned and Move(int(driving.log[index]), None if between else float(driving.t_s[index]), *turned)


def _sides(driving: Blocks, index: int, between: bool) -> tuple[Blocks, Blocks]:
    """Return the blocks before and after block number `index`: of all logs if `between` logs, else of one log."""
    if between:
        return driving.part(slice(max(0, index - REACH), index)), driving.part(slice(index, index + REACH))
    first, last = np.searchsorted(driving.log, [driving.log[index], driving.log[index] + 1])
    # The block in which the rotation happens is left out on both sides
    earlier = slice(max(first, index - REACH), index)
    return driving.part(earlier), driving.part(slice(index + 1, min(last, index + 1 + REACH)))


def turn_between(first: Blocks, second: Blocks) -> tuple[Array, Array] | None:
    """Measure by how much the mount rotated between two groups of blocks.

    Returns the rotation vector along left, up and forward and its standard deviations, shape (3) each, in degrees.
    None if one of the groups does not determine an alignment.
    """
    if min(len(first.log), len(second.log)) < LEAST_BLOCKS:
        return None
    earlier, later = _align_part(first), _align_part(second)
    if earlier is None or later is None:
        return None
    turn = np.degrees(rotation_vector(later.frame @ earlier.frame.T))
    road = ROAD_DEG if first.log[-1] == second.log[0] else OTHER_ROAD_DEG
    variance = earlier.variance + later.variance + 2.0 * road**2
    # The direction of the sway measures the yaw in another way than the frame. An error between the yaws of the two
    # frames makes the sway seem to turn by the same angle
    swayed = earlier.sway_variance + later.sway_variance + 2.0 * SWAY_DEG**2
    error = float(_between_axes_deg(earlier.sway_deg, later.sway_deg))
    if swayed < SWAY_WORST_DEG**2 and error**2 < SWAY_SIGMAS**2 * (swayed + variance[1]):
        turn[1] -= error * variance[1] / (variance[1] + swayed)
        variance[1] *= swayed / (variance[1] + swayed)
    return turn, np.sqrt(variance)


@dataclass
class _PartAlignment:
    frame: Array  # rotation from sensor to vehicle axes, shape (3, 3)
    variance: Array  # variances of pitch, yaw and roll, shape (3), in degrees^2
    sway_deg: float  # direction of the sway, in degrees from forward
    sway_variance: float  # variance of sway_deg, in degrees^2. Infinite without sway.


def _align_part(part: Blocks) -> _PartAlignment | None:
    """Align a part of the drive, with variances by a jackknife over its blocks. None without enough motion."""
    _, varied = fits(np.sum(part.square, axis=0), np.sum(part.product, axis=0))
    if np.sum(varied) < LEAST_VARIED:
        return None
    frame, variance = alignment(part.square, part.product)
    variance[1] += YAW_PRIOR_DEG**2 / float(np.sum(varied))
    sway, count = np.sum(part.sway, axis=0), len(part.sway)
    sway_deg = float(evidence.sway_deg(sway, frame))
    off = _between_axes_deg(sway_deg, evidence.sway_deg(sway - part.sway, frame))
    sway_variance = (count - 1) / count * float(off @ off) if np.any(sway) else np.inf
    return _PartAlignment(frame, variance, sway_deg, sway_variance)


def _between_axes_deg(first_deg: Array | float, second_deg: Array | float) -> Array:
    """Return the angle from one axis to another. An axis has no sign, so the angle is from -90 to 90 degrees."""
    return np.asarray((second_deg - first_deg + 90.0) % 180.0 - 90.0)


def _moment_of_jump(log: Intervals, move: Move, at_s: float) -> float | None:
    """Find the time near at_s at which the vertical jumped. None if it did not: then a slope may cause the tilt."""
    tilt = move.tilt_deg
    weighted = log.weight > 0.0
    time, terms, force = log.t_s[weighted], log.terms[weighted], log.force[weighted]
    # The effects of driving, from the minute before the move and the minute after it
    near = np.abs(time - at_s) < 60.0
    if np.count_nonzero(near) < 10:
        return None
    coefficients, varied = fits(terms[near].T @ terms[near], terms[near].T @ force[near])
    # The vertical: the measured force minus the effects of driving
    level = (force - terms[:, 1:] @ coefficients[1:]) / terms[:, :1]
    left, _, forward = frames(coefficients, varied)
    # Unit vector of the direction in which the vertical moves
    tips = (left * move.turn_deg[2] - forward * move.turn_deg[0]) / tilt
    best, moment = 0.0, at_s
    for time_s in time[np.abs(time - at_s) < 2.5 * STEP_S]:
        early = (time > time_s - STEP_GAP_S - STEP_S) & (time < time_s - STEP_GAP_S)
        late = (time > time_s + STEP_GAP_S) & (time < time_s + STEP_GAP_S + STEP_S)
        if np.count_nonzero(early) < 3 or np.count_nonzero(late) < 3:
            continue
        step = np.degrees((np.median(level[late], axis=0) - np.median(level[early], axis=0)) @ tips)
        if step > best:
            best, moment = float(step), float(time_s)
    return moment if best > STEP_SHARE * tilt or tilt > SURELY_DEG else None
