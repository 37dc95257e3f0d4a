"""The time of a track within a ride is found with an error below 0.2 s, for every profile. The track of another ride is
refused."""

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.joining.compare import Comparison
from kickstand_tools.joining.motion import motion
from kickstand_tools.joining.track import course, segments
from kickstand_tools.signals import EARTH_M
from support.recordings import phone_tracks

PROFILES = ("street", "track", "sweeper", "city", "hills")
# Duration of the ride; rides with few bends must be longer
SECONDS = {"sweeper": 450.0, "city": 300.0, "street": 300.0}


@pytest.fixture(scope="module")
def rides():
    return {name: api.simulate_ride(name, seed=11, seconds=SECONDS.get(name, 200.0)) for name in PROFILES}


def log_of(ride, part: slice = slice(None), slow_ppm: float = 0.0) -> api.Log:
    """Return the log of a board whose clock is slow by slow_ppm parts per million."""
    readings = ride.readings[part]
    t_s = np.arange(len(readings)) / ride.rate_hz * (1.0 - slow_ppm * 1e-6)
    return api.Log(t_s, readings[:, :3], readings[:, 4:], name="ride")


def error_s(joined, late_s: float, at_s: float = 0.0) -> float:
    """Return the error of the match, in s. late_s: the true delay of the track. at_s: the time in the ride."""
    return float(joined.match.ride_s(np.array([phone_tracks.START_UTC_S + late_s + at_s]))[0]) - at_s


@pytest.mark.parametrize("profile", PROFILES)
def test_a_phones_track_is_found_within_a_fifth_of_a_second(rides, profile):
    late_s, smooth_s, seed = (0.2, 0.2, 1) if profile in ("street", "city") else (1.0, 0.4, 2)
    track = phone_tracks.track(rides[profile], late_s, smooth_s=smooth_s, seed=seed, error_m=3.0 + seed % 3)
    joined = api.join_track(log_of(rides[profile]), track)
    error = error_s(joined, late_s)
    assert abs(error) < 0.2
    assert abs(error) < 3.5 * joined.match.sigma_s
    assert 0.85 < joined.match.correlation < 1.0
    assert joined.match.common_s == pytest.approx(rides[profile].time[-1], abs=1.0)


def test_track_over_half_of_the_ride_is_found_at_any_offset(rides):
    """The track may begin hours before the ride. The track may also cover only a part of the ride, because the phone
    was switched on late or off early."""
    ride = rides["hills"]
    track = phone_tracks.track(ride, before_s=8 * 3600.0)
    assert abs(error_s(api.join_track(log_of(ride), track), 0.5)) < 0.2
    late = track.utc_s > phone_tracks.START_UTC_S + 80.0
    second = api.Track(*(values[late] for values in track.columns().values()), name="late")
    joined = api.join_track(log_of(ride), second)
    assert abs(error_s(joined, 0.5)) < 0.2
    assert joined.match.common_s < ride.time[-1] - 79.0


def winding(seconds: float, slow_ppm: float = 0.0) -> tuple[api.Log, api.Track]:
    """Simulate a ride at 20 m/s on a road with random bends.

    Returns:
        The log of an exact sensor, whose clock is slow by slow_ppm.
        The track of an exact receiver with ten positions per second.
    """
    t_s, speed = np.arange(0.0, seconds, 0.02), 20.0
    knots_s = np.arange(0.0, seconds + 12.0, 6.0)
    yaw = np.interp(t_s, knots_s, np.radians(25.0) * np.random.default_rng(1).uniform(-1.0, 1.0, len(knots_s)))
    lean = -np.arctan(speed * yaw / 9.80665)
    rates = np.degrees(np.column_stack((np.zeros(len(t_s)), yaw * np.cos(lean), np.gradient(lean, 0.02))))
    force = np.outer(1.0 / np.cos(lean), [0.0, 1.0, 0.0])
    heading = np.cumsum(yaw) * 0.02
    lat, lon = (np.degrees(np.cumsum(speed * turn(heading)) * 0.02 / EARTH_M)[::5] for turn in (np.sin, np.cos))
    track = api.Track(1.7e9 + np.arange(len(lat)) / 10.0, lat, lon, np.full(len(lat), speed), "exact")
    return api.Log(t_s * (1.0 - slow_ppm * 1e-6), force, rates), track


def test_drift_of_the_clocks_is_found():
    """A drift of 300 ppm is 0.5 s in half an hour. A match without drift would be off by 0.25 s at both ends."""
    log, track = winding(1800.0, slow_ppm=300.0)
    found = api.join_track(log, track).match
    assert found.drift == pytest.approx(300e-6, abs=20e-6)
    for at_s in (0.0, 1800.0):
        assert found.ride_s(np.array([1.7e9 + at_s]))[0] == pytest.approx(at_s * (1.0 - 300e-6), abs=0.12)


