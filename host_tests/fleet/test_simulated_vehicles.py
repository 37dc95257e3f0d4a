"""Simulated vehicles on known roads: the readings of their sensors, with and without errors, and their receivers."""

from dataclasses import replace
from math import atan, cos, degrees, radians, sin, sqrt

import numpy as np
import pytest
from fixed_chance import Fixed
from kickstand.units import STANDARD_GRAVITY
from kickstand_fleet.simulation.route import Route, random_route
from kickstand_fleet.simulation.vehicle import HANDLING, Receiver, VehicleSensor, drive_log, random_sensor
from made_fleet import turn_of

G = STANDARD_GRAVITY
EXACT = VehicleSensor(np.eye(3), np.zeros(3), np.ones(3), np.zeros(3))
COUNT_G, COUNT_DPS = 1.0 / 16384.0, 1.0 / 131.0


def road(speed=10.0, acceleration=0.0, lateral=0.0, slope=0.0, camber=0.0, count=200):
    """Return four seconds of steady driving. lateral: acceleration to the left, in m/s2. slope, camber: in rad."""
    one = np.ones(count)
    yaw_rate = lateral / max(speed, 1e-9)
    return Route(
        np.linspace(0.0, 0.02 * (count - 1), count),
        speed * one,
        acceleration * one,
        yaw_rate * one,
        slope * one,
        camber * one,
    )


def readings(route, kind="car", sensor=EXACT, sigmas=0.0):
    """Return the force in g and the rates in deg/s in the middle of the log."""
    log = drive_log(Fixed(sigmas=sigmas), kind, route, sensor, Receiver(), 0.0)
    return log.accel_g[100], log.gyro_dps[100]


@pytest.mark.parametrize(("kind", "dive_deg"), [("car", 2.5), ("bus", 2.0), ("motorcycle", 4.0)])
def test_a_braking_vehicle_dives(kind, dive_deg):
    """The sensor turns with the body, so it sees more deceleration than the road."""
    force, rates = readings(road(acceleration=-3.0), kind)
    pitch = radians(dive_deg) * -3.0 / G
    assert force == pytest.approx([0.0, cos(pitch), -3.0 / G + sin(pitch)], abs=0.51 * COUNT_G)
    assert rates == pytest.approx([0.0, 0.0, 0.0], abs=0.51 * COUNT_DPS)


@pytest.mark.parametrize(("kind", "roll_deg"), [("car", 4.0), ("bus", 5.5)])
def test_the_body_rolls_outwards_in_a_bend(kind, roll_deg):
    force, rates = readings(road(lateral=3.0), kind)
    roll = radians(roll_deg * 3.0 / G)
    assert force == pytest.approx(
        [3.0 / G * cos(roll) + sin(roll), cos(roll) - 3.0 / G * sin(roll), 0.0], abs=0.51 * COUNT_G
    )
    turning_dps = degrees(0.3)
    assert rates == pytest.approx([turning_dps * sin(roll), turning_dps * cos(roll), 0.0], abs=0.51 * COUNT_DPS)


def test_a_motorcycle_in_a_bend_has_its_force_along_its_up():
    force, rates = readings(road(lateral=5.0), "motorcycle")
    assert force == pytest.approx([0.0, sqrt(1.0 + (5.0 / G) ** 2), 0.0], abs=0.51 * COUNT_G)
    lean = atan(5.0 / G)  # the lean is to the left
    assert rates == pytest.approx([-degrees(0.5) * sin(lean), degrees(0.5) * cos(lean), 0.0], abs=0.51 * COUNT_DPS)


def test_slope_and_camber_tilt_the_force():
    """Uphill the force has a part forward. On a road that falls to the right the force has a part to the left."""
    force, _ = readings(road(slope=0.05, camber=0.03))
    assert force == pytest.approx([cos(0.05) * sin(0.03), cos(0.05) * cos(0.03), sin(0.05)], abs=0.51 * COUNT_G)


def test_a_changing_slope_pitches_and_a_changing_camber_rolls():
    route = road()
    route = replace(route, slope=0.1 * (route.time - 2.0), camber=0.2 * (route.time - 2.0))
    _, rates = readings(route)
    assert rates == pytest.approx([-degrees(0.1), 0.0, degrees(0.2)], abs=0.51 * COUNT_DPS)


@pytest.mark.parametrize(("speed", "moving"), [(0.0, 0.0), (5.0, 0.5), (10.0, 1.0), (20.0, 1.0)])
def test_noise_grows_with_the_speed_up_to_10_mps(speed, moving):
    force, rates = readings(road(speed=speed), sigmas=1.0)
    scatter = np.array([0.06 + 0.25 * moving, 0.06 + 0.5 * moving, 0.06 + 0.25 * moving]) / G
    assert force == pytest.approx([0.0, 1.0, 0.0] + scatter, abs=0.51 * COUNT_G)
    assert rates == pytest.approx([0.1 + 1.2 * moving, 0.1 + 0.5 * moving, 0.1 + 0.8 * moving], abs=0.51 * COUNT_DPS)


