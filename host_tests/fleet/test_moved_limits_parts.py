"""The limits of moves: standard deviations, numbers of blocks, and the time in which the vertical jumps.

In most tests a function replaces compare(), so that each limit has exact numbers on both sides."""

import numpy as np
import pytest
from kickstand_fleet import moved
from test_moved_parts import LEFT, MOUNT, compared, hill, log_of, part, swaying


def decided(monkeypatch, turn_deg, sigma_deg=1.0, between=False, moment: "float | None" = 50.0, **how):
    """Return the moves if compare() finds this rotation at one moment, and nothing at the others.

    between: True for a rotation between two logs. moment: time of the jump of the vertical, None without a jump.
    """
    logs = [log_of(80.0), log_of(80.0)] if between else [log_of(160.0)]

    def compare(before, after):
        there = len(before.log) == 10 and len(after.log) == (10 if between else 9)
        return (np.array(turn_deg), np.full(3, sigma_deg)) if there else None

    monkeypatch.setattr(moved, "compare", compare)
    monkeypatch.setattr(moved, "_moment_of_jump", lambda log, move: moment)
    return moved.find_moves(logs, **how)


@pytest.mark.parametrize(
    ("turn_deg", "between", "count"),
    [
        ((0.0, 4.2, 0.0), False, 0),  # a yaw within a log needs 4.3 standard deviations
        ((0.0, 4.4, 0.0), False, 1),
        ((3.7, 0.0, 0.0), False, 0),  # a tilt within a log needs 3.8
        ((3.9, 0.0, 0.0), False, 1),
        ((2.1, 3.5, 0.0), False, 0),  # a tilt under 2.2 degrees counts as a yaw
        ((0.0, 3.3, 2.3), False, 1),
        ((0.0, 3.25, 0.0), True, 0),  # between logs 3.3 are enough
        ((0.0, -3.4, 0.0), True, 1),
    ],
)
def test_a_move_needs_some_standard_deviations(monkeypatch, turn_deg, between, count):
    assert len(decided(monkeypatch, turn_deg, between=between)) == count


@pytest.mark.parametrize(("yaw_deg", "count"), [(4.4 * 0.7, 0), (4.2, 1), (4.4, 1)])
def test_a_suspected_move_needs_fewer(monkeypatch, yaw_deg, count):
    assert len(decided(monkeypatch, (0.0, yaw_deg, 0.0), suspected=True)) == count


@pytest.mark.parametrize(("yaw_deg", "count"), [(3.0, 0), (3.1, 1)])
def test_the_factor_for_a_suspected_move_is_0_7(monkeypatch, yaw_deg, count):
    """4.3 times 0.7 are 3.01 standard deviations."""
    monkeypatch.setattr(moved, "LEAST_DEG", 1.0)
    assert len(decided(monkeypatch, (0.0, yaw_deg, 0.0), suspected=True)) == count


def test_a_move_has_at_least_3_2_degrees(monkeypatch):
    assert decided(monkeypatch, (0.0, 3.1, 0.0), 0.1, between=True) == []
    assert len(decided(monkeypatch, (0.0, 3.3, 0.0), 0.1, between=True)) == 1


def test_a_tilt_within_a_log_is_a_road_unless_it_jumps_or_yaws(monkeypatch):
    assert decided(monkeypatch, (9.0, 0.0, 0.0), moment=None) == []
    assert decided(monkeypatch, (9.0, 4.2, 0.0), moment=None) == []
    assert decided(monkeypatch, (18.0, 8.4, 0.0), 2.0, moment=None) == []
    (yawed,) = decided(monkeypatch, (9.0, -4.4, 0.0), moment=None)
    assert yawed.at_s == 80.5  # the beginning of its block
    (jumped,) = decided(monkeypatch, (9.0, 0.0, 0.0))
    assert (jumped.log, jumped.at_s) == (0, 50.0)
    (between,) = decided(monkeypatch, (9.0, 0.0, 0.0), between=True, moment=None)
    assert (between.log, between.at_s) == (1, None)


