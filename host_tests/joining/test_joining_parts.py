"""Tests the parts of joining and comparing with small inputs. The expected results were computed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining import agreement, clocks, compare, fit, joined, match, track_files
from kickstand_tools.joining.motion import CellMotion, motion
from kickstand_tools.joining.track import Course, Segments, Track, course, segments

STEP_S = 0.05


def cells(rates, there=None, force=(0.0, 1.0, 0.0)) -> CellMotion:
    rates = np.array(rates, dtype=float)
    there = np.ones(len(rates), dtype=bool) if there is None else np.array(there)
    return CellMotion(np.tile(np.array(force), (len(rates), 1)), rates, there, False, False)


def bends(seconds: float, seed: int = 1) -> np.ndarray:
    """Return smooth random rates of about 10 deg/s, shape (n, 3)."""
    n = round(seconds / STEP_S)
    at_s, knots_s = np.arange(n) * STEP_S, np.arange(0.0, seconds + 2.0, 1.0)
    chance = np.random.default_rng(seed)
    return np.column_stack([np.interp(at_s, knots_s, chance.normal(0.0, 10.0, len(knots_s))) for _ in range(3)])


def turn_about_z(angle_deg: float) -> np.ndarray:
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_times_are_converted_by_offset_and_drift():
    assert match.Match(100.0, 0.1, 0.0, 0.0, 0.0).ride_s(np.array([120.0])) == pytest.approx([18.0])
    assert clocks.Clocks(5.0, 0.1, 0.0, 0.0).of_b(np.array([25.0])) == pytest.approx([18.0])


def test_up_is_the_force_weighted_by_the_rate():
    """The weight is limited. Larger rates are limited, so a rate of 40 deg/s has the same weight as a rate of 20
    deg/s."""
    moved = CellMotion(
        np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), np.array([[0.0, 0.0, 10.0], [0.0, 40.0, 0.0]]),
        np.ones(2, dtype=bool), False, False,
    )  # fmt: skip
    assert moved.t_s == pytest.approx([0.025, 0.075])
    assert moved.seconds == pytest.approx(0.1)
    assert moved.up == pytest.approx(np.array([1.0, 2.0, 0.0]) / np.sqrt(5.0))


def test_motion_subtracts_the_median_rate_and_marks_gaps():
    """The rate is 5 deg/s for 2 s, then 25 deg/s for 0.5 s. Samples are missing from 1.0 to 1.5 s."""
    t_s = np.arange(500) / 200.0
    t_s = t_s[(t_s < 1.0) | (t_s >= 1.5)]
    chance = np.random.default_rng(1)
    gyro = np.outer(np.where(t_s < 2.0, 5.0, 25.0), [0.0, 1.0, 0.0]) + chance.normal(0.0, 0.01, (len(t_s), 3))
    force = np.tile([0.0, 0.6, 0.8], (len(t_s), 1)) + chance.normal(0.0, 1e-3, (len(t_s), 3))
    moved = motion(api.Log(t_s, force, gyro))
    assert len(moved.there) == 50
    assert not moved.there[21:29].any() and moved.there[:20].all() and moved.there[31:].all()
    assert np.all(moved.rate_dps[21:29] == 0.0) and np.all(moved.force_g[21:29] == 0.0)
    assert moved.rate_dps[5] == pytest.approx([0.0, 0.0, 0.0], abs=0.05)
    assert moved.rate_dps[45] == pytest.approx([0.0, 20.0, 0.0], abs=0.05)
    assert moved.force_g[5] == pytest.approx([0.0, 0.6, 0.8], abs=0.005)
    assert (moved.speed, moved.positions) == (False, False)
    with_speed = api.Log(t_s, force, gyro)
    with_speed.speed_mps[7] = 3.0
    assert motion(with_speed).speed is True


def test_a_cell_is_valid_within_its_own_50_ms():
    moved = cells(np.zeros((3, 3)), [True, False, True])
    at_s = np.array([-0.01, 0.001, 0.049, 0.06, 0.11, 0.149, 0.151])
    assert clocks._valid_at(moved, at_s).tolist() == [False, True, True, False, True, True, False]


def test_rates_are_limited_to_60_before_clocks_are_compared():
    rates = np.zeros((40, 3))
    rates[20:, 0] = -100.0
    size = clocks._size(cells(rates))
    assert (size[0], size[-1]) == pytest.approx((-30.0, 30.0))
    assert clocks._size(cells(rates, np.arange(40) >= 25))[[0, -1]] == pytest.approx([-60.0, 0.0])
    along = clocks._along(cells(rates), np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    assert along[-1] == pytest.approx([0.0, -60.0, 0.0])
    assert along[20, 1] == pytest.approx(-36.0)  # the mean of five cells, of which three have the rate -60


def test_rotation_brings_the_rates_of_b_to_those_of_a():
    """B begins 0.5 s later than A. The sensor of B is turned by 40 degrees."""
    rates, turn = bends(60.0), turn_about_z(40.0)
    assert clocks._rotation(cells(rates), cells(rates[10:] @ turn), 0.5) == pytest.approx(turn, abs=1e-3)


def two_clocks(turned_deg: float, seconds: float = 120.0, later_s: float = 7.5):
    rates = bends(seconds)
    plain = api.CalibrationFile(vehicle_from_sensor=np.eye(3), aligned=True)
    other = api.CalibrationFile(vehicle_from_sensor=turn_about_z(turned_deg), aligned=True)
    return clocks.clocks(cells(rates), cells(rates[round(later_s / STEP_S) :]), plain, other)


def test_clocks_of_the_same_rates_differ_by_their_start():
    found = two_clocks(0.0)
    assert found.later_s == pytest.approx(7.5, abs=1e-3)
    assert found.drift == pytest.approx(0.0, abs=1e-6)
    assert found.correlation == pytest.approx(1.0, abs=1e-6)
    assert found.common_s == pytest.approx(112.5, abs=0.06)
    assert found.apart_deg == pytest.approx(0.0, abs=0.01)


def test_calibrations_up_to_15_degrees_apart_are_accepted():
    assert two_clocks(14.0).apart_deg == pytest.approx(14.0, abs=0.05)
    with pytest.raises(InputError, match="16 degrees apart"):
        two_clocks(16.0)


def test_drift_of_b_is_found_and_too_much_is_refused():
    """B's clock is slow by 200 ppm, which is 0.12 s in ten minutes."""
    a = cells(bends(600.0))
    plain = api.CalibrationFile(vehicle_from_sensor=np.eye(3), aligned=True)

    def slow(drift: float) -> CellMotion:
        at_s = a.t_s / (1.0 - drift)
        return cells(np.column_stack([np.interp(at_s, a.t_s, column) for column in a.rate_dps.T]))

    found = clocks.clocks(a, slow(200e-6), plain, plain)
    assert found.drift == pytest.approx(200e-6, abs=20e-6)
    assert found.later_s == pytest.approx(0.0, abs=0.01)
    with pytest.raises(InputError, match="drift apart by more than clocks do"):
        clocks.clocks(a, slow(600e-6), plain, plain)


