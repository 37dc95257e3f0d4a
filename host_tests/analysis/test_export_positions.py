"""Exported positions are read back by the rules of the programs that use the files."""

import functools
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis.channels import downsampled
from kickstand_tools.analysis.export import export_gpx
from kickstand_tools.analysis.track import LogTrack
from kickstand_tools.logs.csv_lines import write_log
from support import command
from support.recordings import app_exports

gpxpy = pytest.importorskip("gpxpy")
pandas = pytest.importorskip("pandas")
START_S = app_exports.START_UTC_S + 0.004  # not a whole second, to test that exports keep milliseconds
HZ = 5  # number of positions per second
ALIGNED = api.CalibrationFile(aligned=True)
DEGREE_M = np.radians(app_exports._EARTH_M)


@functools.cache
def log(start_s: float = 0.0) -> api.Log:
    """Return a log of half a minute with a position every 0.2 s and a speed every second. Positions are missing before
    1 s and from 10 to 20 s. start_s: the start time by the log's own clock."""
    ride = app_exports.riding().every(2)  # 100 samples per second
    row = np.arange(len(ride.t_s))
    known = (row % (100 // HZ) == 7) & (ride.t_s > 1.0) & ~((ride.t_s > 10.0) & (ride.t_s < 20.0))
    track = [np.where(known, v, np.nan) for v in (ride.lat_deg, ride.lon_deg, START_S + ride.t_s)]
    speed = np.where(row % 100 == 7, ride.speed_mps, np.nan)
    names = ("lat_deg", "lon_deg", "utc_s")
    return api.Log(start_s + ride.t_s, ride.force_g, ride.rates_dps, speed, **dict(zip(names, track)))


def exported(form: str, tmp_path: Path, ride: api.Log | api.Stretch | None = None) -> Path:
    out = tmp_path / f"out.{form}"
    api.export(api.open_ride(log() if ride is None else ride, ALIGNED), form, out)
    return out


def away_m(lat, lon, t_s) -> np.ndarray:
    """Return the distance in metres between these places and the ride's true places at these times."""
    ride = app_exports.riding()
    north = (np.asarray(lat) - np.interp(t_s, ride.t_s, ride.lat_deg)) * DEGREE_M
    east = (np.asarray(lon) - np.interp(t_s, ride.t_s, ride.lon_deg)) * DEGREE_M * np.cos(np.radians(52.5))
    return np.hypot(north, east)


def values(points, name: str) -> np.ndarray:
    """Return the number with this element name from each track point's extensions, or NaN if it is missing."""
    found = []
    for point in points:
        elements = [one for part in point.extensions for one in part.iter() if one.tag.endswith("}" + name)]
        found.append(float(elements[0].text) if elements else np.nan)
    return np.array(found)


def test_gpx_has_all_positions_with_time_speed_and_lean(tmp_path):
    gpx = gpxpy.parse(exported("gpx", tmp_path).read_text())
    (track,) = gpx.tracks
    # The track has no line across the gap
    assert [len(segment.points) > 20 for segment in track.segments] == [True, True]
    points = [point for segment in track.segments for point in segment.points]
    given = log()
    there = np.isfinite(given.lat_deg)
    assert len(points) == np.count_nonzero(there)
    t_s = np.array([point.time.timestamp() for point in points]) - START_S
    assert t_s == pytest.approx(given.t_s[there], abs=1e-3)
    assert np.max(away_m([p.latitude for p in points], [p.longitude for p in points], t_s)) < 0.02
    ride = app_exports.riding()
    assert values(points, "speed") == pytest.approx(np.interp(t_s, ride.t_s, ride.speed_mps), abs=1.0)
    lean = api.replay(given, ALIGNED)
    assert values(points, "lean_deg") == pytest.approx(np.interp(t_s, lean.t_s, lean.lean_deg), abs=0.06)
    assert gpx.nsmap["gpxtpx"] == export_gpx.GARMIN
    assert gpx.version == "1.1"


def test_uncertain_lean_is_left_out_of_a_track(tmp_path):
    """The log begins in a turn, so the lean is unknown for some seconds. The positions are kept."""
    later = log().part(log().t_s > 7.5)
    gpx = gpxpy.parse(exported("gpx", tmp_path, later).read_text())
    points = [point for segment in gpx.tracks[0].segments for point in segment.points]
    channels = api.vehicle_channels(later, ALIGNED)
    sure = channels.trusted[np.isfinite(channels.lat_deg)]
    assert 0 < np.count_nonzero(~sure) < len(sure)
    assert np.array_equal(np.isfinite(values(points, "lean_deg")), sure)


def vbo_rows(path: Path) -> dict[str, np.ndarray]:
    lines = path.read_text().split("\n")
    names = lines[lines.index("[column names]") + 1].split()
    table = np.array([[float(cell) for cell in line.split()] for line in lines[lines.index("[data]") + 1 : -1]])
    return dict(zip(names, table.T))


def test_vbo_interpolates_positions_for_every_row(tmp_path):
    rows = vbo_rows(exported("vbo", tmp_path))
    clock = rows["time"]
    midnight = datetime.fromtimestamp(START_S, UTC).replace(hour=0, minute=0, second=0, microsecond=0).timestamp()
    t_s = clock // 10000 * 3600 + clock // 100 % 100 * 60 + clock % 100 + midnight - START_S
    placed = rows["sats"] == 4
    assert set(rows["sats"]) == {0.0, 4.0}
    assert t_s[0] == pytest.approx(0.0, abs=0.006)
    known_s = log().t_s[np.isfinite(log().lat_deg)]
    ends_s = [known_s[0], np.max(known_s[known_s < 15.0]), np.min(known_s[known_s > 15.0]), known_s[-1]]
    within = [(t_s > begin - 0.005) & (t_s < end + 0.005) for begin, end in zip(ends_s[::2], ends_s[1::2])]
    assert np.array_equal(placed, within[0] | within[1])
    # the distance in metres is not 0, because a row's time is rounded to 0.01 s
    assert np.max(away_m(rows["lat"] / 60, -rows["long"] / 60, t_s)[placed]) < 0.2
    assert np.all(rows["lat"][~placed] == 0.0)
    ride = app_exports.riding()
    east, north = np.gradient(ride.lon_deg) * np.cos(np.radians(52.5)), np.gradient(ride.lat_deg)
    course = np.interp(t_s, ride.t_s, np.unwrap(np.arctan2(east, north)))
    moving = placed & (np.interp(t_s, ride.t_s, ride.speed_mps) > 3.0)
    wrong = (rows["heading"] - np.degrees(course) + 180.0) % 360.0 - 180.0
    assert np.max(np.abs(wrong[moving])) < 5.0


@pytest.mark.parametrize("form", ["gpx", "racechrono", "vbo"])
def test_time_of_the_satellites_is_preferred(tmp_path, form):
    """The satellites' time is used if the log's own clock was wrong. The satellites' time is also used for a stretch
    that begins in a second without a position."""
    for ride in (log(1.2e9), api.Stretch(log(), 12.5, 25.0)):
        out = exported(form, tmp_path, ride)
        if form == "gpx":
            point = gpxpy.parse(out.read_text()).tracks[0].segments[-1].points[-1]
            known = np.isfinite(log().utc_s) & (log().t_s <= (40.0 if isinstance(ride, api.Log) else 25.0))
            assert point.time.timestamp() == pytest.approx(np.max(log().utc_s[known]), abs=1e-3)
            continue
        clock = datetime.fromtimestamp(START_S + (0.0 if isinstance(ride, api.Log) else 12.5), UTC)
        assert f"{clock:%d/%m/%Y}" in out.read_text()
        if form == "vbo":
            assert vbo_rows(out)["time"][0] == pytest.approx(float(f"{clock:%H%M%S.%f}"), abs=0.02)


def test_track_without_satellite_time_uses_the_logs_time(tmp_path):
    given = log(1.2e9)
    bare = replace(given, utc_s=np.full(len(given.t_s), np.nan))
    point = gpxpy.parse(exported("gpx", tmp_path, bare).read_text()).tracks[0].segments[-1].points[-1]
    last_s = given.t_s[np.isfinite(given.lat_deg)][-1]
    assert point.time.timestamp() == pytest.approx(1.2e9 + last_s, abs=2e-3)


def test_a_track_across_180_degrees_goes_the_short_way():
    track = LogTrack(np.arange(3.0), np.full(3, -10.0), np.array([179.9999, -179.9999, -179.9997]))
    lat, lon = track.at(np.array([0.25, 0.75, 1.5, 2.1, -0.1]))
    assert lon == pytest.approx([179.99995, -179.99995, -179.9998, np.nan, np.nan], abs=1e-7, nan_ok=True)
    assert lat[:3] == pytest.approx(-10.0)


def test_last_position_of_a_stretch_is_kept():
    """The positions are on both sides of the meridian of 180 degrees. The mean longitude of the positions would be on
    the other side of the earth, so the last position is used."""
    few = log().part(log().t_s < 0.1)
    few.lon_deg[:] = np.nan
    few.lat_deg[:], few.lon_deg[3:6], few.utc_s[2] = -10.0, (179.9999, -179.9999, -179.9998), START_S
    (one,) = downsampled(api.open_ride(few, ALIGNED).blocks(), 1.0)
    assert (one.lat_deg[0], one.lon_deg[0], one.utc_s[0]) == (-10.0, -179.9998, START_S)


def test_single_position_is_interpolated_only_at_its_time():
    lat, lon = LogTrack(np.array([5.0]), np.array([1.0]), np.array([2.0])).at(np.array([4.9, 5.0, 5.1]))
    assert lat == pytest.approx([np.nan, 1.0, np.nan], nan_ok=True)
    assert lon == pytest.approx([np.nan, 2.0, np.nan], nan_ok=True)
    assert np.all(np.isnan(LogTrack(np.zeros(0), np.zeros(0), np.zeros(0)).at(np.array([1.0]))))


def test_command_writes_a_track_or_gives_the_reason(tmp_path, monkeypatch):
    ride, calibration = tmp_path / "ride.csv", tmp_path / "ride.cal.json"
    write_log(ride, log())
    api.write_calibration(calibration, ALIGNED)
    out = tmp_path / "ride.gpx"
    result = command.works("export", ride, "--to", "gpx", "--out", out)
    assert f"written: {out}, " in result.out
    assert len(gpxpy.parse(out.read_text()).tracks[0].segments) == 2
    out.unlink()
    bare = tmp_path / "bare.csv"
    write_log(bare, api.Log(log().t_s, log().accel_g, log().gyro_dps))
    arguments = ("export", bare, "--calibration", calibration, "--to", "gpx", "--out", out)
    command.refused(tmp_path, *arguments, words="has no positions (lat_deg, lon_deg), so there is no track to write")
    monkeypatch.setattr("kickstand_tools.analysis.export.export.find_spec", lambda name: None)
    command.refused(tmp_path, *arguments, words="GPX needs gpxpy")
