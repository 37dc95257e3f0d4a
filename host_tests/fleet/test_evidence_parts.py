"""The intervals of a log with known motion: their terms, weights and limits are compared with known numbers."""

from typing import Any

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_fleet import evidence
from kickstand_tools.logs.log import Log

G = STANDARD_GRAVITY
RATE_HZ = 50.0


def log_of(seconds=60.0, speed: Any = 10.0, yaw_dps: Any = 0.0, every_s=1.0):
    """Return a log whose sensor has its axes along left, up, forward.

    speed, yaw_dps: functions of the time, or numbers.
    """
    t_s = np.linspace(0.0, seconds, round(seconds * RATE_HZ) + 1)
    ones = np.ones(len(t_s))
    mps: Any = speed(t_s) if callable(speed) else speed * ones
    yaw: Any = yaw_dps(t_s) if callable(yaw_dps) else yaw_dps * ones
    force = np.column_stack((mps * np.radians(yaw) / G, ones, np.gradient(mps, t_s) / G))
    rates = np.column_stack((0.0 * ones, yaw, 0.0 * ones))
    seen = np.full(len(t_s), np.nan)
    seen[:: round(every_s * RATE_HZ)] = mps[:: round(every_s * RATE_HZ)]
    return Log(t_s, force, rates, seen, name="known")


def intervals(log, kind="car", lag_s=0.0, bias_dps=(0.0, 0.0, 0.0)):
    return evidence.intervals(log, kind, lag_s, np.array(bias_dps))


def test_an_interval_is_between_two_speeds():
    found = intervals(log_of(10.0))
    assert found.t_s == pytest.approx(np.arange(10) + 0.5)
    assert found.speed == pytest.approx([10.0] * 10) and found.weight == pytest.approx([1.0] * 10)
    assert found.force == pytest.approx(np.tile([0.0, 1.0, 0.0], (10, 1)))
    assert found.terms == pytest.approx(np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)), abs=1e-9)


def test_braking_is_in_g_and_positive_forward():
    found = intervals(log_of(20.0, lambda t_s: 30.0 - 1.2 * t_s))
    assert found.terms[:, 1] == pytest.approx(-1.2 / G) and found.force[:, 2] == pytest.approx(-1.2 / G)
    assert found.speed == pytest.approx(30.0 - 1.2 * found.t_s)


def test_a_bend_is_speed_times_yaw_rate_and_positive_to_the_left():
    found = intervals(log_of(20.0, 10.0, 12.0))
    c = 10.0 * np.radians(12.0) / G
    # In a steady bend the mean force is not quite vertical, so a part of the yaw rate is not seen
    assert found.terms[5:15, 2] == pytest.approx(c / np.sqrt(1.0 + c * c), rel=0.01)
    assert found.terms[5:15, 3] == pytest.approx(0.0, abs=1e-6)
    assert found.weight[5:15] == pytest.approx(1.0 / (1.0 + (12.0 / 20.0) ** 2), rel=0.02)


def test_a_bias_of_the_gyro_is_removed():
    found = intervals(log_of(20.0, 10.0, 3.0), bias_dps=(0.0, 3.0, 0.0))
    assert found.terms[:, 2] == pytest.approx(0.0, abs=1e-12)


def test_the_beginning_of_a_bend_swings_the_sensor():
    """The fourth term is the change of the yaw rate in rad/s2. The term is 0 at the end of a log that ends in a
    bend."""
    found = intervals(log_of(20.0, 10.0, lambda t_s: np.clip(t_s - 10.0, 0.0, 4.0) * 2.0))
    swung = (found.t_s > 11.0) & (found.t_s < 13.0)
    assert found.terms[swung, 3] == pytest.approx(np.radians(2.0), rel=0.01)
    assert found.terms[(found.t_s < 9.0) | (found.t_s > 16.0), 3] == pytest.approx(0.0, abs=1e-6)


def test_a_motorcycle_has_no_force_to_the_left():
    log = log_of(20.0, 10.0, 12.0)
    c = 10.0 * np.radians(12.0) / G
    log.accel_g[:] = [0.0, np.sqrt(1.0 + c * c), 0.0]
    found = intervals(log, "motorcycle")
    assert found.terms == pytest.approx(np.tile([np.sqrt(1.0 + c * c), 0.0, 0.0, 0.0], (20, 1)))
    assert not found.sway.any() and found.weight == pytest.approx([1.0] * 20)


