"""The page Rides accepts files in any order and of other apps, and reports files that are cut off or wrong."""

import base64
import gzip
import json
from pathlib import Path

import pytest
from kickstand_tools.api import CalibrationFile, Log, Track, simulate_ride
from kickstand_tools.calibration.file import write_calibration
from kickstand_tools.logs.csv_lines import write_log
from kickstand_tools.simulation.files import positions
from support.command import works
from support.recordings import analysis_rides, app_exports, phone_tracks
from support.web.rider import LAPTOP, Rider
from support.web.rides_page import PHONE_MOUNTED, WAIT_MS, assert_near, near

DROP = Path(__file__).with_name("drop.js").read_text()
PULLED = Path(__file__).with_name("keep_pulled.js").read_text()


def test_cut_gzip_file_is_shown_with_a_warning(page, ride, calibration, tmp_path):
    """A recorder that loses power leaves a file that is cut off."""
    page.give()
    packed = gzip.compress(ride.read_bytes())
    files = [("RIDE.csv.gz", packed[: len(packed) // 2]), ("RIDE.cal.json", calibration.read_bytes())]
    page.page.evaluate(DROP, ["#drop", [[name, base64.b64encode(data).decode()] for name, data in files]])
    assert page.said() == ""
    assert "the file was cut" in page.warnings()
    (tmp_path / "RIDE.csv.gz").write_bytes(files[0][1])
    (tmp_path / "RIDE.cal.json").write_bytes(files[1][1])
    reported = json.loads(works("report", tmp_path / "RIDE.csv.gz", "--json").out)
    assert page.report()[0][0] == "Duration" and reported["samples"] == json.loads(page.saved("#save-json"))["samples"]


def test_a_log_alone_asks_for_its_calibration(page, ride, calibration):
    """The calibration may be added later, or computed from a ride that is long enough."""
    assert "has no calibration with it" in page.give(ride)
    assert page.page.is_hidden("#report")
    page.page.click("#align")
    assert "of riding: at least" in page.said()
    assert page.add(calibration) == ""
    assert page.page.is_visible("#report")


def test_the_export_of_a_phone_becomes_a_log(page, tmp_path):
    """The page makes the same log as `import`. With a calibration the log is a ride."""
    path = app_exports.into(tmp_path / "phone.zip", app_exports.phyphox(app_exports.riding().every(4)))
    assert "phone.zip has no calibration with it" in page.give(path)
    (tmp_path / "phone.cal.json").write_text(json.dumps(PHONE_MOUNTED))
    assert page.add(tmp_path / "phone.cal.json") == ""
    works("import", path, "--out", tmp_path / "log.csv")
    was, now = tmp_path / "log.csv", tmp_path / "now.csv"
    now.write_bytes(page.saved("#save-log"))
    for name in analysis_rides.table(was).dtype.names or ():
        assert near(analysis_rides.table(now)[name], analysis_rides.table(was)[name], 2e-6), name
    reported = json.loads(works("report", was, "--calibration", tmp_path / "phone.cal.json", "--json").out)
    shown = json.loads(page.saved("#save-json"))
    assert_near({**shown, "ride": ""}, {**reported, "ride": ""})


def test_one_of_several_rides_is_chosen(page, ride, calibration, tmp_path):
    files = []
    for name in ("A", "B"):
        files += [tmp_path / f"{name}.csv", tmp_path / f"{name}.cal.json"]
        rows = ride.read_text().splitlines()
        files[-2].write_text("\n".join(rows[: len(rows) if name == "A" else 1500]) + "\n")
        files[-1].write_bytes(calibration.read_bytes())
    page.give(*files)
    first = page.report()[0]
    # The report appears, although another ride was chosen meanwhile.
    with page.page.expect_download(timeout=WAIT_MS) as lean:
        page.page.evaluate("document.querySelector('#save-lean').click()")
        page.page.select_option("#ride", "B.csv")
    assert lean.value.suggested_filename == "A.lean.csv"
    page.said()
    assert page.page.inner_text("#report-title") == "B.csv"
    assert page.report()[0] != first


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(8), "not text: give what an app has exported"),
        ("made", b"as what was made is called", "not a file of an app that is known"),
        ("slow.csv", b"t_s,ax_g,ay_g,az_g\n0,0,1,0\n", "and no table of sensors"),
        ("ride.parquet", b"PAR1" + bytes(40), "is Parquet, which this page cannot read: give the ride as"),
        ("report.json", b'{"ride": "A"}', "is no calibration: version is missing: give the"),
    ],
)
def test_wrong_file_gives_one_line_and_harms_no_other_ride(page, ride, calibration, tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content)
    assert page.give(path) == f"{name} cannot be used: the list says why."
    assert page.page.is_hidden("#report") and page.page.is_hidden("#charts")
    said = page.held()[name]
    assert said.startswith(words) or words in said
    assert not said.startswith(name) and not any(part in said for part in ("\n", "kickstand", "--", "<"))
    if name == "ride.parquet":
        assert page.add(ride, calibration) == ""
        assert page.page.inner_text("#report-title") == "RIDE.csv"
        assert page.add(path) == ""
        assert page.page.is_visible("#report")
        assert page.page.inner_text("#given-wrong") == f"{name} cannot be used: the list says why."
        page.give(ride)
        assert "has no calibration with it" in page.add(path)
        assert page.page.is_visible("#align")  # the ride still waits for its calibration


