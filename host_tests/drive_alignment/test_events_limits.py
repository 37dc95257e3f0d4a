"""Tests braking events, the regression and the parts of a drive with sums computed by hand."""

import numpy as np
import pytest
from kickstand.drive_alignment import events, history
from kickstand.drive_alignment.events import DrivingEvents, EventFinder, LastEvent
from kickstand.drive_alignment.history import ForceHistory
from kickstand.drive_alignment.parts import DriveParts, angle_between, blend_prior
from kickstand.drive_alignment.regression import BLOCKS, Fit, ForwardRegression

G = 9.80665


# events.py


def ended(changes, seconds=1.0) -> tuple[list[bool], EventFinder]:
    """Return, for each change of speed, whether an event has ended."""
    finder = EventFinder(1)
    return [finder.update(change, seconds, [True]) for change in changes], finder


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_event_begins_above_08_and_ends_below_04(sign):
    for first, going in ((0.79, False), (0.81, True)):
        assert ended([sign * first])[1].going_on is going
    assert ended([sign * 2.0, sign * 0.41])[0] == [False, False]
    seen, finder = ended([sign * 2.0, sign * 0.39])
    assert seen == [False, True] and finder.going_on is False and finder.change == sign * 2.0
    assert ended([sign * 1.0, sign * 0.61], 0.5)[0] == [False, False]  # 1.2 m/s2


def test_an_event_changes_the_speed_by_15_mps():
    assert ended([1.49, 0.0])[0] == [False, False]
    assert ended([1.5, 0.0])[0] == [False, True]
    assert ended([-0.9, -0.6, 0.0])[0] == [False, False, True]
    # an event counts when it ends, also if the opposite event begins at once
    seen, finder = ended([1.0, -2.0])
    assert seen == [False, False] and finder.change == -2.0
    seen, finder = ended([2.0, -2.0])
    assert seen == [False, True] and finder.going_on is False


def test_only_straight_changes_make_an_event_straight():
    finder = EventFinder(2)
    finder.update(-1.0, 1.0, [True, False])
    finder.update(-0.5, 1.0, [True, True])
    assert (finder.was_straight(0), finder.was_straight(1)) == (True, False)
    finder.interrupt()
    assert (finder.going_on, finder.change, finder.was_straight(0)) == (False, 0.0, False)


def test_the_last_event_by_hand():
    """In intervals of 0.5 and 1 s the speed changes by -0.1 and -0.4 g s. The accelerations are therefore -0.2 and -0.4
    g. The weight is 0.5 x 0.04 + 1 x 0.16. The force is the vertical (0, 1, 0) plus forward (0, 0, 1) times the
    acceleration."""
    last, out = LastEvent(), [0.0] * 3
    assert last.forward(out, [0.0, 1.0, 0.0]) == 0.0 and out == [0.0] * 3
    last.add(0.5, -0.1, [0.0, 0.5, -0.1])
    last.add(1.0, -0.4, [0.0, 1.0, -0.4])
    assert last.forward(out, [0.0, 1.0, 0.0]) == pytest.approx(0.18)
    assert out == pytest.approx([0.0, 0.0, 1.0])
    last.clear()
    assert last.forward(out, [0.0, 1.0, 0.0]) == 0.0 and out == [0.0] * 3


def test_the_peak_of_a_parabola_by_hand():
    """1 - (x - 0.25)^2 at -1, 0 and 1 is -0.5625, 0.9375 and 0.4375."""
    assert events._peak([-0.5625, 0.9375, 0.4375], 1) == pytest.approx(0.25)
    assert events._peak([0.4375, 0.9375, -0.5625], 1) == pytest.approx(-0.25)
    assert events._peak([2.0, 1.0], 0) == events._peak([1.0, 2.0], 1) == events._peak([1.0, 1.0, 1.0], 1) == 0.0


