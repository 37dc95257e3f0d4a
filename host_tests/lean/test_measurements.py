"""Tests each measurement of the lean filter, and the conditions that raise its noise. Also runs on MicroPython.

test_known_ride.py tests the values of the variances.
"""

from math import cos, degrees, radians, sin

from bike_motion import near
from kickstand.lean import measurements
from kickstand.lean.bike_model import BIAS_LEFT, LEAN, PITCH, SPEED, STATES, YAW_ERROR, Linearisation

WINDOW_S = 0.2
STILL = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]  # the means of a window, see bike_model.predict()


def model(forward=0.0, rates=(0.0, 0.0, 0.0), lean_deg=0.0, pitch_deg=0.0, speed_mps=0.0, yaw_error_deg=0.0):
    """Return a state, and the model that is linearised at this state."""
    x = [0.0] * STATES
    x[LEAN], x[PITCH], x[SPEED] = radians(lean_deg), radians(pitch_deg), speed_mps
    x[YAW_ERROR] = radians(yaw_error_deg)
    return x, Linearisation(x, list(rates), forward)


def forces(at=None, roll_acceleration=0.0, scale_error=0.0, **changed):
    """Return both measurements of force in a window.

    at: arguments of model().
    changed: changes of the means STILL. For example, mean8=0.04 changes the mean with index 8.
    """
    means = [changed.get("mean%d" % i, STILL[i]) for i in range(9)]  # noqa: UP031 MicroPython
    return measurements.forces(model(**(at or {}))[1], means, roll_acceleration, scale_error)


def test_the_forces_are_the_differences_from_what_was_expected():
    _, here = model(lean_deg=20.0, speed_mps=15.0)
    left, up = forces({"lean_deg": 20.0, "speed_mps": 15.0}, mean0=0.03, mean1=-0.2)
    assert (left[0], up[0]) == (here.left_row, here.up_row)
    near(left[1], 0.03, 1e-12)
    near(up[1], -0.2, 1e-12)


def test_vibration_roll_and_pitch_rates_raise_the_forces_noise():
    for at, changed in (
        ({}, {"mean8": 0.2**2}),
        ({"lean_deg": 30.0}, {"roll_acceleration": radians(100.0)}),
        ({}, {"mean4": radians(100.0)}),
        ({}, {"mean4": radians(-100.0)}),
        ({"speed_mps": 15.0, "rates": (radians(5.0), 0.0, 0.0)}, {}),
    ):
        (_, _, left), (_, _, up) = forces(at, **changed)
        (_, _, still_left), (_, _, still_up) = forces()
        assert left > still_left + 1e-4 or up > still_up + 1e-4, (at, changed)
    assert forces(mean8=-1e-6)[0][2] > 0.0  # rounding may make the variance of the vibration negative


def test_roll_is_subtracted_above_the_roll_axis():
    for sign in (1.0, -1.0):
        left, _ = forces(roll_acceleration=sign * radians(100.0))
        assert 0.05 < sign * left[1] < 0.1
        # the centripetal force is the same for both directions of roll
        assert 0.1 < forces(mean4=sign * radians(100.0))[1][1] < 0.15


def test_the_error_at_rest_is_subtracted_from_the_force_up():
    near(forces(scale_error=-0.01, mean6=1.2)[1][1], 0.012, 1e-9)


def test_a_wheelie_is_pulled_to_level_less_than_a_hill():
    """The pull on the pitch is the innovation divided by the variance. The pull is smaller at a pitch of 30 degrees
    than at 6 degrees."""
    x, here = model(lean_deg=30.0, pitch_deg=2.0, speed_mps=15.0, yaw_error_deg=4.0)
    row, innovation, _ = measurements.level_road(here, x, WINDOW_S)
    assert row == here.level_row
    near(degrees(innovation), -(2.0 + 4.0 * 0.5), 1e-6)
    pulls = []
    for pitch_deg in (2.0, 6.0, 30.0):
        x, here = model(pitch_deg=pitch_deg, speed_mps=15.0)
        _, innovation, variance = measurements.level_road(here, x, WINDOW_S)
        pulls.append(innovation / variance)
    assert pulls[1] < pulls[0] < 0.0
    assert pulls[1] < pulls[2] < 0.0


def test_straights_assume_upright_and_turns_a_usual_speed():
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


def test_a_measured_speed_is_less_certain_while_it_changes():
    row, innovation, steady = measurements.measured_speed(12.0, 10.0, 0.0, 1.0)
    assert row == ((SPEED, 1.0),)
    near(innovation, 2.0, 1e-6)
    for change in (6.0, -6.0):
        assert measurements.measured_speed(12.0, 10.0, change, 1.0)[2] > 2.0 * steady


def test_ten_measured_speeds_per_second_count_as_one():
    """The ten speeds have the same errors, from the delay, the tyre's radius and the scale of the gyro's axis up."""
    once, often = (measurements.measured_speed(20.0, 20.0, 0.0, seconds)[2] for seconds in (1.0, 0.4))
    near(often, once / 0.4, 1e-3 * often)
    assert measurements.measured_speed(40.0, 40.0, 0.0, 1.0)[2] > 2.0 * once  # errors of scale grow with the speed


def test_rest_measures_speed_bias_and_the_vertical():
    means = [0.01, 0.0, 0.003, -0.004, 0.005, 0.2, 0.97, 0.06, 0.0]
    _, here = model(lean_deg=12.0, pitch_deg=3.0, speed_mps=0.5, rates=means[2:5], forward=means[7])
    for axis in range(3):
        speed, bias, side, forward = measurements.at_rest(here, means, 0.05, axis)
        assert speed[:2] == (((SPEED, 1.0),), -0.05)
        assert bias[:2] == (((BIAS_LEFT + axis, 1.0),), means[2 + axis])
        assert sorted(side[0]) == sorted([term for term in here.left_row if term[0] in (LEAN, PITCH)])
        # the force of the estimated speed is added back, because the true speed is 0
        near(side[1], 0.01 + 0.05099 * -0.004, 1e-6)
        ((state, factor),) = forward[0]
        assert state == PITCH
        near(factor, 0.99863, 1e-5)
        near(forward[1], 0.06 - sin(radians(3.0)), 1e-6)


def test_the_springs_pitch_is_subtracted_from_the_forces():
    at = {"lean_deg": 30.0, "speed_mps": 15.0}
    left, up = measurements.forces(model(**at)[1], STILL, 0.0, 0.0, 0.1)
    near(left[1], 0.1 * sin(radians(30.0)), 1e-7)
    near(up[1], 0.1 * cos(radians(30.0)), 1e-7)


def test_pitch_rate_and_lean_raise_the_left_forces_noise():
    pitching = {"speed_mps": 15.0, "rates": (radians(-5.0), 0.0, 0.0)}
    near(forces(pitching)[0][2], forces()[0][2], 1e-12)
    leaning = forces({"lean_deg": 30.0, "speed_mps": 15.0})[0][2]
    assert forces({"lean_deg": 30.0, **pitching})[0][2] > leaning + 1e-3
