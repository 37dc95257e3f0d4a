"""The intervals and blocks of a log with known motion: terms, weights, limits and the errors of the road."""

from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest
from exact import MOUNT
from fleet_drives import drive
from kickstand.units import STANDARD_GRAVITY as G
from kickstand_fleet import evidence, moved
from kickstand_tools.logs.log import Log

RATE_HZ = 50.0


def log_of(seconds=20.0, speed: Any = 10.0, yaw_dps: Any = 0.0, every_s=1.0):
    """Return a log whose sensor's axes are left, up, forward. speed, yaw_dps: functions of the time, or numbers."""
    t_s = np.linspace(0.0, seconds, round(seconds * RATE_HZ) + 1)
    mps: Any = speed(t_s) if callable(speed) else np.full(len(t_s), speed)
    yaw: Any = yaw_dps(t_s) if callable(yaw_dps) else np.full(len(t_s), yaw_dps)
    force = np.column_stack((mps * np.radians(yaw) / G, np.ones(len(t_s)), np.gradient(mps, t_s) / G))
    received = np.full(len(t_s), np.nan)
    received[:: round(every_s * RATE_HZ)] = mps[:: round(every_s * RATE_HZ)]
    return Log(t_s, force, np.column_stack((0.0 * yaw, yaw, 0.0 * yaw)), received, name="exact")


def intervals(log, kind="car", lag_s=0.0, bias_dps=(0.0, 0.0, 0.0)):
    return evidence.intervals(log, kind, lag_s, np.array(bias_dps))


def fitted(driven):
    blocks = evidence.blocks([driven])
    return evidence.fits(np.sum(blocks.square, axis=0), np.sum(blocks.product, axis=0))


@pytest.mark.parametrize("every_s", [0.2, 1.6])
def test_a_car_shows_level_forward_and_left_as_1_g(every_s):
    log, sensor = drive(41, every_s=every_s)
    coefficients, varied = fitted(intervals(log, lag_s=0.3))
    assert coefficients[:3] @ sensor.mount.T == pytest.approx(np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]), abs=0.12)
    assert evidence.handedness(coefficients, varied) == pytest.approx(1.0, abs=0.12)


def test_an_interval_is_between_two_speeds():
    """Braking is positive forward, in g."""
    driven = intervals(log_of(10.0, lambda t_s: 30.0 - 1.2 * t_s))
    assert driven.t_s == pytest.approx(np.arange(10) + 0.5) and driven.speed == pytest.approx(30.0 - 1.2 * driven.t_s)
    assert driven.terms == pytest.approx(np.tile([1.0, -1.2 / G, 0.0, 0.0], (10, 1)), abs=1e-9)
    assert driven.force == pytest.approx(np.tile([0.0, 1.0, -1.2 / G], (10, 1)))
    assert driven.weight == pytest.approx([1.0] * 10)


def test_a_bend_is_speed_times_yaw_rate_to_the_left():
    driven = intervals(log_of(20.0, 10.0, 15.0), bias_dps=(0.0, 3.0, 0.0))
    c = 10.0 * np.radians(12.0) / G
    # The mean force is not quite vertical in a steady bend, so a part of the yaw rate is missing
    assert driven.terms[5:15, 2] == pytest.approx(c / np.hypot(1.0, 10.0 * np.radians(15.0) / G), rel=0.01)
    assert driven.weight[5:15] == pytest.approx(1.0 / (1.0 + (12.0 / 20.0) ** 2), rel=0.03)


def test_blocks_are_sums_over_eight_seconds_of_one_log():
    driven = intervals(log_of(32.0, lambda t_s: 10.0 + 3.0 * np.sin(t_s)))
    empty = evidence.Intervals(*(values[:0] for values in vars(driven).values()))
    blocks = evidence.blocks([driven, empty, driven])
    assert blocks.log.tolist() == [0] * 4 + [2] * 4
    assert blocks.t_s == pytest.approx([0.5, 8.5, 16.5, 24.5] * 2)
    assert blocks.end_s == pytest.approx([7.5, 15.5, 23.5, 31.5] * 2)
    assert blocks.square[:4] == pytest.approx(blocks.square[4:])
    coefficients, varied = evidence.fits(blocks.square, blocks.product)
    assert coefficients.shape == (8, 4, 3) and varied.shape == (8, 2)
    swaying, _ = drive(4, seconds=60.0)
    assert np.trace(evidence.blocks([intervals(swaying)]).sway, axis1=1, axis2=2).max() == pytest.approx(1.0)
    no_blocks = evidence.blocks([])
    assert (no_blocks.square.shape, no_blocks.product.shape, no_blocks.sway.shape) == ((0, 4, 4), (0, 4, 3), (0, 3, 3))
    assert moved.find_moves([]) == []


def coefficients_of(left_g=1.0):
    """Return level, forward and left as fits() computes them with this mount."""
    return np.array([MOUNT[1], MOUNT[2], left_g * MOUNT[0], np.zeros(3)])


@pytest.mark.parametrize("varied", [(1.0, 0.0), (0.0, 1.0), (0.3, 2.0)])
def test_braking_or_bends_show_forward(varied):
    assert evidence.frames(2.0 * coefficients_of(), np.array(varied)) == pytest.approx(MOUNT, abs=1e-12)
    ahead = np.tile(2.0 * MOUNT[2] + 0.7 * MOUNT[1], (3, 1))
    assert evidence.frame_of(np.tile(MOUNT[1], (3, 1)), ahead)[2] == pytest.approx(MOUNT, abs=1e-12)


@pytest.mark.parametrize(
    ("left_g", "bends", "ratio"), [(0.9, 1.0, 0.9), (-1.0, 1.0, -1.0), (1.0, 0.049, 0.0), (1.0, 0.051, 1.0)]
)
def test_handedness_divides_measured_by_computed_force(left_g, bends, ratio):
    assert evidence.handedness(coefficients_of(left_g), np.array([1.0, bends])) == pytest.approx(ratio)


@pytest.mark.parametrize("direction_deg", [0.0, 30.0, -60.0, 89.0])
def test_the_direction_of_sway_counts_from_forward_to_left(direction_deg):
    along = cos(radians(direction_deg)) * MOUNT[2] + sin(radians(direction_deg)) * MOUNT[0]
    sway = np.outer(along, along) + 0.2 * np.eye(3) + 5.0 * np.outer(MOUNT[1], MOUNT[1])
    assert evidence.sway_deg(np.array([sway, 3.0 * sway]), MOUNT) == pytest.approx([direction_deg] * 2)
