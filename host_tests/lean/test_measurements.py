"""What each measurement of the lean filter says, and what makes it less certain. Runs on MicroPython too.

The figures that the variances come to are those of test_known_ride.py.
"""

from math import radians, sin

from bike_motion import near
from kickstand.lean import measurements
from kickstand.lean.bike_model import BIAS_LEFT, LEAN, PITCH, SPEED, STATES, YAW_ERROR, Linearisation

WINDOW_S = 0.2


def model(forward=0.0, rates=(0.0, 0.0, 0.0), lean_deg=0.0, pitch_deg=0.0, speed_mps=0.0, yaw_error_deg=0.0):
    """The state and the model at it."""
    x = [0.0] * STATES
    x[LEAN], x[PITCH], x[SPEED] = radians(lean_deg), radians(pitch_deg), speed_mps
    x[YAW_ERROR] = radians(yaw_error_deg)
    return x, Linearisation(x, list(rates), forward)


def test_the_forces_are_the_differences_from_what_was_expected():
    _, here = model(lean_deg=20.0, speed_mps=15.0)
    left, up = measurements.forces(here, [0.03, -0.2, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 0.0, 0.0)
    assert (left[0], up[0]) == (here.left_row, here.up_row)
    near(left[1], 0.03, 1e-12)
    near(up[1], -0.2, 1e-12)


def test_on_a_straight_the_bike_is_upright_and_elsewhere_its_speed_is_the_usual_one():
    for lean_deg, mps, yaw_dps, straight in (
        (5.0, 15.0, 1.0, True),
        (-5.0, 15.0, -1.0, True),
        (30.0, 15.0, 0.0, False),
        (-30.0, 15.0, 0.0, False),
        (0.0, 15.0, 10.0, False),
        (0.0, 15.0, -10.0, False),
        (0.0, 2.0, 0.0, False),
    ):
        ((state, factor),), innovation, _ = measurements.straight_or_prior_speed(
            radians(lean_deg), mps, radians(yaw_dps), WINDOW_S
        )
        assert (state, factor) == (LEAN if straight else SPEED, 1.0)
        near(innovation, radians(-lean_deg) if straight else 15.0 - mps, 1e-6)


def test_at_rest_there_is_no_speed_the_rates_are_bias_and_the_force_is_the_vertical():
    means = [0.01, 0.0, 0.003, -0.004, 0.005, 0.2, 0.97, 0.06, 0.0]
    _, here = model(lean_deg=12.0, pitch_deg=3.0, speed_mps=0.5, rates=means[2:5], forward=means[7])
    for axis in range(3):
        speed, bias, side, forward = measurements.at_rest(here, means, 0.05, axis)
        assert speed[:2] == (((SPEED, 1.0),), -0.05)
        assert bias[:2] == (((BIAS_LEFT + axis, 1.0),), means[2 + axis])
        assert sorted(side[0]) == sorted([term for term in here.left_row if term[0] in (LEAN, PITCH)])
        near(side[1], 0.01 + 0.05099 * -0.004, 1e-6)  # the force of the speed that it has not got is put back
        ((state, factor),) = forward[0]
        assert state == PITCH
        near(factor, 0.99863, 1e-5)
        near(forward[1], 0.06 - sin(radians(3.0)), 1e-6)
