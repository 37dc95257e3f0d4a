"""`kickstand join` keeps the lines of the ride, and puts each point of the track into the nearest row."""

import gzip

import numpy as np
import pytest
from joining.known_roads import BEGIN_S, another_device, points, road
from kickstand_tools import api
from kickstand_tools.joining.joined import Joined, Match
from support import command
from support.recordings import phone_tracks


@pytest.fixture(scope="module")
def ride():
    """A log of 50 samples per second, which starts 5.5 s later than the track, and whose clock is slow by 100 ppm. The
    track has one point per second."""
    log, track = road(300.0, hz=50)
    return another_device(log, from_s=5.5, drift=100e-6), points(track, slice(None, None, 10))


@pytest.fixture
def files(tmp_path, ride):
    api.write_log(tmp_path / "RIDE.csv", ride[0])
    return tmp_path / "RIDE.csv", phone_tracks.write_gpx(tmp_path / "track.gpx", ride[1], "garmin")


def test_each_point_is_in_the_nearest_row(tmp_path, ride, files):
    """The command's output, and the columns that it adds."""
    out = tmp_path / "JOINED.csv"
    lines = command.works("join", *files, "--out", out).out
    joined = api.read_log(out)
    row = np.flatnonzero(np.isfinite(joined.lat_deg))
    for words in ("the ride began at 2023-11-14 22:13:2", "match: correlation 1.0", f"written: {out}, {len(row)} pos"):
        assert words in lines
    assert len(row) == 294
    with out.open() as file:
        table = np.genfromtxt(file, delimiter=",", names=True)[row]
    assert table["t_s"] == pytest.approx((table["utc_s"] - BEGIN_S - 5.5) * (1.0 - 100e-6), abs=0.06)
    _, track = ride
    part = np.searchsorted(track.utc_s, table["utc_s"] - 0.5)
    for name, error in (("utc_s", 1e-3), ("lat_deg", 1e-7), ("lon_deg", 1e-7), ("speed_mps", 1e-3)):
        assert table[name] == pytest.approx(track.columns()[name][part], abs=error)
    match = api.join_track(ride[0], track).match
    assert np.abs(match.ride_s(table["utc_s"]) - table["t_s"]).max() <= 0.0101  # samples are 20 ms apart


def test_lines_of_the_ride_are_unchanged(tmp_path, files):
    """Every line of the ride is unchanged, except for the new columns at its end."""
    command.works("join", *files, "--out", tmp_path / "JOINED.csv.gz")
    lines = gzip.decompress((tmp_path / "JOINED.csv.gz").read_bytes()).decode().splitlines()
    original = files[0].read_text().splitlines()
    assert lines[0] == original[0] + ",speed_mps,lat_deg,lon_deg,utc_s"
    assert [line.rsplit(",", 4)[0] for line in lines] == original
    assert sum(line.endswith(",,,,") for line in lines) == len(lines) - 1 - 294


def test_own_speed_of_the_log_is_kept(tmp_path, ride, files):
    log = another_device(ride[0])
    log.speed_mps[::50] = np.round(15.0 + np.arange(295) / 300.0, 3)
    api.write_log(files[0], log)
    assert "the log's own speed is kept" in command.works("join", *files, "--out", tmp_path / "JOINED.csv").out
    joined = api.read_log(tmp_path / "JOINED.csv")
    assert joined.speed_mps == pytest.approx(log.speed_mps, nan_ok=True)
    assert np.count_nonzero(np.isfinite(joined.lat_deg)) == 294


def test_quoted_columns_stay_and_empty_ones_are_replaced(tmp_path, files):
    """As after `kickstand import`, the first row has a UTC time, and the speed column is empty."""
    head, *rows = files[0].read_text().splitlines()
    rows = [f'{row},"a, ""b""",,{1.5 if k == 0 else ""}' for k, row in enumerate(rows)]
    files[0].write_text("\n".join([head + ",note,speed_mps,utc_s", *rows]) + "\n")
    command.works("join", *files, "--out", tmp_path / "JOINED.csv")
    names, first, *_ = (tmp_path / "JOINED.csv").read_text().splitlines()
    assert names == head + ",note,speed_mps,lat_deg,lon_deg,utc_s"
    assert '"b"' in first and first.startswith(rows[0].partition(',"')[0])


def test_points_outside_the_log_or_in_a_gap_are_left_out(tmp_path):
    """A point belongs to the nearest row within half a second. Of two points in a row, the later is kept."""
    log = api.Log(np.array([0.0, 0.01, 0.02, 2.0, 2.01]), np.tile([0.0, 1.0, 0.0], (5, 1)), np.zeros((5, 3)))
    ride_s = np.array([-0.1, 0.0, 0.002, 0.013, 1.0, 1.9, 2.01, 2.02])
    track = api.Track(100.0 + ride_s, 40.0 + np.arange(8.0), np.full(8, 11.0), np.full(8, 9.0), "track")
    joined = Joined(log, track, Match(100.0, 0.0, 0.1, 0.9, 2.0), own_speed=False, notices=[])
    assert api.write_joined(tmp_path / "J.csv", joined) == 4
    lat_deg = api.read_log(tmp_path / "J.csv").lat_deg
    assert lat_deg == pytest.approx(np.array([42.0, 43.0, np.nan, 45.0, 46.0]), nan_ok=True)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("route.gpx", '<gpx version="1.1" creator="x"></gpx>', "not a planned route"),
        ("text.gpx", "lat,lon\n", "is not a GPX file"),
        ("text.fit", "lat,lon\n" * 99, "is not a FIT file, or it is damaged"),
        ("track.kml", "", "ends in .gpx or .fit"),
        ("no.gpx", None, "there is no such file"),
    ],
)
def test_a_file_that_is_no_track_is_refused(tmp_path, files, name, content, words):
    if content is not None:
        (tmp_path / name).write_text(content)
    command.refused(tmp_path, "join", files[0], tmp_path / name, "--out", tmp_path / "JOINED.csv", words=words)


def test_a_cut_track_is_refused(tmp_path, ride, files):
    half = phone_tracks.write_fit(tmp_path / "half.fit", ride[1])
    half.write_bytes(half.read_bytes()[:-3000])
    command.refused(tmp_path, "join", files[0], half, "--out", tmp_path / "JOINED.csv", words="damaged")