def test_clocks_need_a_minute_in_common_and_one_ride():
    for seconds, later_s in ((65.0, 7.5), (59.0, 0.0)):
        with pytest.raises(InputError, match=r"at no time do they turn alike|less than 60 s"):
            two_clocks(0.0, seconds, later_s)
    plain = api.CalibrationFile(vehicle_from_sensor=np.eye(3), aligned=True)
    with pytest.raises(InputError, match="at no time do they turn alike"):
        clocks.clocks(cells(bends(120.0)), cells(bends(120.0, seed=2)), plain, plain)
    twice = np.vstack((bends(80.0), bends(80.0)))
    with pytest.raises(InputError, match="they fit at two times"):
        clocks.clocks(cells(twice), cells(bends(80.0)), plain, plain)


def test_a_lean_is_unknown_in_gaps_and_outside_the_log():
    t_s, values = np.array([0.0, 0.1, 0.2, 0.5]), np.array([0.0, 1.0, 2.0, 5.0])
    found = agreement._interpolated(t_s, values, np.array([-0.01, 0.0, 0.05, 0.2, 0.3, 0.5, 0.51]))
    assert found == pytest.approx([np.nan, 0.0, 0.5, 2.0, np.nan, np.nan, np.nan], nan_ok=True)
    ride = SimpleNamespace(t_s=t_s[:3], lean_deg=values[:3], lean_sigma_deg=np.array([1.0, 1.0, np.nan]))
    lean, sigma = agreement._lean_while_riding(ride, t_s[:3], np.array([True, False, True]))
    assert lean == pytest.approx([0.0, np.nan, np.nan], nan_ok=True)
    assert sigma == pytest.approx([1.0, np.nan, np.nan], nan_ok=True)


