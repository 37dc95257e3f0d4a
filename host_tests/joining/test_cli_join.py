"""`kickstand join` reads GPX and FIT and keeps the lines of the ride. The command refuses wrong input in one line."""

import gzip

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.joining import joined
from support import command
from support.recordings import analysis_rides, phone_tracks

pytest.importorskip("fitdecode")


@pytest.fixture(scope="module")
def ride():
    return api.simulate_ride("street", seed=11, seconds=200.0)


@pytest.fixture(scope="module")
def track(ride):
    return phone_tracks.track(ride, before_s=30.0, after_s=20.0)


@pytest.fixture
def log(tmp_path, ride):
    """Write RIDE.csv, the log of a board without GPS. Return its path."""
    made = api.Log.from_readings(ride.readings, ride.rate_hz)
    api.write_log(tmp_path / "RIDE.csv", made)
    return tmp_path / "RIDE.csv"


def placed(path) -> np.ndarray:
    """Return the rows of a log that have a position."""
    table = analysis_rides.table(path)
    return table[np.isfinite(table["lat_deg"])]


def test_each_point_is_in_the_nearest_row(tmp_path, log, ride, track):
    out = tmp_path / "JOINED.csv"
    gpx = phone_tracks.write_gpx(tmp_path / "track.gpx", track, "garmin")
    said = command.works("join", log, gpx, "--out", out).out
    assert "the ride began at 2023-11-14 22:13:20." in said
    assert "s after the track's first point" in said
    assert "match: correlation 0.9" in said
    there = placed(out)
    assert f"written: {out}, {len(there)} positions" in said
    assert len(there) == pytest.approx(ride.time[-1], abs=2)
    assert np.allclose(np.diff(there["t_s"]), 1.0, atol=0.006)
    assert np.allclose(there["utc_s"] - there["t_s"], phone_tracks.START_UTC_S + 0.5, atol=0.2)
    found = api.join_track(log, track).match
    # samples are 5 ms apart, so the nearest is within 2.5 ms
    assert np.all(np.abs(found.ride_s(there["utc_s"]) - there["t_s"]) < 0.0026)
    first = int(np.argmin(np.abs(track.utc_s - there["utc_s"][0])))
    part = slice(first, first + len(there))
    assert np.allclose(there["utc_s"], track.utc_s[part], atol=1e-3)
    assert np.allclose(there["lat_deg"], track.lat_deg[part], atol=1e-7)
    assert np.allclose(there["lon_deg"], track.lon_deg[part], atol=1e-7)
    assert np.allclose(there["speed_mps"], track.speed_mps[part], atol=1e-3)


def test_nearest_row_may_be_before_or_after():
    time_us, at_us = np.arange(0, 50_000, 5000), np.array([-1, 0, 2400, 2600, 12_400, 44_000, 45_000, 45_001])
    rows, points = joined._nearest(time_us, at_us)
    assert rows.tolist() == [0, 1, 2, 9]  # if two points belong to the same row, the later point is kept
    assert points.tolist() == [2, 3, 4, 6]
    gap_us = np.array([0, 1_000_000, 1_005_000])
    assert joined._nearest(gap_us, np.array([100_000, 500_000, 900_000]))[1].tolist() == [0, 2]


def test_lines_of_the_ride_are_unchanged(tmp_path, log, track):
    """Every line of the ride is unchanged, except for the new columns at its end."""
    gpx = phone_tracks.write_gpx(tmp_path / "track.gpx", track)
    packed = tmp_path / "JOINED.csv.gz"
    command.works("join", log, gpx, "--out", packed)
    lines = gzip.decompress(packed.read_bytes()).decode().splitlines()
    given = log.read_text().splitlines()
    assert lines[0] == given[0] + ",speed_mps,lat_deg,lon_deg,utc_s"
    assert [line.rsplit(",", 4)[0] for line in lines] == given
    empty = sum(line.endswith(",,,,") for line in lines)
    assert empty == np.count_nonzero(np.isnan(api.read_log(packed).lat_deg)) > 30_000


