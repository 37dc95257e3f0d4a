"""The limits of the repair of times, each with a value on either side of it."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import even_times as module
from kickstand_tools.logs.even_times import even_blocks, even_times
from kickstand_tools.logs.log import Block


def changing(low: int, high: int, n: int = 400):
    """Return times with steps of `low` and `high` ticks of 0.5 ms in random order, as many of each."""
    steps = np.random.default_rng(1).permutation(np.repeat([low, high], n // 2))
    return np.concatenate(([0], np.cumsum(steps))) * 0.0005


@pytest.mark.parametrize(("low", "high", "changed"), [(20, 21, False), (19, 20, True)])
def test_a_tick_of_a_twentieth_of_the_time_between_samples_is_coarse(low, high, changed):
    times = changing(low, high)
    assert np.array_equal(even_times(times), times) is not changed


@pytest.mark.parametrize(("repeats", "share"), [(20, 0.02), (45, 0.02), (55, 0.9)])
def test_times_that_repeat_in_one_of_twenty_samples_are_all_changed(repeats, share):
    """With fewer repeats only the repeated times are changed."""
    times = np.cumsum(0.01 + 0.002 * np.random.default_rng(1).random(1000)).round(6)
    at = np.linspace(5, 990, repeats).astype(int)
    times[at] = times[at - 1]
    moved = np.abs(even_times(times) - times) > 1e-9
    assert np.mean(moved) >= share if repeats > 50 else np.count_nonzero(moved) <= repeats


def smooth(recorded, tick_s=0.01, period_s=0.01):
    recorded = np.asarray(recorded, dtype=float)
    return module._smooth(recorded, recorded, tick_s, period_s)


@pytest.mark.parametrize(
    ("tick_s", "samples"), [(0.01, 65), (0.081, 65), (0.1, 81)]
)  # at least 64 samples and at least 8 ticks
def test_a_time_is_a_mean_over_64_samples_or_8_ticks(tick_s, samples):
    """The mean of means weighs the time itself with one part in `samples`."""
    line = np.arange(400) * 0.01
    recorded = line + np.where(np.arange(400) == 200, 0.004, 0.0)
    found = smooth(recorded, tick_s)
    assert found[200] - line[200] == pytest.approx(0.004 / samples, rel=1e-3)
    assert found[200 - samples // 2] - line[200 - samples // 2] == pytest.approx(
        0.004 / samples * (1.0 - (samples // 2) / samples), rel=1e-3
    )


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_time_moves_by_six_tenths_of_a_tick_at_most(side):
    recorded = np.arange(400) * 0.01 + np.where(np.arange(400) == 200, side * 0.009, 0.0)
    assert smooth(recorded)[200] - recorded[200] == pytest.approx(-side * 0.006)


@pytest.mark.parametrize(("step_s", "gap"), [(0.0249, False), (0.0251, True)])
def test_a_gap_is_longer_than_1_5_periods_and_a_tick(step_s, gap):
    """Beside a gap each side has its own mean, so both keep their times."""
    recorded = np.arange(400) * 0.01 + np.where(np.arange(400) >= 200, step_s - 0.01, 0.0)
    assert np.allclose(smooth(recorded), recorded) is gap


def test_a_sample_between_two_gaps_keeps_its_time():
    recorded = np.concatenate((np.arange(100) * 0.01, [1.5], 2.0 + np.arange(100) * 0.01))
    times = recorded + np.where(np.arange(201) == 100, 0.003, 0.0)
    assert module._smooth(recorded, times, 0.01, 0.01)[100] == times[100]


@pytest.mark.parametrize(("crowd", "stopped"), [(97, False), (107, True)])
def test_a_clock_has_stopped_at_ten_times_the_usual_number_of_samples(crowd, stopped):
    """Usually ten samples have the same time. With the crowd the mean number is 10.1."""
    times = np.repeat(np.arange(1000) * 0.1, np.where(np.arange(1000) == 500, crowd, 10))
    if stopped:
        with pytest.raises(InputError, match=f"time stands still at 50 s, in {crowd} samples"):
            even_times(times)
    else:
        assert np.all(np.diff(even_times(times)) > 0.0)


def test_steps_are_at_least_two_microseconds():
    times = np.concatenate(([0.0, 0.0, 1e-6], 0.01 + np.arange(60) * 0.0107))
    assert np.diff(even_times(times))[:2] == pytest.approx([2e-6, 2e-6])


@pytest.mark.parametrize(("gap_s", "counts"), [(0.049, True), (0.051, False)])
def test_the_usual_time_between_samples_is_without_gaps(gap_s, counts):
    """Steps of over five usual steps are gaps. Two samples have a common time before the step. They are spread by the
    usual time between samples, and not up to the end of the step."""
    steps = np.tile([0.0099, 0.0101, 0.0099], 30)
    before = np.concatenate(([0.0], np.cumsum(steps)))
    times = np.concatenate((before, before[-1:], before[-1] + gap_s + before))
    driven_s, samples = 2.0 * before[-1], 2 * len(steps)
    period_s = (driven_s + gap_s) / (samples + 2) if counts else driven_s / samples
    assert np.diff(even_times(times))[len(steps)] == pytest.approx(period_s)


def blocks_of(times_s, size):
    time_us = np.rint(np.asarray(times_s) * 1e6).astype(np.int64)
    for k in range(0, len(time_us), size):
        part, n = time_us[k : k + size], len(time_us[k : k + size])
        nothing = np.full(n, np.nan)
        yield Block(
            part, np.arange(7.0 * n).reshape(n, 7), nothing, nothing, nothing, nothing, np.zeros(n, dtype=bool), False,
            0.0, k, [f"{value}" for value in part], ("t_s",),
        )  # fmt: skip


@pytest.mark.parametrize(("tick_s", "period_s", "reported"), [(0.003, 0.0041, False), (0.01, 0.0137, True)])
def test_changes_of_over_two_milliseconds_are_reported(tick_s, period_s, reported):
    remarks: list = []
    list(even_blocks(blocks_of(np.floor(np.arange(3000) * period_s / tick_s) * tick_s, 10**6), "a", remarks))
    assert bool(remarks) is reported
    for remark in remarks:
        assert remark.line().startswith(
            "the times are rounded (0 of 3000 repeat the previous one): they are spread evenly"
        )
        assert 0.004 < remark.shift_s <= 0.006 + 1e-9


@pytest.mark.parametrize("size", [900, 3000, 4001, 7000])
def test_blocks_keep_their_rows_in_their_order(size):
    """Rows that wait for the next block are neither lost nor doubled."""
    times = np.repeat(np.arange(4500) / 100.0, 2)
    found = list(even_blocks(blocks_of(times, size), "a", []))
    assert [line for block in found for line in block.lines] == [
        f"{value}" for value in np.rint(times * 1e6).astype(int)
    ]
    assert np.concatenate([block.t_s for block in found]) == pytest.approx(
        np.arange(9000) * 0.005, abs=0.006
    )  # each block is near the recorded times
    assert found[-1].done == next(reversed(list(blocks_of(times, size)))).done


def test_times_that_become_rounded_continue_after_even_ones():
    """The first block has even times. The last sample of a block is always before the first of the next."""
    even = np.arange(6000) * 0.01
    rounded = 60.0 + np.floor(np.arange(6000) * 0.7) / 100.0
    found = list(even_blocks(blocks_of(np.concatenate((even, rounded)), 3000), "a", []))
    time_us = np.concatenate([block.time_us for block in found])
    assert time_us[0] == 0 and np.all(np.diff(time_us) >= 1) and len(time_us) == 12000
    assert found[0].own_times and not found[-1].own_times
    assert time_us[:3000].tolist() == np.rint(even[:3000] * 1e6).astype(int).tolist()
    assert np.abs(time_us[6000:] * 1e-6 - rounded).max() <= 0.0061


@pytest.mark.parametrize(("at", "counts"), [(6, True), (7, False)])
def test_a_line_through_the_first_samples_continues_before_them(at, counts):
    """The line is fitted to seven samples, if a mean has three on each side. The first mean has three of its points."""
    values = np.where(np.arange(20) == at, 1.0, 0.0)
    for found in (module._mean(values, 3)[0], module._mean(values[::-1], 3)[-1]):
        assert bool(found) is counts
        if counts:  # the line has the mean 1/7 and the slope 3/28 per sample, and its points are 4, 5 and 6 away
            assert found == pytest.approx((3.0 / 7.0 - 15.0 * 3.0 / 28.0) / 7.0)


@pytest.mark.parametrize("size", [5000, 6001, 12000])
def test_blocks_of_a_log_have_the_times_of_the_whole_log(size):
    """The first new time is not 0. It is added to the start of the log."""
    times = np.floor(np.arange(12000) * 0.7 + 1e-9) / 100.0
    whole = even_times(times)
    found = list(even_blocks(blocks_of(times, size), "a", []))
    assert abs(whole[0]) > 0.001 and found[0].time_us[0] == 0
    assert [block.start_s for block in found] == pytest.approx([whole[0]] * len(found), abs=1e-6)
    assert np.concatenate([block.start_s + block.t_s for block in found]) == pytest.approx(whole, abs=3e-6)


def test_a_time_is_after_the_last_time_of_the_previous_block():
    """The second block has two samples for each time, so the mean around its first sample is before the sample."""
    even = np.arange(3000) * 0.01
    found = list(even_blocks(blocks_of(np.concatenate((even, np.repeat(29.99 + even, 2))), 3000), "a", []))
    time_us = np.concatenate([block.time_us for block in found])
    assert time_us[2999] == 29_990_000 and time_us[3000] == 29_990_001 and np.all(np.diff(time_us) >= 1)


def test_a_first_block_with_a_single_time_waits_for_the_next():
    times = [0.0, 0.0, *(0.01 + np.arange(20) * 0.01)]
    assert sum(len(block.time_us) for block in even_blocks(blocks_of(times, 2), "a", [])) == 22


def test_new_times_count_from_the_first_of_them():
    """The second block begins before the end of the first, so its first time is 1 us after that end."""
    blocks = list(blocks_of([0.0, 0.1, 0.15, 0.3], 2))
    spread = module._Spread("a")
    first = spread._ready(replace(blocks[0], start_s=5.0), np.array([0.05, 0.1]))
    second = spread._ready(replace(blocks[1], start_s=5.0), np.array([0.09, 0.3]))
    third = spread._ready(replace(blocks[1], start_s=5.0), np.array([0.2, 0.4]))
    assert [block.time_us.tolist() for block in (first, second, third)] == [
        [0, 50_000],
        [50_001, 250_000],
        [250_001, 350_000],
    ]
    assert {block.start_s for block in (first, second, third)} == {5.05}
    (remark,) = spread.notices()
    assert remark.shift_s == pytest.approx(0.1) and remark.samples == 6 and remark.repeated == 0  # type: ignore[attr-defined]
