"""The times of the samples follow the chip's constant sample rate and are corrected by the board's clock."""

import numpy as np
import pytest
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level

PERIOD_US = 5000


@pytest.fixture
def clock():
    with Board(level):
        from kickstand.imu.sensor import SampleClock

        yield SampleClock(PERIOD_US)


def elapsed(clock, samples_us, looks_us):
    """Return the sum of the steps of a SampleClock, and the true time from the first to the last sample.

    samples_us: times at which the chip takes samples.
    looks_us: times at which the FIFO is emptied.
    """
    total = samples = 0
    for now_us in looks_us:
        ready = int(np.searchsorted(samples_us, now_us, side="right"))
        if ready > samples:
            total += clock.step(ready - samples, now_us)
            samples = ready
        clock.emptied(now_us)
    return total, samples_us[samples - 1] - samples_us[0]


def test_samples_are_a_period_apart(clock):
    """No time passes before the first sample after the start and after a gap."""
    clock.skip(1)
    for n, now_us, periods in ((1, 10_000, 0), (1, 15_000, 1), (3, 30_000, 3), (2, 50_000, 2)):
        assert clock.step(n, now_us) == periods * PERIOD_US
    clock.skip(2)
    assert clock.step(1, 60_000) == 3 * PERIOD_US and clock.lost == 3
    clock.skip(4)
    clock.restart()
    assert [clock.step(4, 100_000), clock.step(1, 105_000)] == [3 * PERIOD_US, PERIOD_US]


@pytest.mark.parametrize("error", [0.01, 0.0, -0.01])
def test_a_chip_that_is_1_percent_off_keeps_the_boards_time(error, clock):
    """The FIFO is emptied for up to 20 s, at random moments that are 2 to 10 ms apart."""
    rng = np.random.default_rng(1)
    samples_us = (np.arange(4000) * PERIOD_US / (1 + error)).astype(int)
    looks_us = np.cumsum(rng.integers(2000, 10_000, 3000))
    total, true = elapsed(clock, samples_us, looks_us[looks_us < samples_us[-1]].tolist())
    assert total == pytest.approx(true, abs=3000) and clock.lost == 0


@pytest.mark.parametrize(
    ("late_us", "added_us", "lost"),
    [(2 * PERIOD_US, 2 * PERIOD_US // 16, 0), (2 * PERIOD_US + 1, 2 * PERIOD_US + 1, 2),
     (-40 * PERIOD_US, -PERIOD_US, 0)],
)  # fmt: skip
def test_a_gap_is_spanned_and_time_never_runs_backward(late_us, added_us, lost, clock):
    """If the last sample is over two periods late, samples were lost, and the whole gap is added. A smaller delay is a
    difference between the clocks, which is corrected gradually."""
    clock.emptied(0)
    clock.step(1, 1_000_000)
    clock.emptied(1_000_000 + PERIOD_US // 2 + late_us)
    assert (clock.step(1, 0), clock.lost) == (PERIOD_US + added_us, lost)


def test_ticks_that_begin_again_at_0_are_no_gap(clock):
    end = 1 << 30
    clock.step(1, end - 2 * PERIOD_US)
    for k in range(-1, 5):
        now_us = (end + k * PERIOD_US + PERIOD_US // 2) % end
        assert clock.step(1, now_us) == PERIOD_US
        clock.emptied(now_us)
