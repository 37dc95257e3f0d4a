"""The quality of a drive and its vertical: each limit with values on both sides of it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand.drive_alignment.alignment import CAR, DriveAlignment
from kickstand.drive_alignment.events import DrivingEvents
from kickstand.drive_alignment.history import ForceHistory
from kickstand.drive_alignment.quality import DrivingQuality
from kickstand.drive_alignment.vertical import StandingVertical, Vertical


def said(problem):
    return problem and (problem.code, *problem.values)


# quality.py


def judged(**given) -> Any:
    """Return a DrivingQuality before _decide(). Each default value is exactly at its limit."""
    drive = {"counted": 5, "lag_s": 0.5} | {k: given.pop(k) for k in ("counted", "lag_s") if k in given}
    up = SimpleNamespace(problem=lambda level: given.get("vertical"), is_car=given.get("is_car", True))

    def forward(out, level):
        out[0], out[1], out[2] = given["last"]
        return given["weight"]

    last = SimpleNamespace(forward=forward)
    made: Any = DrivingQuality(SimpleNamespace(last=last, **drive), up)
    given = {"quality_deg": 1.5, "halves_deg": 4.0, "last": [0.0, 0.0, 0.0], "weight": 0.0} | given
    made.quality_deg, made.halves_deg = given["quality_deg"], given["halves_deg"]
    made.fit.forward = [0.0, 0.0, 1.0]
    made.parts = SimpleNamespace(
        forward_deg=given.get("parts_deg", 4.0), sigmas=given.get("sigmas", 9.0),
        roll_deg=given.get("roll_deg", 7.0), pitch_deg=given.get("pitch_deg", 7.0),
    )  # fmt: skip
    return made


@pytest.mark.parametrize(
    ("given", "good"),
    [
        ({}, True),
        ({"quality_deg": 1.51}, False),
        ({"halves_deg": 4.01}, False),
        ({"counted": 4}, False),
        ({"parts_deg": 4.1, "sigmas": 3.1}, False),
        ({"parts_deg": 9.0, "sigmas": 3.0}, True),
    ],
)
def test_a_drive_becomes_ready_within_its_limits(given, good):
    made = judged(**given)
    made._decide(1.0, 0.0)
    assert made.good is good
    assert made.mount_problem is None and made.speed_problem is None


@pytest.mark.parametrize(
    ("given", "good"),
    [
        ({"quality_deg": 2.5, "halves_deg": 6.0}, True),
        ({"quality_deg": 2.51}, False),
        ({"halves_deg": 6.01}, False),
        ({"parts_deg": 6.1, "sigmas": 4.0}, True),
        ({"parts_deg": 6.1, "sigmas": 4.1}, False),
    ],
)
def test_a_ready_drive_stays_ready_within_wider_limits(given, good):
    made = judged(**given)
    made.agree = made._precise = True
    made._decide(1.0, 0.0)
    assert made.good is good


def test_a_speed_is_checked_from_two_events():
    for counted, problem in ((1, None), (2, ("speed-late", 2.0))):
        made = judged(counted=counted, lag_s=2.0)
        made._decide(1.0, 0.0)
        assert said(made.speed_problem) == problem


@pytest.mark.parametrize(
    ("given", "level_deg", "problem"),
    [
        ({}, 8.0, None),
        ({}, 8.1, ("mount-moved", "vertical", 8.1)),
        ({"roll_deg": 7.1}, 0.0, ("mount-moved", "parts")),
        ({"pitch_deg": 7.1}, 0.0, ("mount-moved", "parts")),
        ({"pitch_deg": 7.1, "is_car": False}, 0.0, None),
        ({"parts_deg": 30.1, "sigmas": 4.1}, 0.0, ("mount-moved", "forward")),
        ({"parts_deg": 30.1, "sigmas": 4.0}, 0.0, None),
        ({"parts_deg": 29.9, "sigmas": 4.1}, 0.0, None),
        ({"last": [0.0, 0.0, -0.51], "weight": 0.0121}, 0.0, ("mount-moved", "forward")),
        ({"last": [0.0, 0.0, -0.51], "weight": 0.0119}, 0.0, None),
        ({"last": [0.0, 0.0, -0.49], "weight": 0.0121}, 0.0, None),
        ({"last": [np.sin(1.38), 0.0, np.cos(1.38)], "weight": 1.0}, 0.0, None),
    ]  # 79 degrees
    + [({"last": [np.sin(1.41), 0.0, np.cos(1.41)], "weight": 1.0}, 0.0, ("mount-moved", "forward"))],
)
def test_a_moved_mount_is_found_beyond_its_limits(given, level_deg, problem):
    assert said(judged(**given)._find_mount_problem(level_deg)) == problem


def test_the_quality_of_a_drive_by_numpy():
    """Six blocks whose forward is at different angles. The jackknife leaves out each block in turn."""
    angles = np.radians([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    made = DrivingEvents(ForceHistory())
    made.braking_count = 6
    for angle in angles:
        for change in (0.3, -0.3):
            made.regression.add(
                0, 15.0, 15.0 * change, 0.0, [15.0 * change * np.sin(angle), 15.0, 15.0 * change * np.cos(angle)]
            )
        list(made.regression.end_event())
    standing: Any = SimpleNamespace(up=[0.0, 1.0, 0.0])
    found = DrivingQuality(made, Vertical(True, None, standing))
    list(found.judge())
    mean = np.arctan2(np.sin(angles).sum(), np.cos(angles).sum())
    rest = [np.arctan2(np.delete(np.sin(angles), k).sum(), np.delete(np.cos(angles), k).sum()) for k in range(6)]
    variance = np.sum(np.degrees(rest - mean) ** 2) * 5 / 6
    weight = 6 * 2 * 15.0 * 0.09
    assert found.quality_deg == pytest.approx(np.sqrt((5 * variance + 4.0 / weight) / 9), rel=1e-3)
    halves = [np.degrees(np.arctan2(np.sin(a).sum(), np.cos(a).sum())) for a in (angles[:3], angles[3:])]
    assert found.halves_deg == pytest.approx(abs(halves[1] - halves[0]), rel=1e-3)
    assert found.good and found.agree and found.parts.count == 6


# vertical.py


def stand(standing, force, seconds, speed=0.0, rate=(0.0, 0.0, 0.0)):
    for _ in range(round(seconds * 10)):
        standing.update(force, rate, speed, 0.1)


def pitched(deg):
    return [0.0, float(np.cos(np.radians(deg))), float(np.sin(np.radians(deg)))]


def test_a_stop_counts_after_one_and_two_seconds():
    standing = StandingVertical()
    stand(standing, pitched(0.0), 0.9)
    assert not standing.standing
    stand(standing, pitched(0.0), 0.2)
    assert standing.standing and standing.stops == 0 and standing.up is None
    stand(standing, pitched(0.0), 1.7)
    assert standing.stops == 0
    stand(standing, pitched(0.0), 0.3)
    assert standing.stops == 1 and standing.up == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize(("speed", "stops"), [(0.5, 1), (0.51, 0)])
def test_half_a_metre_per_second_is_standing(speed, stops):
    standing = StandingVertical()
    stand(standing, pitched(0.0), 4.0, speed)
    assert standing.stops == stops


@pytest.mark.parametrize(("speed", "stops"), [(2.0, 1), (2.1, 2)])
def test_a_new_stop_needs_more_than_two_mps(speed, stops):
    standing = StandingVertical()
    for pitch in (0.0, 7.0):
        stand(standing, pitched(pitch), 4.0)
        stand(standing, pitched(0.0), 1.0, speed)
    assert standing.stops == stops


@pytest.mark.parametrize(
    ("force_g", "rate_dps", "still"), [(0.059, 0.0, True), (0.061, 0.0, False), (0.0, 2.9, True), (0.0, 3.1, False)]
)
def test_a_jerk_begins_the_stop_again(force_g, rate_dps, still):
    standing = StandingVertical()
    stand(standing, pitched(0.0), 2.0)
    standing.update([force_g, 1.0, 0.0], (0.0, rate_dps, 0.0), 0.0, 0.1)
    assert standing.standing is still


@pytest.mark.parametrize(("second", "moved"), [(7.9, False), (8.1, True)])
def test_stops_more_than_8_degrees_apart_are_a_moved_mount(second, moved):
    standing = StandingVertical()
    stand(standing, pitched(0.0), 4.0)
    stand(standing, pitched(0.0), 1.0, 9.0)
    stand(standing, pitched(second), 4.0)
    assert standing.stops == 2 and standing.moved is moved
    assert standing.up == pytest.approx(pitched(second / 2.0), abs=1e-4)


def test_bias_and_vertical_are_means_over_the_stop():
    standing = StandingVertical((9.0, 0.0, 0.0))
    stand(standing, pitched(0.0), 3.0, rate=(1.0, 0.0, 0.0))
    stand(standing, pitched(1.0), 2.0, rate=(2.0, 0.0, 0.0))
    assert standing.bias == pytest.approx([1.0 + 20 / 41, 0.0, 0.0], rel=0.03)
    assert standing.up and np.degrees(np.arcsin(standing.up[2])) == pytest.approx(20 / 41, rel=0.03)


def test_a_tilt_of_up_to_1_5_degrees_does_not_end_a_stop():
    for pitch, standing_still in ((1.3, True), (2.9, False)):
        standing = StandingVertical()
        stand(standing, pitched(0.0), 4.0)
        for _ in range(3):  # call three times with the same pitch
            stand(standing, pitched(pitch), 1.5)
        assert standing.standing is standing_still and not standing.moved


@pytest.mark.parametrize(
    ("is_car", "deg", "problem"),
    [(True, 7.9, None), (True, -8.1, "since-standing"), (False, 7.9, None), (False, 8.1, "since-upright")],
)
def test_riding_straight_and_standing_differ_by_8_degrees(is_car, deg, problem):
    made = Vertical(is_car, None if is_car else [0.0, 1.0, 0.0], SimpleNamespace(up=[0.0, 1.0, 0.0]))
    found = made.problem(pitched(deg))
    assert said(found) == (problem and ("mount-moved", problem, pytest.approx(8.1, abs=1e-3)))
    assert Vertical(True, None, SimpleNamespace(up=None)).problem(pitched(50.0)) is None


# alignment.py


def drive(vehicle: Any = CAR, **given: Any) -> Any:
    made: Any = DriveAlignment(vehicle)
    for name, value in given.items():
        target, _, attribute = name.rpartition("__")
        setattr(getattr(made, target) if target else made, attribute, value)
    return made