@pytest.mark.parametrize(
    ("kind", "speed", "weight"),
    [
        ("car", 0.0, 0.3),  # a standstill has a smaller weight
        ("car", 1.0, 1.0),
        ("car", 2.1, 1.0),
        ("motorcycle", 0.0, 0.0),
        ("motorcycle", 1.99, 0.0),  # below 2 m/s the rider may have a foot on the ground
        ("motorcycle", 2.01, 1.0),
    ],
)
def test_slow_intervals_have_their_weight(kind, speed, weight):
    assert intervals(log_of(10.0, speed), kind).weight == pytest.approx([weight] * 10)


def test_creeping_that_changes_is_no_standstill():
    """Between 0 and 0.3 m/s a speed that changes is neither a standstill nor driving."""
    found = intervals(log_of(10.0, lambda t_s: 0.15 * (np.round(t_s) % 2)))
    assert not found.weight.any()
    found = intervals(log_of(10.0, lambda t_s: 0.07 * (np.round(t_s) % 2)))  # changes of less than 0.01 g are noise
    assert found.weight == pytest.approx(0.3)


@pytest.mark.parametrize(("every_s", "count"), [(0.2, 10), (0.5, 10), (0.88, 5), (0.92, 10), (2.0, 5)])
def test_speeds_are_used_at_most_every_0_9_seconds(every_s, count):
    found = intervals(log_of(10.0, every_s=every_s))
    assert len(found.t_s) == count


def test_speeds_that_are_too_far_apart_give_no_interval():
    assert len(intervals(log_of(20.0, every_s=4.0)).t_s) == 0


def test_a_late_speed_belongs_to_an_earlier_time():
    log = log_of(20.0, lambda t_s: np.clip(t_s - 10.0, 0.0, 5.0))
    late = Log(log.t_s, log.accel_g, log.gyro_dps, np.roll(log.speed_mps, 25), name="late")
    found = intervals(late, lag_s=0.5)
    assert found.t_s[0] == pytest.approx(0.5) and found.force[:, 2] == pytest.approx(found.terms[:, 1], abs=0.002)
    assert found.t_s[-1] < 19.5


@pytest.mark.parametrize("reach_s", [9.0, 11.0])
def test_the_vertical_is_the_mean_force_over_20_seconds(reach_s):
    """A yaw rate about an axis counts as a bend if the force was along this axis within 10 s."""
    log = log_of(60.0, 10.0, 5.0)
    there = np.abs(log.t_s - 30.0) > reach_s
    log.accel_g[:] = np.where(there[:, None], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0])
    found = intervals(log)
    middle = np.argmin(np.abs(found.t_s - 30.5))
    whole = 10.0 * np.radians(5.0) / G
    assert found.terms[middle, 2] == pytest.approx(whole, rel=0.02 if reach_s < 10.0 else 1e-6)
    assert (found.terms[middle, 2] < 0.9999 * whole) == (reach_s < 10.0)


def test_the_sway_is_sideways_if_the_body_shakes_sideways():
    """The sway is the change of force within 0.3 s. At low speed the sway is not used."""
    log = log_of(20.0)
    log.accel_g[:, 0] += 0.1 * np.sin(2.0 * np.pi * 5.0 * log.t_s)
    found = intervals(log)
    mean = found.sway.mean(axis=0)
    assert 0.5 * 0.005 < mean[0, 0] < 1.5 * 0.005 and mean[1:, 1:] == pytest.approx(np.zeros((2, 2)), abs=1e-9)
    slow = log_of(20.0, 1.9)
    slow.accel_g[:] = log.accel_g
    assert not intervals(slow).sway.any()


def test_blocks_are_sums_over_eight_seconds():
    driven = intervals(log_of(32.0, lambda t_s: 10.0 + 3.0 * np.sin(t_s)))
    whole = evidence.blocks([driven])
    assert whole.log.tolist() == [0] * 4
    assert whole.t_s == pytest.approx([0.5, 8.5, 16.5, 24.5]) and whole.end_s == pytest.approx([7.5, 15.5, 23.5, 31.5])
    found, varied = evidence.fits(np.sum(whole.square, axis=0), np.sum(whole.product, axis=0))
    assert found[:2] == pytest.approx(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), abs=0.02) and varied[0] > 0.3
    parts, _ = evidence.fits(whole.square, whole.product)
    assert parts.shape == (4, 4, 3)