def test_own_speed_of_the_log_is_kept(tmp_path, ride, track):
    made = api.Log.from_readings(ride.readings, ride.rate_hz)
    made.speed_mps[::200] = np.round(ride.truth["speed_mps"][::200], 3)
    api.write_log(tmp_path / "RIDE.csv", made)
    gpx = phone_tracks.write_gpx(tmp_path / "track.gpx", track)
    said = command.works("join", tmp_path / "RIDE.csv", gpx, "--out", tmp_path / "JOINED.csv").out
    assert "the log's own speed is kept" in said
    written = api.read_log(tmp_path / "JOINED.csv")
    assert np.array_equal(written.speed_mps, made.speed_mps, equal_nan=True)
    assert np.count_nonzero(np.isfinite(written.lat_deg)) > 150


def test_columns_without_values_are_replaced(tmp_path, log, track):
    """The log is like a log from `kickstand import`: its first row has a UTC time, and its speed column is empty."""
    head, *rows = log.read_text().splitlines()
    rows = [f"{rows[0]},,1.5", *[row + ",," for row in rows[1:]]]
    log.write_text("\n".join([head + ",speed_mps,utc_s", *rows]) + "\n")
    command.works("join", log, phone_tracks.write_gpx(tmp_path / "t.gpx", track), "--out", tmp_path / "JOINED.csv")
    first = (tmp_path / "JOINED.csv").read_text().splitlines()[:2]
    assert first[0] == head + ",speed_mps,lat_deg,lon_deg,utc_s"
    assert first[1].endswith(",,,,")


@pytest.mark.parametrize("kind", ["1.0", "garmin", "fit", ""])
def test_tracks_are_read_with_their_speed(tmp_path, track, kind):
    if kind == "fit":
        read, exact = api.read_track(phone_tracks.write_fit(tmp_path / "track.FIT", track)), 0
    else:
        read, exact = api.read_track(phone_tracks.write_gpx(tmp_path / "track.gpx", track, kind)), 1
    assert np.allclose(read.utc_s, track.utc_s if exact else np.floor(track.utc_s), atol=1e-3)
    assert np.allclose(read.lat_deg, track.lat_deg, atol=1e-7)
    assert np.allclose(read.lon_deg, track.lon_deg, atol=1e-7)
    if kind:
        assert np.allclose(read.speed_mps, track.speed_mps, atol=1e-3)
    else:
        assert np.all(np.isnan(read.speed_mps))
        known = np.isfinite(read.speeds_mps())
        assert np.median(np.abs(read.speeds_mps() - track.speed_mps)[known]) < 1.0
        assert 0.5 < np.mean(known) < 0.95  # the speed is unknown at a standstill


def test_track_of_another_ride_is_refused(tmp_path, log, track):
    short = api.Track(*(values[:20] for values in track.columns().values()), name="short")
    other = phone_tracks.track(api.simulate_ride("hills", seed=2, seconds=200.0))
    for name, words, make in (
        ("other.gpx", "at no time does the ride turn like the track", lambda p: phone_tracks.write_gpx(p, other)),
        ("route.gpx", "not a planned route", lambda p: p.write_text('<gpx version="1.1" creator="x"></gpx>')),
        ("text.gpx", "is not a GPX file", lambda p: p.write_text("lat,lon\n")),
        ("text.fit", "is not a FIT file, or it is damaged", lambda p: p.write_text("lat,lon\n" * 99)),
        ("track.kml", "ends in .gpx or .fit", lambda p: p.write_text("")),
        ("no.gpx", "there is no such file", lambda p: None),
        ("short.gpx", "has 20 points", lambda p: phone_tracks.write_gpx(p, short)),
    ):
        make(tmp_path / name)
        command.refused(tmp_path, "join", log, tmp_path / name, "--out", tmp_path / "JOINED.csv", words=words)
    half = phone_tracks.write_fit(tmp_path / "half.fit", track)
    half.write_bytes(half.read_bytes()[:-3000])
    command.refused(tmp_path, "join", log, half, "--out", tmp_path / "JOINED.csv", words="damaged")


def test_ride_with_positions_or_unsafe_output_is_refused(tmp_path, log, track):
    gpx = phone_tracks.write_gpx(tmp_path / "track.gpx", track)
    command.refused(tmp_path, "join", log, gpx, "--out", log, words="is also an input")
    command.refused(tmp_path, "join", log, gpx, "--out", gpx, words="is also an input")
    command.works("join", log, gpx, "--out", tmp_path / "JOINED.csv")
    again = "join", tmp_path / "JOINED.csv", gpx, "--out", tmp_path / "AGAIN.csv"
    command.refused(tmp_path, *again, words="has positions already")
