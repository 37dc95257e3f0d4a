"""Tests the lean filter at its start, at rest, while rolling, and after a restart. Also runs on MicroPython."""

from math import atan2, cos, degrees, pi, radians, sin, sqrt

from bike_motion import DT_S, DT_US, GRAVITY_MPS2, force_and_rate, near
from kickstand.lean.lean_filter import LeanFilter
from kickstand.lean.measurements import SIGMA_SHARE

LEVEL, NO_RATE = [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]


def hold(estimator, seconds, force=LEVEL, rate=NO_RATE, dt_us=DT_US):
    """Apply the same force and rate for some seconds. Return the last lean."""
    lean = 0.0
    for _ in range(int(seconds * 1e6 / dt_us + 0.5)):
        lean = estimator.update(force, rate, dt_us)
    return lean


def sigma_deg(estimator):
    """Return the standard deviation of the lean without SIGMA_SHARE."""
    return degrees(sqrt(estimator.variance)) / SIGMA_SHARE


def test_coming_to_rest_the_force_is_the_vertical():
    """At rest the force sets lean and pitch. In this test the bike has a lean of 10 degrees that the gyro did not
    measure."""
    estimator = LeanFilter()
    hold(estimator, 3.0)
    hold(estimator, 4.0, [0.0, 1.0, 2.0 / GRAVITY_MPS2])
    force = [sin(radians(10.0)), cos(radians(10.0)) * cos(radians(12.0)), sin(radians(12.0)) * cos(radians(10.0))]
    hold(estimator, 12.0, force)
    assert estimator.at_rest
    near(hold(estimator, 0.2, force) + degrees(estimator.trim.angle), degrees(atan2(force[0], force[1])), 0.15)
    near(estimator.speed_mps, 0.0, 0.01)
    near(estimator.pitch_deg, 11.8, 0.15)


def test_an_inexact_upright_pose_is_found_in_seconds():
    """The rider holds a bike whose pose was off by 3 degrees upright, before setting off. So a part of this error
    is found at once, and the rest while riding straight. A lean of 8 degrees is that of a kickstand."""
    for lean_deg, at_once_deg in ((-8.0, 0.0), (3.0, 0.9)):
        estimator, left, up = LeanFilter(), sin(radians(lean_deg)), cos(radians(lean_deg))
        near(hold(estimator, 3.0, [left, up, 0.0]), lean_deg, 0.01)
        hold(estimator, 1.0, [left, up, 0.3])
        near(degrees(estimator.trim.angle), at_once_deg, 0.2)
    near(hold(estimator, 7.0, [left, up, 0.15]), 0.0, 0.4)


def test_rest_shows_every_bias_and_a_restart_keeps_it():
    """After the rest the bike is rocked. The lean would then be wrong if a bias was not found."""
    bias = [radians(value) for value in (1.2, -0.9, 1.5)]
    for restarted in (False, True):
        estimator = LeanFilter()
        hold(estimator, 30.0, LEVEL, bias)
        assert estimator.at_rest
        if restarted:
            estimator.start()
            assert estimator.variance == pi * pi and not estimator.at_rest and estimator.speed_mps == 0.0
        for k in range(1000):
            lean_deg, roll_dps = 10.0 - 10.0 * cos(k * DT_S), 10.0 * sin(k * DT_S)
            force, rate = force_and_rate(lean_deg, 0.0, roll_dps)
            near(estimator.update(force, [a + b for a, b in zip(rate, bias)], DT_US), lean_deg + 0.0048 * roll_dps, 0.7)


def test_a_measured_speed_vetoes_rest():
    """The readings are as calm as at rest, with a measured speed of 20 m/s or of 0."""
    for speed_mps, rests in ((20.0, False), (0.0, True)):
        estimator = LeanFilter()
        for k in range(1500):
            if k % 100 == 0:
                estimator.measure_speed(speed_mps)
            estimator.update(LEVEL, NO_RATE, DT_US if k else 0)
        assert estimator.at_rest == rests


def test_values_that_are_not_numbers_are_dropped():
    estimator = LeanFilter()
    hold(estimator, 3.0)
    variances = set()
    for k in range(300):
        estimator.update([float("nan") if k < 20 else 0.0, 1.0, 0.0], NO_RATE, DT_US)
        variances.add(estimator.variance)
    assert pi * pi in variances
    near(hold(estimator, 5.0), 0.0, 0.01)
    assert sigma_deg(estimator) < 3.0


def test_a_lean_beyond_half_a_turn_comes_from_the_other_side():
    """A sensor in the hand is turned to the right or left by a whole turn."""
    for sign in (1.0, -1.0):
        estimator = LeanFilter()
        hold(estimator, 3.0)
        for k in range(1500):
            a = sign * min(2.0 * pi, 0.006 * k)
            turning = sign * 0.6 if 0.006 * k < 2.0 * pi else 0.0
            lean = estimator.update([sin(a), cos(a), 0.0], [0.0, 0.0, turning], DT_US)
            if abs(a) > radians(210.0):
                near(lean, degrees(a) - sign * 360.0, 3.0)
        near(hold(estimator, 4.0), 0.0, 0.5)
