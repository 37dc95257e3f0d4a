"""The times of the samples follow the chip's constant sample rate and are corrected by the board's clock."""

import numpy as np
import pytest
from kickstand_tools.simulated_board.simulator import Board

PERIOD_US = 5000


@pytest.fixture(autouse=True)
def board():
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)) as made:
        yield made


def clock():
    from kickstand.imu.sensor import SampleClock

    return SampleClock(PERIOD_US)


def elapsed(own, samples_us, looks_us):
    """Return the sum of the steps of a SampleClock.

    own: the SampleClock.
    samples_us: times at which the chip takes samples.
    looks_us: times at which the FIFO is emptied.
    """
    total, taken = 0, 0
    for now_us in looks_us:
        ready = int(np.searchsorted(samples_us, now_us, side="right"))
        if ready > taken:
            total += own.step(ready - taken, now_us)
            taken = ready
        own.emptied(now_us)
    return total, samples_us[taken - 1] - samples_us[0]


def test_samples_are_a_period_apart():
    own = clock()
    assert own.step(1, 10_000) == 0  # no time passes before the first sample
    assert own.step(1, 15_000) == PERIOD_US
    assert own.step(3, 30_000) == 3 * PERIOD_US
    own.restart()
    assert own.step(4, 100_000) == 3 * PERIOD_US  # three periods pass from the first to the fourth sample
    assert own.step(1, 105_000) == PERIOD_US


@pytest.mark.parametrize("error", [0.01, 0.0, -0.01])
def test_a_chip_that_is_1_percent_off_keeps_the_boards_time(error):
    """The FIFO is emptied for up to 20 s, at random moments that are 2 to 10 ms apart."""
    rng = np.random.default_rng(1)
    samples_us = (np.arange(4000) * PERIOD_US / (1 + error)).astype(int)
    looks_us = np.cumsum(rng.integers(2000, 10_000, 3000))
    looks_us = looks_us[looks_us < samples_us[-1]].tolist()
    total, true = elapsed(clock(), samples_us, looks_us)
    assert total == pytest.approx(true, abs=3000)


@pytest.mark.parametrize(("late_us", "counted"), [(2 * PERIOD_US, False), (2 * PERIOD_US + 1, True)])
def test_a_gap_of_lost_samples_is_spanned(late_us, counted):
    """If the last sample is over two periods late, samples were lost, and the whole gap is added. A smaller delay is a
    difference between the clocks, which is corrected gradually."""
    own = clock()
    own.step(1, 0)
    own.emptied(PERIOD_US // 2 + late_us)
    assert own.step(1, 0) == PERIOD_US + (late_us if counted else late_us // 16)


def test_time_never_runs_backward():
    own = clock()
    own.step(1, 1_000_000)
    own.emptied(1_000_000 - 40 * PERIOD_US)
    assert own.step(1, 1_000_000) == 0


def test_ticks_that_begin_again_at_0_are_no_gap():
    own = clock()
    end = 1 << 30
    own.step(1, end - 2 * PERIOD_US)
    for k in range(-1, 5):
        now_us = (end + k * PERIOD_US + PERIOD_US // 2) % end
        assert own.step(1, now_us) == PERIOD_US
        own.emptied(now_us)


def test_a_sample_is_half_a_period_old_on_average():
    """The first read is at the moment of a sample. The later reads are at random moments within a period, so the age of
    a sample is half a period on average."""
    rng = np.random.default_rng(2)
    errors = []
    samples_us = np.arange(1200) * PERIOD_US
    for _ in range(10):
        looks_us = [0, *(samples_us[1:-1] + rng.integers(0, PERIOD_US, 1198)).tolist()]
        total, true = elapsed(clock(), samples_us, looks_us)
        errors.append(total - true)
    assert np.mean(errors) == pytest.approx(0, abs=300)
