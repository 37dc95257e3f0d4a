"""A ride shows the errors of its alignment, their effect on the lean, and the remedy helps."""

import dataclasses

import numpy as np
import pytest
from kickstand_tools.analysis.overview import lean_cost
from kickstand_tools.api import Log, fit_drive, fit_two_positions, open_ride, overview, simulate_ride, vehicle_channels
from kickstand_tools.signals import rotation_matrix
from small_rides import quality_of

# The axis of each alignment error. With an error of roll, "up" leans to the right of the bike's up. With an error of
# pitch, "forward" points up. With an error of yaw, "forward" points to the right.
AXES = {"roll": (0.0, 0.0, -1.0), "pitch": (1.0, 0.0, 0.0), "yaw": (0.0, 1.0, 0.0)}


def turn(name, degrees):
    return rotation_matrix(np.radians(degrees) * np.array(AXES[name]))


def turned(calibration, name, degrees):
    matrix = turn(name, degrees) @ calibration.vehicle_from_sensor
    return dataclasses.replace(calibration, vehicle_from_sensor=matrix)


@pytest.fixture(scope="module", params=[("hills", 5), pytest.param(("city", 2), marks=pytest.mark.long)])
def ride(request):
    """Return a log of 50 samples per second with a speed, its calibration, the true lean and the profile."""
    profile, seed = request.param
    simulation = simulate_ride(profile, seed, seconds=150.0)
    n = round(simulation.rate_hz / 50.0)
    readings = simulation.readings[: len(simulation.readings) // n * n].reshape(-1, n, 7).mean(axis=1)
    log = Log.from_readings(readings, simulation.rate_hz / n)
    log.speed_mps[::50] = simulation.truth["speed_mps"][n - 1 :: n][: len(readings)][::50]
    stand, upright = (
        Log.from_readings(pose, simulation.rate_hz) for pose in (simulation.kickstand, simulation.upright)
    )
    calibration = fit_drive([log], fit_two_positions(stand, upright).calibration, "motorcycle").calibration
    return log, calibration, simulation.truth["lean_deg"][n - 1 :: n][: len(readings)], profile


def error_deg(ride, calibration, from_share=0.0):
    """Return the rms error of the lean while it is trusted and the bike moves, infinite without such a lean."""
    log, _, true, _ = ride
    course = vehicle_channels(log, calibration)
    moving = course.trusted & (course.resting < 0.5)
    moving[: round(from_share * len(moving))] = False
    return float(np.sqrt(np.mean((course.lean_deg - true)[moving] ** 2))) if np.any(moving) else np.inf


@pytest.mark.parametrize(("name", "degrees"), [("yaw", 12.0), ("pitch", 3.0)])
def test_yaw_and_pitch_cause_the_stated_lean_error(ride, name, degrees):
    """Both directions are tried, because one error may compensate another. At 6 degrees of pitch the lean is hidden."""
    usual = error_deg(ride, ride[1])
    errors = [error_deg(ride, turned(ride[1], name, angle)) for angle in (degrees, -degrees)]
    cost = np.sqrt(max(0.0, np.mean(np.square(errors)) - usual**2))
    stated = getattr(
        lean_cost(quality_of(**({"roll": 0.0, "pitch": 0.0, "yaw": 0.0} | {name: degrees}))), f"{name}_deg"
    )
    assert cost < 1.75 * stated + 0.15 and (ride[3] == "city" or cost > 0.3 * stated)  # slow rides cost less


def test_riding_corrects_roll_up_to_a_limit(ride):
    usual = error_deg(ride, ride[1], 0.5)
    assert error_deg(ride, turned(ride[1], "roll", 3.0), 0.5) < usual + 0.3
    assert error_deg(ride, turned(ride[1], "roll", 12.0), 0.5) > 7.0


def test_calibrate_drive_corrects_yaw(ride):
    log, calibration, *_ = ride
    corrected = fit_drive([log], turned(calibration, "yaw", 9.0), "motorcycle").calibration
    wrong_deg, right_deg = (
        overview(open_ride(log, alignment)).quality.yaw_deg
        for alignment in (turned(calibration, "yaw", 9.0), corrected)
    )
    assert wrong_deg is not None and right_deg is not None
    assert abs(wrong_deg) == pytest.approx(9.0, abs=2.5) and abs(right_deg) < 2.0
    assert corrected.vehicle_from_sensor == pytest.approx(calibration.vehicle_from_sensor, abs=0.02)
