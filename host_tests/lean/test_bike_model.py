"""The bike model's partial derivatives are compared with numerical derivatives of its own equations."""

import math

import numpy as np
import pytest
from kickstand.lean import bike_model
from kickstand.lean.bike_model import (
    BIAS_LEFT,
    BIAS_UP,
    CROSS_LEFT_UP,
    LEAN,
    PITCH,
    SCALE_LEFT,
    SPEED,
    STATES,
    YAW_ERROR,
    Linearisation,
    predict,
)
from kickstand.units import STANDARD_GRAVITY

STEP_S = 0.01
DISTANCE = 1e-4  # step of a state for a numerical derivative
TOLERANCE = 1e-6
MOTION = ("lean_row", "pitch_row", "speed_row")
FORCES = ("left_row", "up_row")


def random_state(chance):
    """Return a random state, force and rate.

    The state has no errors of the gyro's scale and axes. The speed is so high that no step brings it to zero.
    """
    x = np.zeros(STATES)
    x[[LEAN, PITCH, SPEED, YAW_ERROR]] = chance.uniform([-1.0, -0.3, 5.0, -0.2], [1.0, 0.3, 40.0, 0.2])
    x[BIAS_LEFT : BIAS_LEFT + 3] = chance.uniform(-0.05, 0.05, 3)
    return x, chance.uniform([-0.5, 0.5, -0.8], [0.5, 1.5, 0.8]), chance.uniform(-1.0, 1.0, 3)


def equations(x, force, rate):
    """Compute the six equations of the model at the state x, with the model's own step.

    Returns the rates of change in (1) to (3), and the expected values of (4) to (6).
    """
    moved, sums = list(x), [0.0] * 9
    predict(moved, force, rate, STEP_S, sums)
    motion = [(moved[i] - x[i]) / STEP_S for i in (LEAN, PITCH, SPEED)]
    level = x[PITCH] + x[YAW_ERROR] * math.sin(x[LEAN])
    return np.array([*motion, force[0] - sums[0], force[1] - sums[1], level])


def numerical(x, force, rate):
    """Return the partial derivatives of equations(), shape (6, STATES)."""
    out = np.empty((6, STATES))
    for i in range(STATES):
        higher, less = x.copy(), x.copy()
        higher[i] += DISTANCE
        less[i] -= DISTANCE
        out[:, i] = (equations(higher, force, rate) - equations(less, force, rate)) / (2.0 * DISTANCE)
    return out


def linearised(x, force, rate):
    """Linearise the model at the state x.

    Returns:
        derivatives: the model's partial derivatives, shape (6, STATES).
        rates: the corrected rates that the model used.
    """
    sums = [0.0] * 9
    predict(list(x), force, rate, STEP_S, sums)
    model = Linearisation(list(x), sums[2:5], sums[7], math.inf)  # an uncertain lean: use the measured rates
    out = np.zeros((6, STATES))
    for k, name in enumerate((*MOTION, *FORCES, "level_row")):
        for state, derivative in getattr(model, name):
            out[k, state] = derivative
    return out, sums[2:5]


def left_out(x, rates):
    """Return the terms that the model omits because pitch and yaw error are small, shape (6, STATES)."""
    (t, q, v), y = x[:3], x[YAW_ERROR]
    wx, wy, _ = rates
    s, c, tan = math.sin(t), math.cos(t), math.tan(q)
    out = np.zeros((6, STATES))
    out[0, LEAN] = -tan * (wx * c - wy * s)
    out[0, BIAS_LEFT], out[0, BIAS_UP] = tan * s, tan * c
    out[0, SCALE_LEFT], out[0, CROSS_LEFT_UP] = tan * s * wx, tan * s * wy
    out[2, SPEED], out[2, BIAS_UP] = wy * y, -v * y
    out[3, SPEED], out[3, BIAS_UP], out[3, YAW_ERROR] = wy * y * y, -v * y * y, v * wy * y
    out[3] /= STANDARD_GRAVITY
    return out


@pytest.mark.parametrize("seed", range(12))
def test_partial_derivatives_are_those_of_the_equations(seed):
    x, force, rate = random_state(np.random.default_rng(seed))
    jacobian, rates = linearised(x, force, rate)
    np.testing.assert_allclose(jacobian + left_out(x, rates), numerical(x, force, rate), rtol=0, atol=TOLERANCE)


def rates_at(lean, speed, left=0.0, up=0.0):
    return bike_model.turn_rates(speed, math.sin(lean), math.cos(lean), 1.0, left, up)


@pytest.mark.parametrize("lean", [-0.8, -0.3, 0.4, 0.9])
def test_near_balance_the_turn_rates_give_no_force_to_the_side(lean):
    speed = 20.0
    balanced = -STANDARD_GRAVITY * math.sin(lean) / speed
    left, up = rates_at(lean, speed, 0.0, balanced + 0.05)
    x, sums = [0.0] * STATES, [0.0] * 9
    x[LEAN], x[SPEED] = lean, speed
    predict(x, (0.0, 1.0, 0.0), (left, up, 0.0), STEP_S, sums)
    assert sums[0] == pytest.approx(0.0, abs=1e-12)  # the expected force to the left is 0 g
    assert x[PITCH] == pytest.approx(0.0, abs=1e-12)  # the rates are about the vertical, so the pitch does not change


@pytest.mark.parametrize("lean", [-0.6, 0.0, 0.6])
@pytest.mark.parametrize("pitch", [-0.2, 0.2])
def test_pitch_seen_by_the_yaw_error_is_not_lean(lean, pitch):
    """The test takes the direction of the vertical in the bike's axes. The test rotates this direction into the axes of
    a sensor that is turned about up, and computes lean and pitch there. Equation (7) must return the bike's lean."""
    yaw_error = 0.1
    left, up, forward = math.cos(pitch) * math.sin(lean), math.cos(pitch) * math.cos(lean), math.sin(pitch)
    s, c = math.sin(yaw_error), math.cos(yaw_error)
    left, forward = c * left + s * forward, c * forward - s * left
    x = np.zeros(STATES)
    x[[LEAN, PITCH, YAW_ERROR]] = math.atan2(left, up), math.asin(forward), yaw_error
    share = Linearisation(x, np.zeros(3), 0.0).lean_by_pitch(x)
    assert x[LEAN] - share == pytest.approx(lean, abs=math.radians(0.12))
    assert abs(x[LEAN] - lean) > math.radians(0.75)
