"""Stops of simulated rides with an MPU6050 are compared with the truth."""

import numpy as np
import pytest
from kickstand_sim.simulation import profiles
from kickstand_sim.simulation.files import simulate
from kickstand_sim.simulation.plan import Conditions
from kickstand_tools.analysis.ride import downsampled, joined, open_ride
from kickstand_tools.analysis.stops import RATE_S, find_stops, standing
from kickstand_tools.calibration.file import read_calibration, write_calibration
from kickstand_tools.calibration.poses import fit_six_positions, fit_two_positions


def brakes(plan):
    """Plan repeated stops from speeds of 29 to 126 km/h. The decelerations are 2 to 9 m/s2, the slopes up to 3 %."""
    plan.begin()
    while plan.going_on:
        speed = plan.uniform(8.0, 35.0)
        plan.to_speed(speed, 3.0)
        plan.straight(plan.uniform(3.0, 8.0), speed)
        plan.stop(plan.uniform(3.0, 6.0), plan.uniform(2.0, 9.0))
    plan.finish(15.0, 3.0)
    return Conditions()


def simulated(directory, profile, seconds, seed=2):
    """Return the course of a ride whose sensor was calibrated by its poses, the times of the truth and true speeds."""
    simulation = simulate(profile, seed, directory, seconds=seconds)
    poses = [directory / f"POSE_{k}.csv" for k in range(1, 8)]
    write_calibration(directory / "six.json", fit_six_positions(poses).calibration)
    pair = directory / "KICKSTAND.csv", directory / "UPRIGHT.csv"
    fit = fit_two_positions(*pair, read_calibration(directory / "six.json"))
    write_calibration(directory / "RIDE.cal.json", fit.calibration)
    course = joined(list(downsampled(open_ride(directory / "RIDE.csv", None).read().parts(), RATE_S)))
    return course, simulation.time, simulation.truth["speed_mps"]


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(profiles.PROFILES, "brakes", brakes)
        return simulated(tmp_path_factory.mktemp("brakes"), "brakes", 130.0)


def with_speed(ride, hz, late_s, noise_mps):
    """Return the course with the true speed in some samples, with a delay in s and noise in m/s."""
    course, time, speed = ride
    result = course.part(slice(None))
    result.speed_mps = np.full(len(result.t_s), np.nan)
    samples = np.arange(0, len(result.t_s), 50 // hz)
    noise = noise_mps * np.random.default_rng(0).normal(size=len(samples))
    result.speed_mps[samples] = np.abs(np.interp(result.t_s[samples] - late_s, time, speed) + noise).round(2)
    return result


def true_figures(time, speed, stop):
    """Return the initial speed, the distance from stop.start_s on, and the MFDD, from the true speed."""
    near = (time > stop.start_s - 1.0) & (time < stop.stop_s + 1.0)
    t, v = time[near], speed[near]
    first = len(v) - 1 - int(np.argmax(v[::-1] > np.max(v) - 0.01))  # the last sample before the speed falls
    t, v = t[first:], v[first:]
    assert abs(t[0] - stop.start_s) < 0.3
    distance = np.concatenate(([0.0], np.cumsum(np.diff(t) * (v[1:] + v[:-1]) / 2.0)))
    from_start = (
        float(v[0]) * max(0.0, float(t[0]) - stop.start_s) + distance[-1] - np.interp(stop.start_s, t, distance)
    )
    high, low = np.interp([-0.8 * v[0], -0.1 * v[0]], -v, distance)
    return float(v[0]), from_start, (0.8**2 - 0.1**2) * v[0] ** 2 / (2.0 * (low - high))


@pytest.mark.parametrize(
    ("receiver", "mfdd_percent", "speed_percent"),
    [
        ((1, 0.0, 0.0), 1.0, 0.5),
        ((10, 0.0, 0.0), 1.0, 0.5),
        ((1, 0.2, 0.05), 2.0, 1.5),
        ((10, 0.2, 0.05), 1.5, 1.0),
        (None, 3.0, 3.0),
    ],
)
def test_stops_match_the_truth(ride, receiver, mfdd_percent, speed_percent):
    """Largest errors in per cent. receiver: values per second, delay and noise of the speed."""
    course, time, speed = ride
    stops = find_stops(with_speed(ride, *receiver) if receiver else course)
    assert len(stops) == np.count_nonzero((speed[1:] < 0.01) & (speed[:-1] >= 0.01)) >= 4
    errors = []
    for stop in stops:
        initial_mps, distance_m, mfdd = true_figures(time, speed, stop)
        assert stop.speed_from == ("log" if receiver else "integrated")
        assert stop.initial_speed_mps == pytest.approx(initial_mps, rel=speed_percent / 100)
        assert stop.distance_m == pytest.approx(distance_m, rel=0.02 if receiver else 0.05, abs=0.1)
        errors.append(100.0 * (stop.mfdd_mps2 / mfdd - 1.0))
        assert abs(stop.side_m) < 1.0 and mfdd < stop.peak_mps2 < 1.6 * mfdd
    assert np.max(np.abs(errors)) < mfdd_percent and abs(np.mean(errors)) < 0.5 * mfdd_percent


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_a_fast_smooth_track_is_not_a_standstill(tmp_path, seed):
    """Held turns on a smooth track resemble a standstill. The only stop is at the end."""
    course, time, speed = simulated(tmp_path, "track", 120.0, seed)
    course.speed_mps = np.interp(course.t_s, time, speed)
    without = course.part(slice(None))
    without.speed_mps = np.full(len(course.t_s), np.nan)
    still = standing(without)
    assert np.max(course.speed_mps[still]) < 0.5 and np.mean(still[course.speed_mps == 0.0]) > 0.9
    (stop,), (true,) = find_stops(without), find_stops(course)
    assert stop.mfdd_mps2 == pytest.approx(true.mfdd_mps2, rel=0.03)
    assert stop.initial_speed_mps == pytest.approx(true.initial_speed_mps, rel=0.03)
