"""The limits and formulas of joining and comparing, each with values computed by hand or by plain numpy."""

import datetime as dt
from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining import agreement, clocks, compare, fit, match, track_files
from kickstand_tools.joining.clocks import Clocks
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.joining.track import Course, Segments, Track

STEP_S = 0.05


def moved(rates, up=(0.0, 1.0, 0.0)) -> CellMotion:
    rates = np.array(rates, dtype=float)
    return CellMotion(np.tile(np.array(up), (len(rates), 1)), rates, np.ones(len(rates), dtype=bool), False, False)


def steady(n: int, speed: float) -> Course:
    t_s = np.arange(n + 1.0)
    return Course(t_s[:-1], t_s[1:], np.full(n, 4.0), np.full(n, speed), np.ones(n, dtype=bool), np.zeros(n))


def made_segments(begins_s, steps=30) -> Segments:
    begin_s = np.array(begins_s, dtype=float)[:, None] + np.arange(float(steps))
    one = np.ones_like(begin_s)
    return Segments(begin_s, begin_s + 1.0, 0 * one, one / 16.0, 0 * one, one)


# fit.py


def test_the_grids_of_shifts_and_drifts():
    assert fit._SHIFTS == pytest.approx(np.linspace(-6.0, 6.0, 121))
    assert fit._DRIFTS == pytest.approx(np.linspace(-300e-6, 300e-6, 31))


def test_the_priors_of_a_fit():
    assert fit._PRIOR == pytest.approx([0.0, 1e8, 400.0, 400.0, 0.0, 0.0, 0.0])
    assert fit._LEAST_COST == pytest.approx(2.5 * np.log(1.0625))


def test_the_cost_of_an_error_by_hand():
    """An error of 8 degrees with a sigma of 4 is 2 sigma: 2.5 ln(1 + 4 / 4)."""
    given = made_segments([0.0], 2)
    assert fit._cost(given, np.array([[8.0, 0.0]])) == pytest.approx([2.5 * np.log(2.0)])
    assert fit._cost(given, np.array([[8.0, -4.0]])) == pytest.approx([2.5 * (np.log(2.0) + np.log(1.25))])


def test_coefficients_fit_the_weighted_values():
    """The columns are (1, 1, 1) and (0, 1, 2). The values 1, 3, 9 are on the line 1 + 2 t but for the last one."""
    columns = np.array([[[1.0, 1.0, 1.0]], [[0.0, 1.0, 2.0]]])
    assert fit._least(columns, np.array([[1.0, 3.0, 9.0]]), np.array([[1.0, 1.0, 0.0]])) == pytest.approx([1.0, 2.0])
    heavy = fit._least(columns[:1], np.array([[1.0, 3.0, 9.0]]), np.array([[4.0, 1.0, 0.0]]))
    assert heavy == pytest.approx([1.4])  # (4 * 1 + 1 * 3) / 5


def test_small_errors_weigh_as_half_a_sigma():
    """The least usual error is 0.5, so an error of 0.1 has e = 0.2: 4 * 1.25 / (1 + 0.04 / 4)."""
    assert fit._robust_weights(np.full((1, 3), 0.1), np.ones((1, 3))) == pytest.approx(np.full((1, 3), 5.0 / 1.01))


@pytest.fixture(scope="module")
def compared() -> compare.Comparison:
    """300 s of random rates and forces about all axes, and a track with random courses and speeds."""
    chance = np.random.default_rng(3)
    at_s, knots_s = np.arange(6000) * STEP_S, np.arange(0.0, 304.0, 4.0)
    rates, force = (
        np.column_stack([np.interp(at_s, knots_s, chance.normal(0.0, size, len(knots_s))) for _ in range(3)])
        for size in (8.0, 0.1)
    )
    given = made_segments([20.0, 60.0, 110.0, 150.0, 200.0, 240.0])
    given.turned_deg[:], given.speed_mps[:] = chance.normal(0.0, 9.0, (6, 30)), chance.normal(0.0, 3.0, (6, 30))
    motion = CellMotion(force + [0.0, 1.0, 0.0], rates, np.ones(6000, dtype=bool), False, False)
    return compare.Comparison(motion, steady(320, 9.0), given, 3.0, 2.0)


