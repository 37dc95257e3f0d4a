"""Functions on arrays of samples."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.checks.leaning import leaning_of
from kickstand_tools.signals import (
    best_lag,
    bin_numbers,
    binned,
    correlation,
    correlations,
    cross_matrix,
    integral,
    intervals,
    log_likelihood_ratio,
    moving_mean,
    moving_spread,
    peak_offset,
    peaks,
    rotation_angle,
    rotation_matrix,
    rotation_vector,
    runs,
    smoothed,
    window_means,
    window_spreads,
)

CHANCE = np.random.default_rng(1)


@pytest.mark.parametrize("n", [1, 2, 3, 8])
@pytest.mark.parametrize("shape", [(20,), (20, 3)])
def test_means_and_spreads_of_windows(n, shape):
    values = 1e6 + CHANCE.normal(size=shape)
    windows = np.lib.stride_tricks.sliding_window_view(values, n, axis=0)
    assert np.allclose(window_means(values, n), windows.mean(axis=-1), rtol=1e-12)
    assert np.allclose(window_spreads(values, n), windows.std(axis=-1), atol=1e-7)
    for moving, window in ((moving_mean, window_means), (moving_spread, window_spreads)):
        around = moving(values, n)
        assert around.shape == shape
        assert np.allclose(around[n // 2 : 20 - (n - 1 - n // 2)], window(values, n), atol=1e-6)


def test_moving_mean_repeats_the_end_values():
    assert moving_mean(np.array([3.0, 0.0, 0.0, 6.0]), 3).tolist() == [2.0, 1.0, 2.0, 4.0]
    assert len(moving_mean(np.zeros(0), 5)) == len(moving_spread(np.zeros(0), 5)) == 0


def test_smoothing_and_integrals_along_time():
    time = np.arange(0.0, 10.0, 0.01)
    wave = np.sin(time)
    assert np.allclose(integral(time, wave), 1.0 - np.cos(time), atol=1e-4)
    assert np.allclose(smoothed(wave, time, 0.2)[20:-20], wave[20:-20], atol=0.003)
    assert smoothed(np.ones(1), time[:1], 0.2).tolist() == [1.0]


def test_bins_hold_the_means_of_their_samples():
    time = np.concatenate((np.arange(0.3, 2.0, 0.06), np.arange(3.0, 4.0, 0.06)))
    speed = np.where(np.arange(len(time)) % 7 == 0, time, np.nan)
    bins = binned(time, 0.1, [time, time**2], [speed], 100, 100)
    assert bins and bins.first == 3
    assert bins.count[:4].tolist() == [2, 2, 1, 2]
    assert bins.means[0] == pytest.approx([0.33, (0.09 + 0.36**2) / 2.0])
    assert bins.latest[0, 0] == pytest.approx(0.3)
    assert np.all(np.isnan(bins.means[18:26])), "nothing is known where there are no samples"
    seconds = bins.merged(10)
    assert seconds.first == 0
    assert seconds.count.sum() == bins.count.sum()
    assert seconds.means[1, 0] == pytest.approx(np.mean(np.arange(1.02, 1.99, 0.06)))
    assert np.isnan(seconds.means[2]).all()
    assert seconds.latest[1, 0] == pytest.approx(1.14), "the first of a second's"


def test_number_of_bins_is_limited():
    time, ones = np.array([0.0, 1.0, 2.0, 5.0]), np.ones(4)
    assert binned(time[:0], 1.0, [ones[:0]], [], 3, 100) is None
    bins = binned(time, 1.0, [ones], [], 3, 100)
    assert bins and bins.first == 1
    assert bins.count.tolist() == [1, 1, 0, 0, 1]
    assert binned(time, 1.0, [ones], [], 3, 4) is None


def test_runs_and_intervals():
    assert bin_numbers(np.array([0.0, 0.1, 0.3, 0.31]), 0.1).tolist() == [0, 1, 3, 3]
    assert runs(np.array([4, 4, 5, 4])).tolist() == [0, 2, 3]
    assert intervals(np.array([True, True, False, True])).tolist() == [[0, 2], [3, 4]]


@pytest.mark.parametrize("late_s", [0.0, 0.33, 0.8])
def test_lag_between_two_signals_is_found(late_s):
    time = np.arange(0.0, 60.0, 0.1)
    direction = np.array([0.6, 0.0, -0.8])
    lags = np.arange(-0.5, 1.6, 0.1)

    def signal(at):
        return np.sin(at) + np.sin(2.7 * at)

    lag = best_lag(lags, lambda by: (signal(time - late_s), np.outer(signal(time - by), direction)))
    assert lag and lag.inside
    assert lag.lag_s == pytest.approx(late_s, abs=0.01)
    assert lag.value > 0.99
    assert np.allclose(lag.direction, direction)
    assert best_lag(lags, lambda by: None) is None


def test_correlation_with_the_whole_cause_is_smaller():
    effect = CHANCE.normal(size=1000)
    cause = np.column_stack((effect, CHANCE.normal(size=1000)))
    assert correlation(effect, cause).value > 0.99
    assert correlation(effect, cause, whole=True).value == pytest.approx(0.5**0.5, abs=0.05)
    assert correlation(effect, -effect[:, None]).direction.tolist() == [-1.0]
    assert correlation(np.ones(5), np.ones((5, 1))).value == 0.0


def test_correlations_at_all_shifts_are_right():
    first, second = CHANCE.normal(size=300), np.zeros(100)
    second[:] = first[120:220]
    good, other = CHANCE.random(300) > 0.1, CHANCE.random(100) > 0.2
    correlation, count = correlations(first, good, second, other)
    assert int(np.argmax(np.where(count > 50, correlation, 0.0))) == 120 + 99
    assert correlation[219] == pytest.approx(1.0)
    assert count[219] == np.count_nonzero(good[120:220] & other)
    is_valid, overlap = (good[50:150] & other), slice(50, 150)
    energy = np.sum(first[overlap][is_valid] ** 2) * np.sum(second[is_valid] ** 2)
    assert correlation[149] == pytest.approx(np.sum((first[overlap] * second)[is_valid]) / np.sqrt(energy), abs=1e-6)
    ratio = log_likelihood_ratio(correlation, count, 1.0)
    assert ratio[219] > 100.0
    assert np.all(ratio[correlation < 0.0] == 0.0)
    assert peaks(np.array([1.0, 5.0, 4.0, 0.0, 3.0, -1.0]), 1, 9) == [1, 4]


def test_peak_is_interpolated_between_its_neighbours():
    assert peak_offset(np.array([-0.49, -0.09, -1.69])) == pytest.approx(-0.3)
    assert peak_offset(np.array([1.0, 0.0, 1.0])) == 0.0


def test_rotation_vectors_and_matrices_are_each_others_inverse():
    vectors = CHANCE.uniform(-1.8, 1.8, size=(50, 3))
    vectors[0] = 0.0
    vectors[1] *= 1e-9
    matrices = rotation_matrix(vectors)
    assert np.allclose(matrices @ np.swapaxes(matrices, -1, -2), np.eye(3))
    assert np.allclose(np.linalg.det(matrices), 1.0)
    assert np.allclose(rotation_vector(matrices), vectors, atol=1e-12)
    assert np.allclose(rotation_matrix(np.array([0.0, 0.0, np.pi / 2.0])) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    assert np.allclose(cross_matrix(vectors[2]) @ vectors[3], np.cross(vectors[2], vectors[3]))


@pytest.mark.parametrize("angle_deg", [0.0, 1e-6, 44.0, 90.0, 179.99, 180.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_angle_of_a_rotation_is_known_up_to_half_a_turn(angle_deg, axis):
    matrix = rotation_matrix(np.radians(angle_deg) * np.eye(3)[axis])
    assert np.degrees(rotation_angle(matrix)) == pytest.approx(angle_deg, abs=1e-9)
    assert np.degrees(rotation_angle(np.stack([matrix, matrix.T]))) == pytest.approx([angle_deg] * 2, abs=1e-9)


def test_leaning_shows_forward_speed_handedness_and_unit():
    """Forward, speed, handedness and unit are found from bends at 15 m/s, also in rotated axes."""
    time = np.arange(0.0, 120.0, 0.2)
    lean, roll_rate = 0.4 * np.sin(1.1 * time), 0.44 * np.cos(1.1 * time)
    yaw = -STANDARD_GRAVITY * np.tan(lean) / 15.0
    rate = np.column_stack((yaw * np.sin(lean), yaw * np.cos(lean), roll_rate))
    force = np.column_stack((0.0 * lean, 1.0 / np.cos(lean), 0.0 * lean))
    turn = rotation_matrix(np.array([0.5, 1.0, -2.0]))
    riding = np.ones(len(time), dtype=bool)
    leaning = leaning_of(rate @ turn, force @ turn, riding)
    assert np.allclose(leaning.matrix, turn, atol=0.05)
    assert leaning.speed == pytest.approx(15.0, rel=0.1)
    assert leaning.share == pytest.approx(1.0, rel=0.1)
    assert leaning.correlation > 0.9
    assert leaning_of(-rate @ turn, force @ turn, riding).share == pytest.approx(-1.0, rel=0.1)
