"""The smoothed lean is compared with the truth of two simulators."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.api import CalibrationFile, InputError, Log, Stretch, simulate_ride, smooth
from kickstand_tools.common.messages import sentence
from kickstand_tools.estimation.least_squares import Estimate
from kickstand_tools.estimation.model import ALL, DIVE, Prior
from kickstand_tools.estimation.smooth import PoseOff
from kickstand_tools.estimation.windows import windows_of
from kickstand_tools.signals import rotation_matrix
from kickstand_workshop.evaluation.drawn_rides import drawn_ride
from kickstand_workshop.evaluation.smoothed_rides import other, rms, simulated
from window_input import still_log

ALIGNED = CalibrationFile(aligned=True)
RIDES = {
    "street": lambda: simulated("street", 3, 120.0),
    "turn after turn": lambda: other("held", 1, height_m=0.6, seconds=100.0),
    "wheelie": lambda: simulated("wheelie", 1, 80.0),
    "crosswind": lambda: simulated("crosswind", 5, 200.0),
    "banked": lambda: simulated("banked", 9, 150.0),
    "warming up": lambda: simulated("temperature", 8, 150.0),
    "long turns": lambda: other("sweepers", 2, seconds=170.0),
    "corners": lambda: other("track", 4, seconds=150.0, speed=True),
    "sweeper": lambda: simulated("sweeper", 304, 200.0),
    "creep": lambda: simulated("creep", 10, 150.0),
}
# Largest rms errors of the default rides in degrees. The standard deviation fits them within a factor of 1.5.
DEFAULT = {"street": 0.26, "turn after turn": 0.40, "wheelie": 0.15}


@functools.cache
def ride_of(name):
    """Return a ride, which has 50 samples per second in the default tests and otherwise 200."""
    ride = RIDES[name]()
    return ride.part(np.arange(len(ride.log.t_s)) % 4 == 0) if name in DEFAULT else ride


@functools.cache
def smoothed(name):
    return smooth(ride_of(name).log, ride_of(name).calibration)


def codes(lean):
    return [notice.code for notice in lean.notices]


def error(ride, log=None, calibration=None):
    """Return the error of the lean in each sample, and its standard deviation. log, calibration: replace the ride's."""
    lean = smooth(log or ride.log, calibration or ride.calibration)
    return lean.lean_deg - ride.lean_deg, lean.lean_sigma_deg


@pytest.mark.parametrize(
    "name", [name if name in DEFAULT else pytest.param(name, marks=pytest.mark.long) for name in RIDES]
)
def test_smoothed_lean_beats_the_display_and_knows_its_error(name):
    """The whole ride is compared, including the first turns. The limits are for one short ride. Over many rides, at
    least 0.58 of the errors are below one standard deviation. In "creep" the mount yields slowly by 2 to 5 degrees."""
    ride, lean = ride_of(name), smoothed(name)
    off, sigma = (lean.lean_deg - ride.lean_deg)[ride.riding], lean.lean_sigma_deg[ride.riding]
    live = (ride.live() - ride.lean_deg)[ride.riding]
    assert rms(off) < (0.85 if name == "creep" else 0.65) * rms(live[~np.isnan(live)])
    assert np.max(np.abs(off)) < 2.5
    assert np.mean(np.abs(off) < 2.0 * sigma) > (0.5 if name == "warming up" else 0.65)
    assert np.mean(np.abs(off) < 3.0 * sigma) > 0.95
    assert 0.4 * rms(off) < np.mean(lean.lean_sigma_deg) < 1.3
    if name in DEFAULT:
        assert rms(off) < DEFAULT[name] and 1.0 < np.mean(sigma) / rms(off) < 1.5
    assert not np.any(lean.doubtful) and codes(lean) == (["pose-off"] if name == "creep" else [])


def test_speed_follows_the_ride_with_and_without_a_logged_one():
    ride = simulate_ride("hills", seed=22, seconds=80.0)
    log, calibration = Log.from_readings(ride.readings[::4], 50.0), CalibrationFile(aligned=True, six_done=True)
    calibration.vehicle_from_sensor, calibration.gyro_bias_dps = ride.vehicle_from_sensor, ride.chip.gyro_bias
    speed, unlogged = ride.truth["speed_mps"][::4], smooth(log, calibration).speed_mps
    log.speed_mps[::50] = speed[::50]
    riding = np.cumsum(speed > 0.5) > 0
    assert rms((smooth(log, calibration).speed_mps - speed)[riding]) < 0.4
    assert rms((unlogged - speed)[riding]) < 1.0


