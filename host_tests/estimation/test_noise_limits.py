"""The misfit of accelerations, the noise of a sensor in a hand, and the windows of a slow log."""

from typing import Any

import numpy as np
import pytest
from kickstand_tools.estimation import equations as eq, noise as noises, unknowns as of
from kickstand_tools.estimation.windows import windows_of
from made_windows import windows


def misfit_of(climbing, speed=20.0, pitch=0.0, still=False, n=600):
    """Return the Noise after a residual CLIMBING, in standard deviations of a bike at 20 m/s."""
    noise = noises.Noise(windows(n), np.full(n, still))
    noise.speed, noise.pitch = np.full(n, speed), np.full(n, pitch)
    off = np.zeros((n, eq.ROWS))
    off[:, eq.CLIMBING] = climbing * np.hypot(0.1, np.radians(2.5) * 20.0) * np.sqrt(5.0)
    noise.estimate_misfit(off)
    return noise


def lasting(size):
    """Return the misfit of a lasting residual, by hand: ten windows in a mean, and a usual value of a quarter."""
    return 10.0 * (size / np.hypot(1.0, size * np.sqrt(5.0) / 2.0)) ** 2 / 0.0625


def test_the_misfit_is_the_square_of_a_lasting_climb():
    noise = misfit_of(0.1)
    assert noise.misfit[300] == pytest.approx(lasting(0.1)) and 1.5 < lasting(0.1) < 1.6
    assert noise.doubtful.sum() == 0
    assert misfit_of(0.05).misfit[300] == 1.0
    most = misfit_of(0.25)
    assert most.misfit[300] == 6.0 and most.doubtful.all()
    assert misfit_of(0.25, still=True).misfit[300] == 1.0 and not misfit_of(0.25, still=True).doubtful.any()
    assert misfit_of(0.25 * np.where(np.arange(600) % 2, 1.0, -1.0)).misfit[300] == 1.0


def test_the_own_misfit_has_the_unit_of_25_metres_per_second():
    noise = misfit_of(0.15)
    ratio = np.hypot(0.1, np.radians(2.5) * 20.0) / np.hypot(0.1, np.radians(2.5) * 25.0)
    noise.count_own_misfit()
    assert noise.misfit[300] == pytest.approx(lasting(0.15 * ratio))
    steep = misfit_of(0.3, pitch=np.radians(10.0))  # the unit is twice as large
    assert steep.misfit[300] == pytest.approx(lasting(0.15))
    steep.count_own_misfit()
    assert steep.misfit[300] == pytest.approx(lasting(0.15 * ratio))


def test_a_large_but_brief_climb_counts_up_to_twice_the_largest_misfit():
    """Ten windows have a huge residual. With the moving mean over ten windows, 19 squares are not 0, and some are at
    the limit of 2 x 6. The mean is over 301 windows."""
    brief = np.zeros(600)
    brief[300:310] = 1e6
    size = 1.0 / (np.sqrt(5.0) / 2.0)
    squares = np.minimum(10.0 * (np.array([*range(1, 11), *range(9, 0, -1)]) / 10.0 * size) ** 2 / 0.0625, 12.0)
    assert misfit_of(brief).misfit[300] == pytest.approx(max(1.0, squares.sum() / 301.0))
    brief[200:400:20] = 1e6
    assert 1.0 < misfit_of(brief).misfit[300] < 6.0


def test_a_hand_makes_only_its_own_time_uncertain(monkeypatch):
    """A hand surely holds the sensor in windows 10 to 19, and perhaps in 5 to 24. It stands still in 0 to 7."""
    place = np.arange(40)
    surely, perhaps = (place >= 10) & (place < 20), (place >= 5) & (place < 25)
    monkeypatch.setattr(noises, "in_hand", lambda windows: (surely, perhaps))
    noise = noises.Noise(windows(40), place < 8)
    noise.speed = np.full(40, 20.0)
    found = noise.sigma()
    assert np.flatnonzero(~noise.riding).tolist() == list(range(25))
    root = np.sqrt(0.2)
    assert found[15, of.LEAN] == pytest.approx(np.radians(30.0) * root)
    assert found[9, of.LEAN] == pytest.approx(np.radians(0.2) * root)
    assert found[9, [of.LEFT, of.UP, of.FORWARD]] == pytest.approx(np.array([3.0, 1.0, 4.0]) * root)
    assert found[9, eq.RESTING] == pytest.approx([0.5] * 3) and np.isinf(found[9, eq.RESTING_RATE]).all()
    assert found[6, eq.RESTING] == pytest.approx([0.05] * 3) and np.isinf(found[30, eq.RESTING]).all()


def test_a_roll_acceleration_unbalances_a_bike():
    """The rate about forward grows by 0.1 rad/s in each window of 0.2 s."""
    made = windows(40)
    made.rate[:, 2] = 0.1 * np.arange(40)
    noise = noises.Noise(made, np.zeros(40, dtype=bool))
    noise.speed = np.full(40, 20.0)
    assert noise.sigma()[20, eq.BALANCED] == pytest.approx(np.hypot(0.011 * np.sqrt(30.0), 0.05 * 0.5))


@pytest.mark.parametrize(("step_s", "gaps"), [(0.29, 0), (0.31, 1)])
def test_a_slow_log_has_a_gap_after_one_and_a_half_steps(step_s, gaps):
    t_s: Any = np.concatenate((np.arange(20) * 0.2, 3.8 + step_s + np.arange(20) * 0.2))
    ones = np.ones((40, 3))
    assert windows_of(t_s, ones, ones, np.full(40, np.nan), np.zeros(40)).gap.sum() == gaps


def test_a_jolt_is_the_largest_difference_from_the_mean_of_its_window():
    """Each window has 20 samples. One of them has 2 rad/s about two axes, so the mean is 0.1 rad/s."""
    rate = np.zeros((100, 3))
    rate[30, :2] = 2.0
    ones = np.ones((100, 3))
    made = windows_of(np.arange(100) / 100.0, ones, rate, np.full(100, np.nan), np.arange(100) / 10.0)
    assert made.jolt == pytest.approx([0.0, np.sqrt(2.0) * 1.9, 0.0, 0.0, 0.0])
    assert made.warm == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0])