def predicted(compared, state):
    """Return the predicted courses and speeds, both (p, STEPS), for the seven unknowns."""
    courses = np.tensordot(np.append(1.0, state[2:4]), compared.turned(state[0], state[1]), 1)
    return courses, np.tensordot(state[4:], compared.sped_up(state[0], state[1]), 1)


def test_a_step_of_the_fit_is_that_of_numeric_derivatives(compared):
    given, state = compared.given, np.array([3.2, 1e-4, 0.02, -0.03, 0.1, -0.2, 0.9])
    courses, speeds = predicted(compared, state)
    slopes = []
    for k, by in enumerate((0.1, 1e-4, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3)):
        more, less = (predicted(compared, state + sign * by * np.eye(7)[k]) for sign in (1, -1))
        slopes.append([(more[i] - less[i]) / (2.0 * by) for i in (0, 1)])
    slopes[1] = [slope * (given.middle_s - compared.middle_s) for slope in slopes[0]]  # a drift shifts each step
    errors = given.turned_deg - courses, given.speed_mps - speeds
    weights = fit._robust_weights(errors[0], given.course_weight), fit._robust_weights(errors[1], given.speed_weight)
    pulls = np.array([sum((w * e * s).sum(axis=1) for w, e, s in zip(weights, errors, slope)) for slope in slopes]).T
    normal = np.array([[sum((w * p * q).sum() for w, p, q in zip(weights, a, b)) for b in slopes] for a in slopes])
    normal += np.diag([0.0, 1e8, 400.0, 400.0, 0.0, 0.0, 0.0])
    step = fit._step(compared, state)
    assert step.model_deg == pytest.approx(courses)
    assert step.pulls == pytest.approx(pulls, rel=0.03, abs=0.03 * np.abs(pulls).max(axis=0).min())
    scale = np.sqrt(np.outer(np.diag(normal), np.diag(normal)))
    assert np.linalg.inv(step.inverse) / scale == pytest.approx(normal / scale, abs=0.01)


def test_costs_are_those_at_each_shift(compared):
    given, along = compared.given, np.array([1.0, 0.1, -0.2])
    costs = fit._costs(compared, 3.0, 1e-4, along)
    assert costs.shape == (121, 6)
    for k, by in ((0, -6.0), (60, 0.0), (95, 3.5)):
        error = given.turned_deg - np.tensordot(along, compared.turned(3.0 + by, 1e-4), 1)
        assert costs[k] == pytest.approx((2.5 * np.log(1.0 + error**2 / 16.0 / 4.0)).sum(axis=1))


def test_the_evidence_is_computed_from_the_best_cost(compared):
    """Without drift the best of the tried shifts has the least sum of costs; 180 steps count as 45."""
    shift_s, drift, evidence = fit._try_shifts(compared, 3.0)
    costs = {by: fit._cost(compared.given, compared.given.turned_deg - compared.turned(3.0 + by)[0]).sum()
             for by in fit._SHIFTS}  # fmt: skip
    assert min(costs.values()) * 0.97 < (best := fit_cost(compared, shift_s, drift)) < min(costs.values()) * 1.001
    without = fit._cost(compared.given, compared.given.turned_deg).sum()
    assert evidence == pytest.approx(0.5 * 45.0 * np.log(without / best), rel=0.1, abs=0.3)


def fit_cost(compared, shift_s, drift) -> float:
    given = compared.given
    return (
        float(fit._cost(given, given.turned_deg - compared.turned(shift_s, drift)[0]).sum())
        + 0.5 * (drift / 100e-6) ** 2
    )