def test_a_slope_is_forgotten_after_some_hundred_metres():
    """A road's slope causes a smaller error of forward than in a plain regression."""
    log = log_of(120.0, lambda t_s: 15.0 - 4.0 * np.sin(t_s / 3.0))
    slope = 0.03 * np.sin(log.t_s / 20.0)
    log.accel_g[:, 2] += slope
    driven = intervals(log)
    whole = evidence.blocks([driven])
    found, _ = evidence.fits(np.sum(whole.square, axis=0), np.sum(whole.product, axis=0))
    plain, _ = evidence.fits(driven.terms.T @ driven.terms, driven.terms.T @ driven.force)
    assert abs(found[1, 2] - 1.0) < abs(plain[1, 2] - 1.0) + 0.01
    assert abs(found[1, 2] - 1.0) < 0.05


def test_a_tight_turn_counts_less():
    """Below 2 m/s the turn is computed with 2 m/s, because the yaw rate of a slow vehicle is uncertain."""
    assert intervals(log_of(20.0, 4.0, 20.0)).weight[5:15] == pytest.approx(0.5, rel=0.03)
    assert intervals(log_of(20.0, 1.0, 20.0)).weight[5:15] == pytest.approx(0.8, rel=0.01)


def test_the_yaw_rate_at_an_end_is_a_mean_over_0_2_seconds():
    """The yaw rate jumps 0.04 s after the end of an interval, so the mean at this end has 0.3 of the jump."""
    found = intervals(log_of(20.0, 10.0, lambda t_s: np.where(t_s > 10.05, 2.0, 0.0)))
    jump = np.radians(2.0)
    assert found.terms[9:11, 3] == pytest.approx([0.3 * jump, 0.7 * jump], rel=0.02)
    assert np.delete(found.terms[:, 3], [9, 10]) == pytest.approx(0.0, abs=0.01 * jump)


def test_the_sway_is_a_short_mean_minus_a_longer_mean():
    """The means are over 3 and 15 samples of 0.02 s. A single sample of 1 g remains as three of 1/3 - 1/15, and as 12
    of -1/15."""
    log = log_of(20.0)
    at = np.argmin(np.abs(log.t_s - 10.5))
    log.accel_g[at, 0] += 1.0
    found = intervals(log)
    squares = 3.0 * (1.0 / 3.0 - 1.0 / 15.0) ** 2 + 12.0 / 15.0**2
    assert found.sway[10] == pytest.approx(np.diag([0.02 * squares, 0.0, 0.0]), rel=0.01)


def test_errors_of_the_road_are_correlated_over_150_m():
    """The blocks are the normal equations of least squares with correlated errors. Each interval has an error of its
    own with the variance 1 / weight. The error of the road has the variance 1 and decreases with the distance."""
    rng = np.random.default_rng(5)
    count = 40
    t_s = 3.0 + np.cumsum(rng.uniform(0.9, 1.5, count))
    speed, weight = rng.uniform(0.0, 40.0, count), rng.uniform(0.2, 2.0, count)
    terms, force = rng.normal(size=(count, 4)), rng.normal(size=(count, 3))
    whole = evidence.blocks([evidence.Intervals(t_s, force, terms, weight, speed, np.zeros((count, 3, 3)))])
    along_m = np.cumsum(speed * np.diff(t_s, prepend=t_s[0]))
    errors = np.diag(1.0 / weight) + np.exp(-np.abs(along_m[:, None] - along_m) / 150.0)
    assert np.sum(whole.square, axis=0) == pytest.approx(terms.T @ np.linalg.solve(errors, terms))
    assert np.sum(whole.product, axis=0) == pytest.approx(terms.T @ np.linalg.solve(errors, force))


def test_logs_do_not_share_the_errors_of_their_roads():
    log = intervals(log_of(16.0, lambda t_s: 10.0 + t_s))
    empty = evidence.Intervals(*(values[:0] for values in vars(log).values()))
    whole = evidence.blocks([log, empty, log])
    assert whole.log.tolist() == [0, 0, 2, 2]
    assert whole.square[:2] == pytest.approx(whole.square[2:]) and whole.t_s[:2].tolist() == whole.t_s[2:].tolist()


@pytest.mark.parametrize(("bends", "ratio"), [(0.049, 0.0), (0.051, 1.0)])
def test_handedness_needs_bends(bends, ratio):
    found = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    assert evidence.handedness(found, np.array([1.0, bends])) == ratio