@pytest.mark.parametrize(("first", "second", "count"), [(7, 7, 1), (6, 9, 0), (9, 6, 0), (9, 7, 1), (7, 9, 1)])
def test_each_log_beside_a_move_needs_seven_blocks(first, second, count):
    assert len(moved.find_moves([log_of(8.0 * first), log_of(8.0 * second, 20.0)])) == count


def test_75_blocks_on_each_side_are_compared():
    whole = part(count=200)
    before, after = moved._sides(whole, 100, False)
    assert (before.t_s[0], before.t_s[-1]) == (8.0 * 25, 8.0 * 99) and len(before.log) == 75
    assert (after.t_s[0], after.t_s[-1]) == (8.0 * 101, 8.0 * 175)  # the block of the move is left out
    before, after = moved._sides(whole, 100, True)
    assert (len(before.log), len(after.log), after.t_s[0]) == (75, 75, 800.0)
    before, after = moved._sides(whole, 10, False)
    assert (len(before.log), len(after.log)) == (10, 75)
    before, after = moved._sides(whole, 190, False)
    assert (len(before.log), len(after.log)) == (75, 9)


def test_a_move_within_a_log_is_compared_with_this_log_alone():
    whole = part(count=30)
    whole.log[:] = np.repeat([0, 1, 2], 10)
    before, after = moved._sides(whole, 14, False)
    assert (len(before.log), len(after.log)) == (4, 5) and set(before.log) == set(after.log) == {1}


def jump(log, move):
    return moved._moment_of_jump(log, move)


@pytest.mark.parametrize(("climb_s", "jumps"), [(1.0, True), (13.5, True), (16.0, False)])
def test_a_jump_of_the_vertical_takes_under_a_quarter_of_a_minute(climb_s, jumps):
    """The vertical is compared between two stretches of 8 s, whose middles are 10 s apart. In a jump it moves by 70 %
    of the tilt in this time."""
    move = moved.Move(0, 96.0, np.array([6.0, 0.0, 0.0]), np.ones(3))
    found = jump(hill(6.0, climb_s=climb_s), move)
    assert (found == pytest.approx(100.0, abs=2.0)) if jumps else (found is None)


def test_the_moment_of_a_jump_is_near_the_move():
    log = log_of(300.0, 5.0, LEFT, 150.0)
    move = moved.Move(0, 150.0, np.array([5.0, 0.0, 0.0]), np.ones(3))
    for at_s, known in ((150.0, True), (165.0, True), (181.0, False), (119.0, False)):
        move.at_s = at_s
        found = jump(log, move)
        assert (found == pytest.approx(150.0, abs=1.6)) if known else (found is None)
    move.at_s = None
    assert jump(log, move) is None


def test_a_jump_is_not_seen_in_a_part_without_driving():
    """Ten intervals with a weight within a minute are needed, and three of them on each side of the moment."""
    move = moved.Move(0, 30.0, np.array([9.0, 0.0, 0.0]), np.ones(3))
    for used, known in ((9, False), (10, True)):
        log = log_of(60.0, 9.0, LEFT, 30.0)
        log.weight[:] = (np.arange(60) >= 30 - used // 2) & (np.arange(60) < 30 - used // 2 + used)
        assert (jump(log, move) is not None) is known


@pytest.mark.parametrize(("apart_deg", "used"), [(6.4, True), (9.5, False)])
def test_the_direction_of_sway_has_a_standard_deviation_under_five_degrees(apart_deg, used):
    """Half of the blocks sway to one side of forward, the others to the other side. Without one of eight blocks, the
    mean direction is `off`."""
    parts = part(), part()
    for one in parts:
        for k in range(8):
            one.sway[k] = MOUNT.T @ swaying(apart_deg * (-1) ** k) @ MOUNT
    _, sigma = compared(*parts)
    off = np.degrees(0.5 * np.arctan(np.tan(np.radians(2.0 * apart_deg)) / 7.0))
    swayed, braking = 2.0 * 7.0 * off**2 + 2.0 * 0.7**2, 2.0 * 0.16 + 2.0 * 0.25**2
    assert bool(swayed < 25.0) is used
    assert sigma[1] ** 2 == pytest.approx(braking * swayed / (braking + swayed) if used else braking, rel=0.003)