def test_a_cost_of_one_shift_by_numpy(compared, monkeypatch):
    """The fit's shift is at the ride's first sample. With a drift of 0.01 and the middle at 140 s, the shift in the
    middle is 2 * 0.99 + 1.4."""
    monkeypatch.setattr(fit, "Comparison", lambda *_: compared)
    assert compared.middle_s == pytest.approx((20 + 60 + 110 + 150 + 200 + 240) / 6.0 + 15.0)
    found = fit.TrackFit(2.0, 1e-4, 0.1, 0.9, 20.0, np.array([0.1, 0.2]), 6)
    shift_s = 2.0 * (1.0 - 1e-4) + 1e-4 * compared.middle_s
    costs = fit._costs(compared, shift_s, 1e-4, np.array([1.0, 0.1, 0.2]))
    by_hand = (costs[60].sum() - costs.min(axis=0).sum()) / 6.0 / (costs[60].sum() / 180.0)
    none = np.empty(0)
    assert fit.cost_of_one_shift(none, none, none, found) == pytest.approx(by_hand)  # type: ignore[arg-type]
    monkeypatch.setattr(fit, "_LEAST_COST", 10.0)
    few = (costs[60].sum() - costs.min(axis=0).sum()) / 6.0 / 10.0
    assert fit.cost_of_one_shift(none, none, none, found) == pytest.approx(few)  # type: ignore[arg-type]


def test_a_fit_needs_two_segments_in_common():
    rates = np.random.default_rng(1).normal(0.0, 5.0, (2400, 3)) + [0.0, 1.0, 0.0]
    for begins, there in (([20.0], False), ([20.0, 60.0], True), ([6.9, 60.0], False), ([60.0, 83.1], False)):
        given = made_segments(begins)
        given.turned_deg[:] = np.arange(30.0) % 2
        found = fit.fitted(moved(rates), steady(150, 9.0), given, 0.0)
        assert (found is not None) is there


# compare.py


def test_a_yaw_is_the_rate_over_the_cosine_of_the_lean():
    """Within a step, the integral of 10 deg/s about up at 20 m/s: the sine of the lean is 20 * 0.17453 / 9.80665."""
    rates = np.zeros((1000, 3))
    rates[500:, 1] = 10.0
    for speed, sine in ((20.0, 20.0 * np.radians(10.0) / 9.80665), (100.0, 0.87)):
        sums = compare._double_sums(moved(rates), steady(60, speed), 0.0)
        cosine = np.sqrt(1.0 - sine**2)
        assert np.diff(sums[:, 0])[300] == pytest.approx(0.0, abs=1e-9)
        assert (sums[1000, 0] - 2 * sums[800, 0] + sums[600, 0]) == pytest.approx(10.0 / cosine * 10.0 * 10.0, rel=1e-6)


def test_the_speed_is_that_of_the_track_at_the_shift():
    """The track has 0 m/s before 30 s and 20 m/s later. The ride begins at 20 s of the track."""
    track = steady(100, 20.0)
    track.good[:30] = False
    rates = np.tile([0.0, 10.0, 0.0], (1000, 1))
    slopes = np.diff(compare._double_sums(moved(rates), track, 20.0)[:, 0], 2) / STEP_S**2
    assert slopes[100] == pytest.approx(10.0)
    assert slopes[300] == pytest.approx(10.0 / np.sqrt(1.0 - (20.0 * np.radians(10.0) / 9.80665) ** 2))
    # 29.5 and 30.5 s are the middles of the steps, so 10 m/s is at 30.0 s, 10.0 s of the ride
    assert slopes[199] == pytest.approx(10.0 / np.sqrt(1.0 - (10.0 * np.radians(10.0) / 9.80665) ** 2), rel=2e-3)


def test_the_axes_across_up():
    """For an up along y, the axes across it are -z and -x. For an up along x, the smallest element is y: z and -y."""
    rates = np.tile([1.0, 2.0, 4.0], (400, 1))
    for up, axes in (((0.0, 1.0, 0.0), (2.0, -4.0, -1.0)), ((1.0, 0.0, 0.0), (1.0, 4.0, -2.0))):
        sums = compare._double_sums(moved(rates, up), steady(30, 0.0), 0.0)
        assert sums[400, :3] == pytest.approx(np.array(axes) * 20.0**2 / 2.0)


