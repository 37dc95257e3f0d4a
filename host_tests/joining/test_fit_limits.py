"""The fit of a track to a ride, with values computed by hand or by plain numpy."""

import numpy as np
import pytest
from kickstand_tools.joining import compare, fit
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.joining.track import Course, Segments

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


def test_small_errors_weigh_as_half_a_sigma():
    """Errors are divided by their usual size, but at least by 0.5. So an error of 0.1 becomes e = 0.2. The weight of
    this error is 4 * 1.25 / (1 + 0.04 / 4).
    """
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
    """Without drift, the best of the tried shifts has the smallest sum of costs. For the evidence, the 180 steps count
    as 45 independent steps."""
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
    """A result contains the shift at the ride's first sample. With a drift of 0.0001 and the middle at 145 s, the shift
    in the middle is 2 * 0.9999 + 0.0145."""
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
    """The rate about up is 10 deg/s. At 20 m/s the sine of the lean is therefore 20 * 0.17453 / 9.80665."""
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
    """If up is along y, the two axes across it are -z and -x. If up is along x, the two axes are z and -y."""
    rates = np.tile([1.0, 2.0, 4.0], (400, 1))
    for up, axes in (((0.0, 1.0, 0.0), (2.0, -4.0, -1.0)), ((1.0, 0.0, 0.0), (1.0, 4.0, -2.0))):
        sums = compare._double_sums(moved(rates, up), steady(30, 0.0), 0.0)
        assert sums[400, :3] == pytest.approx(np.array(axes) * 20.0**2 / 2.0)


def test_forces_are_integrated_without_their_mean():
    """A force of 0 and then 0.1 g for 10 s each: the speed falls by 4.9 m/s and rises again. The integral of the speed
    is -4.9 * 20 / 2."""
    motion = moved(np.tile([0.0, 1.0, 0.0], (400, 1)))
    motion.force_g[:, 0] = np.where(np.arange(400) < 200, 0.0, 0.1)
    sums = compare._double_sums(motion, steady(30, 0.0), 0.0)
    assert sums[400, 3:] == pytest.approx([-0.98 * 9.80665 / 1.96 * 10.0, 0.0, 0.0], abs=1e-6)


def test_a_drift_moves_segments_apart():
    """A drift of 0.01 about the middle at 35 s moves the segment at 15 s by -0.2 s and the segment at 55 s by 0.2 s."""
    at_s = np.arange(2000) * STEP_S
    motion = moved(np.outer(np.sin(at_s), [0.0, 1.0, 0.0]))
    compared = compare.Comparison(motion, steady(100, 0.0), made_segments([10.0, 50.0], 10), 0.0, 2.0)
    assert compared.middle_s == pytest.approx(35.0)
    drifted = compared.turned(0.0, 0.01, 1)[0]
    assert drifted[0, 0] == pytest.approx(compared.turned(-0.25, 0.0, 1)[0, 0, 0], abs=0.06)
    assert drifted[1, -1] == pytest.approx(compared.turned(0.245, 0.0, 1)[0, 1, -1], abs=0.06)
