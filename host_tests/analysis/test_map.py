"""The map on a ride's page is in metres, with north up. Leans to the left and to the right have different colours. The
map and the charts show the same moment."""

import functools
import re
from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis import interactive, page
from kickstand_tools.analysis.overview import Peak, overview
from kickstand_tools.signals import EARTH_M
from small_rides import ALIGNED, overview_of, samples
from support.recordings import app_exports


@functools.cache
def ride(lat_deg=52.5, lon_deg=13.4, gap=False):
    """Simulate a ride of half a minute that starts at this place, with a position every half second. gap: True to leave
    out the positions from 10 to 16 s."""
    motion = app_exports.riding().every(4)
    placed = np.arange(len(motion.t_s)) % 25 == 3
    if gap:
        placed &= (motion.t_s < 10.0) | (motion.t_s > 16.0)
    narrow = np.cos(np.radians(52.5)) / np.cos(np.radians(lat_deg))
    lat = np.where(placed, motion.lat_deg - 52.5 + lat_deg, np.nan)
    lon = np.where(placed, ((motion.lon_deg - 13.4) * narrow + lon_deg + 180.0) % 360.0 - 180.0, np.nan)
    speed = np.where(placed, motion.speed_mps, np.nan)
    log = api.Log(motion.t_s, motion.force_g, motion.rates_dps, speed, lat_deg=lat, lon_deg=lon, name="RIDE.csv")
    return overview(api.open_ride(log, ALIGNED))


def points_of(ride_overview):
    points = interactive.map_points(ride_overview)
    assert points is not None
    return points


@pytest.mark.parametrize("place", [(-33.9, 151.2), (47.6, 179.999), (-0.001, 0.001)])
def test_a_metre_of_the_map_is_right_in_both_directions(place):
    """At every latitude, on both sides of the equator and across the meridian of 180 degrees."""
    points, motion = points_of(ride(*place)), app_exports.riding()
    north = (motion.lat_deg - motion.lat_deg[0]) * np.radians(EARTH_M)
    east = (motion.lon_deg - motion.lon_deg[0]) * np.radians(EARTH_M) * np.cos(np.radians(52.5))
    for metres, true in ((points.north_m, north), (points.east_m, east)):
        expected = np.interp(points.t_s, motion.t_s, true)
        assert np.max(np.abs(metres - metres[0] - (expected - expected[0]))) < 0.5
    steps = np.hypot(np.diff(points.east_m), np.diff(points.north_m))
    assert np.min(steps) > 0.3  # the points of a standstill are joined into one
    assert np.sum(steps) == pytest.approx(np.sum(np.hypot(np.diff(east), np.diff(north))), rel=0.01)


def test_the_line_of_the_map_is_broken_in_a_gap():
    points = points_of(ride(gap=True))
    (gap,) = np.flatnonzero(np.isnan(points.east_m))
    assert points.t_s[gap - 1] < 10.0 < 16.0 < points.t_s[gap + 1]
    line, dots = interactive.map_figure(points, ride(gap=True))["data"]
    assert [k for k, x in enumerate(line["x"]) if x is None] == [gap] and np.all(np.isfinite(dots["x"]))


def test_the_map_has_left_blue_right_orange_and_north_up():
    figure = interactive.map_figure(points_of(ride()), ride())
    dots, layout = figure["data"][1], figure["layout"]
    assert dots["marker"]["cmin"] == -dots["marker"]["cmax"] < 0.0
    for position, colour in dots["marker"]["colorscale"]:
        assert np.sign(int(colour[5:7], 16) - int(colour[1:3], 16)) == np.sign(0.5 - position)
    lean = np.asarray(dots["marker"]["color"])
    assert lean.min() < -20.0 and lean.max() > 30.0
    assert layout["yaxis"]["scaleanchor"] == "x" and "autorange" not in layout["yaxis"]  # y grows upwards
    assert "N" in layout["annotations"][1]["text"]
    steeper = replace(ride(), summary=replace(ride().summary, right_deg=Peak(43.6, 1.0)))
    bar = interactive.map_figure(points_of(ride()), steeper)["data"][1]["marker"]["colorbar"]
    assert bar["ticktext"] == ["44", "0", "44"]


def track(n=301, step_s=1.0, vehicle="motorcycle", **columns):
    """Return a ride whose positions go north by 1.1 m per sample."""
    positions = {"lat_deg": 10.0 + np.arange(n) * 1e-5, "lon_deg": 8.0} | columns
    return overview_of(samples(n, step_s=step_s, **positions), vehicle=vehicle)


@pytest.mark.parametrize(("vehicle", "lean"), [("motorcycle", True), ("car", False)])
def test_the_points_of_a_map_have_time_lean_and_speed(vehicle, lean):
    ride_overview = track(lean_deg=np.arange(301) / 10.0, speed_mps=10.0, vehicle=vehicle)
    points = points_of(ride_overview)
    line, dots = interactive.map_figure(points, ride_overview)["data"]
    assert line["customdata"][0] == [0.0, 0.0, 36.0] and line["customdata"][-1][0] == pytest.approx(300.0, abs=1.0)
    assert dots["customdata"] == [row[0] for row in line["customdata"]] and len(dots["x"]) == len(line["x"])
    assert dots["customdata"] == pytest.approx(points.t_s, abs=0.051)
    if lean:
        assert dots["marker"]["color"][-1] == pytest.approx(30.0, abs=0.1)
        assert dots["marker"]["colorbar"]["ticktext"] == ["30", "0", "30"]
    else:
        assert isinstance(dots["marker"]["color"], str) and "colorbar" not in dots["marker"]


def test_a_lean_that_is_not_trusted_has_no_dot_on_the_map():
    ride_overview = track(sure=np.where(np.arange(301) < 150, 0.0, 1.0))
    line, dots = interactive.map_figure(points_of(ride_overview), ride_overview)["data"]
    assert line["customdata"][0][1] is None and line["customdata"][-1][1] == 0.0
    assert min(dots["customdata"]) == pytest.approx(150.0, abs=1.0) and len(dots["x"]) < len(line["x"])


def test_a_page_has_a_map_if_there_is_a_track():
    """It loads nothing unless tiles are requested. One position is not a track."""
    plain, streets = page.page(track(), "", ""), page.page(track(), "", "", tiles=True)
    assert 'id="map"' in plain and '"tiles": null' in plain and page.TILES_HOST not in plain
    assert not re.search(r"<(script|link|img)[^>]*(src|href)=", plain)
    assert page.TILES_URL in streets and "openstreetmap.org/copyright" in streets.rpartition('<p id="tiles">')[2]
    assert f"img-src data: blob: {page.TILES_HOST};" in streets and '"hovermode": "x"' in plain
    single = np.where(np.arange(301) == 7, 10.0, np.nan)
    for bare in (track(lat_deg=single, lon_deg=single), track(lat_deg=np.nan)):
        html = page.page(bare, "", "")
        assert 'id="chart"' in html and 'id="map"' not in html and '"hovermode": "x"' not in html