def test_forces_are_integrated_without_their_mean():
    """A force of 0 and then 0.1 g for 10 s each: the speed falls by 4.9 m/s and rises again. Its integral is
    -4.9 * 20 / 2."""
    motion = moved(np.tile([0.0, 1.0, 0.0], (400, 1)))
    motion.force_g[:, 0] = np.where(np.arange(400) < 200, 0.0, 0.1)
    sums = compare._double_sums(motion, steady(30, 0.0), 0.0)
    assert sums[400, 3:] == pytest.approx([-0.98 * 9.80665 / 1.96 * 10.0, 0.0, 0.0], abs=1e-6)


def test_a_drift_moves_segments_apart():
    """A drift of 0.01 about the middle at 35 s moves the segment at 15 s by -0.2 s, and that at 55 s by 0.2 s."""
    at_s = np.arange(2000) * STEP_S
    motion = moved(np.outer(np.sin(at_s), [0.0, 1.0, 0.0]))
    compared = compare.Comparison(motion, steady(100, 0.0), made_segments([10.0, 50.0], 10), 0.0, 2.0)
    assert compared.middle_s == pytest.approx(35.0)
    drifted = compared.turned(0.0, 0.01, 1)[0]
    assert drifted[0, 0] == pytest.approx(compared.turned(-0.25, 0.0, 1)[0, 0, 0], abs=0.06)
    assert drifted[1, -1] == pytest.approx(compared.turned(0.245, 0.0, 1)[0, 1, -1], abs=0.06)


# match.py


def found_fit(shift_s=10.0, evidence=50.0, **others) -> fit.TrackFit:
    given = {"drift": 0.0, "sigma_s": 0.1, "correlation": 0.95, "tilt": np.zeros(2), "segments": 4} | others
    return fit.TrackFit(shift_s=shift_s, evidence=evidence, **given)


@pytest.fixture
def matched(monkeypatch):
    """Return a function that returns the Match, or the refusal, of a track for these fits."""
    track = Track(1000.0 + np.arange(100.0), np.zeros(100), np.arange(100.0) * 1e-4, np.full(100, 9.0), "t")
    motion = moved(np.zeros((1600, 3)))

    def result(*fits, mirrored=False, apart=0.0):
        monkeypatch.setattr(match, "_check_turns", lambda *_: None)
        monkeypatch.setattr(match, "_rough_shifts", lambda *_: (mirrored, list(range(len(fits)))))
        monkeypatch.setattr(match, "fitted", lambda *given: fits[given[3]])
        monkeypatch.setattr(match, "cost_of_one_shift", lambda *_: apart)
        try:
            return match.match(motion, track)
        except InputError as error:
            return str(error)

    return result


def test_a_match_by_hand(matched):
    """The ride of 80 s begins at 10 s of the track of 99 s, so 80 s are in common; from 40 s on, it is 59 s."""
    found = matched(None, found_fit(), found_fit(30.0, 43.9))
    assert (found.start_utc_s, found.drift, found.sigma_s, found.correlation) == (1010.0, 0.0, 0.1, 0.95)
    assert found.common_s == pytest.approx(80.0)
    assert matched(found_fit(40.0)).common_s == pytest.approx(59.0)
    assert matched(found_fit(-5.0)).common_s == pytest.approx(75.0)


def test_the_evidence_and_correlation_that_a_match_needs(matched):
    few = "they have 120 s with too few bends in common"
    assert matched(found_fit(evidence=15.0, correlation=0.6)).correlation == 0.6
    assert matched(found_fit(evidence=14.9)).startswith(few)
    assert matched(found_fit(evidence=14.9, correlation=0.9)).startswith("at no time does the ride turn like")
    assert matched(found_fit(correlation=0.59)).startswith("at no time does the ride turn like")
    assert matched(found_fit(evidence=14.9), mirrored=True).startswith("the ride turns left where the track turns r")
    assert matched(found_fit(), mirrored=True).start_utc_s == 1010.0
    assert matched(None).startswith("they have less than 60 s of riding in common")


def test_another_shift_needs_six_less_evidence(matched):
    assert matched(found_fit(40.0, 44.1), found_fit()).startswith("the track fits at two times, 30 s apart")
    assert matched(found_fit(40.0, 44.0), found_fit()).start_utc_s == 1010.0
    assert matched(found_fit(16.0, 49.0), found_fit()).start_utc_s == 1010.0  # the same shift, but for 6 s
    assert matched(found_fit(3.9, 49.0), found_fit()).startswith("the track fits at two times, 6 s apart")