def test_unreadable_file_does_not_harm_the_others(page, ride, calibration, tmp_path):
    """The file is rewritten after it was chosen. The page treats a folder in the same way."""
    path = tmp_path / "written.csv"
    path.write_bytes(ride.read_bytes())
    page.give(path)
    path.write_text("anew, and of another length")
    assert page.add(ride, calibration) == ""
    assert page.page.inner_text("#report-title") == "RIDE.csv"
    assert page.held()["written.csv"].startswith("cannot be read: it is a folder, or was changed")
    page.add(path)
    assert "not a file of an app" in page.held()["written.csv"]


def test_files_are_added_and_removed_in_any_order(page, ride, calibration, tmp_path):
    assert "This is a calibration. Now add the ride" in page.give(calibration)
    assert page.add(ride) == ""
    assert page.page.inner_text("#calibration") == "RIDE.cal.json"
    other = tmp_path / "other.csv"
    other.write_bytes(ride.read_bytes())
    assert "other.csv has no calibration" in page.add(other)  # the only calibration belongs to the other ride
    bike = tmp_path / "bike.json"
    bike.write_bytes(calibration.read_bytes())
    assert page.add(bike) == ""
    assert (page.page.inner_text("#report-title"), page.page.inner_text("#calibration")) == ("other.csv", "bike.json")
    assert list(page.held()) == ["bike.json", "other.csv", "RIDE.csv", "RIDE.cal.json"]
    page.remove("[aria-label='Remove bike.json']")
    assert "other.csv has no calibration" in page.said()
    assert page.page.is_hidden("#report")
    page.remove("[aria-label='Remove other.csv']")
    page.said()
    assert page.page.inner_text("#report-title") == "RIDE.csv"


def test_the_columns_of_a_table_can_be_named(page, tmp_path):
    """The page has the same choices as the options --columns and --units of `import`."""
    log, riding = tmp_path / "log.csv", app_exports.riding().every(4)
    log.write_text(app_exports.any_table(riding).replace("Acc_X", "Quantity 1", 1))
    assert page.give(log).endswith("and no acceleration found in it: say what its columns are.")
    assert page.page.eval_on_selector("[name=ay]", "select => select.value") == "Acc_Y"
    assert page.page.locator("#first-seconds polyline").count() == 3  # one line for each of the gyro's three axes
    page.page.click("#table button")
    assert page.page.is_visible("#table")  # one column still has no name
    page.page.select_option("[name=ax]", "Quantity 1")
    page.page.select_option("[name=a]", "m/s2")
    page.page.select_option("[name=g]", "deg/s")
    page.page.click("#table button")
    assert "log.csv has no calibration with it" in page.said()
    (tmp_path / "phone.json").write_text(json.dumps(PHONE_MOUNTED))
    page.add(tmp_path / "phone.json")
    columns = "t=Millis,ax=Quantity 1,ay=Acc_Y,az=Acc_Z,gx=Gyro_X,gy=Gyro_Y,gz=Gyro_Z,speed=Speed_kmh"
    named = ["--columns", columns, "--units", "a=m/s2,g=deg/s,speed=km/h"]
    works("import", log, "--out", tmp_path / "R.csv", *named)
    reported = json.loads(works("report", tmp_path / "R.csv", "--calibration", tmp_path / "phone.json", "--json").out)
    assert_near({**json.loads(page.saved("#save-json")), "ride": ""}, {**reported, "ride": ""})


