"""No window of a correct recording is accused of a mistake, wherever it begins: a recording may begin in a long bend.

A mistake is found where the window shows it, and the exchange of axes that is named is the right one."""

import functools

import numpy as np
import pytest
from kickstand_sim.simulation.files import positions
from kickstand_sim.simulation.profiles import PROFILES
from kickstand_sim.simulation.ride import ride
from kickstand_tools.checks.axes import PERMUTATIONS
from kickstand_tools.checks.log import check_log
from kickstand_tools.common.messages import RefusedInput
from kickstand_tools.estimation.alignment import axes, mounted_windows
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log

MOUNTINGS = [exchange for exchange in PERMUTATIONS if np.linalg.det(exchange) > 0.0]
NOT_ENOUGH = {"ride-short", "no-bends", "side-unsure"}  # refusals that accuse nothing
BENDY = "sweeper", "corners", "hills"  # profiles whose windows were accused once
WRONG = [matrix for matrix in PERMUTATIONS if not np.array_equal(matrix, np.eye(3))]


@functools.cache
def long_ride(profile: str, seconds: float) -> Log:
    """Simulate a log with 50 samples per second, and one speed and one position per second."""
    ridden = ride(profile, 8, seconds)
    has_position = np.arange(len(ridden.time[::4])) % 50 == 0
    speed, lat, lon = (
        np.where(has_position, np.asarray(column)[::4], np.nan)
        for column in (ridden.truth["speed_mps"], *positions(ridden)[:2])
    )
    return Log(ridden.time[::4], ridden.readings[::4, :3], ridden.readings[::4, 4:], speed, lat_deg=lat, lon_deg=lon)


def window(log: Log, chance: np.random.Generator) -> Log:
    """Return 30 to 300 s of a log, as measured in another mounting, with or without speed and positions."""
    seconds = min(np.exp(chance.uniform(np.log(30.0), np.log(300.0))), 0.99 * log.t_s[-1])
    begin = chance.uniform(0.0, log.t_s[-1] - seconds)
    part = log.part((log.t_s >= begin) & (log.t_s < begin + seconds))
    mounting = MOUNTINGS[chance.integers(len(MOUNTINGS))]
    accel, gyro = part.accel_g @ mounting.T, part.gyro_dps @ mounting.T
    if chance.random() < 0.5:
        return Log(part.t_s - begin, accel, gyro)
    return Log(part.t_s - begin, accel, gyro, part.speed_mps, lat_deg=part.lat_deg, lon_deg=part.lon_deg)


def accusations(log: Log) -> set[str]:
    """Return the codes of the remarks on a log, and of the refusal of its alignment."""
    codes = {notice.code for notice in check_log(log).notices}
    try:
        axes(mounted_windows(log))
    except RefusedInput as refusal:
        codes.add(refusal.code)
    return codes - NOT_ENOUGH


@pytest.mark.parametrize("profile", BENDY)
def test_no_window_of_bends_is_accused(profile):
    chance = np.random.default_rng(1)
    for _ in range(3):
        assert accusations(window(long_ride(profile, 200.0), chance)) == set()


@pytest.mark.long
@pytest.mark.parametrize("profile", PROFILES)
def test_no_window_of_a_ride_is_accused(profile):
    chance = np.random.default_rng(2)
    for _ in range(12):
        assert accusations(window(long_ride(profile, 640.0), chance)) == set()


def test_no_window_of_a_recording_is_accused(shared_data):
    """A car is named as a car."""
    chance = np.random.default_rng(3)
    for path in sorted(shared_data.glob("*.csv.gz")):
        car = {"not-leaning"} if "car" in path.name else set()
        assert accusations(window(read_log(path), chance)) <= car


@pytest.mark.parametrize(
    ("profile", "count"), [("street", 3), *(pytest.param(p, 6, marks=pytest.mark.long) for p in (*BENDY, "street"))]
)
def test_mistakes_are_found_in_most_windows_and_named_right(profile, count):
    chance = np.random.default_rng(4)
    named = 0
    for _ in range(count):
        log, wrong = window(long_ride(profile, 200.0), chance), WRONG[chance.integers(len(WRONG))]
        notices = check_log(Log(log.t_s, log.accel_g, log.gyro_dps @ wrong.T)).notices
        assert len(notices) <= 1
        for notice in notices:
            named += 1
            repair = -np.eye(3) if notice.code == "left-handed" else notice.values
            assert notice.code == "axes-misfit" or np.array_equal(repair, wrong.T), (notice, wrong)
    assert named >= count / 2