def test_a_drift_or_another_pace_is_another_day(matched):
    assert matched(found_fit(drift=-400e-6), apart=3.0).drift == -400e-6
    for refused in (matched(found_fit(drift=-401e-6)), matched(found_fit(), apart=3.1)):
        assert refused.startswith("the ride turns like the track, but at other times")
    assert matched(found_fit(sigma_s=0.3)).sigma_s == 0.3
    assert matched(found_fit(sigma_s=0.31)).startswith("the track fits only to 0.3 s, not to 0.3 s")


def test_rough_shifts_need_a_tenth_of_the_best_evidence(monkeypatch):
    """The likelihoods are 20 at 10 s and 1.9 or 2.1 at 30 s: the second is tried only if it has 2. Of a ride with
    100 values, the place 119 is the shift 10 s."""
    known = np.ones(200, dtype=bool)
    for other, tried in ((1.9, [10.0]), (2.1, [10.0, 30.0])):
        found = np.zeros(299)
        found[119], found[159] = 20.0, other
        monkeypatch.setattr(match, "_changes_of_track", lambda *_: (np.zeros(200), known))
        monkeypatch.setattr(match, "_changes_of_ride", lambda *_: (np.zeros(100), known[:100]))
        monkeypatch.setattr(match, "correlations", lambda *_, found=found: (found, np.full(299, 60)))
        monkeypatch.setattr(match, "log_likelihood_ratio", lambda values, *_: np.maximum(values, 0.0))
        assert match._rough_shifts(None, None) == (False, tried)  # type: ignore[arg-type]
        monkeypatch.setattr(match, "correlations", lambda *_, found=found: (found, np.full(299, 59)))
        assert match._rough_shifts(None, None) == (False, [])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("likely", "opposite", "mirrored"), [(7.0, 15.1, True), (7.0, 14.9, False), (9.0, 17.9, False), (9.0, 18.1, True)]
)
def test_a_mirrored_ride_fits_twice_as_well(monkeypatch, likely, opposite, mirrored):
    known = np.ones(200, dtype=bool)
    found = np.zeros(299)
    found[119], found[159] = likely, -opposite
    monkeypatch.setattr(match, "_changes_of_track", lambda *_: (np.zeros(200), known))
    monkeypatch.setattr(match, "_changes_of_ride", lambda *_: (np.zeros(100), known[:100]))
    monkeypatch.setattr(match, "correlations", lambda *_: (found, np.full(299, 60)))
    monkeypatch.setattr(match, "log_likelihood_ratio", lambda values, *_: np.maximum(values, 0.0))
    assert match._rough_shifts(None, None)[0] is mirrored  # type: ignore[arg-type]


# clocks.py

PLAIN = CalibrationFile(vehicle_from_sensor=np.eye(3), aligned=True)


@pytest.fixture
def clocked(monkeypatch):
    """Return a function that returns the shift that is fitted, or the refusal.

    The first sensor has 2000 cells and the second 1600. tried: (place, correlation, evidence) of each rough shift.
    """

    def result(*tried):
        by_shift = {round((place - 1599) * STEP_S, 6): (alike, ratio) for place, alike, ratio in tried}
        ratios = {alike: ratio for _, alike, ratio in tried}
        monkeypatch.setattr(clocks, "peaks", lambda *_: [place for place, _, _ in tried])
        monkeypatch.setattr(clocks, "_correlation_at", lambda *given: by_shift[round(given[4], 6)][0])
        monkeypatch.setattr(
            clocks, "log_likelihood_ratio",
            lambda values, *_: np.array(ratios[float(values)]) if values.ndim == 0 else values,
        )  # fmt: skip
        monkeypatch.setattr(clocks, "_rotation", lambda *_: np.eye(3))
        monkeypatch.setattr(clocks, "_fitted", lambda *given: Clocks(given[4], 0.0, 0.9, 80.0))
        rates = np.random.default_rng(1).normal(0.0, 5.0, (2000, 3))
        try:
            return round(clocks.clocks(moved(rates), moved(rates[:1600]), PLAIN, PLAIN).later_s, 6)
        except InputError as error:
            return str(error)

    return result