@pytest.mark.parametrize("mount", ["foreign", "firm"])
def test_only_accelerations_of_a_soft_mount_are_doubted(mount):
    drawn = drawn_ride(3028, 60.0, [mount])
    log = drawn.logs[0].part(np.arange(len(drawn.logs[0].t_s)) % 4 == 0)
    lean = smooth(log, drawn.calibrations[0])
    assert codes(lean) == (["not-the-bikes"] if mount == "foreign" else [])
    assert np.mean(lean.doubtful) > 0.5 if mount == "foreign" else not np.any(lean.doubtful)
    off = lean.lean_deg - np.interp(log.t_s, drawn.time_s, drawn.lean_deg)
    assert np.mean(np.abs(off) < 3.0 * lean.lean_sigma_deg) > 0.9


@pytest.mark.parametrize("dive_deg_per_g", [pytest.param(-1.5, marks=pytest.mark.long), 6.0])
def test_the_dive_of_a_bike_is_learned(dive_deg_per_g):
    """A bike's nose dives under braking. When the dive was treated as a slope of the road or as acceleration, the
    smoothed lean depended on the bike's fork."""
    ride = simulate_ride("track", seed=31, seconds=90.0, dive=(dive_deg_per_g, dive_deg_per_g))
    calibration = CalibrationFile(vehicle_from_sensor=ride.vehicle_from_sensor, aligned=True)
    force, rate = calibration.in_vehicle(ride.readings[::4])
    t_s, no_speed = ride.time[::4], np.full(len(force), np.nan)
    windows = windows_of(t_s, force, np.radians(rate), no_speed, np.zeros(len(force)), aligned=True)
    estimate = Estimate(windows, Prior.of_pose(six_done=False), ALL)
    assert np.degrees(estimate.parameters[0, DIVE]) == pytest.approx(dive_deg_per_g, abs=1.5)


def test_a_faulty_axis_of_the_gyro_is_reported():
    """The rate about forward is 12 % too high. The lean is less exact, and its standard deviation says so."""
    ride = ride_of("street")
    matrix = ride.calibration.vehicle_from_sensor
    fault = matrix.T @ np.diag([1.0, 1.0, 1.12]) @ matrix
    lean = smooth(replace(ride.log, gyro_dps=ride.log.gyro_dps @ fault.T), ride.calibration)
    assert codes(lean) == ["sensor-odd"] and "standard deviations" in sentence(lean.notices[0])
    assert np.mean(lean.lean_sigma_deg) > 4.0 * np.mean(smoothed("street").lean_sigma_deg)
    off = np.abs(lean.lean_deg - ride.lean_deg)[ride.riding]
    assert rms(off) < 1.0 and np.mean(off < lean.lean_sigma_deg[ride.riding]) > 0.9


@pytest.mark.parametrize("wrong_deg", [4.0, pytest.param(-4.0, marks=pytest.mark.long)])
def test_pose_that_was_not_upright_is_reported(wrong_deg):
    """The ride's own pose is 1.5 degrees off. The lean counts from the balanced position."""
    ride = ride_of("street")
    turned = rotation_matrix(np.radians([0.0, 0.0, -wrong_deg])) @ ride.calibration.vehicle_from_sensor
    lean = smooth(ride.log, replace(ride.calibration, vehicle_from_sensor=turned))
    (notice,) = lean.notices
    assert isinstance(notice, PoseOff)
    angle_deg = notice.angle_deg
    assert abs(angle_deg - wrong_deg) < 2.1
    side = "right" if wrong_deg > 0.0 else "left"
    assert f"in balance {abs(angle_deg):.1f} degrees to the {side}" in sentence(notice)
    assert rms((lean.lean_deg - smoothed("street").lean_deg)[ride.riding]) < 0.5


def test_smoothed_lean_is_independent_of_the_mounting():
    ride, rng = ride_of("street"), np.random.default_rng(1)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    log, first = ride.log, ride.calibration
    force, rate = log.accel_g * first.accel_slope + first.accel_offset_g, log.gyro_dps - first.gyro_bias_dps
    other_log = Log(log.t_s, force @ turn.T, rate @ turn.T, temperature_c=log.temperature_c)
    mounting = CalibrationFile(vehicle_from_sensor=first.vehicle_from_sensor @ turn.T, aligned=True, six_done=True)
    assert np.allclose(smoothed("street").lean_deg, smooth(other_log, mounting).lean_deg, atol=0.01)


def test_lost_and_frozen_readings_do_not_harm_the_rest():
    """The log begins while riding, has gaps of 15 s and of 0.3 s, and freezes for 5 s."""
    t = ride_of("street").log.t_s
    ride = ride_of("street").part((t > 35.0) & ((t < 60.0) | (t > 75.0)) & (t % 10.0 > 0.3))
    log = ride.log
    frozen = (log.t_s > 90.0) & (log.t_s < 95.0)
    force, rate = log.accel_g.copy(), log.gyro_dps.copy()
    force[frozen], rate[frozen] = force[np.argmax(frozen)], rate[np.argmax(frozen)]
    lean = smooth(replace(log, accel_g=force, gyro_dps=rate), ride.calibration)
    unknown = np.isnan(lean.lean_deg)
    assert np.array_equal(np.flatnonzero(unknown), np.flatnonzero(frozen)[1:])
    assert np.array_equal(np.isnan(lean.lean_sigma_deg), unknown)
    assert rms((lean.lean_deg - ride.lean_deg)[~unknown]) < 0.5
    assert codes(lean) == ["frozen-readings"]


