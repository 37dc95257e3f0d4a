"""The map on a ride's page is in metres, with north up. Leans to the left and to the right have different colours. The
map and the charts show the same moment."""

import functools
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis.overview import Overview, overview
from kickstand_tools.analysis.plot import page, track_map
from kickstand_tools.analysis.summary import Peak
from support.recordings import app_exports

pytest.importorskip("plotly")
EARTH_M = 6_371_000.0
MOTORCYCLE = api.CalibrationFile(aligned=True)


@functools.cache
def seen(lat_deg: float = 52.5, lon_deg: float = 13.4, gap: bool = False, car: bool = False) -> Overview:
    """Simulate a ride of half a minute that starts at this place, with a position every half second. gap: True to leave
    out the positions from 10 to 16 s."""
    ride = app_exports.riding().every(2)
    known = np.arange(len(ride.t_s)) % 50 == 3
    if gap:
        known &= (ride.t_s < 10.0) | (ride.t_s > 16.0)
    narrow = np.cos(np.radians(52.5)) / np.cos(np.radians(lat_deg))
    lat = np.where(known, ride.lat_deg - 52.5 + lat_deg, np.nan)
    lon = np.where(known, ((ride.lon_deg - 13.4) * narrow + lon_deg + 180.0) % 360.0 - 180.0, np.nan)
    speed = np.where(known, ride.speed_mps, np.nan)
    log = api.Log(ride.t_s, ride.force_g, ride.rates_dps, speed, lat_deg=lat, lon_deg=lon, name="RIDE.csv")
    return overview(api.open_ride(log, replace(MOTORCYCLE, vehicle="car") if car else MOTORCYCLE))


def points_of(*place, **kind) -> track_map.MapPoints:
    found = track_map.map_points(seen(*place, **kind))
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("east_m", "north_m", "shape"), [(100.0, 100.0, 1.0), (900.0, 100.0, 2.2), (100.0, 900.0, 0.6), (0.0, 0.0, 1.0)]
)
def test_the_map_has_the_shape_of_its_track_within_limits(east_m, north_m, shape):
    track = replace(points_of(), east_m=np.array([0.0, np.nan, east_m]), north_m=np.array([north_m, np.nan, 0.0]))
    assert track_map.shape(track) == pytest.approx(shape)


@pytest.mark.parametrize("place", [(-33.9, 151.2), (69.6, 18.9), (47.6, 179.999), (-0.001, 0.001)])
def test_metre_of_the_map_is_right_in_both_directions(place):
    """A metre is right at every latitude, on both sides of the equator and across the meridian of 180 degrees."""
    found = points_of(*place)
    ride = app_exports.riding()
    north = (ride.lat_deg - ride.lat_deg[0]) * np.radians(EARTH_M)
    east = (ride.lon_deg - ride.lon_deg[0]) * np.radians(EARTH_M) * np.cos(np.radians(52.5))
    for got, true in ((found.north_m, north), (found.east_m, east)):
        want = np.interp(found.t_s, ride.t_s, true)
        assert np.max(np.abs(got - got[0] - (want - want[0]))) < 0.5
    moved = np.hypot(np.diff(found.east_m), np.diff(found.north_m))
    assert np.sum(moved) == pytest.approx(np.sum(np.hypot(np.diff(east), np.diff(north))), rel=0.01)
    assert np.min(moved) > 0.3  # the points of a standstill are joined into one


def test_map_shows_lean_and_speed_at_each_moment():
    _, dots = track_map.figure(points_of(car=True), seen(car=True))["data"]
    # The track of a car has one colour, because a car has no lean
    assert isinstance(dots["marker"]["color"], str) and len(dots["x"]) > 50
    found, channels = points_of(), seen().course
    lean = np.interp(found.t_s, channels.t_s, channels.lean_deg)
    known = np.isfinite(found.lean_deg)
    assert np.count_nonzero(known) > 0.9 * len(known)
    assert found.lean_deg[known] == pytest.approx(lean[known], abs=0.7)
    ride = app_exports.riding()
    assert found.speed_kmh == pytest.approx(3.6 * np.interp(found.t_s, ride.t_s, ride.speed_mps), abs=4.0)


def test_line_of_the_map_is_broken_in_a_gap():
    found = points_of(gap=True)
    (gap,) = np.flatnonzero(np.isnan(found.east_m))
    assert found.t_s[gap - 1] < 10.0 < 16.0 < found.t_s[gap + 1]
    line, dots = track_map.figure(found, seen(gap=True))["data"]
    assert [k for k, x in enumerate(line["x"]) if x is None] == [gap]
    assert np.all(np.isfinite(dots["x"]))


