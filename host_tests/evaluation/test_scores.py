"""The scores of leans whose errors are known: a shown lean, and a lean that a fault makes wrong."""

import math

import numpy as np
import pytest
from kickstand_workshop.evaluation import faults, integrity
from kickstand_workshop.evaluation.faults import FAULTS
from kickstand_workshop.evaluation.integrity import FaultJob, Trace
from kickstand_workshop.evaluation.report import pooled
from kickstand_workshop.evaluation.runs import LeanScore, lag_ms, score

RATE, N = 200.0, 40_000
TIME = np.arange(N) / RATE
LEAN = np.where(TIME < 160.0, 35.0 * np.sin(2.0 * np.pi * 0.13 * TIME) * np.sin(2.0 * np.pi * 0.031 * TIME), 0.0)
# The bike stands for 5 s, leans by up to 35 degrees until 160 s, and then goes straight ahead
TRUTH = {
    "lean_deg": LEAN,
    "speed_mps": np.where(TIME < 5.0, 0.0, 15.0),
    "yaw_rate_dps": -np.degrees(9.8 / 15.0 * np.tan(np.radians(LEAN))),
}
NOISE = np.random.default_rng(1).normal(scale=2.0, size=N)


@pytest.mark.parametrize(
    ("shown", "scores"),
    [
        (LEAN + 0.7, {"rms_deg": 0.7, "p95_deg": 0.7, "worst_deg": 0.7, "straight_bias_deg": 0.7, "lag_ms": 0.0}),
        (
            LEAN + np.where(TIME == 150.0, 50.0, NOISE),
            {"rms_deg": 2.0, "p95_deg": 3.92, "worst_deg": 50.0, "slope": 1.0},
        ),
        (np.where(np.abs(LEAN) > 10.0, 0.4, 3.0) * LEAN, {"slope": 0.4}),  # only leans over 10 degrees count
        (LEAN + np.where(TIME < 4.9, 60.0, 0.0), {"worst_deg": 0.0}),  # before it sets off
        (LEAN + np.where(TIME < 170.0, 5.0, -0.25), {"straight_bias_deg": -0.25}),  # the last tenth of the ride
    ],
)
def test_known_errors_have_known_scores(shown, scores):
    result = vars(score(shown, TRUTH, RATE))
    assert {name: result[name] for name in scores} == pytest.approx(scores, rel=0.03, abs=0.02)


def test_a_ride_that_determines_nothing_has_no_figure():
    bend = TRUTH | {"lean_deg": np.full(N, 20.0)}
    assert math.isnan(score(LEAN, bend, RATE).straight_bias_deg)
    flat = score(np.ones(N), TRUTH | {"lean_deg": np.zeros(N)}, RATE)
    assert math.isnan(flat.slope) and math.isnan(flat.lag_ms)


@pytest.mark.parametrize("late_ms", [-42.5, 0.0, 7.5, 180.0])
def test_lag_is_found_between_samples(late_ms):
    def lean(t_s):
        return 30.0 * np.sin(2.0 * np.pi * 0.21 * t_s) + 10.0 * np.sin(2.0 * np.pi * 0.53 * t_s)

    assert lag_ms(lean(TIME - late_ms / 1000.0) + 0.05 * NOISE, lean(TIME), RATE) == pytest.approx(late_ms, abs=1.0)


def test_pooling_keeps_the_worst_of_the_rides_that_have_a_figure():
    unknown = float("nan")
    scores = [LeanScore(1.0, 2.0, 3.0, 0.9, 5.0, 0.1), LeanScore(3.0, 4.0, 9.0, 1.1, unknown, -0.6)]
    assert pooled(scores) == pytest.approx({
        "rms": math.sqrt(5.0), "worst_ride_rms": 3.0, "p95": 3.0, "worst": 9.0, "slope": 1.0, "slope_low": 0.9,
        "slope_high": 1.1, "lag_ms": 5.0, "straight_bias": -0.6,
    })  # fmt: skip
    lone = pooled([LeanScore(1.0, 2.0, 3.0, unknown, unknown, unknown), scores[0]])
    assert [lone[name] for name in ("slope", "slope_low", "slope_high", "lag_ms")] == [0.9, 0.9, 0.9, 5.0]


def during(*spans):
    """Return True in these spans (from s, to s) of 60 s with 10 samples per second."""
    times_s = np.arange(600) / 10.0
    return np.any([(times_s >= first_s - 1e-6) & (times_s < end_s - 1e-6) for first_s, end_s in spans], axis=0)


def judged(error_deg, shown=True, end_s=100.0):
    """Judge 60 s of riding at a lean of 20 degrees, with a fault from 10 s to end_s."""
    lean = np.full(600, 20.0)
    everywhere = np.ones(600, dtype=bool)
    trace = Trace(
        np.arange(600) / 10.0, lean + error_deg, everywhere & shown, lean, np.full(600, 15.0), np.nan, 10.0, end_s
    )
    return integrity.judge(FaultJob(None, 0), trace)


def test_a_shown_lean_over_8_degrees_wrong_for_a_second_misleads():
    outcome = judged(np.where(during((12, 12.9), (20, 22), (30, 33)), 9.0, 7.9))
    assert (outcome.misleading_s, outcome.longest_s, outcome.available) == pytest.approx((5.0, 3.0, 1.0))
    hidden = judged(30.0 * during((20, 30)), ~during((20, 30)))
    assert (hidden.misleading_s, hidden.available, hidden.hidden_after_s) == pytest.approx((0.0, 5 / 6, 10.0))
    for back_s, end_s, recovered in ((28.0, 20.0, True), (29.8, 20.0, False), (28.0, 100.0, None)):
        assert judged(0.0, ~during((15, back_s)), end_s).recovered is recovered


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.title)
def test_each_fault_changes_readings_while_it_lasts(fault):
    readings = np.random.default_rng(0).normal((0, 1.3, 0, 0, 0, 0, 0), 0.01, (12_000, 7))
    ill = faults.apply(fault, readings, 200.0, 20.0, 4, np.eye(3))
    changed = np.flatnonzero((ill.readings != readings).any(axis=1) | ill.lost)
    assert ill.first == (0 if fault.from_start else 4000) and ill.first <= changed[0] and changed[-1] < ill.end
    assert ill.end - ill.first == (12_000 - ill.first if fault.seconds is None else round(200 * fault.seconds))
    if fault.title == "mount slips by 20 degrees":
        assert np.linalg.norm(ill.readings[:, :3], axis=1) == pytest.approx(np.linalg.norm(readings[:, :3], axis=1))
    if fault.title == "gyro axis at the end of its range, 1 s":
        assert ill.saturated.sum() == 200
