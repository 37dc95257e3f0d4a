"""Tests the lean filter on rides that follow its own equations, with vibration and errors of the gyro."""

import math

import numpy as np
import pytest
from kickstand.lean import lean_filter
from kickstand.lean.measurements import gyro_variances
from kickstand.lean.meter import MAX_VARIANCE
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.api import replay
from kickstand_workshop.evaluation.drawn_rides import drawn_ride

HZ, GRAVITY_MPS2 = 100, STANDARD_GRAVITY
DT_US = 1_000_000 // HZ


def balanced(seconds, lean, speed):
    """Compute the motion of a bike in balance on a level road.

    lean: in rad, shape (n), or one value.
    speed: in m/s, shape (n), or one value.

    Returns:
        force: in g, shape (n, 3).
        rate: in rad/s, shape (n, 3).
    """
    t = np.arange(int(seconds * HZ)) / HZ
    yaw = np.where(speed > 1.0, -GRAVITY_MPS2 * np.tan(lean) / np.maximum(speed, 1.0), 0.0)
    left = speed * yaw / GRAVITY_MPS2
    s, c = np.sin(lean), np.cos(lean)
    force = np.column_stack((left * c + s, c - left * s, np.gradient(speed, t) / GRAVITY_MPS2))
    return force, np.column_stack((yaw * s, yaw * c, np.gradient(lean, t)))


def held_turns(seconds):
    """Return lean and speed of a ride. After ten seconds at rest come turns of half a minute to alternate sides, with
    ten seconds between them."""
    t = np.arange(int(seconds * HZ)) / HZ
    lean = np.radians(30.0) * (t > 20.0) * (t % 40.0 > 10.0) * np.where(t % 80.0 > 40.0, 1.0, -1.0)
    lean = np.convolve(lean, np.full(HZ, 1.0 / HZ), mode="same")
    return lean, 20.0 * np.clip((t - 10.0) / 8.0, 0.0, 1.0)


def weaving(seconds):
    """Return lean and speed of a ride at 8 to 22 m/s. The ride has bends of up to 40 degrees, and straights."""
    t = np.arange(int(seconds * HZ)) / HZ
    riding = 1.0 - np.exp(-np.maximum(t - 10.0, 0.0))
    lean = riding * (0.5 * np.sin(0.31 * t) + 0.2 * np.sin(0.83 * t + 1.0)) * (np.sin(0.021 * t) > -0.3)
    return np.convolve(lean, np.full(HZ, 1.0 / HZ), mode="same"), riding * (15.0 + 7.0 * np.sin(0.05 * t))


def leans(force, rate, speeds=None, **parameters):
    """Return the filter's lean in degrees. speeds: {index of a sample: measured speed}."""
    estimator = lean_filter.LeanFilter(**parameters)
    estimates = []
    for k, (f, w) in enumerate(zip(force, rate, strict=True)):
        if speeds and k in speeds:
            estimator.measure_speed(speeds[k])
        estimates.append(estimator.update(f, w, DT_US))
    return np.array(estimates, dtype=float)


def shaken(force, rate, seed=5):
    chance = np.random.default_rng(seed)
    force = force + 0.05 * chance.standard_normal(force.shape)
    return force, rate + np.radians(3.0) * chance.standard_normal(rate.shape)


def slope(shown, true):
    leaned = np.abs(true) > 10.0
    return shown[leaned] @ true[leaned] / (true[leaned] @ true[leaned])


def test_vibration_does_not_make_held_turns_read_low():
    """The filter multiplies the yaw rate by the speed. Noise of the yaw rate must not bias the product of yaw rate and
    speed."""
    lean, speed = held_turns(240.0)
    force, rate = shaken(*balanced(240.0, lean, speed))
    estimates = leans(force.tolist(), rate.tolist())
    assert slope(estimates, np.degrees(lean)) == pytest.approx(1.0, abs=0.03)
    assert np.sqrt(np.mean((estimates - np.degrees(lean)) ** 2)) < 1.0


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_scale_and_cross_axis_errors_are_found(seed):
    """The data sheet allows scale errors of 3 % and cross-axis errors of 2 %. After five minutes with errors of this
    size, the lean is right within a degree."""
    chance = np.random.default_rng(seed)
    lean, speed = weaving(420.0)
    force, rate = shaken(*balanced(420.0, lean, speed))
    errors = np.where(np.eye(3) > 0.0, 0.03, 0.02) * chance.choice([-1.0, 1.0], (3, 3))
    estimates = leans(force.tolist(), (rate @ (np.eye(3) + errors).T).tolist())
    late = slice(300 * HZ, None)
    assert np.sqrt(np.mean((estimates - np.degrees(lean))[late] ** 2)) < 1.0
    assert np.abs(estimates - np.degrees(lean))[late].max() < 2.5


def test_the_tilt_of_axes_without_the_six_positions_is_found_soon():
    """The accelerometer's offset tilts the vehicle's axes by 3 degrees, but not the gyro's."""
    lean, speed = weaving(50.0)
    force, rate = shaken(*balanced(50.0, lean, speed))
    rate += rate[:, 1:2] * [0.05, 0.0, -0.05]
    tilted = gyro_variances([0.0] * 9, [1.0] * 9, True)
    estimates = leans(force.tolist(), rate.tolist(), gyro_variances=tilted)
    assert np.sqrt(np.mean((estimates - np.degrees(lean))[30 * HZ :] ** 2)) < 1.2


