"""The limits of alignment by driving, each with a value on either side of it, and sums computed by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand.drive_alignment import alignment, events, history, quality, vertical
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE, DriveAlignment
from kickstand.drive_alignment.events import DrivingEvents, EventFinder, LastEvent
from kickstand.drive_alignment.history import ForceHistory
from kickstand.drive_alignment.parts import DriveParts, angle_between, blend_prior
from kickstand.drive_alignment.quality import DrivingQuality
from kickstand.drive_alignment.regression import BLOCKS, LAGS, Fit, ForwardRegression
from kickstand.drive_alignment.vertical import StandingVertical, Vertical
from kickstand_tools.simulated_board.simulator import Board

G = 9.80665


def said(problem):
    return problem and (problem.code, *problem.values)


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
    # the event that ends has counted before the opposite one begins
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
    """Intervals of 0.5 and 1 s with changes of -0.1 and -0.4 g s have -0.2 and -0.4 g: the weight is 0.02 + 0.16. The
    force is the vertical (0, 1, 0) plus forward (0, 0, 1) times the acceleration."""
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
    [({"yaw_dps": 1.99}, True), ({"yaw_dps": -2.01}, False), ({"speeds": (1.0, 1.0, 1.0)}, False)]
    + [({"speeds": (1.3, 0.9, 0.8)}, True), ({"force": (0.0, 2.9, 0.0)}, True), ({"force": (0.0, 3.1, 0.0)}, False)]
    + [({"every_us": 2_200_000}, True), ({"every_us": 2_300_000}, False)],
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
    assert (history.BIN_US, history.SIZE) == (100_000, 64)


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
    assert (made.blocks, made.filled) == (5, 5)  # two events belong to a block from now on
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
    [(4, 0.11, 20.0, True, True), (3, 0.2, 30.0, False, True), (4, 0.04, 20.0, False, True), (4, 0.2, 6.0, True, False)]
    + [(2, 9.0, 19.9, False, False), (2, 9.0, 20.0, False, True)],
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


# quality.py


def judged(**given) -> Any:
    """Return a DrivingQuality before _decide(). The limits are exact at the values that are the default here."""
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
    [({}, True), ({"quality_deg": 1.51}, False), ({"halves_deg": 4.01}, False), ({"counted": 4}, False)]
    + [({"parts_deg": 4.1, "sigmas": 3.1}, False), ({"parts_deg": 9.0, "sigmas": 3.0}, True)],
)
def test_a_drive_becomes_ready_within_its_limits(given, good):
    made = judged(**given)
    made._decide(1.0, 0.0)
    assert made.good is good
    assert made.mount_problem is None and made.speed_problem is None


@pytest.mark.parametrize(
    ("given", "good"),
    [({"quality_deg": 2.5, "halves_deg": 6.0}, True), ({"quality_deg": 2.51}, False), ({"halves_deg": 6.01}, False)]
    + [({"parts_deg": 6.1, "sigmas": 4.0}, True), ({"parts_deg": 6.1, "sigmas": 4.1}, False)],
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
    [({}, 8.0, None), ({}, 8.1, ("mount-moved", "vertical", 8.1)), ({"roll_deg": 7.1}, 0.0, ("mount-moved", "parts"))]
    + [({"pitch_deg": 7.1}, 0.0, ("mount-moved", "parts")), ({"pitch_deg": 7.1, "is_car": False}, 0.0, None)]
    + [({"parts_deg": 30.1, "sigmas": 4.1}, 0.0, ("mount-moved", "forward"))]
    + [({"parts_deg": 30.1, "sigmas": 4.0}, 0.0, None), ({"parts_deg": 29.9, "sigmas": 4.1}, 0.0, None)]
    + [({"last": [0.0, 0.0, -0.51], "weight": 0.0121}, 0.0, ("mount-moved", "forward"))]
    + [({"last": [0.0, 0.0, -0.51], "weight": 0.0119}, 0.0, None)]
    + [({"last": [0.0, 0.0, -0.49], "weight": 0.0121}, 0.0, None)]
    + [({"last": [np.sin(1.38), 0.0, np.cos(1.38)], "weight": 1.0}, 0.0, None)]  # 79 degrees
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
    assert (vertical.SETTLE_S, vertical.COUNTS_S, vertical.MOVED_MPS) == (1.0, 2.0, 2.0)


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


def test_a_same_stop_differs_by_less_than_15_degrees():
    for pitch, standing_still in ((1.3, True), (2.9, False)):
        standing = StandingVertical()
        stand(standing, pitched(0.0), 4.0)
        for _ in range(3):  # slowly, so the force is still
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


DRIVEN = {"_speed_mps": 9.0, "_top_mps": 9.0, "standing__stops": 1}


@pytest.mark.parametrize(
    ("given", "state"),
    [({"_speed_mps": -1.0}, 0), ({"_silent_us": 5_000_001}, 0), ({"_silent_us": 5_000_000}, 2)]
    + [({"standing__stops": 0}, 1), ({}, 2), ({"quality__good": True}, 5), ({"standing__moved": True}, 6)]
    + [({"quality__good": True, "_speed_mps": -1.0}, 5), ({"_speed_mps": 0.0}, 2)],
)
def test_the_state_of_a_drive(given, state):
    assert drive(**DRIVEN | given).state == state
    assert (alignment.WAITING_FOR_SPEED, alignment.WAITING_FOR_STOP, alignment.WAITING_FOR_BRAKING) == (0, 1, 2)
    assert (alignment.BRAKING, alignment.TURNING, alignment.READY, alignment.REFUSED) == (3, 4, 5, 6)


def test_braking_is_shown_as_straight_or_in_a_bend():
    made = drive(**DRIVEN)
    made.events._finder.going_on, made.events._finder.change = True, -1.0
    assert made.state == alignment.TURNING
    made.events._straight[0] = True
    assert made.state == alignment.BRAKING
    made.events._finder.change = 1.0
    assert made.state == alignment.WAITING_FOR_BRAKING
    assert drive(MOTORCYCLE, **DRIVEN | {"standing__stops": 0}).state == alignment.WAITING_FOR_BRAKING


@pytest.mark.parametrize(
    ("given", "counted", "reason"),
    [({"_speed_mps": -1.0}, 5, ("no-speed",)), ({"_top_mps": 1.9}, 5, ("not-driven", 5))]
    + [({"_top_mps": 2.0, "standing__stops": 0}, 5, ("not-stopped", 3.0)), ({}, 4, ("few-events", 4, 5, 2))]
    + [
        ({}, 5, ("uncertain", 180.0, 0)),
        ({"quality__quality_deg": 3.0, "quality__agree": True}, 5, ("uncertain", 3.0, 0)),
    ]
    + [({"quality__quality_deg": 3.0, "quality__halves_deg": 12.0}, 5, ("parts-differ", 12.0))],
)
def test_what_a_drive_still_misses(given, counted, reason):
    assert said(drive(**DRIVEN | given).missing(counted, 5, 2)) == reason


def test_the_problem_of_the_mount_is_known_from_five_events():
    for braked, problem in ((4, None), (5, "mount")):
        assert drive(events__braking_count=braked, quality__mount_problem="mount").problem == problem
    assert drive(events__braking_count=5, quality__speed_problem="speed").problem == "speed"
    assert said(drive(standing__moved=True).problem) == ("mount-moved", "between-stops", 8.0)
    assert drive(MOTORCYCLE, standing__moved=True).problem is None
    assert drive(standing__moved=True, _speed_check__problem="stuck").problem == "stuck"


def test_samples_are_summed_to_a_bin_of_a_tenth_of_a_second():
    made = drive(MOTORCYCLE, **DRIVEN)
    seen = []
    made._history.add = lambda sums, yaw, us: seen.append((list(sums[:3]), yaw, us))
    made._speed_check.update = lambda force, yaw_dps, us: seen.append((force, yaw_dps, us))
    for k in range(10):
        made.update([0.1, 1.0, 0.2 * k], [0.0, 3.0, 0.0], 10_000)
    (sums, yaw, us), (force, yaw_dps, check_us) = seen
    assert sums == pytest.approx([1e4, 1e5, 9e4]) and us == check_us == 100_000
    assert force == pytest.approx([0.1, 1.0, 0.9])
    assert yaw_dps == pytest.approx(3.0) and yaw == pytest.approx(3e4)  # 0.3 degrees
    assert made._sums_us == 0 and made._sums == [0.0] * 6 and made._silent_us == 100_000
    made.update([0.0] * 3, [0.0] * 3, 10_000)
    made.update([0.0] * 3, [0.0] * 3, 500_001)
    assert made._sums_us == 0 and made._history._count == 1


def test_a_speed_has_the_time_of_the_newest_sample():
    made = drive()
    seen = []
    made.events.measure_speed = lambda mps, at: seen.append((mps, at))
    made._history.now, made._sums_us, made._silent_us = 1_000_000, 30_000, 9
    made.measure_speed(7.0, 200_000)
    made.measure_speed(-0.3)
    assert seen == [(7.0, 830_000), (0.0, 1_030_000)]
    assert (made._speed_mps, made._top_mps, made._silent_us) == (0.0, 7.0, 0)


def test_bins_of_a_silent_source_are_not_checked():
    for silent_us, checked in ((4_999_999, 1), (5_000_000, 0)):
        made = drive(_silent_us=silent_us)
        seen = []
        made._speed_check.update = lambda *given, seen=seen: seen.append(given)
        made.update([0.0, 1.0, 0.0], [0.0] * 3, 100_000)
        assert len(seen) == checked and made._silent_us == 5_000_001


def test_only_a_fresh_speed_proves_a_standstill():
    for given, updates in (
        ({}, 1),
        ({"_silent_us": 5_000_000}, 1),
        ({"_speed_mps": 0.0}, 1),
        ({"_speed_mps": -1.0}, 0),
        ({"_silent_us": 5_000_001}, 0),
    ):
        made, seen = drive(**DRIVEN | given), []
        made.standing.update = lambda *values, seen=seen: seen.append(values)
        made._means = ([0.0, 1.0, 0.0], [0.0] * 3, 0.1)
        made._do_step()
        assert len(seen) == updates and made._means is None


# background.py


def background(real=False, **given: Any) -> Any:
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):
        from kickstand.drive_alignment.background import BackgroundAlignment
    made: Any = object.__new__(BackgroundAlignment)
    calls: list = []
    calibration = SimpleNamespace(aligned=given.pop("aligned", True), vehicle_from_sensor=[1, 0, 0, 0, 1, 0, 0, 0, 1])
    made._meter = SimpleNamespace(
        calibration=calibration, distrust=lambda code: calls.append(("distrust", code)), trim_deg=1.5,
        reset_maxima=lambda: calls.append("maxima"), speed_mps=given.pop("meter_mps", 0.0),
    )  # fmt: skip
    made.drive = SimpleNamespace(
        problem=given.pop("problem", None), ready=given.pop("ready", True), quality_deg=0.7,
        standing=SimpleNamespace(standing=given.pop("standing", True), bias=[0.1, 0.2, 0.3]),
        interrupt=lambda: calls.append("interrupt"), update=lambda *values: calls.append(("update", *values)),
        measure_speed=lambda *values: calls.append(("speed", *values)), matrix=lambda out: None,
    )  # fmt: skip
    made._leans, made._asked, made._answered, made.message, made.result = True, False, [], None, None
    made._speed_mps, made._speed_ms, made._fed_ms, made._look_ms = 0.0, 0, None, None
    for name, value in given.items():
        setattr(made, name, value)
    made.calls = calls
    if not real:
        made._adopt = lambda anew: calls.append(("adopt", anew))
        made._restart = lambda: calls.append("restart")
    return made


def test_a_speed_is_fresh_for_three_seconds():
    made = background(_speed_mps=4.0)
    assert made.fresh_speed(2999) == 4.0 and made.fresh_speed(3000) is None and made.fresh_speed(0) is None


@pytest.mark.parametrize(
    ("given", "away"),
    [({"_speed_mps": 2.0}, False), ({"_speed_mps": 2.1}, True), ({"meter_mps": 9.0}, False)]
    + [({"meter_mps": 2.1, "problem": "stuck"}, True), ({"meter_mps": 2.0, "problem": "stuck"}, False)]
    + [({"meter_mps": 9.0, "message": SimpleNamespace(code="other-side")}, False)]
    + [({"meter_mps": 9.0, "message": SimpleNamespace(code="store")}, True)],
)
def test_a_vehicle_is_away_above_two_mps(given, away):
    made = background(standing=False, **given)
    assert made._away() is away
    before = made.message
    made._look(0)
    assert made.message is (None if away else before)


@pytest.mark.parametrize(
    ("verdict", "given", "calls", "code"),
    [(1, {}, [("distrust", None)], None), (2, {}, [("adopt", False)], None), (2, {"ready": False}, [], None)]
    + [(3, {}, [("distrust", "other-side")], "other-side"), (4, {}, [("distrust", "mount-moved")], "mount-moved")]
    + [(0, {}, [], None), (1, {"_leans": False}, [], None), (2, {"_leans": False}, [("adopt", False)], None)]
    + [(3, {"_leans": False}, [("adopt", True)], None), (4, {"_leans": False, "ready": False}, [], None)]
    + [(4, {"_leans": False}, [("adopt", True)], None), (4, {"_answered": ["mount-moved"]}, [], None)]
    + [(0, {"_asked": True}, [("adopt", True)], None), (0, {"_asked": True, "ready": False}, [], None)]
    + [(1, {"aligned": False}, [("adopt", True)], None), (1, {"standing": False}, [], None)]
    + [(1, {"_speed_ms": None}, [], None)],
)
def test_each_verdict_has_its_reaction(monkeypatch, verdict, given, calls, code):
    made = background(**given)
    from kickstand.drive_alignment import background as module

    monkeypatch.setattr(module, "compare", lambda *_: verdict)
    made._look(0)
    assert made.calls == calls
    assert (made.message and made.message.code) == code


def test_a_problem_is_said_only_if_an_alignment_is_in_use():
    problem = SimpleNamespace(code="speed-stuck")
    for aligned in (True, False):
        made = background(problem=problem, aligned=aligned)
        made._look(0)
        assert made.calls == ["restart"] and made.result is problem
        assert made.message is (problem if aligned else None)


def test_two_passes_of_counts_are_fed_together():
    made = background(_force=[0.0] * 3, _rate=[0.0] * 3, _total=[0] * 7, _n=0, _us=0, _turns=0)
    applied = []
    made._calibration = SimpleNamespace(apply=lambda means, force, rate: applied.append(means))
    made.feed([1] * 7, 1, 5000, 0)
    assert not applied and made._fed_ms == 0
    made.feed([8] * 7, 2, 10_000, 300)
    assert applied == [[3.0] * 7] and made.calls == [("update", made._force, made._rate, 15_000)]
    assert (made._n, made._us, made._turns, made._total) == (0, 0, 0, [0] * 7)
    made.feed([1] * 7, 1, 5000, 300)
    made.feed([1] * 7, 1, 5000, 601)  # 301 ms later
    assert "interrupt" in made.calls and made._n == 1 and made._fed_ms == 601


def test_the_result_is_looked_at_once_a_second():
    made = background(_fed_ms=0, _total=[0] * 7)
    looks = []
    made._look = looks.append
    made._share = lambda speed: speed
    speeds = iter([None, 6.0, None, None, None])
    made.speed = SimpleNamespace(poll=lambda now: next(speeds), age_us=70)
    assert [made.poll(now) for now in (0, 500, 999, 1000, 2001)] == [None, 6.0, None, None, None]
    assert looks == [0, 1000, 2001] and ("speed", 6.0, 70) in made.calls
    assert made._speed_mps == 6.0 and made._speed_ms == 500
    assert made.calls.count("interrupt") == 1 and made._fed_ms is None  # no reading for over 1 s


def test_an_answer_exchanges_forward_and_backward():
    for agreed, code, expected in ((True, "other-side", True), (False, "other-side", False), (True, "store", False)):
        made = background(message=SimpleNamespace(code=code))
        saved = []
        made._save = lambda matrix, trim, saved=saved: saved.append((list(matrix), trim)) or True
        made.answer(agreed)
        assert bool(saved) is expected and made._answered == [code]
        assert (("distrust", None) in made.calls) is (code == "other-side")
        if expected:
            assert saved == [([-1, 0, 0, 0, 1, 0, 0, 0, -1], -1.5)] and made.message.code == "side-fixed"
            assert "maxima" in made.calls
        else:
            assert made.message is None


def test_a_saved_alignment_has_the_whole_bias():
    made = background()
    seen = []
    made._meter.calibration.with_alignment = lambda *values: values
    made._calibration = SimpleNamespace(gyro_bias=[1.0, 2.0, 3.0])
    made._active = SimpleNamespace(refine=seen.append)
    assert made._save("matrix", 0.5) is True
    assert seen == [("matrix", pytest.approx([1.1, 2.2, 3.3]), 0.5, True)]


@pytest.mark.parametrize(
    ("given", "up", "bias", "shown"),
    [({}, True, True, False), ({"_leans": False}, False, True, False), ({"aligned": False}, False, False, False)]
    + [({"_asked": True}, False, True, False), ({"_leans": False, "aligned": False}, False, False, True)]
    + [({"shown": True}, True, True, True)],
)
def test_a_new_drive_knows_what_the_alignment_knows(given, up, bias, shown):
    """A motorcycle's upright pose is the vertical, unless the drive must replace the alignment. The bias of an aligned
    sensor is subtracted already."""
    made = background(real=True, _total=[9] * 7, **{"shown": False} | given)
    made.result = "old"
    made._restart()
    assert (made.drive.vertical._from_pose is not None) is up
    assert made.drive._bias_given is bias and made.drive.standing.bias == [0.0] * 3
    assert made.drive.vertical.is_car is not made._leans and made.shown is shown
    assert made.result is None and made._total == [0] * 7


def test_a_request_begins_a_drive_that_replaces_the_alignment():
    made = background(shown=False, _answered=["other-side"], message="m")
    made.ask()
    assert made.shown and made._asked and made._answered == [] and made.message is None
    made.begin()
    assert made._asked is False and made.calls == ["restart", "restart"]


def test_an_adopted_alignment_is_saved_with_its_trim():
    for anew, trim in ((True, 0.0), (False, 1.5)):
        made = background(real=True, _asked=True)
        saved = []
        made._save = lambda matrix, trim_deg, saved=saved: saved.append(trim_deg) or True
        made._adopt(anew)
        assert saved == [trim] and said(made.result) == ("aligned", 0.7)
        assert (made.message is made.result, made._asked, "maxima" in made.calls) == (anew, not anew, anew)
        made._save, made.result = (lambda *_: False), None
        made._adopt(anew)
        assert made.result is None


def test_an_old_speed_is_forgotten_even_if_nobody_asks():
    made = background(_total=[0] * 7)
    made._look = lambda now: None
    made.speed = SimpleNamespace(poll=lambda now: None)
    made.poll(2999)
    assert made._speed_ms == 0
    made.poll(3999)
    assert made._speed_ms is None


def test_lags_and_blocks_have_their_sizes():
    assert (LAGS, BLOCKS, events.LAG_STEP_US, events.MIN_INTERVAL_US) == (11, 8, 250_000, 400_000)
    assert (quality.MIN_EVENTS, quality.MIN_EVENTS_TO_CHECK_SPEED, alignment.STEP_US) == (5, 2, 12_000)
