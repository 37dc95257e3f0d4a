"""Tests two verdicts: on an earlier alignment, by its angle to the drive's alignment, and on a speed that may be
stuck."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand.drive_alignment import verdict
from kickstand.drive_alignment.speed_check import SpeedCheck


def judged(yaw=0.0, up=0.0, straight=6, counted=6, ready=True, quality=0.5, problem=None, blocks=()):
    """Return the verdict on an alignment that is the identity matrix, compared with a drive.

    yaw: the angle between the drive's forward and the alignment's, in degrees.
    up: the angle between the drive's up and the alignment's, in degrees.
    straight: number of straight events.
    counted: number of accepted events, of 6 that are needed.
    quality: standard error of the drive's forward, in degrees.
    blocks: the forward of each block of the drive, as an angle in degrees.
    """
    cos, sin = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
    fit = SimpleNamespace(forward=[sin, 0.0, cos], level=[0.0, np.cos(np.radians(up)), np.sin(np.radians(up))])

    def of_block(part, lag, block, end):
        assert end == block + 1
        part.forward = [np.sin(np.radians(blocks[block])), 0.0, np.cos(np.radians(blocks[block]))]
        return True

    regression = SimpleNamespace(filled=len(blocks), fit=of_block)
    events = SimpleNamespace(straight_count=straight, regression=regression, lag=0)
    drive_quality = SimpleNamespace(speed_problem=problem, fit=fit, quality_deg=quality)
    drive = SimpleNamespace(events=events, quality=drive_quality, counted=counted, needed=6, ready=ready)
    return verdict.compare(drive, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, verdict.SAME),
        ({"yaw": 0.99}, verdict.SAME),
        ({"yaw": -1.01}, verdict.REFINED),
        ({"yaw": 2.0, "quality": 2.01}, verdict.SAME),  # the difference is within the drive's own standard error
        ({"yaw": 29.9}, verdict.REFINED),
        ({"yaw": 30.1}, verdict.MOVED),
        ({"yaw": 134.0}, verdict.MOVED),
        ({"yaw": 136.0, "blocks": (180.0, 91.0)}, verdict.REVERSED),
        ({"yaw": 136.0, "blocks": (180.0, 89.0)}, verdict.MOVED),
        ({"yaw": 180.0, "straight": 2, "counted": 2}, verdict.REVERSED),
        ({"yaw": 180.0, "straight": 1, "counted": 1}, verdict.UNKNOWN),
        ({"yaw": 180.0, "problem": "unit"}, verdict.UNKNOWN),
        ({"up": 7.9}, verdict.SAME),
        ({"up": 8.1}, verdict.MOVED),
        ({"up": 8.1, "counted": 5}, verdict.UNKNOWN),
        ({"yaw": 20.0, "ready": False}, verdict.UNKNOWN),
    ],
)
def test_an_alignment_is_judged_by_its_angles(given, said):
    assert judged(**given) == said


def test_the_verdicts_differ_and_turning_round_reverses_two_axes():
    assert len({verdict.UNKNOWN, verdict.SAME, verdict.REFINED, verdict.REVERSED, verdict.MOVED}) == 5
    matrix = [float(k) for k in range(1, 10)]
    verdict.turn_round(matrix)
    assert matrix == [-1.0, -2.0, -3.0, 4.0, 5.0, 6.0, -7.0, -8.0, -9.0]


@pytest.mark.parametrize(
    ("lively", "calm", "stuck"),
    # the share must be at least 15 %, which is 8 of 53 s
    [(7, 0, False), (8, 0, True), (8, 45, True), (8, 46, False), (9, 51, True)],
)
def test_a_stuck_speed_needs_eight_lively_seconds_of_a_seventh(lively, calm, stuck):
    check: Any = SpeedCheck()
    check.measure(12.0)
    force = [0.0, 1.0, 0.0]
    check.update_second(force)
    for _ in range(calm):
        force[0] += 0.029
        check.update_second(force)
    for _ in range(lively):
        assert check.problem is None
        force[0] += 0.031
        check.update_second(force)
    problem = check.problem
    assert (problem and (problem.code, *problem.values)) == (("speed-stuck", 12.0) if stuck else None)


def test_bends_and_changes_of_the_speed_do_not_count_as_stuck():
    check: Any = SpeedCheck()
    for k in range(42):
        check.measure(12.0 + k // 7 * 0.1)
        check.update_second([0.05 * (k % 2), 1.0, 0.0])
    for k in range(40):
        # every second is in a bend or directly after a bend
        check.update_second([0.05 * (k % 2), 1.0, 0.0], 5.1 * (k % 2 == 0))
    assert check.problem is None


@pytest.mark.parametrize(("mps", "code"), [(-0.5, None), (-0.51, "speed-negative"), (float("nan"), "speed-negative")])
def test_a_negative_speed_is_a_fault(mps, code):
    check: Any = SpeedCheck()
    check.measure(mps)
    assert (check.problem and check.problem.code) == code


def test_parts_of_a_second_are_averaged_by_their_time():
    check: Any = SpeedCheck()
    seen = []
    check.update_second = lambda force, yaw_dps: seen.append((force, yaw_dps))
    check.update([0.4, 1.0, 0.0], -8.0, 250_000)
    check.update([0.0, 1.0, 0.4], 0.0, 750_000)
    check.update([0.2, 1.0, 0.0], 3.0, 1_000_000)
    assert [pytest.approx(force) for force, _ in seen] == [[0.1, 1.0, 0.3], [0.2, 1.0, 0.0]]
    assert [yaw for _, yaw in seen] == [pytest.approx(2.0), pytest.approx(3.0)]
