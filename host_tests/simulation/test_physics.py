"""Motion, road, engine, sensor and mount of the simulated ride, by laws of physics and numerical derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY as G
from kickstand_sim.simulation.commands import Leg, commands
from kickstand_sim.simulation.physics import bike as physics, road
from kickstand_sim.simulation.physics.bike import Bike, Motion, body_rates, specific_force
from kickstand_sim.simulation.physics.chip import Chip
from kickstand_sim.simulation.physics.signals import integral, second_order, smoothed, smoothstep
from kickstand_tools.signals import rotation_matrix

RATE = 1000.0
EDGE = slice(50, -50)  # derivatives are one-sided at both ends


def test_steps_and_smoothing():
    """The step is u^3 (10 - 15 u + 6 u^2). At u = 1 / 4 the step is 0.015625 * 6.625."""
    assert smoothstep(np.array([-1.0, 0.25, 0.5, 2.0])) == pytest.approx([0.0, 0.103515625, 0.5, 1.0])
    step = smoothed(np.where(np.arange(4000) < 2000, 0.0, 1.0), 0.1, RATE)
    assert step[[0, 1900, -1]] == pytest.approx([0.0, 0.1587, 1.0], abs=0.003)  # the normal distribution


@pytest.mark.parametrize(("hz", "damping", "gain", "delayed"), [(0.0, 0.7, 1.0, 0.0), (10.0, 0.5, 1.0, 0.25),
    (10.0, 0.7, 1.0 / 1.4, 0.25), (50.0, 0.7, 1.0 / np.hypot(24.0, 7.0), None)])  # fmt: skip
def test_a_low_pass_of_second_order_at_10_hz(hz, damping, gain, delayed):
    """At its natural frequency the gain is 1 / (2 damping), and the delay a quarter of a period."""
    t = np.arange(4000) / RATE
    output = second_order(np.cos(2 * np.pi * hz * t), 10.0, damping, RATE)[1000:3000]
    if delayed is None:
        assert np.max(np.abs(output)) == pytest.approx(gain, rel=0.03)
    else:
        expected = gain * np.cos(2 * np.pi * (hz * t - delayed))[1000:3000]
        assert output == pytest.approx(expected, abs=0.02)


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
        return rotation_matrix(angle[:, None] * np.eye(3)[axis])

    heading = integral(motion.yaw_rate, motion.rate_hz)
    # At heading 0, forward is east and left is north
    start = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    # Nose up is a negative rotation about left, and leaning to the right turns the left axis towards up
    return about(2, heading) @ start @ about(0, -motion.pitch) @ about(2, motion.lean)


def test_readings_are_derivatives_of_attitude_and_position():
    motion, bike = wild_motion(), Bike(sensor_left=0.08)
    turned, heading = attitude(motion), integral(motion.yaw_rate, RATE)
    spin = np.swapaxes(turned, 1, 2) @ np.gradient(turned, 1.0 / RATE, axis=0)
    rates = np.column_stack((spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]))
    assert np.abs(rates - body_rates(motion))[EDGE].max() < 2e-3
    level = np.cos(motion.slope)
    direction = np.array([level * np.cos(heading), level * np.sin(heading), np.sin(motion.slope)])
    centre = np.column_stack([integral(v, RATE) for v in motion.speed * direction])
    arm = np.array([bike.sensor_left, bike.sensor_height - bike.tyre_radius, bike.sensor_forward])
    acceleration = np.gradient(np.gradient(centre + turned @ arm, 1.0 / RATE, axis=0), 1.0 / RATE, axis=0)
    force = np.einsum("nji,nj->ni", turned, acceleration + [0.0, 0.0, G])
    assert np.abs(force - specific_force(motion, bike))[EDGE].max() < 0.01


def held_turn(lean_deg: float, bike: Bike, speed: float = 18.0, **more: float) -> tuple[physics.Roll, int]:
    """Return the roll of a simulated turn, and the index of a sample in its steady middle."""
    command = commands([Leg("straight", 3.0, speed, 0.0), Leg("turn", 8.0, speed, lean_deg, **more)], RATE)
    return physics.roll(command, bike, np.zeros_like(command.time)), 9000


@pytest.mark.parametrize("lean_deg", [-45.0, 10.0, 38.0])
def test_a_steady_turn_balances_gravity_and_centripetal_force(lean_deg):
    """Wide tyres touch the road beside their middle, and spinning wheels resist the turn."""
    for bike in (Bike(tyre_radius=0.0, wheel_inertia=0.0), Bike()):
        rolled, k = held_turn(lean_deg, bike)
        centripetal = -18.0 * rolled.yaw_rate[k] / G
        assert np.degrees(rolled.balance[k]) == pytest.approx(lean_deg, abs=0.01)
        assert np.tan(rolled.balance[k]) == pytest.approx((1.0 + bike.wheel_inertia) * centripetal)
        flank = np.degrees(np.arcsin(bike.tyre_radius * np.sin(np.radians(lean_deg)) / (0.62 - bike.tyre_radius)))
        assert np.degrees(rolled.lean[k]) == pytest.approx(lean_deg + flank, abs=0.01)
    assert np.sign(rolled.yaw_rate[3000:3500][np.argmax(np.abs(rolled.yaw_rate[3000:3300]))]) == np.sign(lean_deg)


def test_wind_from_the_left_leans_a_straight_ride_to_the_left():
    command = commands([Leg("straight", 6.0, 20.0, 0.0, crosswind_mps2=0.5)], RATE)
    rolled = physics.roll(command, Bike(), np.zeros_like(command.time))
    assert np.degrees(rolled.balance[3000]) == pytest.approx(-np.degrees(np.arctan(0.5 / G)))
    assert abs(rolled.yaw_rate[3000]) < 1e-6


@pytest.mark.parametrize(("dive", "g", "nose_deg"), [(4.0, -0.5, -2.0), (4.0, 0.5, 0.75), (-1.0, -0.5, 0.5)])
def test_braking_lowers_the_nose_and_acceleration_raises_it(dive, g, nose_deg):
    bike = Bike(dive_deg_per_g=dive, squat_deg_per_g=1.5)
    push = np.where(np.arange(8000) > 1000, g * G, 0.0)
    assert np.degrees(bike.dive(push, RATE)[4000]) == pytest.approx(nose_deg, abs=0.01)


def heave_g(speed: float, roughness: float, seconds: float = 40.0):
    chance, n = np.random.default_rng(0), int(seconds * RATE)
    distance = np.linspace(0.0, speed * seconds, n)
    surface = road.profile_slope(chance, float(distance[-1]) + 10.0, roughness)
    return road.shaking(chance, distance, np.full(n, speed), surface, Bike(), RATE).heave / G


def test_shaking_grows_with_roughness_and_speed():
    """An ordinary road at 90 km/h has peaks of 0.3 to 0.5 g."""
    assert 0.3 < np.percentile(np.abs(heave_g(25.0, road.CLASS_B)), 99.9) < 0.6
    assert np.std(heave_g(15.0, road.CLASS_C)) / np.std(heave_g(15.0, road.CLASS_A)) == pytest.approx(4.0, rel=0.01)
    assert np.std(heave_g(25.0, road.CLASS_B)) > 1.5 * np.std(heave_g(6.0, road.CLASS_B))


N = 10000
PERFECT = Chip(np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), gyro_walk=0.0)
STILL = np.zeros((N, 3))


def read(chip, force, rates, temp_c=25.0):
    return chip.read(np.random.default_rng(0), force, rates, np.full(len(force), temp_c))


@pytest.mark.parametrize(("hz", "aliased_hz", "size"), [(5.0, 5.0, 1.0), (44.0, 44.0, np.sqrt(0.5)), (195.0, 5.0, 0.1)])
def test_the_filter_of_the_chip_is_that_of_the_data_sheet(hz, aliased_hz, size):
    """The filter has -3 dB at 44 Hz and a delay of 4.9 ms. Vibration above 100 Hz that passes the filter aliases."""
    wave = np.zeros((N, 3))
    wave[:, 0] = np.sin(2.0 * np.pi * hz * np.arange(N) / RATE)
    readings, t = read(PERFECT, wave, 100.0 * wave), np.arange(N // 5) / 200.0
    z = 2.0 * np.mean(readings[:, 0] * np.exp(-2j * np.pi * aliased_hz * t))
    assert abs(z) == pytest.approx(size, abs=0.04)
    if hz == 5.0:
        assert -(np.angle(z) + np.pi / 2.0) / (2.0 * np.pi * hz) == pytest.approx(0.0049, abs=0.0003)


def test_the_chip_reads_counts_within_its_range():
    readings = read(PERFECT, np.full((N, 3), 9.0), np.full((N, 3), -700.0))
    assert readings[0, [0, 4]] == pytest.approx([8.0, -500.0], abs=0.02)
    still = read(PERFECT, STILL, STILL)
    for columns, lsb in ((still[:, :3], 4096.0), (still[:, 4:], 65.5)):
        assert np.allclose(columns * lsb, np.round(columns * lsb), atol=1e-6)
    # The range ends before the filter: shaking beyond 8 g on one side falsifies the mean
    shaken = STILL + np.where(np.arange(N) % 4 < 2, 11.0, 3.0)[:, None]
    assert read(PERFECT, shaken, STILL)[100:, 0].mean() == pytest.approx((8.0 + 3.0) / 2.0, abs=0.05)


@pytest.mark.parametrize(("low_pass", "bandwidth_hz"), [(True, 50.0), (False, 500.0)])
def test_noise_is_that_of_the_data_sheet(low_pass, bandwidth_hz):
    """The noise is 400 ug/sqrt(Hz) and 0.005 deg/s/sqrt(Hz)."""
    still = read(replace(PERFECT, low_pass=low_pass), STILL, STILL)
    assert still[:, :3].std() == pytest.approx(400e-6 * np.sqrt(bandwidth_hz), rel=0.1)
    assert still[:, 4:].std() == pytest.approx(0.005 * np.sqrt(bandwidth_hz), rel=0.15)


def test_errors_and_temperature_reach_the_reading():
    """The gyro reads 0.1 deg/s per g."""
    accel, gyro = 1.02 * np.eye(3), np.eye(3)
    accel[0, 1], gyro[2, 0] = 0.02, 0.05
    chip = replace(
        PERFECT, accel_matrix=accel, gyro_matrix=gyro, accel_offset=np.array([0.05, 0.0, 0.0]),
        gyro_bias=np.array([0.0, 12.0, 0.0]), accel_per_c=np.array([0.0, 0.0, 0.001]),
        gyro_per_c=np.array([0.1, 0.0, 0.0]),
    )  # fmt: skip
    mean = read(chip, STILL + [0.0, 1.0, 1.0], STILL + [20.0, 0.0, 0.0], temp_c=35.0).mean(axis=0)
    assert mean == pytest.approx([0.07, 1.02, 1.03, 35.0, 21.0, 12.1, 1.1], abs=0.01)
    walked = read(replace(PERFECT, gyro_walk=0.1), np.zeros((100_000, 3)), np.zeros((100_000, 3)))[-200:, 4:]
    assert 0.2 < np.abs(walked.mean(axis=0)).max() < 5.0


def test_a_random_chip_is_within_the_data_sheet():
    chips = [Chip.random(np.random.default_rng(k)) for k in range(200)]
    for name, limit in (
        ("accel_offset", [0.05, 0.05, 0.08]),
        ("gyro_bias", [20.0] * 3),
        ("accel_per_c", [0.0003] * 3),
        ("gyro_per_c", [0.06] * 3),
    ):
        values = np.array([getattr(chip, name) for chip in chips])
        assert np.abs(values).max(axis=0) == pytest.approx(limit, rel=0.05) and values.min() < 0.0 < values.max()
    for name in ("accel_matrix", "gyro_matrix"):
        errors = np.abs([getattr(chip, name) - np.eye(3) for chip in chips]).max(axis=0)
        assert errors == pytest.approx(np.where(np.eye(3) > 0.0, 0.03, 0.02))
    half = Chip.random(np.random.default_rng(1), share=0.5, drift=3.0)
    assert half.accel_offset == pytest.approx(0.5 * chips[1].accel_offset)
    assert half.gyro_per_c == pytest.approx(1.5 * chips[1].gyro_per_c)
