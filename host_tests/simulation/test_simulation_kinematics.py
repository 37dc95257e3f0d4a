"""The simulated motion agrees with numerical derivatives of attitude and position, and with the laws of balance."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.simulation.commands import Leg, commands
from kickstand_tools.simulation.physics import bike as physics
from kickstand_tools.simulation.physics.bike import Bike
from kickstand_tools.simulation.physics.kinematics import Motion, body_rates, specific_force
from kickstand_tools.simulation.physics.signals import integral

RATE = 1000.0
EDGE = 50  # samples at both ends, where derivatives are one-sided


def wild_motion() -> Motion:
    """Return a motion in which speed, slope, yaw, lean and pitch all change."""
    t = np.arange(8000) / RATE
    return Motion(
        RATE,
        15.0 + 5.0 * np.sin(0.9 * t),
        0.12 * np.sin(0.7 * t),
        0.5 * np.sin(1.1 * t + 0.3),
        0.9 * np.sin(2.1 * t),
        0.12 * np.sin(0.7 * t) + 0.06 * np.sin(3.0 * t),
        np.zeros_like(t),
    )


def attitude(motion: Motion) -> np.ndarray:
    """Return the attitude as rotation matrices, shape (n, 3, 3).

    The columns are the vehicle's left, up and forward, in the world's axes east, north and up.
    """

    def about(axis: int, angle: np.ndarray) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        made = np.zeros((len(angle), 3, 3))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        made[:, axis, axis] = 1.0
        made[:, i, i], made[:, i, j] = c, -s
        made[:, j, i], made[:, j, j] = s, c
        return made

    heading = integral(motion.yaw_rate, motion.rate_hz)
    # At heading 0, forward is east and left is north. The columns are left, up and forward
    start = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    # nose up is a negative rotation about left, and leaning to the right turns the left axis towards up
    return about(2, heading) @ start @ about(0, -motion.pitch) @ about(2, motion.lean)


def test_rates_are_the_derivative_of_the_attitude():
    motion = wild_motion()
    turned = attitude(motion)
    spin = np.swapaxes(turned, 1, 2) @ np.gradient(turned, 1.0 / RATE, axis=0)
    rates = np.column_stack((spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]))
    assert np.abs(rates - body_rates(motion))[EDGE:-EDGE].max() < 2e-3


def test_force_is_the_second_derivative_of_the_sensors_place():
    bike = Bike(sensor_left=0.08)
    motion = wild_motion()
    turned = attitude(motion)
    heading = integral(motion.yaw_rate, RATE)
    velocity = motion.speed * np.array(
        [np.cos(motion.slope) * np.cos(heading), np.cos(motion.slope) * np.sin(heading), np.sin(motion.slope)]
    )
    centre = np.column_stack([integral(v, RATE) for v in velocity])
    arm = np.array([bike.sensor_left, bike.sensor_height - bike.tyre_radius, bike.sensor_forward])
    acceleration = np.gradient(np.gradient(centre + turned @ arm, 1.0 / RATE, axis=0), 1.0 / RATE, axis=0)
    acceleration[:, 2] += STANDARD_GRAVITY
    force = np.einsum("nji,nj->ni", turned, acceleration)
    assert np.abs(force - specific_force(motion, bike))[EDGE:-EDGE].max() < 0.01


def held_turn(lean_deg: float, bike: Bike, speed: float = 18.0, **more: float) -> tuple[physics.Roll, int]:
    """Return the roll of a simulated turn, and the index of a sample in its steady middle."""
    command = commands([Leg("straight", 3.0, speed, 0.0), Leg("turn", 8.0, speed, lean_deg, **more)], RATE)
    return physics.roll(command, bike, np.zeros_like(command.time)), 9000


@pytest.mark.parametrize("lean_deg", [-45.0, -20.0, 10.0, 38.0])
def test_steady_turn_balances_gravity_and_centripetal_force(lean_deg):
    narrow = Bike(tyre_radius=0.0, wheel_inertia=0.0)
    rolled, k = held_turn(lean_deg, narrow)
    assert np.degrees(rolled.lean[k]) == pytest.approx(lean_deg, abs=0.01)
    assert np.degrees(np.arctan(-18.0 * rolled.yaw_rate[k] / STANDARD_GRAVITY)) == pytest.approx(lean_deg, abs=0.01)


def test_wide_tyres_and_spinning_wheels_add_lean():
    bike = Bike()
    rolled, k = held_turn(40.0, bike)
    centripetal = -18.0 * rolled.yaw_rate[k] / STANDARD_GRAVITY
    assert np.tan(rolled.balance[k]) == pytest.approx((1.0 + bike.wheel_inertia) * centripetal)
    formula = np.degrees(np.arctan(centripetal))
    flank = np.degrees(np.arcsin(0.06 * np.sin(np.radians(40.0)) / (0.62 - 0.06)))
    assert np.degrees(rolled.lean[k]) == pytest.approx(40.0 + flank, abs=0.01)
    assert 1.10 < np.degrees(rolled.lean[k]) / formula < 1.15


def test_the_moments_about_the_contact_point_balance():
    """The road is banked, the rider hangs off and the tyres are wide. The line from the contact point to the centre of
    mass must have the lean of balance."""
    bike, bank, hang, b = Bike(), np.radians(7.0), 0.03, np.radians(31.0)
    lean = physics.chassis_lean(b, bike, bank, hang)
    arm = bike.mass_height - bike.tyre_radius
    right = bike.tyre_radius * np.sin(bank) + arm * np.sin(lean) + hang * np.cos(lean)
    up = bike.tyre_radius * np.cos(bank) + arm * np.cos(lean) - hang * np.sin(lean)
    assert np.arctan2(right, up) == pytest.approx(b)


def test_hanging_off_to_the_inside_reduces_the_lean():
    hung, k = held_turn(30.0, Bike(), hang_m=0.04)
    plain, _ = held_turn(30.0, Bike())
    assert 3.0 < np.degrees(plain.lean[k] - hung.lean[k]) < 5.0
    assert hung.yaw_rate[k] == pytest.approx(plain.yaw_rate[k], rel=1e-6)


def test_a_turn_begins_with_countersteering():
    rolled, _ = held_turn(35.0, Bike(), roll_s=1.0)
    entry = rolled.yaw_rate[3000:3500]
    assert entry.max() > 0.05  # before a turn to the right, the bike yaws to the left for a moment
    assert rolled.yaw_rate[9000] < -0.2


def test_wind_from_the_left_leans_a_straight_ride_to_the_left():
    command = commands([Leg("straight", 6.0, 20.0, 0.0, crosswind_mps2=0.5)], RATE)
    rolled = physics.roll(command, Bike(), np.zeros_like(command.time))
    assert np.degrees(rolled.balance[3000]) == pytest.approx(-np.degrees(np.arctan(0.5 / STANDARD_GRAVITY)))
    assert abs(rolled.yaw_rate[3000]) < 1e-6


def test_braking_lowers_the_nose_and_acceleration_raises_it():
    bike = Bike(dive_deg_per_g=4.0, squat_deg_per_g=1.5)
    for g, nose_deg in ((-0.5, -2.0), (0.5, 0.75)):
        push = np.where(np.arange(8000) > 1000, g * STANDARD_GRAVITY, 0.0)
        assert np.degrees(bike.dive(push, RATE)[3000]) == pytest.approx(nose_deg, abs=0.01)
    rising = Bike(dive_deg_per_g=-1.0)
    assert rising.dive(np.full(8000, -0.5 * STANDARD_GRAVITY), RATE)[4000] > np.radians(0.49)
