"""Rounded times and times that several samples share become even again. The result is compared with the true times."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.even_times import even_times
from kickstand_tools.logs.reader import read_blocks

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


def changing(low: int, high: int, n: int = 400):
    """Return times with steps of `low` and `high` ticks of 0.5 ms in random order, as many of each."""
    steps = np.random.default_rng(1).permutation(np.repeat([low, high], n // 2))
    return np.concatenate(([0], np.cumsum(steps))) * 0.0005


RANDOM = np.random.default_rng(1)
UNCHANGED = {
    "even": np.arange(1000) / 100.0,
    "some samples are lost": np.delete(np.arange(1000) / 100.0, [5, 500, 501]),
    "2 % of the steps are lost": np.cumsum([0.0, *[0.01] * 98, 0.02, 0.02]),
    "fine ticks": np.round(np.cumsum(0.01 + 0.002 * RANDOM.random(1000)), 4),
    "a tick of a twentieth": changing(20, 21),
    "since 1970": 1.7e9 + np.arange(1000) / 200.0,
    "one": np.array([3.0]),
    "none": np.array([]),
}


@pytest.mark.parametrize("name", UNCHANGED)
def test_fine_or_even_times_are_unchanged(name):
    assert np.array_equal(even_times(UNCHANGED[name]), UNCHANGED[name])
    assert not np.array_equal(even_times(changing(19, 20)), changing(19, 20))


@pytest.mark.parametrize(("repeats", "least", "most"), [(20, 1, 20), (45, 1, 45), (55, 900, 1000)])
def test_one_repeated_time_in_twenty_changes_all_times(repeats, least, most):
    """With fewer repeats only the repeated times are changed."""
    times = np.cumsum(0.01 + 0.002 * np.random.default_rng(1).random(1000)).round(6)
    rows = np.linspace(5, 990, repeats).astype(int)
    times[rows] = times[rows - 1]
    moved = np.abs(even_times(times) - times) > 1e-9
    assert least <= np.count_nonzero(moved) <= most


@pytest.mark.parametrize("gap", [4, 8, 40])
def test_gaps_do_not_lengthen_the_period(gap):
    """Samples are 10.4 ms apart, rounded to 10 ms. After every 20 samples some samples are missing."""
    numbers = np.concatenate([np.arange(20) + (19 + gap) * k for k in range(60)])
    steps = np.diff(even_times(np.rint(numbers * 1.04) / 100.0))
    inside = np.arange(len(steps)) % 20 != 19
    assert np.mean(steps[inside]) == pytest.approx(0.0104, rel=0.01)
    assert steps[inside] / 0.0104 == pytest.approx(1.0, abs=0.4)


@pytest.mark.parametrize("gap_s", [0.035, 0.5, 45.0])
def test_gaps_stay_gaps(gap_s):
    true = np.arange(3000) / 104 + np.where(np.arange(3000) >= 1500, gap_s, 0.0)
    steps = np.diff(even_times(np.round(true, 2)))
    assert steps[1499] == pytest.approx(gap_s + 1.0 / 104, abs=0.01)
    assert np.delete(steps, 1499) * 104 == pytest.approx(1.0, abs=0.1)


def test_a_repeated_line_moves_other_times_within_rounding():
    times = np.arange(1000) / 100.0
    twice = np.insert(times, 500, times[500])
    spread = even_times(twice)
    assert np.all(np.diff(spread) > 0.004) and np.abs(spread - twice).max() <= 0.006
    assert np.abs(spread - twice)[:400].max() < 1e-3
    fine = times + 1e-6 * np.random.default_rng(2).integers(0, 900, 1000)
    spread = even_times(np.insert(fine, 500, fine[500]))
    assert np.delete(spread, 501) == pytest.approx(fine, abs=1e-5) and fine[500] < spread[501] < fine[501]


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


@pytest.mark.parametrize(("usual", "crowd"), [(1, 50), (10, 97)])
def test_a_crowd_of_samples_at_one_time_is_spread(usual, crowd):
    """A clock has stopped at over 50 samples with one time, and at over ten times the usual number."""
    times = np.repeat(np.arange(1000) * 0.1, np.where(np.arange(1000) == 500, crowd, usual))
    assert np.all(np.diff(even_times(times)) > 0.0)


def rows_at(times):
    return [f"{time:.6f},0.{k % 9}1,-0.02,1.01,0.5,-0.5,0.1{k % 7}" for k, time in enumerate(times)]


LOGS = {  # recorded times, true times, the largest error
    "104 per s, rounded to hundredths": (np.round(np.arange(12_000) / 104, 2), np.arange(12_000) / 104, 0.004),
    "two samples per time": (np.repeat(np.arange(4500) / 100.0, 2), np.arange(9000) / 200.0, 0.006),
}


@pytest.mark.parametrize("name", LOGS)
@pytest.mark.parametrize("size", [300, 50_000, 1 << 22])
def test_times_are_spread_equally_for_any_block_size(text_log, small_blocks, name, size):
    """Rows that wait for the next block are neither lost nor doubled."""
    recorded, true, error = LOGS[name]
    small_blocks(size)
    notices = []
    blocks = list(read_blocks(text_log(*rows_at(recorded)), notices=notices))
    times = np.concatenate([block.start_s + block.t_s for block in blocks])
    assert [line for block in blocks for line in block.lines] == rows_at(recorded)
    assert np.diff(times)[100:-100] / np.diff(true)[0] == pytest.approx(1.0, abs=0.02)
    assert np.abs(times - true).max() < error and blocks[0].time_us[0] == 0
    assert not blocks[-1].own_times
    assert len(blocks) > 2 or size == 1 << 22
    (notice,) = (notice for notice in notices if notice.code == "times-spread")
    repeated = np.count_nonzero(np.diff(recorded) == 0.0)
    assert f"({repeated} of {len(true)} repeat the previous one): they are spread evenly" in notice.line()


def test_times_that_become_rounded_continue_after_even_ones(text_log, small_blocks):
    """The times of the first blocks are unchanged. Blocks have about 700 rows."""
    small_blocks(30_000)
    even = np.arange(6000) * 0.01
    rounded = 60.0 + np.floor(np.arange(6000) * 0.7) / 100.0
    blocks = list(read_blocks(text_log(*rows_at([*even, *rounded]))))
    time_us = np.concatenate([block.time_us for block in blocks])
    assert np.all(np.diff(time_us) >= 1) and len(time_us) == 12_000
    assert blocks[0].own_times and not blocks[-1].own_times
    assert time_us[:3000].tolist() == np.rint(even[:3000] * 1e6).astype(int).tolist()
    assert np.abs(time_us[6000:] * 1e-6 - rounded).max() <= 0.0061


def test_a_shift_of_under_two_milliseconds_is_no_remark(text_log):
    notices = []
    (block,) = read_blocks(text_log(*rows_at(np.round(np.arange(2000) / 300.0, 3))), notices=notices)
    assert not block.own_times and "times-spread" not in [notice.code for notice in notices]
