"""A track is matched with a ride: the shift and the drift of the clocks, the limits, and the refusals."""

import functools

import numpy as np
import pytest
from joining.known_roads import BEGIN_S, another_device, points, road, turned
from kickstand_tools import api
from support.recordings import phone_tracks


@pytest.mark.parametrize(
    ("seconds", "device", "selection"),
    [
        (400.0, {"mount": turned(140.0), "bias_dps": 3.0}, slice(None)),
        (1800.0, {"from_s": 200.3, "drift": -300e-6}, slice(None)),
        (1800.0, {"to_s": 1500.0, "drift": 300e-6}, slice(1500, None)),
        (900.0, {"from_s": 100.0}, np.flatnonzero(np.random.default_rng(1).random(9000) < 0.06)),
    ],
    ids=["any mount", "fast clock", "slow clock, late track", "sparse points"],
)
def test_an_exact_track_is_matched_exactly(seconds, device, selection):
    """The sign of the drift: a slow clock (drift > 0) counts fewer seconds than the track."""
    log, track = road(seconds)
    track, log = points(track, selection), another_device(log, **device)
    match = api.join_track(log, track).match
    drift, from_s = device.get("drift", 0.0), device.get("from_s", 0.0)
    assert match.drift == pytest.approx(drift, abs=30e-6)
    for time_s in (from_s, from_s + 300.0):
        ride_s = (time_s - from_s) * (1.0 - drift)
        assert match.ride_s(np.array([BEGIN_S + time_s]))[0] == pytest.approx(ride_s, abs=0.08)
    assert match.correlation > 0.995 and 0.05 <= match.sigma_s < 0.09
    begin_s, end_s = track.utc_s[[0, -1]] - BEGIN_S
    common_s = min(end_s, device.get("to_s", seconds)) - max(begin_s, from_s)
    assert match.common_s == pytest.approx(common_s, abs=1.1)


def result(log, track):
    """Return the drift of a match, or the words of its refusal."""
    try:
        return api.join_track(log, track).match.drift
    except api.InputError as error:
        return str(error)


def slalom(seconds, hz):
    """Return a log and a track of bends that are all alike."""
    t_s = np.arange(0.0, seconds, 1.0 / hz)
    yaw_dps = 25.0 * np.sin(2.0 * np.pi * t_s / 12.0)
    log = api.Log(t_s, np.tile([0.0, 1.0, 0.0], (len(t_s), 1)), np.outer(yaw_dps, [0.0, 1.0, 0.0]))
    heading = np.cumsum(np.radians(yaw_dps)) / hz
    lat, lon = (np.cumsum(8.0 * component(heading))[::hz] / hz / 111_194.9 for component in (np.sin, np.cos))
    return log, api.Track(BEGIN_S + np.arange(float(len(lat))), lat, lon, np.full(len(lat), 8.0), "slalom")


@pytest.mark.parametrize(
    ("ride", "other", "words"),
    [
        ({"to_s": 59.9}, {}, "the ride lasts 60 s: at least 60 s"),
        ({"to_s": 60.1}, {}, "less than 60 s of riding in common"),
        ({"to_s": 200.0}, {}, None),
        ({}, {"points": 600}, "the track moves for 59 s only"),
        ({}, {"points": 2000}, None),
        ({"drift": 380e-6}, {"seconds": 1800.0}, None),
        ({"drift": 420e-6}, {"seconds": 1800.0}, "but at other times"),
        ({"drift": -420e-6}, {"seconds": 1800.0}, "but at other times"),
        ({"mirrored": True}, {}, "turns left where the track turns right: do all accelerations"),
        ({}, {"seed": 2}, "at no time does the ride turn like the track"),
        ({"to_s": 62.0, "bends": 0.1}, {}, "too few bends"),
        ({"positions": True}, {}, "has positions already"),
    ],
)
def test_a_match_is_refused_beyond_its_limits(ride, other, words):
    seconds = other.get("seconds", 400.0)
    log = another_device(road(seconds)[0], 0.0, ride.get("to_s", np.inf), ride.get("drift", 0.0))
    track = points(road(seconds, other.get("seed", 1))[1], slice(0, other.get("points")))
    log.gyro_dps[:] *= ride.get("bends", 1.0)
    if ride.get("mirrored"):
        log.accel_g[:] *= -1.0
    if ride.get("positions"):
        log.lat_deg[:] = log.lon_deg[:] = 1.0
    outcome = result(log, track)
    assert isinstance(outcome, float) if words is None else words in str(outcome), outcome


