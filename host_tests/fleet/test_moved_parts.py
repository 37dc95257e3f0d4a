"""Rotations between two groups of exact intervals: the angle, the standard deviations, and the limits below which
nothing is found."""

import numpy as np
import pytest
from kickstand_fleet import moved
from kickstand_fleet.evidence import Blocks, Intervals
from made_fleet import turn_of

LEFT, UP, FORWARD = np.eye(3)
MOUNT = turn_of(50.0, (1.0, 2.0, 3.0))  # rotation from the sensor's axes to left, up, forward
NO_SWAY = np.zeros((3, 3))


def part(turn_deg=0.0, axis=UP, count=8, varied=1.0, sway=NO_SWAY, log=0):
    """Return equal blocks of a mount that was rotated by an angle.

    varied: variation of braking in all blocks, in g^2 s. sway: covariance along the vehicle's axes, of each block.
    """
    mount = turn_of(turn_deg, axis) @ MOUNT
    a = np.sqrt(varied / count / 4.0)
    terms = np.array([[1.0, sign * a, other * a, 0.0] for sign in (-1.0, 1.0) for other in (-1e-3, 1e-3)])
    force = terms[:, :3] @ np.array([mount[1], mount[2], mount[0]])
    begin_s = np.linspace(0.0, 8.0 * (count - 1), count)
    return Blocks(
        np.tile(terms.T @ terms, (count, 1, 1)),
        np.tile(terms.T @ force, (count, 1, 1)),
        np.tile(mount.T @ sway @ mount, (count, 1, 1)),
        np.full(count, log),
        begin_s,
        begin_s + 7.0,
    )


def swaying(direction_deg):
    """Return the sway in a horizontal direction, from forward towards left."""
    along = np.cos(np.radians(direction_deg)) * FORWARD + np.sin(np.radians(direction_deg)) * LEFT
    return np.outer(along, along) / 8.0


def compared(before, after):
    found = moved.compare(before, after)
    assert found
    return found


@pytest.mark.parametrize(("axis", "turn_deg"), [(UP, 9.0), (LEFT, -4.0), (FORWARD, 30.0), ((0.6, 0.0, 0.8), 5.0)])
def test_an_exact_rotation_is_measured_exactly(axis, turn_deg):
    turn, _ = compared(part(), part(turn_deg, axis))
    assert turn == pytest.approx(turn_deg * np.array(axis), abs=0.01)


@pytest.mark.parametrize(("log", "road"), [(0, (0.5, 0.25, 0.35)), (1, (0.75, 0.7, 0.5))])
def test_without_noise_the_errors_are_those_of_roads_and_of_chance(log, road):
    """The variances of the errors before and after the move add. Before and after the move, yaw also has an error of
    0.4 degrees at a variation of 1 g^2 s."""
    _, sigma = compared(part(varied=2.0), part(varied=4.0, log=log))
    variance = 2.0 * np.square(road) + [0.0, 0.16 / 2.0 + 0.16 / 4.0, 0.0]
    assert sigma == pytest.approx(np.sqrt(variance), rel=0.001)


def test_noise_in_one_block_is_seen_by_the_jackknife():
    """Pitch of one of eight blocks differs by 4 degrees, so the mean differs by 0.5 degrees."""
    noisy, odd = part(), part(4.0, LEFT)
    noisy.product[3] = odd.product[3]
    _, sigma = compared(part(), noisy)
    # Without the odd block the mean is 0, without another block it is 4/7
    off = np.array([0.5] + [4.0 / 7.0 - 0.5] * 7)
    assert sigma[0] == pytest.approx(np.sqrt(7.0 / 8.0 * np.sum(off**2) + 2.0 * 0.25), rel=0.01)


@pytest.mark.parametrize(("count", "found"), [(6, False), (7, True)])
def test_each_side_needs_seven_blocks(count, found):
    assert (moved.compare(part(count=count), part()) is not None) is found
    assert (moved.compare(part(), part(count=count)) is not None) is found


@pytest.mark.parametrize(("varied", "found"), [(0.199, False), (0.201, True)])
def test_each_side_needs_braking_or_bends(varied, found):
    assert (moved.compare(part(varied=varied), part()) is not None) is found
    assert (moved.compare(part(), part(varied=varied)) is not None) is found


def test_the_sway_measures_yaw_too():
    """The mean of both yaws is weighted by their variances: 0.445 for braking, 0.98 for the sway."""
    braking, road = 2.0 * 0.16 + 2.0 * 0.25**2, 2.0 * 0.7**2
    # The sway keeps its direction relative to the sensor's frame, while braking says 2 degrees
    turn, sigma = compared(part(sway=swaying(80.0)), part(2.0, sway=swaying(82.0)))
    assert turn[1] == pytest.approx(2.0 - 2.0 * braking / (braking + road), abs=0.01)
    assert sigma[1] == pytest.approx(np.sqrt(braking * road / (braking + road)), rel=0.001)
    turn, _ = compared(part(sway=swaying(82.0)), part(2.0, sway=swaying(80.0)))
    assert turn[1] == pytest.approx(2.0 + 2.0 * braking / (braking + road), abs=0.01)
    # Directions of 89 and -89 degrees are 2 degrees apart
    turn, _ = compared(part(sway=swaying(89.0)), part(2.0, sway=swaying(-89.0)))
    assert turn[1] == pytest.approx(2.0 - 2.0 * braking / (braking + road), abs=0.01)