def test_a_difference_by_hand():
    """The leans of A and B differ by 3 and -1 degrees alternately. The mean difference is 1 degree, and the rms around
    this mean is 2 degrees. The standard deviations of 1.2 and 1.6 degrees combine to 2.0 degrees."""
    n, zeros = 1200, np.zeros(1200)
    other = np.where(np.arange(n) % 2, 3.0, -1.0)
    seen = agreement._difference((zeros, zeros + 1.2), (other, zeros + 1.6))
    assert seen is not None
    assert (seen.seconds, seen.rms_deg, seen.constant_deg, seen.moving_deg) == pytest.approx((24.0, 5**0.5, 1.0, 2.0))
    assert (seen.p95_deg, seen.worst_deg, seen.expected_deg) == pytest.approx((2.0, 2.0, 2.0))
    assert (seen.within_1, seen.within_2) == (0.5, 1.0)
    assert (seen.slope, seen.delay_s) == (None, None)
    # the differences are 6 and 2 times the sigma of 0.5 degrees
    twice = agreement._difference((zeros, zeros + 0.3), (other, zeros + 0.4))
    assert twice is not None and (twice.within_1, twice.within_2) == (0.0, 0.5)
    assert agreement._difference((zeros[:1000], zeros[:1000]), (zeros[:1000], zeros[:1000])) is not None
    assert agreement._difference((zeros[:999], zeros[:999]), (zeros[:999], zeros[:999])) is None


@pytest.mark.parametrize(("one", "other", "known"), [(2.9, 9.0, False), (9.0, 2.9, False), (3.1, 3.1, True)])
def test_a_slope_needs_three_degrees_of_lean_in_both(one, other, known):
    wave = np.sqrt(2.0) * np.sin(np.arange(0.0, 20.0 * np.pi, agreement.STEP_S))
    slope, delay_s = agreement._slope_and_delay(one * wave, other * wave, np.ones(len(wave), dtype=bool))
    assert (slope is not None, delay_s is not None) == (known, known)