def test_track_with_sparse_points_is_found(rides):
    track = phone_tracks.track(rides["street"], error_m=3.0)
    some = np.flatnonzero(np.random.default_rng(1).random(len(track.utc_s)) < 0.6)
    thin = api.Track(*(values[some] for values in track.columns().values()), name="watch")
    assert abs(error_s(api.join_track(log_of(rides["street"]), thin), 0.5)) < 0.25


@pytest.mark.parametrize(("profile", "other"), [("street", "track"), ("hills", "city")])
def test_another_rides_track_is_refused(rides, profile, other):
    with pytest.raises(api.InputError, match="the track of another ride"):
        api.join_track(log_of(rides[profile]), phone_tracks.track(rides[other]))


@pytest.mark.parametrize(("profile", "differs"), [("street", 0.03), ("track", 0.08), ("city", 0.08), ("hills", 0.03)])
def test_the_same_roads_on_another_day_are_refused(rides, profile, differs):
    """The other ride has the same bends. The speed of the other ride differs by some per cent, and this difference
    changes every 20 s."""
    ride = rides[profile]
    knots_s = np.arange(0.0, ride.time[-1] + 40.0, 20.0)
    faster = np.interp(ride.time, knots_s, 1.0 + np.random.default_rng(6).normal(0.0, differs, len(knots_s)))
    pace = np.cumsum(1.0 / faster) / ride.rate_hz, faster
    with pytest.raises(api.InputError, match=r"at other times|of another ride"):
        api.join_track(log_of(ride), phone_tracks.track(ride, pace=pace))


def test_short_or_straight_ride_is_refused(rides):
    ride = rides["street"]
    track = phone_tracks.track(ride)
    with pytest.raises(api.InputError, match="ride, track: the ride lasts 30 s"):
        api.join_track(log_of(ride, slice(6000, 12000)), track)
    straight = ride.readings.copy()
    straight[:, 4:] = np.random.default_rng(1).normal(0.0, 0.1, (len(straight), 3))
    with pytest.raises(api.InputError, match="too few bends"):
        api.join_track(api.Log.from_readings(straight, ride.rate_hz), track)
    still = api.Track(track.utc_s, 0 * track.lat_deg, 0 * track.lon_deg, track.speed_mps, "still")
    with pytest.raises(api.InputError, match="the track moves for 0 s only"):
        api.join_track(log_of(ride), still)


def test_similar_bends_are_refused_as_ambiguous():
    """In a slalom all bends are alike, so the track matches the ride at many times."""
    t_s = np.arange(0.0, 120.0, 0.01)
    yaw_dps = 25.0 * np.sin(2.0 * np.pi * t_s / 12.0)
    log = api.Log(t_s, np.tile([0.0, 1.0, 0.0], (len(t_s), 1)), np.outer(yaw_dps, [0.0, 1.0, 0.0]))
    heading = np.cumsum(np.radians(25.0 * np.sin(2.0 * np.pi * np.arange(0.0, 400.0, 0.01) / 12.0))) * 0.01
    lat, lon = (np.degrees(np.cumsum(8.0 * turn(heading)) * 0.01 / 6_371_000.0)[::100] for turn in (np.sin, np.cos))
    slalom = api.Track(1.7e9 + np.arange(400.0), lat, lon, np.full(400, 8.0), "slalom")
    with pytest.raises(api.InputError, match=r"fits at two times, \d+ s apart"):
        api.join_track(log, slalom)


def test_mirrored_accelerations_are_reported(rides):
    log = log_of(rides["track"])
    mirrored = api.Log(log.t_s, -log.accel_g, log.gyro_dps)
    with pytest.raises(api.InputError, match="turns left where the track turns right: do all accelerations"):
        api.join_track(mirrored, phone_tracks.track(rides["track"]))


def test_frozen_readings_and_gaps_are_left_out(rides):
    ride = rides["hills"]
    log = log_of(ride)
    accel, gyro = log.accel_g.copy(), log.gyro_dps.copy()
    fast = 6000 + int(np.argmax(np.linalg.norm(gyro[6000:30_000], axis=1)))
    accel[fast : fast + 4000], gyro[fast : fast + 4000] = accel[fast], gyro[fast]
    kept = np.abs(np.arange(len(log.t_s)) - 35_000) > 1500
    broken = api.Log(log.t_s[kept], accel[kept], gyro[kept])
    joined = api.join_track(broken, phone_tracks.track(ride))
    assert [notice.code for notice in joined.notices] == ["frozen-readings"]
    assert abs(error_s(joined, 0.5)) < 0.2
    assert joined.match.correlation > 0.97  # if the frozen readings counted, the correlation would be 0.8


def test_course_turns_are_scaled_by_the_lean():
    """The gyro's rate about the bike's up is smaller than the yaw rate. At a lean of 45 degrees it is 0.7 times the yaw
    rate."""
    log, track = winding(300.0)
    steps = course(track.once_a_second())
    compared = Comparison(motion(log), steps, segments(steps), 0.0, 3.0)
    error = compared.turned(0.0)[0] - compared.given.turned_deg
    assert np.abs(compared.given.turned_deg).max() > 40.0
    assert np.abs(error[compared.given.course_weight > 0.0]).max() < 3.0
