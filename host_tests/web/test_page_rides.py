"""The page Rides in Chromium: it shows what the commands print, accepts files in any order, and sends none to a server.

test_ride_files.py tests the same code without a browser. Python starts once, because all tests use one page. The
content security policy is enforced.
"""

import base64
import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from kickstand_sim.simulation.files import positions
from kickstand_tools import api
from kickstand_tools.analysis import charts, interactive
from kickstand_tools.analysis.overview import overview
from kickstand_tools.logs.reader import write_log
from support.command import works
from support.recordings import analysis_rides, app_exports, phone_tracks
from support.web.rider import LAPTOP, Rider
from support.web.rides_page import PHONE_MOUNTED, WAIT_MS, Rides, assert_near, near

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def page(chromium, address):
    rider = Rider(chromium, address + "rides.html", policy=True, **LAPTOP)
    yield Rides(rider)
    away = [url for url in rider.asked if not url.startswith((address, "blob:" + address, "data:"))]
    rider.context.close()
    assert (away, rider.errors) == ([], [])


def reported(*arguments):
    return {**json.loads(works("report", *arguments, "--json").out), "ride": ""}


def shown(page):
    """Return the saved JSON of the report."""
    return {**json.loads(page.saved("#save-json")), "ride": ""}


def test_report_and_lean_are_those_of_the_commands(page, ride, calibration, tmp_path):
    page.show(ride, calibration)
    assert_near(shown(page), reported(ride))
    words = works("report", ride).out.split()
    assert [word for row in page.report() for cell in row for word in cell.split() if word not in words] == []
    assert len(page.report()) == 10 and page.warnings() == ""
    works("smooth", ride, "--out", tmp_path / "lean.csv")
    (tmp_path / "shown.csv").write_bytes(page.saved("#save-lean"))
    command, site = (analysis_rides.table(tmp_path / name) for name in ("lean.csv", "shown.csv"))
    assert site.dtype.names == command.dtype.names and len(site) == len(command) > 1000
    for name in command.dtype.names or ():
        assert near(site[name], command[name], 0.002), name
    assert page.rider.axe() == [] and page.rider.fits()


def test_the_charts_are_those_of_the_command(page, ride, calibration):
    """The frame of the charts has no rights, and needs no scroll bar. The saved page needs no other file."""
    page.show(ride, calibration)
    drawn = interactive.charts_figure(charts.charts(overview(api.open_ride(ride, calibration, smoothed=True))))["data"]
    inside = page.page.frame_locator("#plot")
    chart = inside.locator("#chart")
    chart.locator(".main-svg").first.wait_for()
    assert chart.evaluate("() => window.origin") == "null" and inside.locator("#map").count() == 0
    traces = json.loads(chart.evaluate("() => JSON.stringify(CHART.data)"))
    assert [trace.get("name") for trace in traces] == [trace.get("name") for trace in drawn]
    for command, site in zip(drawn, traces):
        assert all(near(site[axis], command[axis], 0.002) for axis in "xy"), command.get("name")
    html = page.saved("#save-page").decode()
    assert "Plotly.newPlot" in html and '<script src="' not in html and "<h1>RIDE</h1>" in html
    assert page.page.locator("#plot").bounding_box()["height"] > 900
    for scheme, filtered, paper in (("dark", True, "rgb(26, 29, 36)"), ("light", False, "rgb(255, 255, 255)")):
        page.page.emulate_media(color_scheme=scheme)
        style = chart.evaluate(
            "(chart) => [getComputedStyle(chart).filter, getComputedStyle(chart.ownerDocument.body).backgroundColor]"
        )
        assert (style[0] != "none", style[1]) == (filtered, paper)