def test_words_of_a_comparison_name_each_side():
    of = agreement.Difference(90.0, 2.0, 1.5, 1.0, 1.9, 3.0, 1.03, 0.04, 1.2, 0.5, 0.9)
    back = agreement.Difference(90.0, 2.0, -1.5, 1.0, 1.9, 3.0, 1.03, -0.04, 1.2, 0.5, 0.9)
    first = agreement.Agreement(clocks.Clocks(-7.25, 80e-6, 0.95, 150.0), None, of, np.zeros(1), {})
    said = list(agreement.words(first))
    assert said[0].startswith(
        "B begins 7.25 s before A; they have 2.5 minutes in common (correlation of the rates 0.95"
    )
    assert "80 ppm slow" in said[0]
    assert said[1] == "live: hardly anywhere is a lean shown by both"
    assert "2.00 degrees rms over 1.5 minutes of riding: B leans 1.50 more to the right" in said[2]
    assert said[3] == "    B's lean is 1.030 times A's, and 40 ms later"
    assert "both expect 1.20 rms" in said[4] and "50 % of the differences are within one of it, 90 % within" in said[4]
    second = agreement.Agreement(clocks.Clocks(0.0, -80e-6, 0.95, 150.0), back, of, np.zeros(1), {})
    said = list(agreement.words(second))
    assert "s after A" in said[0] and "80 ppm fast" in said[0]
    assert "more to the left" in said[1] and said[2].endswith("40 ms earlier")
    assert first.as_data()["live"] is None and second.as_data()["live"]["rms_deg"] == 2.0


def test_a_picture_must_be_a_png(tmp_path, monkeypatch):
    monkeypatch.setattr(agreement, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="a picture needs matplotlib"):
        agreement.check_picture(tmp_path / "a.png")
    monkeypatch.setattr(agreement, "find_spec", lambda name: name == "matplotlib")
    agreement.check_picture(tmp_path / "a.png")
    with pytest.raises(InputError, match=r"must end in \.png"):
        agreement.check_picture(tmp_path / "a.jpg")


def steps(n: int, turn_deg: float = 9.0, speed: float = 10.0, bad=()) -> Course:
    t_s, good = np.arange(n + 1.0), np.ones(n, dtype=bool)
    good[list(bad)] = False
    return Course(t_s[:-1], t_s[1:], np.full(n, 4.0), np.full(n, speed), good, np.full(n, turn_deg))


def test_a_tracks_change_of_course_is_over_four_seconds():
    """The track turns by 9 deg/s at 10 m/s, which is 36 degrees in 4 s. The lateral force of 0.160 g belongs to a lean
    whose cosine is 0.98741."""
    change, known = match._changes_of_track(steps(30))
    assert change[20] == pytest.approx(36.0 * 0.98741, abs=0.001)
    # The change is known in the cells from 2 to 28 s
    assert len(change) == 60 and np.flatnonzero(known)[[0, -1]].tolist() == [4, 56]
    known = match._changes_of_track(steps(30, bad=[15]))[1]  # the bad step is from 15 to 16 s
    assert known[25] and not known[27:36].any() and known[37]  # the 4 s around 12.5 and 18.5 s exclude the bad step


def test_a_rides_change_of_course_is_over_four_seconds():
    there = np.ones(600, dtype=bool)
    there[300:307] = False  # a gap of 0.35 s is allowed, because up to 0.4 s of 4 s may be missing
    moved = cells(np.tile([0.0, 9.0, 0.0], (600, 1)), there)
    change, known = match._changes_of_ride(moved)
    assert change[20] == pytest.approx(36.0)
    assert np.flatnonzero(known)[[0, -1]].tolist() == [4, 56] and known[4:57].all()
    moved.there[300:309] = False  # a gap of 0.45 s is too long
    assert not match._changes_of_ride(moved)[1][30]


def test_a_match_needs_a_minute_and_360_degrees_of_bends():
    bend = [0.0, 4.0, 0.0]
    match._check_turns(cells(np.tile(bend, (1820, 1))), steps(61))  # the ride turns by 364 degrees
    with pytest.raises(InputError, match="the ride turns by 356 degrees"):
        match._check_turns(cells(np.tile(bend, (1780, 1))), steps(61))
    with pytest.raises(InputError, match="the ride turns by 0 degrees"):  # rates under 3 deg/s do not count
        match._check_turns(cells(np.tile([0.0, 2.9, 0.0], (9000, 1))), steps(61))
    match._check_turns(cells(np.tile([0.0, 40.0, 0.0], (1200, 1))), steps(60))
    with pytest.raises(InputError, match="the ride lasts 60 s: at least 60 s"):
        match._check_turns(cells(np.tile([0.0, 40.0, 0.0], (1199, 1))), steps(60))
    with pytest.raises(InputError, match="the track moves for 59 s only"):
        match._check_turns(cells(np.tile([0.0, 40.0, 0.0], (1200, 1))), steps(60, bad=[7]))


