"""Tests the scores of an evaluation with leans whose errors are known."""

import math

import numpy as np
import pytest
from kickstand_workshop.evaluation.metrics import LeanScore, lag_ms, score, slope, straights
from kickstand_workshop.evaluation.picture import ZOOM_S, zoom_start
from kickstand_workshop.evaluation.report import pooled

RATE = 200.0
N = 40000
TIME = np.arange(N) / RATE


def truth() -> dict[str, np.ndarray]:
    """Return the truth of a ride. The bike leans by up to 35 degrees in the first 80 % and then goes straight ahead."""
    lean = 35.0 * np.sin(2.0 * np.pi * 0.13 * TIME) * np.sin(2.0 * np.pi * 0.031 * TIME)
    lean[int(0.8 * N) :] = 0.0
    return {
        "lean_deg": lean,
        "speed_mps": np.where(TIME < 5.0, 0.0, 15.0),
        "yaw_rate_dps": -np.degrees(9.8 / 15.0 * np.tan(np.radians(lean))),
    }


def test_constant_error_has_the_expected_scores():
    true = truth()
    found = score(true["lean_deg"] + 0.7, true, RATE)
    assert (found.rms_deg, found.p95_deg, found.worst_deg) == pytest.approx((0.7, 0.7, 0.7))
    assert found.straight_bias_deg == pytest.approx(0.7)
    assert found.lag_ms == pytest.approx(0.0, abs=0.5)


def test_noise_and_one_outlier_have_the_expected_scores():
    true = truth()
    noise = np.random.default_rng(1).normal(scale=2.0, size=N)
    noise[30000] = 50.0
    found = score(true["lean_deg"] + noise, true, RATE)
    assert found.rms_deg == pytest.approx(2.0, rel=0.03)
    assert found.p95_deg == pytest.approx(1.96 * 2.0, rel=0.03)
    assert found.worst_deg == 50.0
    assert found.slope == pytest.approx(1.0, abs=0.005)


def test_the_slope_is_the_share_shown_where_it_leans():
    true = truth()
    shown = np.where(np.abs(true["lean_deg"]) > 10.0, 0.4, 3.0) * true["lean_deg"]
    assert score(shown, true, RATE).slope == pytest.approx(0.4)
    assert math.isnan(slope(np.ones(10), np.ones(10)))


@pytest.mark.parametrize("late_ms", [-42.5, 0.0, 7.5, 180.0])
def test_lag_is_found_between_samples(late_ms):
    def lean(t):
        return 30.0 * np.sin(2.0 * np.pi * 0.21 * t) + 10.0 * np.sin(2.0 * np.pi * 0.53 * t)

    assert math.isnan(lag_ms(np.zeros(N), np.zeros(N), RATE))  # without motion there is no lag
    noise = np.random.default_rng(2).normal(scale=0.1, size=N)
    assert lag_ms(lean(TIME - late_ms / 1000.0) + noise, lean(TIME), RATE) == pytest.approx(late_ms, abs=1.0)


def test_time_before_setting_off_does_not_count():
    true = truth()
    shown = true["lean_deg"] + np.where(TIME < 4.9, 60.0, 0.0)
    assert score(shown, true, RATE).worst_deg == 0.0


def test_bias_is_only_from_the_last_straights():
    true = truth()
    shown = true["lean_deg"] + np.where(TIME < 0.85 * TIME[-1], 5.0, -0.25)
    assert score(shown, true, RATE).straight_bias_deg == pytest.approx(-0.25)
    true["lean_deg"][:] = 20.0
    assert not straights(true, RATE).any()
    assert math.isnan(score(shown, true, RATE).straight_bias_deg)


def test_pooling_keeps_the_worst():
    one = LeanScore(1.0, 2.0, 3.0, 0.9, 5.0, 0.1)
    two = LeanScore(3.0, 4.0, 9.0, 1.1, float("nan"), -0.6)
    found = pooled([one, two])
    assert found["rms"] == pytest.approx(math.sqrt(5.0))
    assert found["worst_ride_rms"] == 3.0
    assert found["worst"] == 9.0
    assert (found["slope_low"], found["slope_high"]) == (0.9, 1.1)
    assert found["straight_bias"] == -0.6
    assert found["lag_ms"] == 5.0


def test_ride_without_corners_does_not_spoil_the_pool():
    nothing = float("nan")
    flat, bent = LeanScore(1.0, 2.0, 3.0, nothing, nothing, nothing), LeanScore(1.0, 2.0, 3.0, 0.9, 5.0, 0.1)
    for scores in [flat, bent], [bent, flat]:
        found = pooled(scores)
        assert [found[name] for name in ("slope", "slope_low", "slope_high")] == [0.9] * 3
        assert (found["lag_ms"], found["straight_bias"]) == (5.0, 0.1)


def test_zoom_shows_the_most_leaning():
    lean = np.zeros(N)
    lean[20000:24000] = 30.0
    start = zoom_start(TIME, lean)
    assert 100.0 - ZOOM_S < start < 120.0
    assert zoom_start(TIME[:100], lean[:100]) == 0.0
