"""A hand that turns the sensor, and filters of the simulation. The hand's rates agree with the turn of gravity."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools.signals import rotation_matrix
from kickstand_tools.simulation import ride
from kickstand_tools.simulation.physics.signals import second_order
from kickstand_tools.simulation.scripted import sensor_errors


@pytest.mark.parametrize(
    ("before", "after", "degrees"),
    [
        ([1, 0, 0], [0, 1, 0], 90.0),
        ([0, 0, 2], [0.6, 0.0, 0.8], np.degrees(np.arctan2(0.6, 0.8))),
        ([1, 2, 2], [2, -2, 1], 90.0),
        ([0, 1, 0], [0, -1, 0], 180.0),
        ([1, 0, 0], [-1, 0, 0], 180.0),
        ([1, 1, 1], [-1, -1, -1], 180.0),
    ],
)
def test_the_rates_of_a_hand_turn_gravity_to_the_next_pose(before, after, degrees):
    """The test integrates the direction up, u, in the sensor's axes: du/dt = -rate x u. The turn lasts from 1 to 3 s.
    Halfway through the turn, at 2 s, the rate is largest: 15 / 8 of the mean rate."""
    part = SimpleNamespace(vehicle_from_sensor=np.eye(3).ravel().tolist(), world=lambda motion: motion)  # no errors
    world = sensor_errors.turning(part, before, after, 1.0, 3.0)
    up, step_s = np.array(before) / np.linalg.norm(before), 0.002
    for t_s in np.arange(0.5, 3.5, step_s) + step_s / 2:
        reading = np.array(world(t_s)[:6])
        assert np.linalg.norm(reading[:3]) == pytest.approx(1.0, abs=1e-6)
        up = rotation_matrix(-np.radians(reading[3:]) * step_s) @ up
    end = np.array(after) / np.linalg.norm(after)
    assert up == pytest.approx(end, abs=1e-3)
    assert np.array(world(3.5)[:3]) == pytest.approx(end, abs=1e-6)
    assert np.array(world(0.5)[:3]) == pytest.approx(np.array(before) / np.linalg.norm(before), abs=1e-6)
    assert np.linalg.norm(world(2.0)[3:6]) == pytest.approx(degrees / 2.0 * 15.0 / 8.0, rel=1e-6)
    half = np.radians(degrees / 2.0)
    assert np.array(world(2.0)[:3]) @ end == pytest.approx(np.cos(half), abs=1e-6)


def test_a_low_pass_of_second_order_at_its_own_frequency():
    """The gain is 1 at 0 Hz. At the natural frequency the gain is 1 / (2 damping), and the delay a quarter of a period.
    Far above the natural frequency, the gain falls with the square of the frequency."""
    rate_hz, t_s = 1000.0, np.arange(4000) / 1000.0
    inner = slice(1000, 3000)
    assert second_order(np.ones(4000), 10.0, 0.7, rate_hz)[inner] == pytest.approx(np.ones(2000), abs=1e-6)
    for damping in (0.5, 0.7):
        found = second_order(np.sin(2 * np.pi * 10.0 * t_s), 10.0, damping, rate_hz)
        assert found[inner] == pytest.approx(-np.cos(2 * np.pi * 10.0 * t_s)[inner] / (2.0 * damping), abs=0.02)
    found = second_order(np.sin(2 * np.pi * 50.0 * t_s), 10.0, 0.7, rate_hz)
    assert np.max(np.abs(found[inner])) == pytest.approx(1.0 / np.hypot(24.0, 7.0), rel=0.03)


def test_a_mount_that_creeps_turns_slowly_and_at_once():
    """The mount turns by 2 degrees about one axis. 60 % of this turn is slow and even. The rest takes one second."""
    turned = ride._creep(np.random.default_rng(3), 20_000, 2.0)
    size = np.degrees(np.linalg.norm(turned, axis=1))
    assert size[0] == pytest.approx(0.0, abs=1e-3)
    assert size[-1] == pytest.approx(2.0, abs=1e-3)
    axis = turned[-1] / np.linalg.norm(turned[-1])
    assert np.max(np.abs(turned - np.outer(turned @ axis, axis))) < 1e-9
    assert np.max(np.diff(size, prepend=0.0)[:4000]) == pytest.approx(1.2 / 20_000, rel=0.05)
    jump = np.argmax(np.diff(size))
    second = ride.RATE_HZ
    assert size[int(jump + second)] - size[int(jump - second)] == pytest.approx(
        0.8 + 1.2 * 2 * second / 20_000, abs=0.02
    )