def driven(yaw_dps=0.0, speeds=(20.0, 19.0), every_us=500_000, force=(0.0, 1.0, -0.2)) -> DrivingEvents:
    """Follow the given speeds, in bins of 100 ms of constant force and yaw rate."""
    kept = ForceHistory()
    made = DrivingEvents(kept)
    made.interrupt()
    for speed in speeds:
        for _ in range(every_us // 100_000):
            kept.add([f * 1e5 for f in force], yaw_dps * 1e4, 100_000)
        made.measure_speed(speed, kept.now)
        while made.due:
            list(made.follow(True))
    return made


def test_a_straight_interval_is_in_the_regression():
    """From 20 to 19 m/s in 0.5 s at 1 deg/s: a is -1 / g, and c is 19.5 m/s times 0.01745 rad/s / g."""
    made = driven(1.0, (20.0, 20.0, 19.0))
    sums, a, c = np.array(made.regression._sums[0][:15]), -1.0 / G, 19.5 * np.radians(1.0) / G
    first_c = 20.0 * np.radians(1.0) / G
    assert sums[:6] == pytest.approx(
        [1.0, a, 0.5 * (c + first_c), a * a / 0.5, a * c, 0.5 * (c * c + first_c**2)], rel=1e-4
    )
    assert sums[6:9] == pytest.approx([0.0, 1.0, -0.2], rel=1e-4)
    assert sums[9:12] == pytest.approx([0.0, a / 0.5 * 0.5, a / 0.5 * -0.1], rel=1e-4)
    assert sums[12:15] == pytest.approx([0.0, 0.5 * (c + first_c), -0.1 * (c + first_c)], rel=1e-4)
    assert made.braking and made.straight


@pytest.mark.parametrize(
    ("given", "used"),
    [
        ({"yaw_dps": 1.99}, True),
        ({"yaw_dps": -2.01}, False),
        ({"speeds": (1.0, 1.0, 1.0)}, False),
        ({"speeds": (1.3, 0.9, 0.8)}, True),
        ({"force": (0.0, 2.9, 0.0)}, True),
        ({"force": (0.0, 3.1, 0.0)}, False),
        ({"every_us": 2_200_000}, True),
        ({"every_us": 2_300_000}, False),
    ],
)
def test_an_interval_is_straight_fast_and_without_a_knock(given, used):
    assert (driven(**{"speeds": (20.0, 19.0, 18.0), **given}).regression._sums[0][0] > 0.0) is used


def test_intervals_of_400_ms_wait_and_at_most_four():
    made = DrivingEvents(ForceHistory())
    made.interrupt()
    for time_us in (0, 399_000, 400_000, 800_000, 1_200_000, 1_600_000):
        made.measure_speed(9.0, time_us)
    assert [at for _, at in made._waiting] == [0, 400_000, 800_000, 1_200_000]


def test_two_accelerations_count_with_all_brakings():
    made = DrivingEvents(ForceHistory())
    for braking, acceleration, counted in ((0, 1, 1), (0, 2, 2), (0, 3, 2), (4, 3, 6)):
        made.braking_count, made.acceleration_count = braking, acceleration
        assert (made.counted, made.straight_count) == (counted, braking + acceleration)


def test_events_are_counted_by_their_kind():
    assert driven(0.0, (20.0, 20.0, 18.0, 16.0, 16.0)).braking_count == 1
    assert driven(3.0, (20.0, 20.0, 18.0, 16.0, 16.0)).turning_count == 1
    made = driven(0.0, (16.0, 16.0, 18.0, 20.0, 20.0), force=(0.0, 1.0, 0.4))
    assert (made.acceleration_count, made.braking_count, made.turning_count, made.braking) == (1, 0, 0, False)
    assert driven(3.0, (16.0, 16.0, 18.0, 20.0, 20.0)).turning_count == 0


def test_differences_wrap_at_half():
    assert history.difference(5, 3) == 2 and history.difference(3, 5) == -2
    assert history.difference(3, history.MASK) == 4 and history.difference(history.MASK, 3) == -4


# regression.py


def test_a_regression_by_hand():
    """Four intervals of 1 s with a = 0.1, -0.1, 0.3, -0.3 and c = 0.1, 0.1, -0.1, -0.1 are not correlated."""
    made, fit = ForwardRegression(), Fit()
    for a, c in ((0.1, 0.1), (-0.1, 0.1), (0.3, -0.1), (-0.3, -0.1)):
        made.add(0, 1.0, a, c, [0.5 * c, 1.0, 2.0 * a])
    assert made.filled == 0
    list(made.end_event())
    assert (made.filled, made.blocks) == (1, 2)
    assert made.fit(fit, 0) and fit.found
    assert fit.forward == pytest.approx([0.0, 0.0, 2.0], abs=1e-6)
    assert fit.level == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert (fit.weight, fit.seconds, fit.explained) == pytest.approx((0.2, 4.0, 0.8))
    assert not made.fit(fit, 1) and not fit.found


def test_correlated_changes_and_curves_by_numpy():
    chance = np.random.default_rng(2)
    a, c = chance.normal(0.0, 0.2, 20), chance.normal(0.0, 0.05, 20)
    a += 2.0 * c
    made, fit = ForwardRegression(), Fit()
    for x, y in zip(a.tolist(), c.tolist()):
        made.add(3, 2.0, 2.0 * x, y, [2.0 * (0.7 * x + 0.3 * y + 0.1), 2.0, 0.0])
    assert made.fit(fit, 3)
    assert fit.forward == pytest.approx([0.7, 0.0, 0.0], abs=1e-4)
    aa, ac, cc = (2.0 * 20 * np.cov(p, q, bias=True)[0, 1] for p, q in ((a, a), (a, c), (c, c)))
    assert fit.weight == pytest.approx(aa - ac * ac / (cc + 40e-6), rel=1e-4)
    assert fit.level == pytest.approx([0.1, 1.0, 0.0], abs=1e-4)


def test_full_blocks_are_joined_in_pairs():
    made, fit = ForwardRegression(), Fit()
    for k in range(BLOCKS):
        for change in (0.1, -0.1 * (k + 1)):
            made.add(0, 1.0, change, 0.0, [0.0, 1.0, change])
        list(made.end_event())
    assert (made.blocks, made.filled) == (5, 4)
    seconds = [made._sums[0][15 * block] for block in range(BLOCKS)]
    assert seconds == [4.0, 4.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0]
    assert [made._sums[0][15 * block + 1] for block in range(4)] == pytest.approx([-0.1, -0.5, -0.9, -1.3])
    made.add(0, 1.0, 0.5, 0.0, [0.0, 1.0, 0.5])
    list(made.end_event())
    assert (made.blocks, made.filled) == (5, 5)  # from now on a block has two events
    list(made.end_event())
    assert (made.blocks, made.filled) == (6, 5)
    assert made.fit(fit, 0, 0, 2) and fit.seconds == 8.0
    assert list(made.fitting(fit, 0, 0, 4, 1))[-1] is None and fit.seconds == 12.0


# parts.py


def test_angles_and_priors_by_hand():
    assert angle_between(1.0, 3.0) == pytest.approx(2.0)
    assert angle_between(-3.0, 3.0) == pytest.approx(2.0 * np.pi - 6.0)
    assert blend_prior(3.0, 0.5, 6) == pytest.approx((6 * 3.0 + 4 * 1.0 / 0.5) / 10)


@pytest.mark.parametrize(
    ("count", "weight", "seconds", "forward", "pitch"),
    [
        (4, 0.11, 20.0, True, True),
        (3, 0.2, 30.0, False, True),
        (4, 0.04, 20.0, False, True),
        (4, 0.2, 6.0, True, False),
        (2, 9.0, 19.9, False, False),
        (2, 9.0, 20.0, False, True),
    ],
)
def test_parts_need_blocks_weight_and_time(count, weight, seconds, forward, pitch):
    made = DriveParts()
    for k in range(count):
        angle = 0.5 * (k >= count // 2)
        made.add(np.sin(angle), np.cos(angle), 0.02 * (k >= count // 2), 0.1 * (k >= count // 2), weight, seconds)
    list(made.compare())
    assert (made.forward_deg > 0.0, made.pitch_deg > 0.0) == (forward, pitch)
    if pitch:
        assert (made.roll_deg, made.pitch_deg) == pytest.approx((np.degrees(0.02), np.degrees(0.1)), rel=1e-5)