def held_from_side_to_side(seconds):
    """Return lean and speed of a ride. After ten seconds at rest and a short straight come turns of 40 s at 38 degrees,
    directly one after the other."""
    t = np.arange(int(seconds * HZ)) / HZ
    lean = np.radians(38.0) * (t > 23.0) * np.where((t - 23.0) % 80.0 < 40.0, 1.0, -1.0)
    lean = np.convolve(lean, np.full(HZ, 1.0 / HZ), mode="same")
    return lean, 22.0 * np.clip((t - 10.0) / 8.0, 0.0, 1.0)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_power_on_in_the_hand_and_laid_down(seed):
    """A hand moves the sensor for 20 s from the first sample on, then lays it down. The filter must find the rest and
    the lean, although the movement may have given it a wrong estimate of the gyro's errors."""
    rng = np.random.default_rng(seed)
    hand = lean_filter.LeanFilter()
    rate, push, up, lean = np.zeros(3), np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.0
    for k in range(60 * HZ):
        moving = k < 20 * HZ
        rate = 0.98 * rate + math.radians(8.0) * rng.normal(size=3) if moving else np.zeros(3)  # rates of 40 deg/s rms
        push = 0.95 * push + 0.06 * rng.normal(size=3) if moving else np.zeros(3)  # 0.2 g
        up = up - np.cross(rate, up) / HZ
        up /= np.linalg.norm(up)
        force = up + push + rng.normal(0, 0.003, 3)
        lean = hand.update(force.tolist(), (rate + rng.normal(0, 5e-4, 3)).tolist(), DT_US if k else 0)
    if abs(up[2]) < 0.7:  # with the nose up or down the sensor has no lean
        assert hand.at_rest
        assert lean == pytest.approx(math.degrees(math.atan2(up[0], up[1])), abs=2.0)


@pytest.mark.parametrize("vibration_g", [0.003, 0.03])
def test_a_cold_sensor_without_the_six_positions_rests_on_its_stand(vibration_g):
    """The sensor reads 8 % too little force, and its bias has changed by 1.4 deg/s. Without vibration the filter finds
    the rest within 2 s. With the vibration of an engine, the same readings may come from a bend."""
    chance, cold, rested = np.random.default_rng(3), lean_filter.LeanFilter(), False
    for k in range(2 * HZ):
        force = [-0.19, 0.9, 0.0] + vibration_g * chance.standard_normal(3)
        rate = np.radians([1.2, -1.4, 0.6]) + 5e-4 * chance.standard_normal(3)
        cold.update(force.tolist(), rate.tolist(), DT_US if k else 0)
        rested = rested or cold.at_rest
    assert rested == (vibration_g < 0.01) == (cold.speed_mps < 0.1)


@pytest.mark.parametrize("braking_mps2", [2.5, 6.0])
def test_an_even_braking_on_a_smooth_road_is_no_rest(braking_mps2):
    """The end of even braking is as calm as a bike at rest on a slope. Rest must be found only when the bike has
    stopped, and the lean must stay certain."""
    seconds = 20.0 / braking_mps2
    speed = np.concatenate((np.zeros(5 * HZ), np.linspace(0.0, 20.0, 8 * HZ), np.full(6 * HZ, 20.0)))
    speed = np.concatenate((speed, np.linspace(20.0, 0.0, round(seconds * HZ)), np.zeros(8 * HZ)))
    forward = np.gradient(speed) * HZ / GRAVITY_MPS2
    rng = np.random.default_rng(1)
    ridden = lean_filter.LeanFilter()
    for k, push in enumerate(forward):
        force = np.array([0.0, 1.0, push]) + rng.normal(0, 0.004, 3)
        ridden.update(force.tolist(), rng.normal(0, 1e-3, 3).tolist(), DT_US if k else 0)
        assert not ridden.at_rest or speed[k] < 2.0
        assert k < HZ or ridden.variance < MAX_VARIANCE
    assert ridden.at_rest
    assert abs(ridden.pitch_deg) < 1.0


@pytest.mark.long
def test_a_measured_speed_makes_no_long_bend_worse():
    """The gyro's axis up has a scale error of 3 %. The wheel's speed has a scale error of 5 %, and is measured ten
    times per second."""
    lean, speed = held_from_side_to_side(190.0)
    force, rate = shaken(*balanced(190.0, lean, speed))
    rate[:, 1] *= 1.03
    force, rate = force.tolist(), rate.tolist()
    measured = {k: 1.05 * speed[k] for k in range(0, len(speed), HZ // 10)}
    without, measuring = (leans(force, rate, speeds) - np.degrees(lean) for speeds in (None, measured))
    assert np.sqrt(np.mean(measuring**2)) < 1.03 * np.sqrt(np.mean(without**2))


@pytest.mark.long
def test_the_stated_sigma_fits_the_error_of_the_lean():
    """In a ride of the second simulator, about two thirds of the errors are within one standard deviation."""
    ride = drawn_ride(2, 100.0, ["firm"], "street")
    estimates = replay(ride.logs[0], ride.calibrations[0])
    error = (estimates.lean_deg - ride.true_lean(0)) / estimates.lean_sigma_deg
    error = np.abs(error[ride.riding(0) & ~np.isnan(error)])
    assert 0.5 < np.mean(error < 1.0) < 0.9
    assert np.mean(error < 2.0) > 0.85