@pytest.mark.parametrize(
    "write", [phone_tracks.write_gpx, pytest.param(phone_tracks.write_fit, marks=pytest.mark.nightly)]
)
def test_a_track_joins_a_ride_without_gps(page, tmp_path, write):
    """As after `join`, the page has a map, and the log with positions can be saved. The track of another ride is
    refused."""
    made = simulate_ride("hills", seed=1, seconds=120.0)
    log = Log.from_readings(made.readings[::4], made.rate_hz / 4)
    write_log(tmp_path / "bare.csv", log)
    calibration = CalibrationFile(vehicle_from_sensor=made.vehicle_from_sensor, aligned=True)
    write_calibration(tmp_path / "bare.cal.json", calibration)
    lat, lon, utc_s = (values[::200] for values in positions(made))
    speed_mps = made.truth["speed_mps"][::200]
    track = write(tmp_path / f"ride.{write.__name__[-3:]}", Track(utc_s, lat, lon, speed_mps, "track"))
    assert f"{track.name} is joined: correlation " in page.give(
        tmp_path / "bare.csv", tmp_path / "bare.cal.json", track
    )
    page.page.frame_locator("#plot").locator("#map .main-svg").first.wait_for()
    works("join", tmp_path / "bare.csv", track, "--out", tmp_path / "joined.csv")
    assert page.saved("#save-log") == (tmp_path / "joined.csv").read_bytes()
    page.add(write(track, Track(utc_s, lat[::-1], lon, speed_mps[::-1], "track")))
    assert f"{track.name} is not joined" in page.warnings()


def test_sample_ride_is_shown_as_simulated(page):
    """At first a drawing of a report is beside the place for files. With the sample ride, the charts are beside the
    figures."""
    page.give()
    drop, drawn = (page.page.locator(one).bounding_box() for one in ("#drop", ".sample svg"))
    assert drop["height"] > 300 and drawn["y"] + drawn["height"] < page.page.viewport_size["height"]
    page.page.click("#sample")
    page.page.wait_for_selector("#report", timeout=WAIT_MS)
    assert page.said() == "This ride is simulated: nobody has ridden it."
    assert page.page.inner_text("#report-title") == "simulated-ride.csv.gz"
    assert page.page.inner_text("#alignment").startswith("Alignment: good.")
    assert page.page.is_visible("#drawing") or page.page.locator("#plot[style]").count()
    page.page.frame_locator("#plot").locator("#map .main-svg").first.wait_for()
    page.page.wait_for_selector("#drawing", state="hidden")
    assert page.warnings() == "" and page.page.is_hidden("#sample")
    plot, figures = (page.page.locator(one).bounding_box() for one in ("#plot", "#figures"))
    assert plot["y"] < figures["y"] and plot["x"] > figures["x"] + figures["width"]
    assert "right, 0.02 g from 1 are allowed" in page.page.inner_text("#alignment")


def test_browser_without_a_store_is_told_so(chromium, address):
    """In a private window some browsers refuse to store data."""
    rider = Rider(chromium, address + "licences.txt", **LAPTOP)
    rider.context.add_init_script("IDBFactory.prototype.open = () => { throw new DOMException('', 'SecurityError'); }")
    rider.page.goto(address + "rides.html#pulled")
    rider.page.wait_for_function("document.querySelector('#said').textContent.startsWith('This browser keeps nothing')")
    assert rider.errors == []
    rider.context.close()


def test_pulled_rides_are_opened_once(page, address, ride, calibration):
    page.page.evaluate(PULLED, [[path.name, path.read_text()] for path in (ride, calibration)])
    page.page.goto(address + "licences.txt")
    page.page.goto(address + "rides.html#pulled")
    page.page.wait_for_selector("#report", timeout=WAIT_MS)  # the report appears some time after the page has loaded
    assert page.said() == ""
    assert page.page.inner_text("#report-title") == "RIDE.csv"
    page.page.goto(address + "licences.txt")
    page.page.goto(address + "rides.html#pulled")
    page.page.wait_for_function("location.hash === ''")
    page.page.wait_for_timeout(500)
    assert page.page.is_hidden("#report") and page.page.is_hidden("#work")
