"""Simulates the readings of a sensor on a bike from the equations of motion. Also runs on MicroPython."""

from math import cos, degrees, pi, radians, sin, tan

from kickstand.calibration.parameters import Calibration
from kickstand_tools.replay.replay_engine import ReplayMeter

GRAVITY_MPS2 = 9.80665
DT_US = 10_000
DT_S = DT_US * 1e-6


def force_and_rate(lean_deg=0.0, speed_mps=0.0, roll_dps=0.0, forward_mps2=0.0):
    """Compute the motion of a bike on a level road. Above 1 m/s the bike is in balance.

    Returns:
        force: specific force along left, up, forward, in g.
        rate: about the same axes, in rad/s.
    """
    t = radians(lean_deg)
    yaw = -GRAVITY_MPS2 * tan(t) / speed_mps if speed_mps > 1.0 else 0.0
    left = speed_mps * yaw / GRAVITY_MPS2
    force = [left * cos(t) + sin(t), cos(t) - left * sin(t), forward_mps2 / GRAVITY_MPS2]
    return force, [yaw * sin(t), yaw * cos(t), radians(roll_dps)]


def reading(force, rate):
    """Return seven readings in the chip's order: three forces in g, the temperature in C, three rates in deg/s."""
    return list(force) + [25.0] + [degrees(value) for value in rate]


def meter(calibration=None, **options):
    """Return a meter whose sensor is mounted along the bike's axes, with x left, y up and z forward."""
    calibration = calibration or Calibration()
    for i in range(9):
        calibration.vehicle_from_sensor[i] = 1.0 if i % 4 == 0 else 0.0
    return ReplayMeter(calibration, **options)


def ride(shown, seconds, speed_mps=None, **motion):
    """Pass the readings of a steady motion to the meter. speed_mps only affects these readings. The meter gets no
    measured speed."""
    readings = reading(*force_and_rate(speed_mps=speed_mps or 0.0, **motion))
    for _ in range(int(seconds / DT_S + 0.5)):
        shown.update(readings, DT_US)
    return shown


def roll(shown, from_deg, to_deg, speed_mps=0.0, dps=60.0):
    """Change the lean from one angle to another, at dps degrees per second."""
    steps = int(abs(to_deg - from_deg) / (dps * DT_S) + 0.5)
    rate = (to_deg - from_deg) / (steps * DT_S)
    for k in range(steps):
        shown.update(reading(*force_and_rate(from_deg + (k + 1) * rate * DT_S, speed_mps, rate)), DT_US)
    return shown


def speed_up(shown, from_mps, to_mps, seconds):
    """Ride straight, and change from one speed to another."""
    rate = (to_mps - from_mps) / seconds
    steps = int(seconds / DT_S + 0.5)
    for k in range(steps):
        shown.update(reading(*force_and_rate(0.0, from_mps + rate * DT_S * (k + 1), 0.0, rate)), DT_US)
    return shown


def nose_up(shown, from_deg, to_deg, dps=30.0):
    """Pitch an upright bike at rest or at a steady speed."""
    steps = int(abs(to_deg - from_deg) / (dps * DT_S) + 0.5)
    rate = (to_deg - from_deg) / (steps * DT_S) * pi / 180.0
    for k in range(steps):
        q = radians(from_deg + (to_deg - from_deg) * (k + 1) / steps)
        shown.update(reading((0.0, cos(q), sin(q)), (-rate, 0.0, 0.0)), DT_US)
    return shown


def near(value, expected, within):
    """Assert that both values are equal within a tolerance. MicroPython has no pytest.approx()."""
    assert abs(value - expected) <= within, (value, expected)