@pytest.mark.parametrize(("apart_deg", "used"), [(3.55, True), (3.62, False), (-3.55, True), (-3.62, False)])
def test_sway_that_contradicts_by_three_standard_deviations_is_not_used(apart_deg, used):
    """Three standard deviations of the difference are 3.58 degrees."""
    _, sigma = compared(part(sway=swaying(40.0)), part(sway=swaying(40.0 + apart_deg)))
    assert bool(sigma[1] < 0.6) is used


def test_uncertain_sway_is_not_used():
    """The directions of the blocks differ, so the direction of their mean has a large error."""
    before, after = part(sway=swaying(0.0)), part(sway=swaying(0.0))
    for k in range(8):
        after.sway[k] = MOUNT.T @ swaying(40.0 * (-1) ** k) @ MOUNT
    _, sigma = compared(before, after)
    assert sigma[1] == pytest.approx(np.sqrt(2.0 * 0.16 + 2.0 * 0.25**2), rel=0.001)


def log_of(seconds, turn_deg=0.0, axis=UP, at_s=0.0):
    """Return the intervals of a log whose mount rotates at at_s."""
    count = int(seconds)
    t_s = np.linspace(0.5, count - 0.5, count)
    a = np.where(np.arange(count) % 4 < 2, -0.2, 0.2)
    c = np.where(np.arange(count) % 6 < 3, -0.1, 0.1)
    terms = np.column_stack((np.ones(count), a, c, np.zeros(count)))
    force = terms[:, :3] @ np.array([MOUNT[1], MOUNT[2], MOUNT[0]])
    turned = turn_of(turn_deg, axis) @ MOUNT
    later = t_s > at_s
    force[later] = terms[later, :3] @ np.array([turned[1], turned[2], turned[0]])
    return Intervals(t_s, force, terms, np.ones(count), np.full(count, 10.0), np.zeros((count, 3, 3)))


def test_nothing_is_found_in_logs_without_a_rotation():
    assert moved.find_moves([log_of(96.0), log_of(96.0)]) == []


@pytest.mark.parametrize(("turn_deg", "count"), [(3.1, 0), (3.3, 1), (-3.3, 1), (20.0, 1)])
def test_rotations_over_three_degrees_are_found_between_logs(turn_deg, count):
    """A rotation about forward has a standard deviation of 0.7 degrees between logs."""
    found = moved.find_moves([log_of(96.0), log_of(96.0, turn_deg, FORWARD)])
    assert [(move.log, move.at_s) for move in found] == [(1, None)] * count
    for move in found:
        assert move.turn_deg == pytest.approx([0.0, 0.0, turn_deg], abs=0.1)


@pytest.mark.parametrize(
    ("sigmas", "suspected", "count"), [(3.2, False, 0), (3.4, False, 1), (3.2, True, 1)]
)  # fmt: skip
def test_a_rotation_between_logs_needs_3_3_standard_deviations(sigmas, suspected, count):
    """Yaw has a standard deviation of about 1 degree between logs."""
    probe = moved.find_moves([log_of(96.0), log_of(96.0, 8.0, UP)])[0]
    angle = sigmas * probe.sigma_deg[1]
    assert angle > moved.LEAST_DEG
    assert len(moved.find_moves([log_of(96.0), log_of(96.0, angle, UP)], suspected)) == count


def test_the_rotations_are_in_the_order_of_time():
    logs = [log_of(180.0, 12.0, UP, 90.0), log_of(96.0, 25.0, UP), log_of(96.0)]
    found = moved.find_moves(logs)
    assert [move.log for move in found] == [0, 1, 2]
    assert [round(move.turn_deg[1]) for move in found[:2]] == [12, 13] and found[2].turn_deg[1] < -15.0
    assert found[0].at_s == pytest.approx(90.0, abs=8.0) and found[1].at_s is found[2].at_s is None


def test_a_yaw_within_a_log_is_found_in_its_block():
    (move,) = moved.find_moves([log_of(180.0, 10.0, UP, 90.0)])
    assert move.at_s == pytest.approx(90.0, abs=8.1) and move.turn_deg == pytest.approx([0.0, 10.0, 0.0], abs=0.5)


def test_the_moment_of_a_tilt_is_known_to_the_second():
    (move,) = moved.find_moves([log_of(180.0, 5.0, LEFT, 90.0)])
    assert move.at_s == pytest.approx(90.0, abs=1.6) and move.turn_deg[0] == pytest.approx(5.0, abs=0.3)


def hill(degrees, seconds=200.0, climb_s=60.0):
    """Return the intervals of a log on a road whose slope changes slowly."""
    log = log_of(seconds)
    for k, t_s in enumerate(log.t_s):
        turned = turn_of(degrees * np.clip((t_s - seconds / 2.0) / climb_s + 0.5, 0.0, 1.0), LEFT) @ MOUNT
        log.force[k] = log.terms[k, :3] @ np.array([turned[1], turned[2], turned[0]])
    return log


@pytest.mark.parametrize(("degrees", "count"), [(5.0, 0), (7.0, 0), (12.0, 1)])
def test_a_slow_tilt_is_a_hill_up_to_eight_degrees(degrees, count):
    assert len(moved.find_moves([hill(degrees)])) == count
