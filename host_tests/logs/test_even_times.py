"""Rounded times and times that several samples share become even again. The result is compared with the true times."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs.even_times import even_times

ROUND = {"down": lambda x: np.floor(x + 1e-9), "to nearest": np.rint}


@pytest.mark.parametrize("way", ROUND)
@pytest.mark.parametrize(
    ("rate_hz", "tick_s"), [(52, 1.0), (95, 0.01), (101, 1.0 / 64.0), (104, 0.01), (143, 0.01), (416, 0.001)]
)
def test_rounded_times_are_even_again(rate_hz, tick_s, way):
    """Without the repair some steps are 0 and some are twice as long. The 200 samples at either end do not count."""
    true = 0.123 + np.arange(5000) / rate_hz
    recorded = ROUND[way](true / tick_s) * tick_s
    times = even_times(recorded)
    error = (times - true)[200:-200]
    assert np.diff(times)[200:-200] * rate_hz == pytest.approx(1.0, abs=0.03)
    assert np.abs(error - error.mean()).max() < 0.07 * tick_s
    assert np.all(np.diff(times) > 0.0) and np.abs(times - recorded).max() <= 0.6 * tick_s + 1e-9


def test_samples_with_a_common_time_are_spread():
    true = np.arange(5000) / 104
    times = even_times(np.repeat(true[9::10], 10))
    error = (times - true)[200:-200]
    assert np.diff(times)[200:-200] * 104 == pytest.approx(1.0, abs=0.01)
    assert np.abs(error - error.mean()).max() < 0.001
    assert even_times([0.0, 0.0, 0.1, 0.1, 0.2]) == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2], abs=0.06)


@given(st.lists(st.integers(0, 20), min_size=2, max_size=200), st.sampled_from([1e-6, 0.001, 0.01, 1.0]))
def test_times_increase_and_stay_near(steps, tick_s):
    """For any times that do not decrease: each result is after the previous one, or the clock has stopped."""
    recorded = np.cumsum([0, *steps]) * tick_s
    try:
        times = even_times(recorded)
    except InputError as error:
        assert "the same in all samples" in str(error) or "stands still" in str(error)
        return
    assert len(times) == len(recorded) and np.all(np.diff(times) > 0.0)


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([0.0, 0.01, 0.01, 0.03, 0.02], r"log: time goes back at 0\.02 s: it must increase"),
        ([1.0, 1.0, 1.0], "log: the time is the same in all samples"),
        ([0.0, np.nan], "log: some times are not numbers"),
        ([*np.arange(100) / 100.0, *[1.0] * 51, *(1.01 + np.arange(100) / 100.0)], "still at 1 s, in 51 samples"),
        (np.repeat(np.arange(1000) * 0.1, np.where(np.arange(1000) == 500, 107, 10)), "still at 50 s, in 107 samples"),
    ],
)
def test_an_invalid_time_is_refused(times, words):
    with pytest.raises(InputError, match=words):
        even_times(times, "log")
