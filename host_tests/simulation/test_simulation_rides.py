"""Whole simulated rides. A seed always gives the same ride, the values are in their stated ranges, and the logs are
valid."""

import functools
import tracemalloc

import numpy as np
import pytest
from kickstand_tools.logs.reader import read_log
from kickstand_tools.simulation.files import simulate
from kickstand_tools.simulation.physics.chip import RATE_HZ
from kickstand_tools.simulation.profiles import PROFILES
from kickstand_tools.simulation.ride import ride
from support.command import refused, works

SHORT_S = 150.0


@functools.cache
def ride_of(name):
    return ride(name, 5, SHORT_S)


def vehicle_readings(made):
    """Return force in g and rates in deg/s along the vehicle's axes, each of shape (n, 3).

    The sensor's mounting and its biases are removed.
    """
    chip, mounting = made.chip, made.vehicle_from_sensor
    force = (made.readings[:, :3] - chip.accel_offset) @ np.linalg.inv(chip.accel_matrix).T @ mounting.T
    rates = (made.readings[:, 4:] - chip.gyro_bias) @ np.linalg.inv(chip.gyro_matrix).T @ mounting.T
    return force, rates


def test_seed_determines_the_ride():
    first, again, other = ride("street", 1, 60.0), ride("street", 1, 60.0), ride("street", 2, 60.0)
    assert np.array_equal(first.readings, again.readings)
    assert np.array_equal(first.truth["lean_deg"], again.truth["lean_deg"])
    assert np.array_equal(first.upright, again.upright)
    assert len(first.time) != len(other.time) or not np.allclose(first.readings, other.readings)
    assert not np.allclose(first.vehicle_from_sensor, other.vehicle_from_sensor)


@pytest.mark.parametrize("name", list(PROFILES))
def test_simulated_values_are_possible_for_a_motorcycle(name):
    made = ride_of(name)
    truth = made.truth
    assert all(np.all(np.isfinite(values)) for values in [made.readings, *truth.values()])
    assert made.rate_hz == 200.0
    assert np.allclose(np.diff(made.time), 0.005)
    assert SHORT_S - 10.0 < made.time[-1] < SHORT_S + 120.0
    limit = 85.0 if name in ("fall", "parked") else 60.0
    assert np.abs(truth["lean_deg"]).max() < limit
    assert 0.0 <= truth["speed_mps"].min() and truth["speed_mps"].max() < 70.0
    assert np.abs(truth["slope_deg"]).max() < np.degrees(np.arctan(0.125))
    assert np.abs(np.gradient(truth["lean_deg"], 0.005)).max() < 250.0
    standing = truth["speed_mps"] == 0.0
    assert np.abs(truth["yaw_rate_dps"][standing]).max(initial=0.0) < 0.5


@pytest.mark.parametrize(
    ("name", "lean", "speed", "yaw"),
    [
        ("street", (25, 45), (18, 28), (12, 60)),
        ("track", (40, 58), (30, 66), (20, 90)),
        ("sweeper", (15, 53), (17, 33), (6, 35)),
        ("city", (12, 45), (9, 16), (20, 90)),
        ("hills", (28, 50), (11, 21), (25, 110)),
        ("held", (36, 50), (18, 26), (14, 40)),
        ("corners", (38, 60), (20, 45), (15, 60)),
    ],
)
def test_profiles_reach_their_stated_ranges(name, lean, speed, yaw):
    truth = ride_of(name).truth
    assert lean[0] < np.abs(truth["lean_deg"]).max() < lean[1]
    assert speed[0] < truth["speed_mps"].max() < speed[1]
    assert yaw[0] < np.abs(truth["yaw_rate_dps"]).max() < yaw[1]