def test_a_pothole_leaves_no_lean_behind():
    """In a pothole the sensor shows a roll rate of 300 deg/s for 60 ms, but the bike does not roll. Two phones on one
    scooter measured such rates with opposite signs, so the phones moved and the scooter did not."""
    ride = ride_of("street")
    log, pothole_s = ride.log, 80.0
    hit = (log.t_s > pothole_s) & (log.t_s < pothole_s + 0.06)
    rate = log.gyro_dps + np.where(hit[:, None], 300.0, 0.0) * ride.calibration.vehicle_from_sensor[2]
    off, sigma = error(ride, replace(log, gyro_dps=rate))
    assert np.max(np.abs(off)[(np.abs(log.t_s - pothole_s) > 0.5) & ride.riding]) < 1.5
    assert np.all(np.abs(off)[hit] < 3.0 * sigma[hit])


def in_hand(seconds, seed, rate_hz=50):
    """Simulate a sensor that is turned in the hand. Return its force in g and its rate in deg/s, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * rate_hz)) / rate_hz
    turns = rng.normal(size=(3, 4)) * 60.0
    rate = np.sum([np.outer(np.sin(2 * np.pi * (0.2 + 0.25 * k) * t + k), turns[:, k]) for k in range(4)], axis=0)
    up, force = np.array([0.3, 0.5, 0.8]), np.empty((len(t), 3))
    for k in range(len(t)):
        up = up - np.cross(np.radians(rate[k]), up) / rate_hz
        up /= np.linalg.norm(up)
        force[k] = up
    return force + 0.1 * rng.normal(size=force.shape), rate + rng.normal(size=force.shape)


def test_time_in_the_hand_does_not_spoil_the_ride():
    ride = ride_of("street")
    n = len(ride.log.t_s)
    first, last = in_hand(20.0, 4), in_hand(20.0, 5)
    force = np.concatenate((first[0], ride.log.accel_g, last[0]))
    rate = np.concatenate((first[1], ride.log.gyro_dps, last[1]))
    lean = smooth(Log(np.arange(len(force)) / 50.0, force, rate), ride.calibration)
    riding = slice(len(first[0]), len(first[0]) + n)
    off = np.abs(lean.lean_deg[riding] - ride.lean_deg)
    assert rms(off[500:-500]) < 0.8
    assert np.mean(off < 2.0 * lean.lean_sigma_deg[riding]) > 0.85


@pytest.mark.parametrize("seconds", [0.05, 0.3, 2.0, 6.0])
def test_short_log_has_a_lean_with_a_large_sigma(seconds):
    t = ride_of("street").log.t_s
    ride = ride_of("street").part((t >= 60.0) & (t < 60.0 + seconds))
    off, sigma = error(ride)
    assert np.all(np.abs(off) < 3.0 * sigma)


def test_a_long_ride_is_estimated_in_parts_without_seams():
    """A ride of over 16 minutes is estimated in two parts. The last part is short, and uses earlier readings."""
    log, steps = still_log(1090.0, 12.5), []
    lean = smooth(log, ALIGNED, lambda *step: steps.append(step))
    assert lean.t_s == pytest.approx(log.t_s)
    assert np.max(np.abs(lean.lean_deg)) < 0.5 and np.max(np.abs(np.diff(lean.lean_deg))) < 0.3
    assert np.min(lean.lean_sigma_deg) > 1.5 and lean.notices == []
    assert steps == sorted(steps) and steps[-1][0] == steps[-1][1]


def test_a_stretch_has_its_own_samples_of_the_whole_estimate():
    log = still_log(20.0, 10.0)
    part, ride = smooth(Stretch(log, 5.0, 6.0), ALIGNED), smooth(log, ALIGNED)
    assert part.t_s.tolist() == pytest.approx([5.0 + k / 10 for k in range(11)])
    assert part.lean_deg.tolist() == ride.lean_deg[50:61].tolist()


@pytest.mark.parametrize(
    ("calibration", "hz", "words"),
    [
        (CalibrationFile(aligned=True, vehicle="car"), 50.0, "^n: a car does not lean, and its calibration is a car's"),
        (CalibrationFile(), 50.0, "^the calibration is not aligned, so the lean is unknown"),
        (ALIGNED, 9.9, "^n: under 10 samples per second: too few to smooth the lean"),
    ],
)
def test_what_cannot_be_smoothed_is_refused(calibration, hz, words):
    with pytest.raises(InputError, match=words):
        smooth(still_log(9.0, hz), calibration)
