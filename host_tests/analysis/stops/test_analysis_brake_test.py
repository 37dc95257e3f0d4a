"""Stops of simulated rides are compared with the truth: the mean fully developed deceleration (MFDD) is within 1 %."""

from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.analysis.channels import Channels, downsampled, joined
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.analysis.stops.brake_test import RATE_S, Stop, find_stops, mfdd_mps2
from kickstand_tools.calibration.file import read_calibration, write_calibration
from kickstand_tools.calibration.poses import fit_six_positions, fit_two_positions
from kickstand_tools.simulation import profiles
from kickstand_tools.simulation.files import simulate
from kickstand_tools.simulation.plan import Conditions, Plan

# Each speed in the log: number of values per second, delay in s, standard deviation of the noise in m/s
PERFECT_1HZ, PERFECT_10HZ = (1, 0.0, 0.0), (10, 0.0, 0.0)
SATELLITES_1HZ, SATELLITES_10HZ = (1, 0.2, 0.05), (10, 0.2, 0.05)


def course(path: Path) -> Channels:
    return joined(list(downsampled(open_ride(path, None).blocks(), RATE_S)))


def brakes(plan: Plan) -> Conditions:
    """Plan repeated stops from speeds of 29 to 126 km/h. The decelerations are 2 to 9 m/s2, the slopes up to 3 %."""
    plan.begin()
    while plan.going_on:
        speed = plan.uniform(8.0, 35.0)
        plan.to_speed(speed, 3.0)
        plan.straight(plan.uniform(3.0, 8.0), speed)
        plan.stop(plan.uniform(3.0, 6.0), plan.uniform(2.0, 9.0))
    plan.finish(15.0, 3.0)
    return Conditions()


@pytest.fixture(scope="module")
def ride(tmp_path_factory) -> tuple[Channels, np.ndarray, np.ndarray]:
    """Simulate a ride with a randomly mounted MPU6050 that is calibrated by its poses. Return its channels, the times
    of the truth and the true speeds."""
    directory = tmp_path_factory.mktemp("brakes")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(profiles.PROFILES, "brakes", brakes)
        made = simulate("brakes", 2, directory, seconds=300.0)
    poses = [directory / f"POSE_{k}.csv" for k in range(1, 8)]
    write_calibration(directory / "six.json", fit_six_positions(poses).calibration)
    pair = directory / "KICKSTAND.csv", directory / "UPRIGHT.csv"
    six = read_calibration(directory / "six.json")
    write_calibration(directory / "RIDE.cal.json", fit_two_positions(*pair, six).calibration)
    return course(directory / "RIDE.csv"), made.time, made.truth["speed_mps"]