def test_too_short_ride_is_reported_at_the_top(page, calibration, tmp_path):
    """A bike at rest with a running engine is not a ride."""
    noise = np.random.default_rng(1).normal(0.0, [0.03] * 3 + [1.0] * 3, (1200, 6))
    log = api.Log(np.arange(1200) / 100.0, noise[:, :3] + [0.0, 1.0, 0.0], noise[:, 3:])
    write_log(tmp_path / "RIDE.csv", log)
    (tmp_path / "RIDE.cal.json").write_bytes(calibration.read_bytes())
    assert page.give(tmp_path / "RIDE.csv", tmp_path / "RIDE.cal.json") == ""
    message = page.page.inner_text("#too-little")
    assert message == "0:12 of log, all of it standing: too little for a report."
    assert message in works("report", tmp_path / "RIDE.csv").out and page.page.is_hidden("#terms")


# Presses Stop when the work begins: a short ride could be done before a click from outside the page
STOP_AT_ONCE = """() => {
    const work = document.querySelector("#work");
    new MutationObserver((_, observer) => {
        if (!work.hidden) { observer.disconnect(); document.querySelector("#stop").click(); }
    }).observe(work, { attributes: true });
}"""


def test_long_work_can_be_stopped_and_repeated(page, ride, calibration):
    page.give()
    page.page.evaluate(STOP_AT_ONCE)
    page.page.set_input_files("#files", [ride, calibration])
    page.page.wait_for_function("!document.querySelector('#again').closest('[hidden]')")
    assert page.said() == "Stopped." and len(page.held()) == 2
    assert page.page.is_hidden("#report") and page.page.is_hidden("#charts")
    page.page.click("#again")
    page.page.wait_for_function("!document.querySelector('#work').hidden || !document.querySelector('#report').hidden")
    assert page.add(ride, calibration) == "" and page.page.inner_text("#report-title") == "RIDE.csv"
    page.page.evaluate("['#save-lean', '#stop'].forEach((button) => document.querySelector(button).click())")
    assert page.said() == "Stopped." and page.page.is_hidden("#report")


DROP = Path(__file__).with_name("drop.js").read_text()