def some_segments(begins_s) -> Segments:
    begin_s = np.array(begins_s, dtype=float)[:, None] + np.arange(30.0)
    one = np.ones_like(begin_s)
    return Segments(begin_s, begin_s + 1.0, 0 * one, one, 0 * one, one)


def test_only_segments_within_the_ride_are_compared():
    """The ride has 100 s and begins at 10 s of the track. With a margin of 2 s, the segments must be between 12 and
    108 s of the track. Each has 30 s."""
    moved = cells(bends(100.0))
    found = compare.Comparison(moved, steps(200), some_segments([11.9, 12.1, 40.0, 77.9, 78.1]), 10.0, 2.0)
    assert found.given.begin_s[:, 0] == pytest.approx([12.1, 40.0, 77.9])
    assert found.middle_s == pytest.approx((12.1 + 40.0 + 77.9) / 3.0 + 15.0)
    moved.there[600:629] = False  # 1.45 s of 30 s are missing, which is under 5 %
    assert len(compare.Comparison(moved, steps(200), some_segments([40.0]), 10.0, 2.0).given.begin_s) == 1
    moved.there[600:632] = False
    none = compare.Comparison(moved, steps(200), some_segments([40.0]), 10.0, 2.0)
    assert (len(none.given.begin_s), none.middle_s) == (0, 0.0)


def test_the_rides_yaw_and_force_are_integrated_over_each_step():
    """The rate about up grows by 0.1 deg/s per second, so the angle is a parabola of 0.05 t^2 degrees. Its trend is
    subtracted. The force forward is integrated in the same way."""
    n = 2000
    moved = cells(np.outer(np.arange(n) * STEP_S * 0.1, [0.0, 1.0, 0.0]))
    moved.force_g[:, 2] = np.arange(n) * STEP_S * 0.01
    up = CellMotion(moved.force_g.copy(), moved.rate_dps, moved.there, False, False)
    up.force_g[:, 2] = 0.0
    given = some_segments([20.0])
    found = compare.Comparison(up, steps(200, speed=0.0), given, 5.0, 1.0)
    parabola = 0.05 * (np.arange(30.0) - 14.5) ** 2
    assert found.turned(5.0)[0, 0] == pytest.approx(parabola - parabola.mean(), abs=0.01)
    assert found.turned(5.0, axes=1).shape == (1, 1, 30)
    assert found.turned(5.0)[1:] == pytest.approx(np.zeros((2, 1, 30)), abs=1e-6)
    sped_up = compare.Comparison(moved, steps(200, speed=0.0), given, 5.0, 1.0).sped_up(5.0)
    assert sped_up[2, 0] == pytest.approx(9.80665 * 0.1 * (parabola - parabola.mean()), abs=0.01)


def test_integrals_begin_with_zero():
    assert compare._sums(np.array([[1.0], [2.0]])) == pytest.approx(np.array([[0.0], [0.05], [0.15]]))


def test_the_cost_is_minus_the_log_likelihood_of_students_distribution():
    """For an error e and 4 degrees of freedom the cost is 2.5 ln(1 + e^2 / 4)."""
    given = SimpleNamespace(course_weight=np.array([[1.0, 0.25, 0.0]]))
    cost = fit._cost(given, np.array([[2.0, 4.0, 9.0]]))  # type: ignore[arg-type]
    assert cost == pytest.approx([2 * 2.5 * np.log(2.0)])


