"""The lean filter in the board's 32-bit floats against 64-bit ones, over an hour."""

import math

import numpy as np
from kickstand import kalman, lean_filter, rest, trim

HOUR_S, HZ, GRAVITY_MPS2 = 3600.0, 100, 9.80665


def ride():
    """(n, 3) force in g and rate in rad/s of a balanced bike that weaves at 8 to 22 m/s, with noise and gyro bias."""
    chance = np.random.default_rng(5)
    t = np.arange(int(HOUR_S * HZ)) / HZ
    riding = 1.0 - np.exp(-np.maximum(t - 10.0, 0.0))
    lean = riding * (0.5 * np.sin(0.31 * t) + 0.2 * np.sin(0.83 * t + 1.0)) * (np.sin(0.021 * t) > -0.3)
    lean = np.convolve(lean, np.full(HZ, 1.0 / HZ), mode="same")
    speed = riding * (15.0 + 7.0 * np.sin(0.05 * t))
    yaw = -riding * GRAVITY_MPS2 * np.tan(lean) / np.maximum(speed, 3.0)
    left = speed * yaw / GRAVITY_MPS2
    s, c = np.sin(lean), np.cos(lean)
    force = np.column_stack((left * c + s, c - left * s, np.gradient(speed, t) / GRAVITY_MPS2))
    rate = np.column_stack((yaw * s, yaw * c, np.gradient(lean, t))) + [0.002, -0.003, 0.004]
    return force + 0.02 * chance.standard_normal(force.shape), rate + 0.01 * chance.standard_normal(rate.shape)


def leans(force, rate):
    estimator = lean_filter.LeanFilter()
    dt_us = 1_000_000 // HZ
    return np.array([estimator.update(f, w, dt_us) for f, w in zip(force, rate, strict=True)], dtype=float)


def single(function):
    """function with its result as a 32-bit float."""
    return lambda *x: np.float32(function(*x))


def test_an_hour_in_float32_and_in_float64_is_the_same(monkeypatch):
    force, rate = ride()
    exact = leans(force.tolist(), rate.tolist())
    for module in (lean_filter, kalman, rest, trim):
        for name in ("sin", "cos", "sqrt", "atan2", "degrees"):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, single(getattr(math, name)))
    rounded = leans([list(row) for row in force.astype(np.float32)], [list(row) for row in rate.astype(np.float32)])
    assert np.abs(exact).max() > 30.0
    assert np.abs(rounded - exact).max() < 0.1
