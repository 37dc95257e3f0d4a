"""The repair of rounded times, and of times that several samples share. The result is compared with the true times."""

import doctest
import sys

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.even_times import even_times

ROUND = {"down": lambda x: np.floor(x + 1e-9), "to nearest": np.rint}


def errors(true, recorded):
    """Repair the recorded times and return two errors. The 200 samples at either end do not count.

    Returns:
        the largest relative error of a step.
        the largest error of a time in s, after the mean error is removed.
    """
    found = even_times(recorded)
    assert np.all(np.diff(found) > 0.0)
    inner = slice(200, -200)
    away = (found - true)[inner]
    return np.max(np.abs(np.diff(found) / np.diff(true) - 1.0)[inner]), np.max(np.abs(away - np.mean(away)))


@pytest.mark.parametrize("how", ROUND)
@pytest.mark.parametrize(
    ("rate_hz", "tick_s"), [(52, 1.0), (95, 0.01), (101, 1.0 / 64.0), (104, 0.01), (208, 1.0 / 64.0), (416, 0.001)]
)
def test_rounded_times_are_even_again(rate_hz, tick_s, how):
    true = 0.123 + np.arange(5000) / rate_hz
    recorded = ROUND[how](true / tick_s) * tick_s
    step_error, time_error = errors(true, recorded)
    assert step_error < 0.03  # without the repair some steps are 0 and some are twice as long
    assert time_error < 0.07 * tick_s
    found = even_times(recorded)
    assert np.max(np.abs(found - recorded)) <= 0.6 * tick_s + 1e-9


def test_samples_with_a_common_time_are_spread():
    true = np.arange(5000) / 104
    step_error, time_error = errors(true, np.repeat(true[9::10], 10))
    assert step_error < 0.01
    assert time_error < 0.001


def test_fine_or_even_times_are_unchanged():
    chance = np.random.default_rng(1)
    for times in (
        np.arange(1000) / 100.0,
        np.delete(np.arange(1000) / 100.0, [5, 500, 501]),  # some samples are lost
        np.round(np.cumsum(0.01 + 0.002 * chance.random(1000)), 4),
        1.7e9 + np.arange(1000) / 200.0,
    ):
        assert np.array_equal(even_times(times), times)
    assert len(even_times([])) == 0
    assert even_times([3.0]).tolist() == [3.0]


def test_gaps_stay_gaps():
    true = np.concatenate((np.arange(1500) / 104, 60.0 + np.arange(1500) / 104))
    found = even_times(np.round(true, 2))
    steps = np.diff(found)
    assert steps[1499] == pytest.approx(true[1500] - true[1499], abs=0.01)
    assert np.max(np.abs(np.delete(steps, 1499) * 104 - 1.0)) < 0.1


def test_repeated_line_moves_other_times_within_rounding():
    times = np.arange(1000) / 100.0
    twice = np.insert(times, 500, times[500])
    found = even_times(twice)
    assert np.all(np.diff(found) > 0.004)
    assert np.max(np.abs(found - twice)) <= 0.006
    assert np.max(np.abs(found - twice)[:400]) < 1e-3
    fine = times + 1e-6 * np.random.default_rng(2).integers(0, 900, 1000)
    found = even_times(np.insert(fine, 500, fine[500]))
    assert np.delete(found, 501) == pytest.approx(fine, abs=1e-5)
    assert fine[500] < found[501] < fine[501]


def test_invalid_time_is_refused():
    """test_cli_logs.py tests times that go back, and times that are all the same."""
    with pytest.raises(InputError, match=r"time stands still at 0\.99 s"):
        even_times([*np.arange(100) / 100.0, *[0.99] * 600, *(1.0 + np.arange(100) / 100.0)])


def test_example_in_the_docstring_works():
    assert doctest.testmod(sys.modules[even_times.__module__]).failed == 0


@pytest.mark.parametrize(("gap", "error"), [(4, 0.01), (8, 0.01), (40, 0.01)])
def test_gaps_do_not_lengthen_the_period(gap, error):
    """The samples are 10.4 ms apart, and their times are rounded to 10 ms. After every 20 samples some samples are
    missing."""
    numbers = np.concatenate([np.arange(20) + (19 + gap) * k for k in range(60)])
    found = even_times(np.rint(numbers * 1.04) / 100.0)
    steps = np.diff(found).reshape(-1)
    inside = np.arange(len(steps)) % 20 != 19
    assert np.mean(steps[inside]) == pytest.approx(0.0104, rel=error)
    assert np.max(np.abs(steps[inside] / 0.0104 - 1.0)) < 0.4


def test_a_time_that_goes_back_is_named():
    with pytest.raises(InputError, match=r"log: time goes back at 0.02 s: it must increase"):
        even_times([0.0, 0.01, 0.01, 0.03, 0.02], "log")
    with pytest.raises(InputError, match="the time is the same in all samples"):
        even_times([1.0, 1.0, 1.0])
    with pytest.raises(InputError, match="some times are not numbers"):
        even_times([0.0, np.nan])