def test_each_profile_has_its_special_condition():
    turn = ride_of("sweeper").phase == "turn"
    assert turn.sum() > 60 * 200
    assert np.abs(ride_of("sweeper").truth["lean_deg"][turn]).min() < 60.0
    lean = ride_of("held").truth["lean_deg"][ride_of("held").phase == "turn"]
    assert (lean > 25.0).sum() > 40 * 200 and (lean < -25.0).sum() > 40 * 200
    city = ride_of("city")
    assert ((city.truth["speed_mps"] == 0.0) & (city.phase == "stopped")).any() or "walking pace" in city.phase
    assert np.abs(ride_of("hills").truth["slope_deg"]).max() > 4.0
    assert ride_of("wheelie").truth["pitch_deg"].max() > 9.0
    hard = np.gradient(ride_of("bumps").truth["speed_mps"], 0.005)
    assert hard.min() < -5.5
    fallen = ride_of("fall")
    assert np.abs(fallen.truth["lean_deg"][-200:]) == pytest.approx(80.0, abs=2.0)
    assert (fallen.phase == "lying").sum() > 20 * 200
    assert np.ptp(ride_of("parked").truth["lean_deg"]) == 0.0
    assert np.ptp(ride_of("temperature").readings[:, 3]) > 5.0
    windy = ride_of("crosswind")
    straight = (windy.phase == "straight") & (windy.truth["speed_mps"] > 10.0)
    straight[: len(straight) // 2] = False  # leave out the first half, because the wind turns in the middle of the ride
    assert np.abs(np.mean(windy.truth["lean_deg"][straight])) > 1.8


@pytest.mark.parametrize("name", ["held", "corners", "weight"])
def test_moving_rider_does_not_tilt_a_bike_on_its_stand(name):
    made = ride_of(name)
    lean = made.truth["lean_deg"]
    assert np.ptp(lean[made.phase == "kickstand"]) < 0.02
    assert np.ptp(lean[(made.phase == "standing") & (made.truth["speed_mps"] == 0.0)]) < 1.5


def test_a_creeping_mount_turns_by_some_degrees():
    """At the end, the measured direction of gravity differs from the true lean and pitch."""
    made = ride("creep", 4, 60.0, share=0.0)
    force, _ = vehicle_readings(made)
    early, late = force[200:600].mean(axis=0), force[-600:-200].mean(axis=0)
    lean = np.radians(made.truth["lean_deg"])
    first = np.degrees(np.arctan2(early[0], early[1]) - lean[200:600].mean())
    moved = np.degrees(np.arctan2(late[0], late[1]) - lean[-600:-200].mean()) - first
    nose = np.degrees(np.arcsin(late[2])) - made.truth["pitch_deg"][-600:-200].mean()
    assert max(abs(moved), abs(nose)) > 0.5


def test_simulate_writes_logs_that_calibrate_and_replay(tmp_path):
    works("simulate", "--profile", "hills", "--seed", 2, "--seconds", 60, "--out", tmp_path / "r")  # exactly
    poses = [tmp_path / "r" / f"POSE_{k}.csv" for k in range(1, 8)]
    six, both = tmp_path / "six.json", tmp_path / "both.json"
    works("calibrate", "six", *poses, "--out", six)
    pair = tmp_path / "r" / "KICKSTAND.csv", tmp_path / "r" / "UPRIGHT.csv"
    works("calibrate", "two", *pair, "--calibration", six, "--out", both)
    works("replay", tmp_path / "r" / "RIDE.csv", "--calibration", both, "--out", tmp_path / "lean.csv")
    truth = (tmp_path / "r" / "TRUTH.csv").read_text().splitlines()
    assert truth[0] == "t_s,lean_deg,speed_mps,yaw_rate_dps,pitch_deg,slope_deg,phase"
    assert len(truth) == len((tmp_path / "r" / "RIDE.csv").read_text().splitlines()) == 60 * 200 + 1


def test_speed_is_written_once_per_second_if_requested(tmp_path):
    made = simulate("street", 1, tmp_path, seconds=60.0, speed=True)
    log = read_log(tmp_path / "RIDE.csv")
    given = [k for k, v in enumerate(log.speed_mps) if v == v]
    assert given[:3] == [0, 200, 400]
    assert log.speed_mps[8000] == pytest.approx(made.truth["speed_mps"][8000], abs=0.01)
    simulate("street", 1, tmp_path, seconds=60.0)
    assert np.all(np.isnan(read_log(tmp_path / "RIDE.csv").speed_mps))


@pytest.mark.parametrize(("profile", "seed"), [("hills", 3), ("fall", 1)])
def test_ride_has_the_requested_length(profile, seed):
    """The first ride is cut off in a bend. The second ride ends with a fall."""
    assert len(ride(profile, seed, 120.0, exact=True).readings) == 120 * 200


def test_calibration_of_the_previous_ride_is_removed(tmp_path):
    """`report` would use this file as RIDE.csv's calibration, but it belongs to a sensor with another mounting."""
    works("simulate", "--profile", "street", "--seconds", 30, "--out", tmp_path)
    (tmp_path / "RIDE.cal.json").write_text("{}")
    works("simulate", "--profile", "street", "--seed", 1, "--seconds", 30, "--out", tmp_path)
    refused(tmp_path, "report", tmp_path / "RIDE.csv", words="no calibration RIDE.cal.json beside it")


def test_memory_of_a_ride_is_limited():
    """An hour has 3.6 million rows at the chip's 1 kHz. The result keeps none of the rows in memory."""
    seconds = 400.0
    column = seconds * RATE_HZ * 8  # bytes of a column with one number per row
    tracemalloc.start()
    try:
        made = ride("creep", seed=0, seconds=seconds)
        left, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert made.rate_hz == 200.0
    assert peak < 44 * column
    assert left < 6 * column