def test_similar_bends_are_refused_as_ambiguous():
    """A slalom of 120 s fits a slalom of 400 s at many times."""
    assert "fits at two times, " in str(result(slalom(120.0, 100)[0], slalom(400.0, 100)[1]))


def test_frozen_readings_and_gaps_are_left_out():
    """If 20 s of frozen readings counted, the correlation would be 0.8."""
    log, track = road(400.0, hz=50)
    fastest = int(np.argmax(np.linalg.norm(log.gyro_dps[:7500], axis=1)))
    log = another_device(log)
    for readings in (log.accel_g, log.gyro_dps):
        readings[fastest : fastest + 1000] = readings[fastest]
    is_far = np.abs(np.arange(len(log.t_s)) - 12_000) > 400
    joined = api.join_track(api.Log(log.t_s[is_far], log.accel_g[is_far], log.gyro_dps[is_far]), track)
    assert "frozen-readings" in [notice.code for notice in joined.notices]
    assert joined.match.correlation > 0.97
    assert joined.match.start_utc_s == pytest.approx(BEGIN_S, abs=0.1)


@functools.cache
def noisy_ride(profile, seconds=200.0):
    """Return a simulated ride with a sensor's and a road's noise."""
    ride = api.simulate_ride(profile, seed=11, seconds=seconds)
    return ride, api.Log.from_readings(ride.readings[::4], ride.rate_hz / 4)


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("profile", "seconds", "late_s", "smooth_s", "kind"),
    [
        ("hills", 200.0, 0.5, 0.3, {"before_s": 8 * 3600.0}),
        pytest.param("street", 300.0, 0.2, 0.2, {}, marks=LONG),
        pytest.param("track", 200.0, 1.0, 0.4, {"error_m": 5.0}, marks=LONG),
        pytest.param("sweeper", 450.0, 1.0, 0.4, {"error_m": 5.0}, marks=LONG),
        pytest.param("city", 300.0, 0.2, 0.2, {}, marks=LONG),
    ],
)
def test_a_phones_track_is_matched_within_a_fifth_of_a_second(profile, seconds, late_s, smooth_s, kind):
    """Positions have an error of 4 m, and may begin hours before the ride."""
    ride, log = noisy_ride(profile, seconds)
    match = api.join_track(log, phone_tracks.track(ride, late_s, smooth_s=smooth_s, **kind)).match
    error_s = match.start_utc_s - (phone_tracks.START_UTC_S + late_s)
    assert abs(error_s) < 0.2 and abs(error_s) < 3.5 * match.sigma_s
    assert 0.85 < match.correlation < 1.0
    assert match.common_s == pytest.approx(ride.time[-1], abs=1.0)


@pytest.mark.parametrize(
    ("profile", "differs"), [("street", 0.03), ("hills", 0.03), pytest.param("track", 0.08, marks=LONG)]
)
def test_the_same_road_on_another_day_is_refused(profile, differs):
    """The bends are the same. The speed differs by some per cent, and this difference changes every 20 s."""
    ride, log = noisy_ride(profile)
    knots_s = np.arange(0.0, ride.time[-1] + 40.0, 20.0)
    factor = np.interp(ride.time, knots_s, 1.0 + np.random.default_rng(6).normal(0.0, differs, len(knots_s)))
    track = phone_tracks.track(ride, pace=(np.cumsum(1.0 / factor) / ride.rate_hz, factor))
    with pytest.raises(api.InputError, match=r"at other times|of another ride"):
        api.join_track(log, track)