def test_least_squares_leave_out_what_has_no_weight():
    columns = np.array([[[1.0, 1.0, 1.0]], [[0.0, 1.0, 2.0]]])
    found = fit._least(columns, np.array([[3.0, 5.0, 99.0]]), np.array([[1.0, 4.0, 0.0]]))
    assert found == pytest.approx([3.0, 2.0])


def test_the_standard_deviation_of_a_fit_by_hand():
    """The variance of the shift is a sum of three terms.

    * Three segments pull by 1, 1 and -2. The sum of the squares is 6, which gives 6 * 3 / 1 * 0.1^2 = 0.18 s2.
    * The end is 70 s from the middle, where a drift with a standard deviation of 0.01 gives 0.49 s2.
    * The receiver's delay has a standard deviation of 0.05 s, which gives 0.0025 s2.
    """
    turned = np.array([[1.0, -1.0], [2.0, 0.0], [0.0, -2.0]])
    given = SimpleNamespace(
        begin_s=np.array([[0.0]]), end_s=np.array([[120.0]]), course_weight=np.ones((3, 2)), turned_deg=turned
    )
    pulls, inverse = np.zeros((3, 7)), np.zeros((7, 7))
    pulls[:, 0] = 1.0, 1.0, -2.0
    inverse[0, 0], inverse[1, 1] = 0.1, 1e-6
    now = np.array([10.0, 1e-3, 0.01, 0.02, 0.0, 0.0, 0.0])
    step = fit._Step(2.0 * turned, pulls, inverse)
    found = fit._with_sigma(SimpleNamespace(given=given, middle_s=50.0), 7.0, now, step)  # type: ignore[arg-type]
    assert found.shift_s == pytest.approx((10.0 - 0.05) / 0.999)
    assert found.sigma_s == pytest.approx(np.sqrt(0.18 + 0.49 + 0.0025))
    assert (found.drift, found.correlation, found.evidence, found.segments) == pytest.approx((1e-3, 1.0, 7.0, 3))
    assert found.tilt.tolist() == [0.01, 0.02]


START_S, SLOW = 50.3, -200e-6  # the track's time at the ride's first sample, and the drift of its clock


@pytest.fixture(scope="module")
def exact() -> tuple[CellMotion, Course]:
    """Simulate a ride of 1500 s and its track, on a road with random bends, at a changing speed.

    The track has one step per second. The ride begins at 50.3 s of the track, and its clock is fast.
    """
    at_s, knots_s = np.arange(0.0, 1700.0, 0.01), np.arange(0.0, 1706.0, 5.0)
    chance = np.random.default_rng(1)
    yaw, speed = (np.interp(at_s, knots_s, chance.uniform(*bounds, len(knots_s))) for bounds in ((-0.4, 0.4), (10, 20)))
    on_track_s = START_S + (np.arange(30_000) + 0.5) * STEP_S / (1.0 - SLOW)
    yaw_then, speed_then = (np.interp(on_track_s, at_s, values) for values in (yaw, speed))
    force = np.outer(np.ones(30_000), [0.0, 1.0, 0.0])
    force[:, 2] = np.gradient(speed_then, STEP_S) / 9.80665
    rates = np.outer(np.degrees(yaw_then * np.cos(np.arctan(speed_then * yaw_then / 9.80665))), [0.0, 1.0, 0.0])
    direction = np.degrees(np.cumsum(yaw) * 0.01).reshape(1700, 100).mean(axis=1)
    t_s = np.arange(1701.0)
    turn = np.diff(direction, prepend=direction[:1])
    ones = np.ones(1700)
    track = Course(t_s[:-1], t_s[1:], 4.0 * ones, speed.reshape(1700, 100).mean(axis=1), ones > 0.0, turn)
    return CellMotion(force, rates, np.ones(30_000, dtype=bool), False, False), track


