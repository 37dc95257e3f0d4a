"""The smoother's equations are compared with motions whose readings follow from geometry."""

import numpy as np
import pytest
from kickstand_tools.estimation import model as of
from kickstand_tools.estimation.windows import windows_of
from window_input import windows

G = 9.80665
MOTION = slice(0, of.STATES)
WHEELS = (of.SLIDING, of.CLIMBING, of.SLOPING)


def residuals(rate, force, states=(), parameters=(), speed=np.nan, warm=0.0):
    """Return the residuals of one window with these readings, shape (ROWS).

    states, parameters: {index: value}. All others are 0.
    """
    x = np.zeros((of.STATES + of.PARAMETERS, 1))
    for index, value in dict(states).items():
        x[index] = value
    for index, value in dict(parameters).items():
        x[of.STATES + index] = value
    return of.process_and_measurements(windows(1, rate, force, speed, warm=np.array([warm])), x)[:, 0]


@pytest.mark.parametrize("lean", [-0.9, 0.0, 0.6])
@pytest.mark.parametrize("yaw_rate", [-0.4, 0.5])
def test_steady_turn_is_constant(lean, yaw_rate):
    """Nicolae's equations (22) and (23) give the force in a steady turn, whether the lean is balanced or not."""
    speed, s, c = 17.0, np.sin(lean), np.cos(lean)
    across = speed * yaw_rate / G
    rate, force = [yaw_rate * s, yaw_rate * c, 0.0], [across * c + s, c - across * s, 0.0]
    motion = residuals(rate, force, {of.LEAN: lean, of.FORWARD: speed})
    assert np.allclose(motion[[*range(of.STATES), *WHEELS]], 0.0, atol=1e-9)


@pytest.mark.parametrize("braking", [0.0, -0.5])
@pytest.mark.parametrize("pitch", [-0.1, 0.0, 0.15])
def test_rest_and_braking_on_a_slope_fit_the_model(pitch, braking):
    lean = 0.2
    force = np.array([np.cos(pitch) * np.sin(lean), np.cos(pitch) * np.cos(lean), np.sin(pitch)])
    level = np.array([-np.sin(lean) * np.sin(pitch), -np.cos(lean) * np.sin(pitch), np.cos(pitch)])
    motion = residuals([0.0] * 3, force + braking * level, {of.LEAN: lean, of.PITCH: pitch})[MOTION]
    assert motion[of.FORWARD] == pytest.approx(braking * G, abs=1e-9)
    assert np.allclose(np.delete(motion, of.FORWARD), 0.0, atol=1e-9)


@pytest.mark.parametrize("lean", [-0.5, 0.0, 0.8])
def test_sensor_above_the_roll_axis_moves_with_the_roll(lean):
    """The sensor is 0.6 m above the roll axis and 0.7 m in front of the rear wheel, while the bike rolls and turns."""
    height, ahead, speed, roll, yaw = 0.6, 0.7, 15.0, 1.2, -0.3
    s, c = np.sin(lean), np.cos(lean)
    left, up, forward = -height * c * roll + ahead * yaw, -height * s * roll, speed + height * s * yaw
    states = {of.LEAN: lean, of.LEFT: left, of.UP: up, of.FORWARD: forward}
    position = {of.HEIGHT: height, of.AHEAD: ahead}
    measured = residuals([yaw * s, yaw * c, roll], [0.0, 1.0, 0.0], states, position, speed)
    assert np.allclose(measured[[*WHEELS, of.MEASURED_SPEED, of.BACKWARD]], 0.0, atol=1e-9)
    assert measured[of.ANY_SPEED] == pytest.approx(speed - 15.0)


@pytest.mark.parametrize(
    ("force", "lean", "parameters"),
    [
        (0.1 * np.sin(0.7) * 1.2, 0.7, {of.TYRES: 0.1}),  # a leaned tyre touches the road beside its middle
        (0.03 * np.cos(0.5), 0.5, {of.BESIDE: 0.03}),  # the force of a side wind is level
        (0.01, 0.0, {of.CAMBER: 0.01}),  # the camber of the road matters only on straights
        (0.01, 0.02, {of.CAMBER: 0.01}),
        (0.0, 0.5, {of.CAMBER: 0.01}),
    ],
)
def test_balanced_bike_has_the_modelled_side_force(force, lean, parameters):
    assert abs(residuals([0.0] * 3, [force, 1.2, 0.0], {of.LEAN: lean}, parameters)[of.BALANCED]) < 5e-5


def test_dive_and_delay_of_the_speed_follow_the_braking():
    """At 0.5 g the nose dives by 0.5 x 0.03 rad, and a speed that is 0.4 s late is 0.5 g x 0.4 s too high."""
    braking = -0.5
    states = {of.FORWARD: 20.0, of.PITCH: 0.03 * braking}
    force = [0.0, np.cos(0.015) - braking * np.sin(0.03 * braking), braking * np.cos(0.015) + np.sin(0.03 * braking)]
    parameters = {of.DIVE: 0.03, of.DELAY: 0.4}
    measured = residuals([0.0] * 3, force, states, parameters, speed=20.0 + 0.4 * 0.5 * G)
    assert measured[[of.CLIMBING, of.MEASURED_SPEED]] == pytest.approx([0.0, 0.0], abs=2e-3)
    assert measured[of.BACKWARD] == 0.0
    assert residuals([0.0] * 3, force, {of.FORWARD: -2.0})[of.BACKWARD] == pytest.approx(-2.0)


def test_the_jacobian_equals_central_differences():
    """All states and parameters are tested, at forward and backward speeds."""
    rng, n = np.random.default_rng(3), 30
    force, rate = rng.normal(size=(2, n, 3))
    noise = windows_of(np.linspace(0.0, 6.0, n), force, rate, rng.normal(size=n), rng.normal(size=n))
    x = 0.3 * rng.normal(size=(of.STATES + of.PARAMETERS, n))
    x[of.FORWARD] *= 10.0
    unknown = np.arange(len(x))
    for row, derivative in zip(unknown, of.jacobian(noise, x, unknown), strict=True):
        step = 1e-5 * (unknown == row)[:, None]
        above, below = (of.process_and_measurements(noise, x + sign * step) for sign in (1.0, -1.0))
        assert np.allclose(derivative, (above - below) / 2e-5, rtol=1e-4, atol=1e-4), row