def test_the_best_rough_shift_is_fitted(clocked):
    assert clocked((1599, 0.9, 20.0)) == 0.0
    assert clocked((1699, 0.91, 40.0), (1599, 0.9, 20.0)) == 5.0
    assert clocked((1699, 0.9, 34.0), (1599, 0.91, 40.0)) == 0.0
    assert clocked((1699, 0.9, 34.1), (1599, 0.91, 40.0)).startswith("they fit at two times")


def test_two_logs_need_evidence_and_correlation(clocked):
    assert clocked((1599, 0.8, 15.0)) == 0.0
    for refused in (clocked((1599, 0.79, 20.0)), clocked((1599, 0.9, 14.9)), clocked()):
        assert refused.startswith("at no time do they turn alike for a minute")


def test_a_correlation_of_rates_by_hand():
    """One axis has 1, 2, 3, 4 and the other 2, 4, 6, 0: without their means the product is 0 - (-1.5 * -1 ...) = -2,
    and the squares are 5 and 20."""
    a = moved(np.zeros((4, 3)))
    one, other = np.array([[1.0], [2.0], [3.0], [4.0]]), np.array([[2.0], [4.0], [6.0], [0.0]])
    product = -1.5 * -1.0 + -0.5 * 1.0 + 0.5 * 3.0 + 1.5 * -3.0
    assert clocks._correlation_at(a, a, one, other, 0.0) == pytest.approx(product / np.sqrt(5.0 * 20.0))
    assert clocks._correlation_at(a, a, one, one[::-1], 0.0) == pytest.approx(-1.0)
    later = clocks._correlation_at(a, moved(np.zeros((3, 3))), one, one[1:], STEP_S)
    assert later == pytest.approx(1.0)


def test_clocks_use_a_sum_and_an_interpolation_by_hand():
    p, q = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[1.0, 1.0], [2.0, -1.0]])
    assert clocks._dot(p, q, np.array([1.0, 10.0])) == pytest.approx(3.0 + 20.0)
    between = clocks._interpolated_at(np.array([0.0, 1.0]), np.array([[0.0, 5.0], [2.0, 9.0]]), np.array([0.25]))
    assert between == pytest.approx(np.array([[0.5, 6.0]]))


def test_a_fit_of_clocks_finds_a_shift_of_eight_cells():
    """A shift of 0.4 s is found from no shift. The rates of B have an error of 0.5 deg/s."""
    at_s = np.arange(3000) * STEP_S
    rates = np.column_stack([20.0 * np.sin(at_s * rate + rate) for rate in (0.7, 0.9, 1.3)])
    late = np.column_stack([20.0 * np.sin((at_s + 0.4) * rate + rate) for rate in (0.7, 0.9, 1.3)])
    late += np.random.default_rng(1).normal(0.0, 0.5, late.shape)
    found = clocks._fitted(moved(rates), moved(late), rates, late, 0.0)
    assert found.later_s == pytest.approx(0.4, abs=5e-3)
    assert found.drift == pytest.approx(0.0, abs=5e-5)
    assert found.common_s == pytest.approx(150.0 - 0.4, abs=0.06)


# agreement.py


