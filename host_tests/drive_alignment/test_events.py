"""Braking events, the history of readings, the regression and the quality of a drive, with numpy and by hand."""

import numpy as np
import pytest
from kickstand.drive_alignment import quality as limits
from kickstand.drive_alignment.alignment import StandingVertical, Vertical
from kickstand.drive_alignment.events import (
    BIN_US,
    MASK,
    SIZE,
    DrivingEvents,
    EventFinder,
    Fit,
    ForceHistory,
    difference,
)
from kickstand.drive_alignment.quality import DrivingQuality
from support.engines import ENGINES, run


@pytest.mark.parametrize(
    ("changes", "seconds", "ended", "going_on"),
    [
        ([0.79], 1.0, [False], False),  # an event begins above 0.8 m/s2
        ([0.81], 1.0, [False], True),
        ([2.0, 0.41], 1.0, [False, False], True),  # and ends below 0.4 m/s2
        ([2.0, 0.39], 1.0, [False, True], False),
        ([1.0, 0.61], 0.5, [False, False], True),
        ([1.49, 0.0], 1.0, [False, False], False),  # it changes the speed by 1.5 m/s
        ([1.5, 0.0], 1.0, [False, True], False),
        ([0.9, 0.6, 0.0], 1.0, [False, False, True], False),
        ([1.0, -2.0], 1.0, [False, False], True),  # the opposite event begins at once
        ([2.0, -2.0], 1.0, [False, True], False),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_event_is_a_lasting_change_of_speed(sign, changes, seconds, ended, going_on):
    finder = EventFinder(1)
    assert [finder.update(sign * change, seconds, [True]) for change in changes] == ended
    assert finder.going_on is going_on


def driven(yaw_dps=0.0, speeds=(20.0, 19.0, 18.0), every_us=500_000, force=(0.0, 1.0, -0.2), use=True):
    """Follow the given speeds, in bins of 100 ms of constant force and yaw rate."""
    history = ForceHistory()
    events = DrivingEvents(history)
    events.interrupt()
    for speed in speeds:
        for _ in range(every_us // 100_000):
            history.add([f * 1e5 for f in force], yaw_dps * 1e4, 100_000)
        events.measure_speed(speed, history.now)
        while events.due:
            list(events.follow(use))
    return events


@pytest.mark.parametrize(
    ("conditions", "used"),
    [
        ({"yaw_dps": 1.99}, True),
        ({"yaw_dps": -2.01}, False),
        ({"speeds": (1.0, 1.0, 0.5)}, False),
        ({"speeds": (1.3, 0.9, 0.8)}, True),
        ({"force": (0.0, 2.9, 0.0)}, True),
        ({"force": (0.0, 3.1, 0.0)}, False),
        ({"every_us": 2_200_000, "speeds": (20.0, 19.0, 14.0)}, True),
        ({"every_us": 2_300_000, "speeds": (20.0, 19.0, 14.0)}, False),
        ({"use": False}, False),
    ],
)
def test_an_interval_is_straight_fast_and_without_a_knock(conditions, used):
    fit = Fit()
    driven(**{"speeds": (20.0, 19.0, 17.0), **conditions}).regression.fit(fit, 0)
    assert (fit.total[0] > 0.0) is used


@pytest.mark.parametrize(
    ("yaw_dps", "speeds", "braking", "acceleration", "turning"),
    [
        (0.0, (20.0, 20.0, 18.0, 16.0, 16.0), 1, 0, 0),
        (3.0, (20.0, 20.0, 18.0, 16.0, 16.0), 0, 0, 1),
        (0.0, (16.0, 16.0, 18.0, 20.0, 20.0), 0, 1, 0),
        (3.0, (16.0, 16.0, 18.0, 20.0, 20.0), 0, 0, 0),
        (0.0, (10.0, 11.0, 12.0, 12.0, 13.0, 14.0, 14.0, 15.0, 16.0, 16.0, 14.0, 12.0, 12.0), 1, 3, 0),
    ],
)
def test_events_are_counted_by_their_kind(yaw_dps, speeds, braking, acceleration, turning):
    """At most two accelerations count."""
    events = driven(yaw_dps, speeds)
    assert (events.braking_count, events.acceleration_count, events.turning_count) == (braking, acceleration, turning)
    assert (events.straight_count, events.counted) == (braking + acceleration, braking + min(2, acceleration))


def test_history_is_exact_and_wraps_round():
    """Differences between two integrals equal numpy's, also after the time or a sum has wrapped around."""
    rng = np.random.default_rng(2)
    history = ForceHistory()
    history.now = MASK - 3_000_000
    history.clear()
    times, totals = [0], [np.zeros(4)]
    late, early = [0] * 4, [0] * 4
    for k in range(300):
        length = int(BIN_US + rng.integers(0, 60_000))
        force, yaw = rng.normal(size=3) * 3.0 * length, rng.normal() * 1e5
        history.add(force, yaw, length)
        times.append(times[-1] + length)
        totals.append(totals[-1] + [*force, yaw])
        if k < SIZE:
            continue
        oldest = times[-1] - times[-SIZE]
        ages = sorted(int(age) for age in rng.integers(0, oldest - 1, 2))
        assert history.at(late, history.now - ages[0]) and history.at(early, history.now - ages[1])
        columns = np.array(totals).T
        exact = [np.array([np.interp(times[-1] - age, times, column) for column in columns]) for age in ages]
        looked_up = [difference(a, b) for a, b in zip(late, early, strict=True)]
        # The values are about a million. A difference of 200 allows for the rounding of about 60 bins
        assert np.abs(np.array(looked_up) - (exact[0] - exact[1])).max() < 200
        assert not history.at(late, history.now + 1000) and not history.at(late, history.now - oldest - 1000)
    history.clear()
    assert not history.at(late, history.now)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("count", [60, 300])
def test_regression_is_weighted_least_squares(engine, count):
    """Forward and level match numpy for any number of joined blocks."""
    rng = np.random.default_rng(count)
    seconds = rng.uniform(0.4, 1.1, count)
    a, c = rng.normal(0, 0.1, count), rng.normal(0, 0.03, count)
    force = np.array([0.3, 0.9, 0.1]) + np.outer(a, [0.6, -0.2, 0.7]) + np.outer(c, [0.1, 0.5, 0.2])
    force += rng.normal(0, 0.02, force.shape)
    rows = [[s, x * s, y, (f * s).tolist()] for s, x, y, f in zip(seconds, a, c, force, strict=True)]
    [(forward, level, blocks)] = run(engine, [("regression", (rows, 3))])
    weight = np.sqrt(seconds)[:, None]
    design = np.column_stack((a, np.ones(count), c))
    expected = np.linalg.lstsq(design * weight, force * weight, rcond=None)[0]
    # The tolerance allows for the ridge term of c and for 32-bit sums
    assert np.abs(np.array(forward) - expected[0]).max() < 2e-3
    assert np.abs(np.array(level) - expected[1]).max() < 2e-4
    assert 5 <= blocks <= 8


@pytest.mark.parametrize("engine", ENGINES)
def test_parts_of_a_drive(engine):
    """Forward turns by 12 degrees after five of eight blocks. The pitch changes by 5 degrees after four blocks. The
    differences match numpy, whatever the forward direction of the whole drive is."""
    rng = np.random.default_rng(5)
    weights, seconds = rng.uniform(0.1, 0.5, 8), rng.uniform(25.0, 40.0, 8)
    angles = np.array([0.0] * 5 + [12.0] * 3) + rng.normal(0.0, 1.0, 8)
    split = slice(0, 5), slice(5, 8)
    means = [np.average(angles[part], weights=weights[part]) for part in split]
    scatter = sum((weights[p] * (angles[p] - m) ** 2).sum() for p, m in zip(split, means, strict=True))
    unit = (scatter + limits.PRIOR_FREEDOM * limits.PRIOR_DEG**2) / (6 + limits.PRIOR_FREEDOM)
    variance = sum(
        unit / weights[p].sum() + limits.STRETCH_DEG**2 * (weights[p] ** 2).sum() / weights[p].sum() ** 2 for p in split
    )
    calls = []
    for forward in (0.0, 175.0):
        a = np.radians(angles - forward)
        columns = (np.sin(a), np.cos(a), np.zeros(8), np.radians(np.repeat((0.0, 5.0), 4)), weights, seconds)
        calls.append(("parts", [np.column_stack(columns).tolist()]))
    for forward_deg, sigmas, roll_deg, pitch_deg in run(engine, calls):
        assert forward_deg == pytest.approx(means[1] - means[0], abs=0.1)
        assert sigmas == pytest.approx(forward_deg / np.sqrt(variance), rel=0.01)
        assert (roll_deg, pitch_deg) == (0.0, pytest.approx(5.0, rel=1e-3))


class Drive:
    """A car's drive. Each event has an angle of forward and a pitch, in degrees."""

    def __init__(self, counted=6, lag_s=0.5, is_car=True):
        self.events, standing = DrivingEvents(ForceHistory()), StandingVertical()
        self.events.braking_count, self.events.lag_s = counted, lag_s
        for _ in range(40):
            standing.update([0.0, 1.0, 0.0], (0.0, 0.0, 0.0), 0.0, 0.1)
        self.quality = DrivingQuality(self.events, Vertical(is_car, None if is_car else [0.0, 1.0, 0.0], standing))

    def judge(self, angles, pitches=(0.0,), ratio=1.0):
        """Add events and judge the drive. ratio: change of force per change of speed."""
        for angle, pitch in np.radians(np.broadcast_arrays(angles, np.resize(pitches, len(angles)))).T:
            for change in (0.3, -0.3):
                across, along = ratio * change * np.sin(angle), ratio * change * np.cos(angle)
                force = [across, np.cos(pitch), along + np.sin(pitch)]
                self.events.regression.add(0, 15.0, 15.0 * change, 0.0, [15.0 * f for f in force])
            list(self.events.regression.end_event())
        list(self.quality.judge())
        return self.quality


def test_the_quality_of_a_drive_by_numpy():
    """The jackknife leaves out each of six blocks in turn."""
    angles = np.array([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    quality = Drive().judge(angles)
    a = np.radians(angles)
    mean = np.arctan2(np.sin(a).sum(), np.cos(a).sum())
    left_out_angles = [np.arctan2(np.delete(np.sin(a), k).sum(), np.delete(np.cos(a), k).sum()) for k in range(6)]
    variance, weight = np.sum(np.degrees(left_out_angles - mean) ** 2) * 5 / 6, 6 * 2 * 15.0 * 0.09
    assert quality.quality_deg == pytest.approx(np.sqrt((5 * variance + 4.0 / weight) / 9), rel=1e-3)
    assert quality.halves_deg == pytest.approx(abs(np.mean(angles[3:]) - np.mean(angles[:3])), rel=1e-3)
    assert quality.good and quality.agree and quality.parts.count == 6
    assert quality.mount_problem is None and quality.speed_problem is None


@pytest.mark.parametrize(
    ("first", "angles", "good"),
    [
        ([0.0] * 3, [3.9] * 3, True),  # the halves differ by up to 4 degrees
        ([0.0] * 3, [4.1] * 3, False),
        ([5.0, -5.0] * 2, [5.0, -5.0], False),  # a standard error of 2 degrees is too large
    ],
)
def test_a_drive_becomes_ready_within_its_limits(first, angles, good):
    assert Drive().judge([*first, *angles]).good is good
