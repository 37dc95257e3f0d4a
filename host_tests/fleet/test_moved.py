"""Rotations of a mount: angle, standard deviation, moment, and the limits below which roads and chance explain them."""

import copy

import numpy as np
import pytest
from exact import FORWARD, LEFT, MOUNT, UP, block_group, drive_intervals, horizontal_sway
from fleet_drives import turn_of
from kickstand_fleet import evidence
from kickstand_fleet.moved import LEAST_DEG, Move, compare, find_moves
from kickstand_tools.calibration.drive import fit_logs, usable
from kickstand_tools.logs.reader import read_log

BRAKING, SWAY_ROAD = 2.0 * 0.16 + 2.0 * 0.25**2, 2.0 * 0.7**2  # variances of both ways to measure yaw, in deg^2


def compared(before, after):
    result = compare(before, after)
    assert result
    return result


@pytest.mark.parametrize(("axis", "turn_deg"), [(UP, 9.0), (LEFT, -4.0), (FORWARD, 30.0), ((0.6, 0.0, 0.8), 5.0)])
def test_an_exact_rotation_is_measured_exactly(axis, turn_deg):
    turn, _ = compared(block_group(), block_group(turn_deg, axis))
    assert turn == pytest.approx(turn_deg * np.array(axis), abs=0.01)


@pytest.mark.parametrize(("log", "road"), [(0, (0.5, 0.25, 0.35)), (1, (0.75, 0.7, 0.5))])
def test_without_noise_the_errors_are_those_of_roads_and_of_chance(log, road):
    """The variances of both sides add. Yaw also has an error of 0.4 degrees at a variation of 1 g^2 s."""
    _, sigma = compared(block_group(varied=2.0), block_group(varied=4.0, log=log))
    assert sigma == pytest.approx(np.sqrt(2.0 * np.square(road) + [0.0, 0.16 / 2.0 + 0.16 / 4.0, 0.0]), rel=0.001)


def test_noise_in_one_block_is_seen_by_the_jackknife():
    """Pitch of one of eight blocks differs by 4 degrees. Without it the mean is 0, without another block it is 4/7."""
    noisy = block_group()
    noisy.product[3] = block_group(4.0, LEFT).product[3]
    _, sigma = compared(block_group(), noisy)
    off = np.array([0.5] + [4.0 / 7.0 - 0.5] * 7)
    assert sigma[0] == pytest.approx(np.sqrt(7.0 / 8.0 * np.sum(off**2) + 2.0 * 0.25), rel=0.01)


@pytest.mark.parametrize(
    ("part", "enough"),
    [({"count": 6}, False), ({"count": 7}, True), ({"varied": 0.199}, False), ({"varied": 0.201}, True)],
)
def test_each_side_needs_seven_blocks_and_braking(part, enough):
    assert (compare(block_group(**part), block_group()) is not None) is enough
    assert (compare(block_group(), block_group(**part)) is not None) is enough


@pytest.mark.parametrize(("before_deg", "after_deg", "sign"), [(80.0, 82.0, -1), (82.0, 80.0, 1), (89.0, -89.0, -1)])
def test_the_sway_measures_yaw_too(before_deg, after_deg, sign):
    """The mean of both yaws is weighted by their variances. Directions of 89 and -89 degrees are 2 degrees apart."""
    before, after = block_group(sway=horizontal_sway(before_deg)), block_group(2.0, sway=horizontal_sway(after_deg))
    turn, sigma = compared(before, after)
    assert turn[1] == pytest.approx(2.0 + sign * 2.0 * BRAKING / (BRAKING + SWAY_ROAD), abs=0.01)
    assert sigma[1] == pytest.approx(np.sqrt(BRAKING * SWAY_ROAD / (BRAKING + SWAY_ROAD)), rel=0.001)


@pytest.mark.parametrize(("apart_deg", "used"), [(3.55, True), (3.62, False), (-3.55, True), (-3.62, False)])
def test_sway_that_contradicts_by_three_deviations_is_ignored(apart_deg, used):
    """Three standard deviations of the difference are 3.58 degrees."""
    _, sigma = compared(block_group(sway=horizontal_sway(40.0)), block_group(sway=horizontal_sway(40.0 + apart_deg)))
    assert bool(sigma[1] < 0.6) is used


@pytest.mark.parametrize(("apart_deg", "used"), [(6.4, True), (9.5, False), (40.0, False)])
def test_sway_with_a_deviation_over_five_degrees_is_ignored(apart_deg, used):
    """Half of the blocks sway to each side of forward. Without one of eight blocks, the mean direction is `off`."""
    groups = block_group(), block_group()
    for group in groups:
        for k in range(8):
            group.sway[k] = MOUNT.T @ horizontal_sway(apart_deg * (-1) ** k) @ MOUNT
    _, sigma = compared(*groups)
    off = np.degrees(0.5 * np.arctan(np.tan(np.radians(2.0 * apart_deg)) / 7.0))
    sway = 2.0 * 7.0 * off**2 + SWAY_ROAD
    assert sigma[1] ** 2 == pytest.approx(BRAKING * sway / (BRAKING + sway) if used else BRAKING, rel=0.003)