def test_leans_are_compared_above_3_mps_only(monkeypatch):
    """Two logs of 100 s; the second one is 1 s later. It rides at 3.0 m/s until 40 s, and faster until 90 s."""
    t_s = np.arange(0.0, 100.0, 0.1)
    ride = SimpleNamespace(
        t_s=t_s, lean_deg=np.zeros(1000), lean_sigma_deg=np.ones(1000), notices=[],
        speed_mps=np.where((t_s > 40.0) & (t_s < 90.0), 3.1, 3.0),
    )  # fmt: skip
    monkeypatch.setattr(agreement, "read_twice", lambda source: source)
    monkeypatch.setattr(agreement, "motion", lambda *_: None)
    monkeypatch.setattr(agreement, "clocks", lambda *_: Clocks(1.0, 0.0, 0.9, 99.0))
    monkeypatch.setattr(agreement, "smooth", lambda *_: ride)
    monkeypatch.setattr(agreement, "replay", lambda *_: ride)
    found = agreement.compare_rides("a", "b", PLAIN, PLAIN)
    assert found.t_s[:2] == pytest.approx([0.0, 0.02]) and found.t_s[-1] == pytest.approx(99.88)
    assert found.smoothed.seconds == pytest.approx(49.0, abs=0.3)
    riding = found.t_s[np.isfinite(found.leans["smoothed B"])]
    assert riding[0] == pytest.approx(41.0, abs=0.11) and riding[-1] == pytest.approx(90.0, abs=0.11)
    ride.speed_mps = np.where((t_s > 40.0) & (t_s < 60.0), 3.1, 3.0)
    with pytest.raises(InputError, match="a, b: under 20 s of riding in common"):
        agreement.compare_rides("a", "b", PLAIN, PLAIN)


def test_a_lean_is_unknown_between_samples_200_ms_apart():
    for gap_s, known in ((0.19, True), (0.21, False)):
        found = agreement._interpolated(np.array([0.0, gap_s]), np.array([1.0, 1.0]), np.array([0.05]))
        assert np.isfinite(found[0]) == known


def test_a_picture_shows_both_leans_and_their_difference(monkeypatch, tmp_path):
    from matplotlib.figure import Figure

    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, dpi: drawn.append((figure, path, dpi)))
    names = ("live A", "live B", "smoothed A", "smoothed B")
    leans = {name: np.full(3, value) for name, value in zip(names, (1.0, 3.0, 10.0, 17.0))}
    same = agreement.Difference(90.0, 2.0, 1.5, 1.0, 1.9, 3.0, 1.03, 0.04, 1.2, 0.5, 0.9)
    found = agreement.Agreement(
        Clocks(0.0, 0.0, 0.9, 9.0), None, same, np.array([0.0, 60.0, 120.0]), leans, {}, ("x/A.csv", "B.csv")
    )
    agreement.draw(tmp_path / "c.png", found)
    figure, path, dpi = drawn[0]
    assert (tuple(figure.get_size_inches()), path, dpi) == ((14.0, 7.0), tmp_path / "c.png", 100)
    above, below = figure.axes
    lines = [(line.get_label(), line.get_ydata()[0], line.get_linewidth()) for line in (*above.lines, *below.lines)]
    assert lines == [
        ("smoothed A: A.csv", 10.0, 1.6), ("smoothed B: B.csv", 17.0, 0.9), ("live, B less A", 2.0, 0.6),
        ("smoothed, B less A", 7.0, 1.2),
    ]  # fmt: skip
    assert above.get_xlim() == (0.0, 120.0) and below.xaxis.get_major_formatter()(60.0, 0) == "1:00"
    assert not any(text.get_parse_math() for axis in figure.axes for text in axis.get_legend().get_texts())


# track_files.py


def test_a_time_without_a_zone_is_universal():
    """Both formats write Universal Time. One day has 86,400 s."""
    day = dt.datetime(1970, 1, 2)
    assert track_files._utc_s(day) == track_files._utc_s(day.replace(tzinfo=dt.UTC)) == 86_400.0
    assert track_files._utc_s(day.replace(tzinfo=dt.timezone(dt.timedelta(hours=2)))) == 79_200.0


def test_a_gpx_speed_is_its_own_or_an_extensions():
    def extension(tag, text):
        return SimpleNamespace(iter=lambda: [SimpleNamespace(tag=tag, text=text)])

    def speed(own, *extensions):
        return track_files._gpx_speed(SimpleNamespace(speed=own, extensions=extensions))

    assert speed(3, extension("speed", "4")) == 3.0
    assert speed(None, extension("{x}hr", "90"), extension("{x}Speed", "4")) == 4.0
    for nothing in ((), (extension("speed", "x"),), (extension("speed", ""),), (extension(None, "4"),)):
        assert np.isnan(speed(None, *nothing))
