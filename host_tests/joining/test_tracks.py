"""Tracks: their courses and speeds by hand, their files, and the points and files that are refused."""

import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from joining.known_roads import points
from kickstand_tools import api
from kickstand_tools.joining.track import course
from support.recordings import broken_logs, phone_tracks

METRE = 1.0 / 111_194.9  # in degrees of latitude, at the equator also of longitude


def track_of(utc_s, east_m, north_m: Any = 0.0, speed_mps=np.nan):
    utc_s, east, north, speed = np.broadcast_arrays(np.asarray(utc_s, float), east_m, north_m, speed_mps)
    return api.Track(utc_s.copy(), north * METRE, east * METRE, speed.astype(float), "t")


def test_a_course_turns_to_the_left():
    """The track goes 20 m east, 20 m north, 20 m west, 3 m west (too slow) and 400 m west (a jump)."""
    steps = course(track_of([0, 1, 2, 3, 5, 6], [0, 20, 20, 0, -3, -403], [0, 0, 20, 20, 20, 20]))
    assert steps.speed_mps == pytest.approx([20.0, 20.0, 20.0, 1.5, 400.0], rel=1e-3)
    assert steps.good.tolist() == [True, True, True, False, False]
    assert steps.turn_deg == pytest.approx([0.0, 90.0, 90.0, 0.0, 0.0], abs=0.01)
    # 1 m to the side over 20 m, and 4 degrees of other errors
    assert steps.sigma_deg[0] == pytest.approx(np.hypot(np.degrees(1.0 / 20.0), 4.0), rel=1e-4)


@pytest.mark.parametrize(
    ("step_s", "step_m", "good"),
    [(1.0, 2.4, False), (1.0, 2.6, True), (1.0, 99.0, True), (1.0, 101.0, False), (6.0, 60.0, True),
     (6.1, 60.0, False)],
)  # fmt: skip
def test_a_step_is_good_between_a_walk_and_a_jump(step_s, step_m, good):
    assert course(track_of([0.0, step_s], [0.0, step_m])).good.tolist() == [good]


def test_speeds_without_their_own_are_means_over_four_steps():
    track = track_of(np.arange(11.0), np.cumsum([0.0, 10, 10, 20, 20, 20, 20, 1, 1, 1, 1]))
    speeds = track.speeds_mps()
    assert np.isnan(speeds[[0, 1, 8, 9, 10]]).all()  # unknown at both ends, and below 2.5 m/s
    assert speeds[2:8] == pytest.approx([15.0, 17.5, 20.0, 15.25, 10.5, 5.75], rel=1e-3)
    assert replace(track, speed_mps=np.where(np.arange(11) == 3, 5.0, np.nan)).speeds_mps()[3] == 5.0
    assert np.isnan(points(track, slice(4)).speeds_mps()).all()


def test_a_track_of_ten_points_a_second_is_thinned_to_one():
    quick = track_of(np.arange(35) / 10.0 + 100.0, np.arange(35.0))
    assert quick.once_a_second().utc_s.tolist() == [100.0, 101.0, 102.0, 103.0]
    for step_s, unchanged in ((0.69, False), (0.71, True)):
        track = track_of(np.arange(20) * step_s, 0.0)
        assert (track.once_a_second() is track) is unchanged


def write_points(path, texts):
    path.write_text(f'<gpx version="1.1" creator="x"><trk><trkseg>{"".join(texts)}</trkseg></trk></gpx>')
    return path


def point(k, lat=48.0, lon=11.0, speed="5", zone="Z"):
    extra = f"<extensions><a><other>1</other><Speed>{speed}</Speed></a></extensions>"
    time = f"<time>1970-01-01T00:{k // 60:02}:{k % 60:02}{zone}</time>"
    return f'<trkpt lat="{lat}" lon="{lon}">{time}{extra}</trkpt>'


def test_bad_points_and_speeds_of_a_track_are_left_out(tmp_path):
    good = [point(k) for k in range(10, 40)]
    speeds = [point(k, speed=text) for k, text in enumerate(["0", "100", "-1", "101", "fast", ""], 40)]
    bad = [point(50, lat=90.5), point(51, lon=-180.5), point(10, lat=1.0)]  # the first of two equal times is kept
    edge = [point(54, lat=90), point(55, lon=-180), point(56, zone="")]  # a time without a zone is UTC
    progress = []
    path = write_points(tmp_path / "a.GPX", good + speeds + bad + edge)
    track = api.read_track(path, lambda *done: progress.append(done))
    assert track.utc_s.tolist() == [*range(10, 46), 54, 55, 56] and track.lat_deg[0] == 48.0
    assert track.speed_mps[29:36] == pytest.approx([5.0, 0.0, 100.0, *[np.nan] * 4], nan_ok=True)
    assert progress[-1] == (path.stat().st_size, path.stat().st_size)


def test_a_track_has_30_points_and_at_most_50_mb(tmp_path):
    path = write_points(tmp_path / "a.gpx", [point(k) for k in range(30)])
    assert len(api.read_track(path).utc_s) == 30
    write_points(path, [point(k) for k in range(29)])
    with pytest.raises(api.InputError, match="has 29 points with a time: at least 30"):
        api.read_track(path)
    for size, words in ((50_000_000, "is not a FIT file"), (50_000_001, "too large for a track: over 50 MB")):
        with (tmp_path / "c.fit").open("wb") as file:
            file.truncate(size)
        with pytest.raises(api.InputError, match=words):
            api.read_track(tmp_path / "c.fit")


TRACK = api.Track(
    1.78e9 + np.arange(60.0), 48.1 + 1e-4 * np.arange(60.0), 11.5 + 1e-4 * np.arange(60.0), np.full(60, 12.3), "t"
)


@pytest.mark.parametrize("kind", ["1.0", "garmin", "fit", ""])
def test_tracks_are_read_with_their_speed(tmp_path, kind):
    if kind == "fit":
        path = phone_tracks.write_fit(tmp_path / "track.FIT", TRACK)
    else:
        path = phone_tracks.write_gpx(tmp_path / "track.gpx", TRACK, kind)
    track = api.read_track(path)
    for name in ("utc_s", "lat_deg", "lon_deg"):
        assert getattr(track, name) == pytest.approx(getattr(TRACK, name), abs=1e-7)
    speed = pytest.approx(TRACK.speed_mps, abs=1e-3) if kind else pytest.approx(np.full(60, np.nan), nan_ok=True)
    assert track.speed_mps == speed


@pytest.mark.parametrize("kind", ["gpx", "fit"])
def test_a_damaged_track_is_read_or_refused_in_one_line(tmp_path, kind):
    path = tmp_path / f"t.{kind}"
    (phone_tracks.write_gpx if kind == "gpx" else phone_tracks.write_fit)(path, TRACK)
    content, ways = path.read_bytes(), broken_logs.WAYS
    if kind == "fit":
        ways = [broken_logs.flip_bytes, broken_logs.cut_end, broken_logs.cut_a_piece, broken_logs.put_nul_bytes]
    results = set()
    for number in range(60):
        path.write_bytes(ways[number % len(ways)](content, random.Random(number)))
        try:
            api.read_track(path)
            results.add("read")
        except api.InputError as error:
            results.add("refused")
            assert "\n" not in str(error) and len(str(error)) < 400
    assert results == {"read", "refused"}