def test_a_sensor_adds_its_errors_and_counts():
    sensor = VehicleSensor(turn_of(90.0, (0, 0, 1)), np.array([0.1, 0.0, 0.0]), np.full(3, 2.0), np.array([1.0, 0, 3]))
    force, rates = readings(road(), sensor=sensor)
    assert force == pytest.approx([0.5 * (1.0 - 0.1), 0.0, 0.0], abs=0.51 * COUNT_G)  # the sensor's x axis points up
    assert rates == pytest.approx([1.0, 0.0, 3.0], abs=0.51 * COUNT_DPS)
    assert force / COUNT_G == pytest.approx(np.round(force / COUNT_G))
    assert rates / COUNT_DPS == pytest.approx(np.round(rates / COUNT_DPS))


def test_a_random_sensor_has_errors_of_one_percent():
    sensor = random_sensor(Fixed(sigmas=1.0))
    assert sensor.offset_g == pytest.approx([0.01] * 3) and sensor.slope == pytest.approx([1.01] * 3)
    assert sensor.bias_dps == pytest.approx([1.0] * 3)
    assert sensor.mount @ sensor.mount.T == pytest.approx(np.eye(3), abs=1e-9)


def received(receiver, sigmas=0.0, speed=10.0):
    """Return {time: (speed, Universal Time)} of a vehicle that accelerates from `speed` with 1 m/s2."""
    route = replace(road(), speed=speed + road().time)
    log = drive_log(Fixed(sigmas=sigmas), "car", route, EXACT, receiver, 1000.04)
    shown = ~np.isnan(log.speed_mps)
    assert (shown == ~np.isnan(log.utc_s)).all()
    values = zip(log.t_s[shown], log.speed_mps[shown], log.utc_s[shown], strict=True)
    return {round(float(t_s), 2): (float(mps), float(utc_s)) for t_s, mps, utc_s in values}


def test_a_receiver_is_late_and_has_a_rate():
    seen = received(Receiver(1.0, 0.5))
    assert list(seen) == [0.0, 1.0, 2.0, 3.0]
    assert [speed for speed, _ in seen.values()] == pytest.approx([10.0, 10.5, 11.5, 12.5])
    assert [utc_s for _, utc_s in seen.values()] == pytest.approx([1000.0, 1001.0, 1002.0, 1003.0])
    assert list(received(Receiver(0.5))) == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]
    usual = received(Receiver())
    assert list(usual) == [0.0, 1.0, 2.0, 3.0]
    assert usual[1.0][0] == pytest.approx(10.7)  # by default a speed is 0.3 s late
    assert received(Receiver(late_s=0.0), speed=10.1271)[0.0][0] == 10.13  # a speed has two decimals
    assert len(received(Receiver(0.001))) == 200  # a sample never has more than one speed


def test_a_receiver_may_end_or_send_another_unit():
    assert list(received(Receiver(until_s=2.0))) == [0.0, 1.0, 2.0]
    assert received(Receiver(until_s=-1.0)) == {}
    assert received(Receiver(late_s=0.0, factor=3.6))[1.0][0] == pytest.approx(39.6)


def test_a_receiver_has_noise_except_at_a_standstill():
    assert received(Receiver(late_s=0.0), 1.0)[1.0][0] == pytest.approx(11.05)
    assert received(Receiver(late_s=0.0), 1.0, 0.2)[0.0][0] == 0.0
    assert received(Receiver(late_s=0.0), 1.0, 0.21)[0.0][0] == pytest.approx(0.26)
    assert received(Receiver(late_s=0.0), -10.0, 0.3)[0.0][0] == 0.0  # never negative


def test_a_moving_mount_turns_within_a_third_of_a_second():
    turn = turn_of(30.0, (0.0, 1.0, 0.0))
    log = drive_log(Fixed(), "car", road(acceleration=2.0), EXACT, Receiver(), 0.0, (2.0, turn))
    before, after = log.t_s < 1.99, log.t_s >= 2.0
    level = log.accel_g[0]
    assert np.allclose(log.accel_g[before], level) and np.allclose(log.accel_g[after], level @ turn, atol=COUNT_G)
    turning = np.any(log.gyro_dps != 0.0, axis=1)
    assert log.t_s[turning][[0, -1]] == pytest.approx([1.86, 2.14], abs=0.011)
    assert np.sum(log.gyro_dps, axis=0) * 0.02 == pytest.approx([0.0, 30.0, 0.0], abs=2.1)
    assert log.gyro_dps[turning][:, 1] == pytest.approx(100.0, abs=0.51 * COUNT_DPS)


@pytest.mark.parametrize(
    ("kind", "gentle", "hard"),
    [
        # cruising speed, acceleration and deceleration forward, acceleration in bends
        ("car", (8.0, 1.0, 1.3, 1.0), (19.0, 2.4, 3.4, 3.0)),
        ("bus", (7.0, 0.7, 1.0, 0.7), (14.0, 1.3, 2.0, 1.6)),
        ("motorcycle", (9.0, 1.5, 1.6, 1.5), (22.0, 3.2, 4.5, 4.0)),
    ],
)
def test_a_bus_is_driven_gently_and_a_motorcycle_hard(kind, gentle, hard):
    for share, expected in ((0.0, gentle), (1.0, hard)):
        route = random_route(Fixed(share, 0.6), HANDLING[kind], 45.0, 50.0)  # with a junction
        lateral = np.abs(route.speed * route.yaw_rate).max()
        found = route.speed.max(), route.acceleration.max(), -route.acceleration.min(), lateral
        assert found == pytest.approx(expected, rel=0.07)