def test_the_fit_finds_the_shift_and_the_drift(exact):
    moved, track = exact
    found = fit.fitted(moved, track, segments(track), START_S + 3.0)
    assert found is not None
    assert found.shift_s == pytest.approx(START_S, abs=0.05)
    assert found.drift == pytest.approx(SLOW, abs=60e-6)
    assert found.correlation == pytest.approx(1.0, abs=0.005)
    assert found.tilt == pytest.approx([0.0, 0.0], abs=0.005)
    assert 0.05 <= found.sigma_s < 0.07 and found.segments == 49
    assert fit.fitted(moved, track, segments(track), 1660.0) is None
    far = fit.fitted(moved, track, segments(track), START_S + 60.0)
    assert far is not None and far.evidence < found.evidence - match.LEAST_LEAD


def test_the_rough_fit_tries_shifts_and_drifts(exact):
    """The clocks drift apart by 200 ppm. So the shift in the middle of the ride, after about 700 s, differs from the
    shift at its start."""
    moved, track = exact
    compared = compare.Comparison(moved, track, segments(track), START_S + 2.0, 7.0)
    shift_s, drift, evidence = fit._try_shifts(compared, START_S + 2.0)
    assert shift_s == pytest.approx(START_S + SLOW * (compared.middle_s - START_S), abs=0.11)
    assert drift == pytest.approx(SLOW, abs=150e-6) and drift < 0.0
    assert evidence > 100.0


def test_a_single_shift_costs_little_on_the_same_ride(exact):
    """If every second segment is one second late, no single shift fits all segments."""
    moved, track = exact
    found = fit.fitted(moved, track, segments(track), START_S)
    assert found is not None and fit.cost_of_one_shift(moved, track, segments(track), found) < 1.0
    parts = segments(track)
    parts.begin_s[::2] += 1.0
    parts.end_s[::2] += 1.0
    assert fit.cost_of_one_shift(moved, track, parts, found) > 4.0


def test_the_forward_axis_follows_from_the_speed(exact):
    moved, track = exact
    compared = compare.Comparison(moved, track, segments(track), START_S, 2.0)
    forward = fit._least(compared.sped_up(START_S, SLOW), compared.given.speed_mps, compared.given.speed_weight)
    assert forward[2] == pytest.approx(1.0, abs=0.02)
    step = fit._step(compared, np.array([START_S, SLOW, 0.0, 0.0, *forward]))
    assert np.std(step.model_deg - compared.given.turned_deg) < 1.5
    late = fit._step(compared, np.array([START_S + 0.5, SLOW, 0.0, 0.0, *forward]))
    by = late.inverse @ late.pulls.sum(axis=0)
    assert by[0] == pytest.approx(-0.5, abs=0.15)  # a single step of the Gauss-Newton method corrects most of the error


def test_the_rough_shifts_contain_the_right_one(exact):
    moved, track = exact
    mirrored, found = match._rough_shifts(moved, track)
    assert not mirrored and abs(found[0] - START_S) <= 0.5
    moved = CellMotion(moved.force_g, -moved.rate_dps, moved.there, False, False)
    assert match._rough_shifts(moved, track)[0]


def gpx(path, points: str):
    path.write_text(f'<gpx version="1.1" creator="x"><trk><trkseg>{points}</trkseg></trk></gpx>')
    return path


def point(k: float, lat=48.0, lon=11.0, speed: str | None = None) -> str:
    more = "" if speed is None else f"<extensions><a><other>1</other><Speed>{speed}</Speed></a></extensions>"
    at = f"<time>1970-01-01T00:{int(k) // 60:02}:{int(k) % 60:02}Z</time>"
    return f'<trkpt lat="{lat}" lon="{lon}">{at}{more}</trkpt>'


