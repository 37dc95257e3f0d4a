"""What each measurement of the lean filter says, and how far it is believed. Runs on MicroPython too.

A disturbance of 1 sigma that lasts tau seconds counts, in each window of T seconds, as sigma sqrt(2 tau / T).
"""

from math import degrees, radians, sin, sqrt

from bike_motion import GRAVITY_MPS2, near
from kickstand.lean import measurements
from kickstand.lean.bike_model import BIAS_LEFT, LEAN, PITCH, SPEED, STATES, YAW_ERROR, Linearisation

WINDOW_S = 0.2
STILL = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]  # the means of a window, see bike_model.predict()


def state(lean_deg=0.0, pitch_deg=0.0, speed_mps=0.0, yaw_error_deg=0.0):
    x = [0.0] * STATES
    x[LEAN], x[PITCH], x[SPEED] = radians(lean_deg), radians(pitch_deg), speed_mps / GRAVITY_MPS2
    x[YAW_ERROR] = radians(yaw_error_deg)
    return x


def model(forward=0.0, rates=(0.0, 0.0, 0.0), **at):
    return Linearisation(state(**at), list(rates), forward)


def dense(row):
    full = [0.0] * STATES
    for i, value in row:
        full[i] += value
    return full


def test_the_forces_without_vibration_and_rolling():
    """40 mg to the side, where wheels and tyres disturb least, and 70 mg up, because of bumps."""
    here = model(lean_deg=20.0, speed_mps=15.0)
    means = [0.03, -0.2] + STILL[2:8] + [0.03**2]
    left, up = measurements.forces(here, means, 0.0, 0.0)
    assert left[0] == here.left_row
    assert up[0] == here.up_row
    near(left[1], 0.03, 1e-12)
    near(up[1], -0.2, 1e-12)
    near(sqrt(left[2]), 0.04, 1e-9)
    near(sqrt(up[2]), 0.07, 1e-9)


def test_a_tenth_of_the_vibration_stays_in_a_mean():
    means = [0.03] + STILL[1:8] + [0.03**2 + 0.2**2]
    (_, _, variance), _ = measurements.forces(model(), means, 0.0, 0.0)
    near(variance - 0.04**2, 0.1 * 0.2**2, 1e-9)
    means[8] = 0.0  # rounding may make less of it than nothing
    (_, _, variance), _ = measurements.forces(model(), means, 0.0, 0.0)
    near(variance, 0.04**2, 1e-12)


def test_a_sensor_0_4_m_above_the_roll_axis_feels_the_roll_begin():
    """At 100 deg/s^2 that is 0.071 g, as uncertain as it is large."""
    roll_acceleration = radians(100.0) / GRAVITY_MPS2
    left, up = measurements.forces(model(lean_deg=30.0), STILL, roll_acceleration, 0.0)
    near(left[1], 0.0712 * 0.866, 1e-4)
    near(sqrt(left[2] - 0.04**2), 0.0712, 1e-4)
    near(sqrt(up[2] - 0.07**2), 0.0712 * 0.5, 1e-4)
    left, _ = measurements.forces(model(lean_deg=30.0), STILL, -roll_acceleration, 0.0)
    near(left[1], -0.0712 * 0.866, 1e-4)


def test_a_quick_roll_takes_from_the_force_up():
    """100 deg/s about an axis 0.4 m below are 0.124 g, as uncertain as they are large."""
    means = STILL[:4] + [radians(100.0)] + STILL[5:]
    for rate in (100.0, -100.0):
        means[4] = radians(rate)
        _, up = measurements.forces(model(), means, 0.0, 0.0)
        near(up[1], 0.1243, 1e-4)
        near(sqrt(up[2] - 0.07**2), 0.1243, 1e-4)


def test_where_the_bike_pitches_the_force_up_tells_less():
    """At 5 deg/s and 15 m/s v w_x is 0.133 g: springs may do that, twice over, without a change of height."""
    here = Linearisation(state(speed_mps=15.0), [radians(5.0), 0.0, 0.0], 0.0)
    _, up = measurements.forces(here, STILL, 0.0, 0.0)
    near(sqrt(up[2] - 0.07**2), 2.0 * 0.1335, 1e-3)


def test_the_accelerometers_error_at_rest_is_taken_off_the_force_up():
    means = STILL[:6] + [1.2] + STILL[7:]
    _, up = measurements.forces(model(), means, 0.0, -0.01)
    near(up[1], STILL[1] + 0.012, 1e-9)


def test_roads_are_level_but_for_slopes_of_1_6_degrees_for_three_seconds():
    x = state(lean_deg=30.0, pitch_deg=2.0, speed_mps=15.0, yaw_error_deg=4.0)
    here = Linearisation(x, [0.0, 0.0, 0.0], 0.0)
    row, innovation, variance = measurements.level_road(here, x, WINDOW_S)
    assert row == here.level_row
    near(degrees(innovation), -(2.0 + 4.0 * 0.5), 1e-6)
    near(degrees(sqrt(variance)), 1.6 * sqrt((1.0 + (4.0 / 6.0) ** 2) * 2.0 * 3.0 / WINDOW_S), 1e-6)