def test_map_has_left_blue_right_orange_and_north_up():
    made = track_map.figure(points_of(), seen())
    _, dots = made["data"]
    scale = dict(dots["marker"]["colorscale"])
    assert dots["marker"]["cmin"] == -dots["marker"]["cmax"] < 0.0
    steeper = replace(seen(), summary=replace(seen().summary, right_deg=Peak(43.6, 1.0)))  # the title shows 44 degrees
    bar = track_map.figure(points_of(), steeper)["data"][1]["marker"]["colorbar"]
    assert bar["ticktext"] == ["44", "0", "44"]
    for place, colour in scale.items():
        red, blue = int(colour[1:3], 16), int(colour[5:7], 16)
        assert np.sign(blue - red) == np.sign(0.5 - place)
    lean = np.asarray(dots["marker"]["color"])
    assert lean.min() < -20.0 and lean.max() > 30.0
    assert made["layout"]["yaxis"]["scaleanchor"] == "x"
    assert "autorange" not in made["layout"]["yaxis"]  # without autorange, y grows upwards
    assert "N" in made["layout"]["annotations"][1]["text"]


def page_of(tmp_path: Path, which: Overview, tiles: bool = False) -> str:
    page.draw(tmp_path / "ride.html", which, tiles)
    return (tmp_path / "ride.html").read_text()


@pytest.mark.parametrize("positions", [0, 1])
def test_without_positions_there_is_no_map(tmp_path, positions):
    """One position is not a track."""
    course = seen().course
    places = {name: np.where(np.arange(len(course.t_s)) < positions, 5.0, np.nan) for name in ("lat_deg", "lon_deg")}
    html = page_of(tmp_path, replace(seen(), course=replace(course, **places)))
    assert 'id="chart"' in html
    assert 'id="map"' not in html
    assert 'id="map"' in page_of(tmp_path, seen())


def test_page_loads_nothing_unless_tiles_are_requested(tmp_path):
    html = page_of(tmp_path, seen())
    assert not re.search(r"<(script|link|img)[^>]*(src|href)=", html)
    assert page.TILES_URL not in html
    assert '"tiles": null' in html
    assert "OpenStreetMap contributors" not in html.rpartition("<p id=")[2]
    html = page_of(tmp_path, seen(), tiles=True)
    assert page.TILES_URL in html
    assert "openstreetmap.org/copyright" in html.rpartition('<p id="tiles">')[2]


@pytest.mark.parametrize("place", [(52.5, 13.4), (-33.9, 151.2), (47.6, -0.01)])
def test_tiles_match_the_track(place):
    """The map's metres give the same tile for the start as the formula of web maps for latitude and longitude."""
    found = points_of(*place)
    tiles = page.tiles_at(found)
    size = tiles["world_m"] / 2**15
    lat, lon = np.radians(found.lat_deg), found.lon_deg
    column = (lon + 180.0) / 360.0 * 2**15
    row = (1.0 - np.log(np.tan(lat) + 1.0 / np.cos(lat)) / np.pi) / 2.0 * 2**15
    assert tiles["west_m"] / size == pytest.approx(column, abs=1e-6)
    assert tiles["north_m"] / size == pytest.approx(row, abs=1e-6)


_POINT = """() => {
  const k = Math.floor(map.data[0].x.length * 0.6), x = map._fullLayout.xaxis, y = map._fullLayout.yaxis;
  return [x._offset + x.d2p(map.data[0].x[k]), y._offset + y.d2p(map.data[0].y[k]), map.data[0].customdata[k][0]];
}"""


def test_in_a_browser_chart_and_map_show_the_same_moment(tmp_path, chromium):
    page_of(tmp_path, seen())
    view = chromium.new_page(viewport={"width": 1300, "height": 800})
    view.set_default_timeout(120_000)  # drawing is slow on a busy machine
    asked, errors = [], []
    view.on("request", lambda request: asked.append(request.url))
    view.on("pageerror", lambda error: errors.append(str(error)))
    view.goto((tmp_path / "ride.html").as_uri())
    view.wait_for_function("map.layout.annotations[0].text != ''")
    bar = view.evaluate("[map.layout.annotations[0].text, map.layout.shapes[1].x1, map.layout.xaxis.range]")
    area, chart = view.locator("#map").bounding_box(), view.locator("#chart").bounding_box()
    at = view.evaluate(_POINT)
    before = view.locator("#here").text_content()
    view.mouse.move(area["x"] + at[0], area["y"] + at[1])
    view.wait_for_function("before => document.querySelector('#here').textContent !== before", arg=before)
    said = view.locator("#here").text_content()
    view.mouse.move(chart["x"] + 0.6 * chart["width"], chart["y"] + 180)
    view.wait_for_timeout(300)
    there = view.evaluate("[map.layout.shapes[0].xanchor, map.layout.shapes[0].yanchor]")
    later, tip = (view.locator(one).text_content() for one in ("#here", "#tip"))
    view.close()
    assert errors == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    metres, (west, east) = float(bar[0].split()[0]), bar[2]
    assert bar[0].endswith(" m")
    assert (bar[1] - 0.02) * (east - west) == pytest.approx(metres, rel=1e-6)
    assert said.split()[0] == f"0:{round(at[2]):02}"
    assert tip.split(",")[0] == later.split()[0], "one moment has two times"
    points = points_of()
    minutes, seconds = later.split()[0].split(":")
    k = np.argmin(np.hypot(points.east_m - there[0], points.north_m - there[1]))
    assert points.t_s[k] == pytest.approx(60 * int(minutes) + int(seconds), abs=1.1)
    assert json.dumps(there) != json.dumps([0, 0])