def test_bad_points_and_speeds_of_a_track_are_left_out(tmp_path):
    """Of two points with the same time the first is kept. Points with an impossible latitude or longitude are left
    out."""
    pytest.importorskip("gpxpy")
    good = "".join(point(k, speed="5") for k in range(10, 40))
    speeds = "".join(point(k, speed=text) for k, text in enumerate(["0", "100", "-1", "101", "fast", ""], 40))
    bad = point(50, lat=90.5) + point(51, lon=-180.5) + point(52, lat=-90.5) + point(53, lon=180.5)
    edge = point(54, lat=90) + point(55, lon=-180)
    read = track_files.read_track(gpx(tmp_path / "a.GPX", good + point(10, lat=1.0) + speeds + bad + edge))
    assert read.utc_s.tolist() == [*range(10, 46), 54, 55]
    assert read.lat_deg[0] == 48.0 and read.lon_deg[0] == 11.0
    assert read.speed_mps[29:36] == pytest.approx([5.0, 0.0, 100.0, np.nan, np.nan, np.nan, np.nan], nan_ok=True)
    assert read.name == str(tmp_path / "a.GPX")


def test_a_track_has_at_least_30_points_and_at_most_50_mb(tmp_path, monkeypatch):
    pytest.importorskip("gpxpy")
    seen = []
    path = gpx(tmp_path / "a.gpx", "".join(point(k) for k in range(30)))
    assert len(track_files.read_track(path, lambda *done: seen.append(done)).utc_s) == 30
    assert seen == [(path.stat().st_size, path.stat().st_size)]
    with pytest.raises(InputError, match="has 29 points with a time: at least 30"):
        track_files.read_track(gpx(tmp_path / "b.gpx", "".join(point(k) for k in range(29))))
    monkeypatch.setattr(track_files, "_MOST_BYTES", path.stat().st_size)
    track_files.read_track(path)
    monkeypatch.setattr(track_files, "_MOST_BYTES", path.stat().st_size - 1)
    with pytest.raises(InputError, match="too large for a track"):
        track_files.read_track(path)


def test_a_semicircle_is_half_a_turn_over_2_to_the_31(tmp_path):
    assert track_files._DEGREES * 2**30 == 90.0


def test_the_words_of_a_library_are_cut_to_one_line_of_60_letters():
    assert track_files._words(ValueError("a\n  b")) == "a b"
    assert track_files._words(ValueError("x" * 99)) == "x" * 60
    assert track_files._words(ValueError()) == "ValueError"


def test_columns_are_taken_out_of_quoted_lines():
    block = SimpleNamespace(names=["t_s", "note", "x"], lines=['1,"a,b",2', "3,c,4"])
    assert joined._with_columns(block, ["x", "t_s"]) == ["2,1", "4,3"]  # type: ignore[arg-type]


def test_a_log_of_one_row_takes_the_points_at_its_time():
    rows, points = joined._nearest(np.array([5]), np.array([4, 5, 6]))
    assert (rows.tolist(), points.tolist()) == ([0], [1])
    assert joined._placed(np.array([7.0]), np.array([1]), 3) == pytest.approx([np.nan, 7.0, np.nan], nan_ok=True)


def test_a_fit_of_clocks_needs_60_s_in_common():
    rates = bends(60.0)
    a, along = cells(rates), clocks._along(cells(rates), np.eye(3))
    assert clocks._fitted(a, a, along, along, 0.0).common_s == pytest.approx(60.0, abs=0.06)
    with pytest.raises(InputError, match="they have less than 60 s of riding in common"):
        clocks._fitted(a, a, along, along, 3.0)


def test_a_step_of_exactly_6_s_is_good():
    track = Track(np.array([0.0, 6.0, 12.1]), np.zeros(3), np.array([0.0, 1e-3, 2e-3]), np.full(3, np.nan), "t")
    assert course(track).good.tolist() == [True, False]


def test_a_track_of_over_50_mb_is_refused(tmp_path):
    with (tmp_path / "a.gpx").open("wb") as file:
        file.truncate(50_000_001)
    with pytest.raises(InputError, match="too large for a track: over 50 MB"):
        track_files.read_track(tmp_path / "a.gpx")
