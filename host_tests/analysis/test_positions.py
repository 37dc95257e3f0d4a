"""Exported positions are read back by the rules of the programs that use the files."""

import functools
from datetime import UTC, datetime

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis.export import GARMIN
from kickstand_tools.logs.reader import write_log
from kickstand_tools.signals import EARTH_M
from small_rides import ALIGNED
from support import command
from support.recordings import app_exports

gpxpy = pytest.importorskip("gpxpy")
START_S = app_exports.START_UTC_S + 0.004  # not a whole second, to test that exports keep milliseconds
HZ = 5  # number of positions per second


@functools.cache
def log(start_s=0.0):
    """Return a log of half a minute with a position every 0.2 s and a speed every second. Positions are missing before
    1 s and from 10 to 20 s. start_s: the start time by the log's own clock."""
    ride = app_exports.riding().every(2)  # 100 samples per second
    row = np.arange(len(ride.t_s))
    placed = (row % (100 // HZ) == 7) & (ride.t_s > 1.0) & ~((ride.t_s > 10.0) & (ride.t_s < 20.0))
    track = [np.where(placed, v, np.nan) for v in (ride.lat_deg, ride.lon_deg, START_S + ride.t_s)]
    speed = np.where(row % 100 == 7, ride.speed_mps, np.nan)
    columns = dict(zip(("lat_deg", "lon_deg", "utc_s"), track))
    return api.Log(start_s + ride.t_s, ride.force_g, ride.rates_dps, speed, **columns)


def exported(form, tmp_path, ride=None):
    out = tmp_path / f"out.{form}"
    api.export(api.open_ride(ride or log(), ALIGNED), form, out)
    return out


def points_of(path):
    return [p for segment in gpxpy.parse(path.read_text()).tracks[0].segments for p in segment.points]


def away_m(lat, lon, t_s):
    """Return the distance in metres between these places and the ride's true places at these times."""
    ride = app_exports.riding()
    north = (np.asarray(lat) - np.interp(t_s, ride.t_s, ride.lat_deg)) * np.radians(EARTH_M)
    east = (np.asarray(lon) - np.interp(t_s, ride.t_s, ride.lon_deg)) * np.radians(EARTH_M) * np.cos(np.radians(52.5))
    return np.hypot(north, east)


def extensions(points, name):
    """Return the number with this element name from each track point's extensions, or NaN."""
    numbers = []
    for point in points:
        elements = [e for part in point.extensions for e in part.iter() if e.tag.endswith("}" + name)]
        numbers.append(float(elements[0].text) if elements else np.nan)
    return np.array(numbers)


def test_gpx_has_all_positions_with_time_speed_and_lean(tmp_path):
    path = exported("gpx", tmp_path)
    gpx, points = gpxpy.parse(path.read_text()), points_of(path)
    assert [len(segment.points) > 20 for segment in gpx.tracks[0].segments] == [True, True]  # no line across the gap
    placed = np.isfinite(log().lat_deg)
    t_s = np.array([point.time.timestamp() for point in points]) - START_S
    assert t_s == pytest.approx(log().t_s[placed], abs=1e-3)
    assert np.max(away_m([p.latitude for p in points], [p.longitude for p in points], t_s)) < 0.02
    ride, lean = app_exports.riding(), api.replay(log(), ALIGNED)
    assert extensions(points, "speed") == pytest.approx(np.interp(t_s, ride.t_s, ride.speed_mps), abs=1.0)
    assert extensions(points, "lean_deg") == pytest.approx(np.interp(t_s, lean.t_s, lean.lean_deg), abs=0.06)
    assert (gpx.nsmap["gpxtpx"], gpx.version) == (GARMIN, "1.1")


def test_uncertain_lean_is_left_out_of_a_track(tmp_path):
    """The log begins in a turn, so the lean is unknown for some seconds. The positions are kept."""
    later = log().part(log().t_s > 7.5)
    channels = api.vehicle_channels(later, ALIGNED)
    sure = channels.trusted[np.isfinite(channels.lat_deg)]
    assert 0 < np.count_nonzero(~sure) < len(sure)
    lean = extensions(points_of(exported("gpx", tmp_path, later)), "lean_deg")
    assert np.array_equal(np.isfinite(lean), sure)


def vbo_rows(path):
    lines = path.read_text().split("\n")
    names = lines[lines.index("[column names]") + 1].split()
    table = np.array([[float(cell) for cell in line.split()] for line in lines[lines.index("[data]") + 1 : -1]])
    return dict(zip(names, table.T))


@pytest.mark.parametrize("form", ["gpx", "racechrono", "vbo"])
@pytest.mark.parametrize(("start_s", "from_s", "to_s"), [(1.2e9, None, None), (0.0, 12.5, 25.0)])
def test_the_time_of_the_satellites_is_preferred(tmp_path, form, start_s, from_s, to_s):
    """Also if the log's own clock was wrong, and for a stretch that begins in a second without a position."""
    ride = log(start_s) if from_s is None else api.Stretch(log(), from_s, to_s)
    out, clock = exported(form, tmp_path, ride), datetime.fromtimestamp(START_S + (from_s or 0.0), UTC)
    if form == "gpx":
        placed = np.isfinite(log().utc_s) & (log().t_s <= (to_s or 40.0))
        assert points_of(out)[-1].time.timestamp() == pytest.approx(np.max(log().utc_s[placed]), abs=1e-3)
    else:
        assert f"{clock:%d/%m/%Y}" in out.read_text()
    if form == "vbo":
        assert vbo_rows(out)["time"][0] == pytest.approx(float(f"{clock:%H%M%S.%f}"), abs=0.02)


def test_the_command_writes_a_track_or_gives_the_reason(tmp_path):
    ride, calibration, out = tmp_path / "ride.csv", tmp_path / "ride.cal.json", tmp_path / "ride.gpx"
    write_log(ride, log())
    api.write_calibration(calibration, ALIGNED)
    assert f"written: {out}, " in command.works("export", ride, "--to", "gpx", "--out", out).out
    assert len(gpxpy.parse(out.read_text()).tracks[0].segments) == 2
    write_log(tmp_path / "bare.csv", api.Log(log().t_s, log().accel_g, log().gyro_dps))
    arguments = ("export", tmp_path / "bare.csv", "--calibration", calibration, "--to", "gpx", "--out", out)
    command.refused(tmp_path, *arguments, words="has no positions (lat_deg, lon_deg), so there is no track to write")