def with_speed(ride, hz: int, late_s: float, noise_mps: float) -> Channels:
    """Return the course with the true speed in some samples."""
    whole, time, speed = ride
    result = whole.part(slice(None))
    result.speed_mps = np.full(len(result.t_s), np.nan)
    places = np.arange(0, len(result.t_s), 50 // hz)
    noise = noise_mps * np.random.default_rng(0).normal(size=len(places))
    result.speed_mps[places] = np.abs(np.interp(result.t_s[places] - late_s, time, speed) + noise).round(2)
    return result


def truth(time: np.ndarray, speed: np.ndarray, stop: Stop) -> tuple[float, float, float]:
    """Compute the figures of a stop from the true speed.

    Returns:
        initial speed: in m/s.
        distance: from the start that was found to the standstill, in m.
        MFDD: in m/s2.
    """
    near = (time > stop.start_s - 1.0) & (time < stop.stop_s + 1.0)
    t, v = time[near], speed[near]
    first = len(v) - 1 - int(np.argmax(v[::-1] > np.max(v) - 0.01))  # the last sample before the speed falls
    t, v = t[first:], v[first:]
    distance = np.concatenate(([0.0], np.cumsum(np.diff(t) * (v[1:] + v[:-1]) / 2.0)))
    kmh = v * 3.6
    vb, ve = 0.8 * kmh[0], 0.1 * kmh[0]
    sb, se = np.interp([-vb, -ve], -kmh, distance)
    before = float(v[0]) * max(0.0, float(t[0]) - stop.start_s)
    found = before + float(distance[-1] - np.interp(stop.start_s, t, distance))
    assert abs(t[0] - stop.start_s) < 0.3
    return float(v[0]), found, float((vb**2 - ve**2) / (25.92 * (se - sb)))


def true_stops(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    return time[1:][(speed[1:] < 0.01) & (speed[:-1] >= 0.01)]


# largest errors of the MFDD and of the initial speed, in per cent
LIMITS = {
    "1 Hz": (PERFECT_1HZ, 1.0, 0.5),
    "10 Hz": (PERFECT_10HZ, 1.0, 0.5),
    "satellites at 1 Hz": (SATELLITES_1HZ, 2.0, 1.5),
    "satellites at 10 Hz": (SATELLITES_10HZ, 1.5, 1.0),
}


@pytest.mark.parametrize("name", LIMITS)
def test_stops_with_a_speed_match_the_truth(ride, name):
    source, mfdd_limit, speed_limit = LIMITS[name]
    found = find_stops(with_speed(ride, *source))
    assert len(found) == len(true_stops(ride[1], ride[2])) >= 9
    errors = []
    for stop in found:
        speed, distance, mfdd = truth(ride[1], ride[2], stop)
        assert stop.speed_from == "log"
        assert stop.initial_speed_mps == pytest.approx(speed, rel=speed_limit / 100)
        assert stop.distance_m == pytest.approx(distance, rel=0.02, abs=0.1)
        errors.append(100.0 * (stop.mfdd_mps2 / mfdd - 1.0))
        assert abs(stop.side_m) < 1.0
        assert mfdd < stop.peak_mps2 < 1.6 * mfdd
    assert np.max(np.abs(errors)) < mfdd_limit
    assert abs(np.mean(errors)) < 0.5 * mfdd_limit


def test_stops_without_a_speed_match_the_truth(ride):
    """All true stops are found, and no others. The errors of the MFDD are at most 3 %, and their rms is at most 1 %."""
    whole = ride[0]
    found = find_stops(whole)
    assert len(found) == len(true_stops(ride[1], ride[2]))
    errors = []
    for stop in found:
        assert stop.speed_from == "integrated"
        errors.append(100.0 * (stop.mfdd_mps2 / truth(ride[1], ride[2], stop)[2] - 1.0))
    assert np.max(np.abs(errors)) < 3.0
    assert np.sqrt(np.mean(np.square(errors))) < 1.2


def test_mfdd_follows_its_definition():
    """The MFDD equals the deceleration if the deceleration is constant. Only the braking from 0.8 v0 to 0.1 v0 counts,
    where v0 is the initial speed."""
    v = np.linspace(20.0, 0.0, 2001)
    assert mfdd_mps2(v, (20.0**2 - v * v) / (2 * 5.0)) == pytest.approx(5.0, rel=1e-9)
    # decelerate at 3 m/s2 down to 0.8 v0, then at 8 and at 5 m/s2, then at 3 m/s2 again
    pieces = [(20.0, 16.0, 3.0), (16.0, 9.0, 8.0), (9.0, 2.0, 5.0), (2.0, 0.0, 3.0)]
    distance = np.cumsum([0.0, *[(high**2 - low**2) / (2 * level) for high, low, level in pieces]])
    corners = np.array([20.0, *[low for _, low, _ in pieces]])
    bent = np.interp(-v * v, -corners * corners, distance)
    want = (16.0**2 - 2.0**2) / (2 * (distance[3] - distance[1]))
    assert mfdd_mps2(v, bent) == pytest.approx(want, rel=1e-6)
    assert mfdd_mps2(np.array([9.0, 0.0]), np.zeros(2)) == float(
        "inf"
    )  # the speed falls to 0 from one sample to the next


def test_slowing_down_is_not_a_stop(ride):
    """The log is cut before the standstill."""
    whole, time, speed = ride
    first = true_stops(time, speed)[0]
    part = with_speed(ride, *PERFECT_1HZ).part(whole.t_s < first - 0.5)
    assert find_stops(part) == []
    assert find_stops(whole.part(whole.t_s < first - 0.5)) == []


def test_shortest_ride_has_no_stops(ride):
    for n in 1, 2, 5, 40:
        assert find_stops(ride[0].part(slice(0, n))) == []