def test_dropped_file_that_is_cut_off_is_shown_with_a_warning(page, ride, calibration, tmp_path):
    """A recorder that loses power leaves a file that is cut off."""
    page.give()
    packed = gzip.compress(ride.read_bytes())
    contents = {"RIDE.csv.gz": packed[: len(packed) // 2], "RIDE.cal.json": calibration.read_bytes()}
    page.page.evaluate(DROP, ["#drop", [[name, base64.b64encode(data).decode()] for name, data in contents.items()]])
    assert page.said() == "" and "the file was cut" in page.warnings()
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    assert shown(page)["samples"] == reported(tmp_path / "RIDE.csv.gz")["samples"]


def test_the_export_of_a_phone_becomes_a_log(page, tmp_path):
    """The page makes the same log as `import`. With a calibration, the log is a ride."""
    path = app_exports.into(tmp_path / "phone.zip", app_exports.phyphox(app_exports.riding().every(4)))
    assert "phone.zip has no calibration with it" in page.give(path)
    (tmp_path / "phone.cal.json").write_text(json.dumps(PHONE_MOUNTED))
    assert page.add(tmp_path / "phone.cal.json") == ""
    works("import", path, "--out", tmp_path / "log.csv")
    (tmp_path / "site.csv").write_bytes(page.saved("#save-log"))
    command, site = (analysis_rides.table(tmp_path / name) for name in ("log.csv", "site.csv"))
    assert all(near(site[name], command[name], 2e-6) for name in command.dtype.names or ())
    assert_near(shown(page), reported(tmp_path / "log.csv", "--calibration", tmp_path / "phone.cal.json"))


def test_one_of_several_rides_is_chosen(page, ride, calibration, tmp_path):
    rows = ride.read_text().splitlines()
    for name, count in (("A", len(rows)), ("B", 700)):
        (tmp_path / f"{name}.csv").write_text("\n".join(rows[:count]) + "\n")
        (tmp_path / f"{name}.cal.json").write_bytes(calibration.read_bytes())
    page.give(*sorted(tmp_path.iterdir()))
    first = page.report()[0]
    with page.page.expect_download(timeout=WAIT_MS) as lean:  # of the ride that was chosen when the button was pressed
        page.page.evaluate("document.querySelector('#save-lean').click()")
        page.page.select_option("#ride", "B.csv")
    assert lean.value.suggested_filename == "A.lean.csv"
    page.said()
    assert page.page.inner_text("#report-title") == "B.csv" and page.report()[0] != first


def test_the_columns_of_a_table_can_be_named(page, tmp_path):
    """The page has the same choices as the options --columns and --units of `import`."""
    log, cal = tmp_path / "log.csv", tmp_path / "phone.json"
    log.write_text(app_exports.any_table(app_exports.riding().every(4)).replace("Acc_X", "Quantity 1", 1))
    cal.write_text(json.dumps(PHONE_MOUNTED))
    assert page.give(log).endswith("and no acceleration found in it: say what its columns are.")
    assert page.page.eval_on_selector("[name=ay]", "select => select.value") == "Acc_Y"
    assert page.page.locator("#first-seconds polyline").count() == 3  # one line for each of the gyro's three axes
    page.page.click("#table button")
    assert page.page.is_visible("#table")  # one column still has no name
    for name, value in (("ax", "Quantity 1"), ("a", "m/s2"), ("g", "deg/s")):
        page.page.select_option(f"[name={name}]", value)
    page.page.click("#table button")
    assert "log.csv has no calibration with it" in page.said()
    page.add(cal)
    columns = "t=Millis,ax=Quantity 1,ay=Acc_Y,az=Acc_Z,gx=Gyro_X,gy=Gyro_Y,gz=Gyro_Z,speed=Speed_kmh"
    options = "--columns", columns, "--units", "a=m/s2,g=deg/s,speed=km/h"
    works("import", log, "--out", tmp_path / "R.csv", *options)
    assert_near(shown(page), reported(tmp_path / "R.csv", "--calibration", cal))


def test_a_track_joins_a_ride_without_gps(page, tmp_path):
    """As after `join`, the page has a map, and saves the log with positions. The track of another ride is refused."""
    simulated = api.simulate_ride("hills", seed=1, seconds=120.0)
    write_log(tmp_path / "bare.csv", api.Log.from_readings(simulated.readings[::4], simulated.rate_hz / 4))
    calibration = api.CalibrationFile(vehicle_from_sensor=simulated.vehicle_from_sensor, aligned=True)
    api.write_calibration(tmp_path / "bare.cal.json", calibration)
    lat, lon, utc_s = (values[::200] for values in positions(simulated))
    speed_mps = simulated.truth["speed_mps"][::200]
    track = phone_tracks.write_gpx(tmp_path / "ride.gpx", api.Track(utc_s, lat, lon, speed_mps, "track"))
    message = page.give(tmp_path / "bare.csv", tmp_path / "bare.cal.json", track)
    assert "ride.gpx is joined: correlation " in message
    page.page.frame_locator("#plot").locator("#map .main-svg").first.wait_for()
    works("join", tmp_path / "bare.csv", track, "--out", tmp_path / "joined.csv")
    assert page.saved("#save-log") == (tmp_path / "joined.csv").read_bytes()
    page.add(phone_tracks.write_gpx(track, api.Track(utc_s, lat[::-1], lon, speed_mps[::-1], "track")))
    assert "ride.gpx is not joined" in page.warnings()


PULLED = Path(__file__).with_name("keep_pulled.js").read_text()


def test_pulled_rides_are_opened_once(page, address, ride, calibration):
    page.page.evaluate(PULLED, [[path.name, path.read_text()] for path in (ride, calibration)])
    page.page.goto(address + "licences.txt")
    page.page.goto(address + "rides.html#pulled")
    page.page.wait_for_selector("#report", timeout=WAIT_MS)  # the report appears some time after the page has loaded
    assert page.said() == "" and page.page.inner_text("#report-title") == "RIDE.csv"
    page.page.goto(address + "licences.txt")
    page.page.goto(address + "rides.html#pulled")
    page.page.wait_for_function("location.hash === ''")
    page.page.wait_for_timeout(500)
    assert page.page.is_hidden("#report") and page.page.is_hidden("#work")
