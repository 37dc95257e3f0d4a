"""Rotations of a mount: angle, standard deviation, moment, and the limits below which roads and chance explain them."""

import copy

import numpy as np
import pytest
from exact import FORWARD, LEFT, UP, block_group, drive_intervals
from fleet_drives import turn_of
from kickstand_fleet import evidence
from kickstand_fleet.moved import LEAST_DEG, Move, find_moves, turn_between
from kickstand_tools.calibration.drive import fit_logs, usable
from kickstand_tools.logs.reader import read_log


def compared(before, after):
    result = turn_between(before, after)
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


@pytest.mark.parametrize(("axis", "turn_deg", "within_s"), [(UP, 10.0, 8.1), (LEFT, 5.0, 1.6), (FORWARD, -5.0, 2.6)])
def test_the_moment_of_a_tilt_is_known_to_the_second(axis, turn_deg, within_s):
    """A yaw is found in its block of 8 s."""
    (move,) = find_moves([drive_intervals(180.0, turn_deg, axis, 90.0)])
    assert move.at_s == pytest.approx(90.0, abs=within_s) and move.turn_deg == pytest.approx(turn_deg * axis, abs=0.5)


def driven(log, lag_s=0.3, bias_dps=(0.0, 0.0, 0.0)):
    return evidence.intervals(log, "car", lag_s, np.array(bias_dps))


def test_turns_of_five_degrees_in_a_recorded_drive(shared_data):
    log = usable(read_log(shared_data / "car-urban-medium-turn-loop-nominal-001.csv.gz"), False)
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