def test_a_wheelie_is_pulled_down_less_than_a_hill():
    """The pull on the pitch is innovation over variance: of 30 degrees it is smaller than of 6."""
    pulls = []
    for pitch_deg in (2.0, 6.0, 30.0):
        x = state(pitch_deg=pitch_deg, speed_mps=15.0)
        _, innovation, variance = measurements.level_road(Linearisation(x, [0.0, 0.0, 0.0], 0.0), x, WINDOW_S)
        pulls.append(innovation / variance)
    slight, _, wheelie = (pull / pulls[1] for pull in pulls)
    near(slight, 0.6, 1e-6)
    near(wheelie, 5.0 / 13.0, 1e-6)


def what(lean_deg=0.0, speed_mps=15.0, yaw_dps=0.0):
    """The state that is measured, the innovation and 1 sigma of something that lasts so long: degrees or m/s."""
    (term,), innovation, variance = measurements.straight_or_usual_speed(
        radians(lean_deg), speed_mps / GRAVITY_MPS2, radians(yaw_dps), WINDOW_S
    )
    assert term[1] == 1.0
    if term[0] == LEAN:
        return "lean", degrees(innovation), degrees(sqrt(variance * WINDOW_S / (2.0 * 3.0)))
    assert term[0] == SPEED
    return "speed", innovation * GRAVITY_MPS2, sqrt(variance * WINDOW_S / (2.0 * 60.0)) * GRAVITY_MPS2


def test_a_straight_is_less_than_8_degrees_of_lean_and_2_5_of_yaw_a_second_and_over_4_mps():
    for sign in (1.0, -1.0):
        assert what(lean_deg=sign * 7.9)[0] == "lean"
        assert what(lean_deg=sign * 8.1)[0] == "speed"
        assert what(yaw_dps=sign * 2.4)[0] == "lean"
        assert what(yaw_dps=sign * 2.6)[0] == "speed"
    assert what(speed_mps=4.1)[0] == "lean"
    assert what(speed_mps=3.9)[0] == "speed"


def test_on_a_straight_the_bike_is_upright_to_0_8_degrees_for_three_seconds():
    _, innovation, sigma = what(lean_deg=5.0)
    near(innovation, -5.0, 1e-6)
    near(sigma, 0.8, 1e-6)


def test_elsewhere_its_speed_is_15_mps_to_20_for_a_minute():
    _, innovation, sigma = what(lean_deg=30.0, speed_mps=22.0)
    near(innovation, 15.0 - 22.0, 1e-6)
    near(sigma, 20.0, 1e-6)


def test_a_speed_that_is_told_is_right_to_1_mps_and_a_second_late():
    row, innovation, variance = measurements.measured_speed(12.0 / GRAVITY_MPS2, 10.0 / GRAVITY_MPS2, 0.0)
    assert row == ((SPEED, 1.0),)
    near(innovation * GRAVITY_MPS2, 2.0, 1e-6)
    near(sqrt(variance) * GRAVITY_MPS2, 1.0, 1e-6)
    for braking_mps2 in (6.0, -6.0):  # a second later it may be 6 m/s off
        _, _, variance = measurements.measured_speed(1.0, 1.0, braking_mps2 / GRAVITY_MPS2)
        near(sqrt(variance) * GRAVITY_MPS2, sqrt(1.0 + 36.0), 1e-6)


def test_at_rest_there_is_no_speed_the_rates_are_bias_and_the_force_is_the_vertical():
    means = [0.01, 0.0, 0.003, -0.004, 0.005, 0.2, 0.97, 0.06, 0.0]
    here = model(lean_deg=12.0, pitch_deg=3.0, speed_mps=0.5, rates=means[2:5], forward=means[7])
    for axis in range(3):
        speed, bias, side, forward = measurements.at_rest(here, means, 0.05, axis)
        assert speed[:2] == (((SPEED, 1.0),), -0.05)
        near(sqrt(speed[2]) * GRAVITY_MPS2, 0.02, 1e-6)
        assert bias[:2] == (((BIAS_LEFT + axis, 1.0),), means[2 + axis])
        near(degrees(sqrt(bias[2])), 0.1, 1e-6)
        assert dense(side[0]) == dense([term for term in here.left_row if term[0] in (LEAN, PITCH)])
        near(side[1], 0.01 + 0.05099 * -0.004, 1e-6)  # the force of the speed that it has not got is put back
        near(sqrt(side[2]), 0.02, 1e-9)
        near(dense(forward[0])[PITCH], 0.99863, 1e-5)
        near(forward[1], 0.06 - sin(radians(3.0)), 1e-6)
        near(sqrt(forward[2]), 0.02, 1e-9)