def test_a_move_is_described_by_its_angle_and_its_tilt():
    move = Move(0, 1.0, np.array([3.0, 12.0, 4.0]), np.array([1.0, 2.0, 1.0]))
    assert (move.angle_deg, move.tilt_deg) == pytest.approx((13.0, 5.0))
    assert move.sigmas == pytest.approx(np.sqrt(9.0 + 36.0 + 16.0))
    assert move.angle_sigma_deg == pytest.approx(np.sqrt(9.0 + 576.0 + 16.0) / 13.0)


@pytest.mark.parametrize(
    ("turn_deg", "axis", "count"),
    [(0.0, UP, 0), (3.1, FORWARD, 0), (3.3, FORWARD, 1), (-3.3, FORWARD, 1), (20.0, FORWARD, 1), (25.0, LEFT, 1)],
)
def test_rotations_over_3_2_degrees_are_found_between_logs(turn_deg, axis, count):
    moves = find_moves([drive_intervals(96.0), drive_intervals(96.0, turn_deg, axis)])
    assert [(move.log, move.at_s) for move in moves] == [(1, None)] * count
    for move in moves:
        assert move.turn_deg == pytest.approx(turn_deg * axis, abs=0.2)


def rotated(turn_deg, axis, between):
    """Return the logs of a mount that rotates between two logs of 96 s, or in the middle of a log of 180 s."""
    if between:
        return [drive_intervals(96.0), drive_intervals(96.0, turn_deg, axis)]
    return [drive_intervals(184.0, turn_deg, axis, 92.0)]


@pytest.mark.parametrize(
    ("axis", "between", "limit"), [(UP, True, 3.3), (UP, False, 4.3), (LEFT, False, 3.8), (FORWARD, False, 3.8)]
)
@pytest.mark.parametrize(("share", "suspected"), [(1.0, False), (0.7, True)])
def test_a_move_needs_some_standard_deviations(axis, between, limit, share, suspected):
    """A limit is 30 % lower if the firmware suspects a move. A move also needs 3.2 degrees."""
    (probe,) = find_moves(rotated(9.0, axis, between))
    sigma = probe.angle_deg / probe.sigmas
    for excess in (0.9, 1.12):
        angle = max(excess * share * limit * sigma, LEAST_DEG + 0.1) if excess > 1.0 else excess * share * limit * sigma
        assert len(find_moves(rotated(angle, axis, between), suspected)) == (excess > 1.0), (angle, sigma)


def test_the_moves_are_in_chronological_order():
    logs = [drive_intervals(180.0, 12.0, UP, 90.0), drive_intervals(96.0, 25.0, UP), drive_intervals(96.0)]
    moves = find_moves(logs)
    assert [move.log for move in moves] == [0, 1, 2]
    assert [round(move.turn_deg[1]) for move in moves[:2]] == [12, 13] and moves[2].turn_deg[1] < -15.0
    assert moves[0].at_s == pytest.approx(90.0, abs=8.0) and moves[1].at_s is moves[2].at_s is None


@pytest.mark.parametrize(("axis", "turn_deg", "within_s"), [(UP, 10.0, 8.1), (LEFT, 5.0, 1.6), (FORWARD, -5.0, 2.6)])
def test_the_moment_of_a_tilt_is_known_to_the_second(axis, turn_deg, within_s):
    """A yaw is found in its block of 8 s."""
    (move,) = find_moves([drive_intervals(180.0, turn_deg, axis, 90.0)])
    assert move.at_s == pytest.approx(90.0, abs=within_s) and move.turn_deg == pytest.approx(turn_deg * axis, abs=0.5)


@pytest.mark.parametrize(
    ("degrees", "climb_s", "count"),
    [(5.0, 60.0, 0), (7.0, 60.0, 0), (12.0, 60.0, 1), (6.0, 1.0, 1), (6.0, 12.0, 1), (6.0, 22.0, 0)],
)
def test_a_slow_tilt_under_eight_degrees_is_a_hill(degrees, climb_s, count):
    t_s = np.arange(200.0) + 0.5
    slope = degrees * np.clip((t_s - 100.0) / climb_s + 0.5, 0.0, 1.0)
    assert len(find_moves([drive_intervals(200.0, slope, LEFT)])) == count


def driven(log, lag_s=0.3, bias_dps=(0.0, 0.0, 0.0)):
    return evidence.intervals(log, "car", lag_s, np.array(bias_dps))


def test_turns_of_five_degrees_in_a_recorded_drive(shared_data):
    log = usable(read_log(shared_data / "car-urban-medium-turn-loop-nominal-001.csv.gz", axes=False), False)
    fit = fit_logs([log], None, "car")
    frame, lag_s = fit.calibration.vehicle_from_sensor, fit.lag_s or 0.0
    assert find_moves([driven(log, lag_s, fit.bias_dps)]) == []
    successes, chance = 0, np.random.default_rng(8)
    for k in range(8):
        axis = UP if k % 2 else (np.cos(k), 0.0, np.sin(k))
        turn = frame.T @ turn_of(5.0, axis).T @ frame  # the rotation of the sensor, in the sensor's own axes
        later = (log.t_s >= log.t_s[-1] * chance.uniform(0.4, 0.6))[:, None]
        turned = copy.copy(log)
        turned.accel_g = np.where(later, log.accel_g @ turn.T, log.accel_g)
        turned.gyro_dps = np.where(later, (log.gyro_dps - fit.bias_dps) @ turn.T + fit.bias_dps, log.gyro_dps)
        successes += bool(find_moves([driven(turned, lag_s, fit.bias_dps)]))
    assert successes >= 7
