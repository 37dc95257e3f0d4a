"""The simulated MPU6050 has the delay, bandwidth, range, steps and errors of the data sheet."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.simulation.physics.chip import RATE_HZ, Chip

N = 10000


PERFECT = Chip(np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), gyro_walk=0.0)
STILL = np.zeros((N, 3))


def read(chip: Chip, force: np.ndarray, rates: np.ndarray, temp_c: float = 25.0, seed: int = 0) -> np.ndarray:
    return chip.read(np.random.default_rng(seed), force, rates, np.full(len(force), temp_c))


def wave(hz: float, size: float) -> np.ndarray:
    x = np.zeros((N, 3))
    x[:, 0] = size * np.sin(2.0 * np.pi * hz * np.arange(N) / RATE_HZ)
    return x


def size_and_phase(values: np.ndarray, hz: float) -> tuple[float, float]:
    t = np.arange(len(values)) / 200.0
    z = 2.0 * np.mean(values * np.exp(-2j * np.pi * hz * t))
    return float(abs(z)), float(np.angle(z) + np.pi / 2.0)


def test_filter_has_4_9_ms_of_delay():
    readings = read(PERFECT, wave(5.0, 1.0), STILL)
    _, phase = size_and_phase(readings[:, 0], 5.0)
    assert -phase / (2.0 * np.pi * 5.0) == pytest.approx(0.0049, abs=0.0003)


def test_the_filter_halves_the_power_at_44_hz():
    readings = read(PERFECT, STILL, wave(44.0, 100.0))
    size, _ = size_and_phase(readings[:, 4], 44.0)
    assert size / 100.0 == pytest.approx(np.sqrt(0.5), abs=0.03)


def test_vibration_above_100_hz_aliases():
    readings = read(PERFECT, wave(195.0, 1.0), STILL)
    size, _ = size_and_phase(readings[:, 0], 5.0)
    assert 0.05 < size < 0.15


def test_readings_stop_at_the_range_and_come_in_counts():
    readings = read(PERFECT, np.full((N, 3), 9.0), np.full((N, 3), -700.0))
    assert np.all(readings[:, :3] <= 32767 / 4096.0)
    assert np.all(readings[:, 4:] >= -500.3)
    still = read(PERFECT, STILL, STILL)
    for columns, lsb in ((still[:, :3], 4096.0), (still[:, 4:], 65.5)):
        assert np.allclose(columns * lsb, np.round(columns * lsb), atol=1e-6)


def test_the_range_ends_before_the_filter():
    """The chip is shaken past 8 g on one side only, so the measured mean differs from the true one."""
    shaken = np.zeros((N, 3))
    shaken[:, 0] = 7.0 + np.where(np.arange(N) % 4 < 2, 4.0, -4.0)
    mean = read(PERFECT, shaken, STILL)[100:, 0].mean()
    assert mean == pytest.approx((8.0 + 3.0) / 2.0, abs=0.05)


def test_noise_matches_the_data_sheet():
    still = read(PERFECT, STILL, STILL)
    # The equivalent noise bandwidth of the chip's 44 Hz low-pass is about 50 Hz.
    assert still[:, :3].std() == pytest.approx(400e-6 * np.sqrt(50.0), rel=0.1)
    assert still[:, 4:].std() == pytest.approx(0.005 * np.sqrt(50.0), rel=0.15)


def test_random_sensors_stay_within_the_data_sheet():
    parts = [Chip.random(np.random.default_rng(seed)) for seed in range(100)]
    matrices = np.array([p.accel_matrix for p in parts] + [p.gyro_matrix for p in parts])
    off = matrices - np.eye(3)
    assert np.abs(off[:, np.eye(3, dtype=bool)]).max() <= 0.03 + 1e-12
    assert np.abs(off[:, ~np.eye(3, dtype=bool)]).max() <= 0.02 + 1e-12
    biases = np.array([p.gyro_bias for p in parts])
    assert 18.0 < np.abs(biases).max() <= 20.0
    assert np.abs(np.array([p.accel_offset for p in parts])).max(axis=0) == pytest.approx([0.05, 0.05, 0.08], rel=0.1)
    perfect_part = Chip.random(np.random.default_rng(1), share=0.0)
    assert np.array_equal(perfect_part.gyro_matrix, np.eye(3))


def test_errors_and_temperature_reach_the_reading():
    accel = {"accel_matrix": np.eye(3) * 1.02, "accel_offset": np.array([0.05, 0.0, 0.0])}
    per_c = {"accel_per_c": np.array([0.0, 0.0, 0.001]), "gyro_per_c": np.array([0.1, 0.0, 0.0])}
    chip = replace(PERFECT, **accel, **per_c, gyro_bias=np.array([0.0, 12.0, 0.0]))
    force = np.tile([0.0, 0.0, 1.0], (N, 1))
    mean = read(chip, force, np.zeros((N, 3)), temp_c=35.0).mean(axis=0)
    assert mean[:3] == pytest.approx([0.05, 0.0, 1.03], abs=5e-4)
    assert mean[3] == pytest.approx(35.0, abs=0.01)
    assert mean[4:] == pytest.approx([1.0, 12.0, 0.1], abs=0.01)  # gyro z reads 0.1 deg/s per g


def test_bias_drifts_at_random():
    n = 100 * RATE_HZ
    gyro = replace(PERFECT, gyro_walk=0.1).read(
        np.random.default_rng(3), np.zeros((n, 3)), np.zeros((n, 3)), np.full(n, 25.0)
    )[:, 4:]
    late = np.abs(gyro[-200:].mean(axis=0))
    assert 0.2 < late.max() < 5.0
