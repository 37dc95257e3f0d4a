"""Forward from exact intervals: its standard errors by known numbers, and the limits below which it is unknown."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_fleet import forward
from kickstand_fleet.evidence import Intervals
from kickstand_tools.calibration.drive import UP_DEG
from made_fleet import turn_of

UP = (0.0, 1.0, 0.0)
MOUNT = turn_of(50.0, (1.0, 2.0, 3.0))  # from the sensor's axes to left, up, forward


def log_of(seconds, turn_deg=0.0, axis=UP, from_s=0.0, arm=0.0):
    """Return exact intervals of one second. From from_s the sensor is turned.

    arm: force to the left in g if the yaw rate changes by 1 rad/s2.
    """
    count = int(seconds)
    t_s = np.linspace(0.5, count - 0.5, count)
    a = np.where(np.arange(count) % 4 < 2, -0.2, 0.2)
    c = np.where(np.arange(count) % 8 < 4, -0.1, 0.1)
    w = np.where(np.arange(count) % 2 < 1, -0.3, 0.3)
    terms = np.column_stack((np.ones(count), a, c, w))
    mounts = [turn_of(turn_deg if now > from_s else 0.0, axis) @ MOUNT for now in t_s]
    force = np.array([row[0] * m[1] + row[1] * m[2] + (row[2] + arm * row[3]) * m[0] for row, m in zip(terms, mounts)])
    return Intervals(t_s, force, terms, np.ones(count), np.full(count, 1000.0), np.zeros((count, 3, 3)))


def found(*logs, device=None):
    made = forward.find_forward(list(logs), device)
    assert made
    return made


def test_without_noise_only_the_errors_of_the_sensor_remain():
    made = found(log_of(64.0))
    assert made.frame == pytest.approx(MOUNT, abs=1e-3)
    assert made.sigma_deg == pytest.approx(0.3, abs=0.001) and made.halves_deg == pytest.approx(0.0, abs=0.02)
    assert made.attitude_deg == pytest.approx(np.hypot(0.3, UP_DEG), abs=0.001)


@pytest.mark.parametrize(("seconds", "known"), [(24.0, False), (32.0, True)])
def test_forward_needs_four_blocks(seconds, known):
    assert (forward.find_forward([log_of(seconds)]) is not None) is known
    assert forward.find_forward([]) is None
    assert forward.find_forward([log_of(seconds / 2.0)] * 2) is not None  # blocks of all logs count


@pytest.mark.parametrize("turn_deg", [6.0, -6.0])
def test_the_halves_of_the_driving_are_compared(turn_deg):
    """The sign of the difference does not matter. Blocks count, so the halves may be parts of different logs."""
    assert found(log_of(64.0, turn_deg, from_s=32.0)).halves_deg == pytest.approx(6.0, abs=0.05)
    assert found(log_of(32.0), log_of(32.0, turn_deg)).halves_deg == pytest.approx(6.0, abs=0.05)


@pytest.mark.parametrize(("axis", "of_forward"), [(UP, True), ((1.0, 0.0, 0.0), False), ((0.0, 0.0, 1.0), False)])
def test_the_jackknife_sees_one_odd_block(axis, of_forward):
    """One of eight blocks is turned by 4 degrees. Without it the mean is 0, without another block it is 4/7 degrees."""
    made = found(log_of(64.0, 4.0, axis, from_s=56.0))
    off = np.array([0.5] + [4.0 / 7.0 - 0.5] * 7)
    odd = 7.0 / 8.0 * np.sum(off**2)
    assert made.sigma_deg == pytest.approx(np.sqrt(0.09 + odd * of_forward), rel=0.05)
    assert made.attitude_deg == pytest.approx(np.sqrt(0.09 + UP_DEG**2 + odd), rel=0.05)


def test_the_beginnings_of_bends_are_not_fitted():
    """They would make forward worse, so a long arm is noise."""
    assert found(log_of(64.0, arm=0.1)).frame == pytest.approx(MOUNT, abs=0.02)


def device_of(frame, quality_deg, halves_deg=None):
    """Return an alignment by the firmware."""
    calibration = SimpleNamespace(vehicle_from_sensor=frame)
    return SimpleNamespace(calibration=calibration, quality_deg=quality_deg, halves_deg=halves_deg)


@pytest.mark.parametrize("halves_deg", [None, 2.5])
def test_a_short_drive_has_the_firmwares_alignment(halves_deg):
    """Its standard error includes the error of the sensor."""
    made = found(log_of(24.0), device=device_of(MOUNT, 0.4, halves_deg))
    assert made.frame is MOUNT and (made.sigma_deg, made.halves_deg) == (pytest.approx(0.5), halves_deg or 0.0)
    assert made.attitude_deg == pytest.approx(np.hypot(0.5, UP_DEG))


def test_the_firmwares_alignment_gives_up_and_a_part_of_forward():
    """Both have the same standard error, so forward is in the middle. The attitude has the error of this mean."""
    theirs = turn_of(1.0, UP) @ turn_of(2.0, (0.0, 0.0, 1.0)) @ MOUNT
    made = found(log_of(64.0), device=device_of(theirs, 0.0))
    assert made.frame[1] == pytest.approx(theirs[1])
    assert np.degrees(np.arcsin(made.frame[2] @ theirs[0])) == pytest.approx(0.5, abs=0.03)
    assert made.sigma_deg == pytest.approx(np.sqrt(0.75) * 0.3 * max(1.0, 1.0 / 0.3 / 2.0), rel=0.02)
    assert made.attitude_deg == pytest.approx(np.hypot(made.sigma_deg, UP_DEG), rel=0.01)
