"""Rides given to the page: what it shows is what the commands say, and no file leaves it."""

import base64
import gzip
import json
import zipfile
from pathlib import Path

import analysis_rides
import app_exports
import command
import numpy as np
import pytest
from command import works
from kickstand_tools import remedies
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.plot import charts
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.cli.main import kickstand
from kickstand_tools.web import rides_guest
from rider import MISSING, Rider
from test_page_looks import LAPTOP, PHONE

PHONE_MOUNTED = analysis_rides.CALIBRATION | {"vehicle_from_sensor": app_exports.PHONE.tolist()}
WAIT_MS = 120_000  # a busy machine starts Python late
DROP = """([selector, files]) => {
  const data = new DataTransfer();
  for (const [name, bytes] of files) {
    data.items.add(new File([Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0))], name));
  }
  for (const kind of ["dragover", "drop"]) {
    document.querySelector(selector).dispatchEvent(new DragEvent(kind, { dataTransfer: data, bubbles: true }));
  }
}"""
AWAKE = """() => {
  let last = performance.now();
  window.longestMs = 0;
  setInterval(() => {
    window.longestMs = Math.max(window.longestMs, performance.now() - last);
    last = performance.now();
  }, 50);
}"""
PULLED = """(files) => new Promise((done) => {
  const opening = indexedDB.open("kickstand", 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore("files");
  opening.onsuccess = () => {
    const work = opening.result.transaction("files", "readwrite");
    const all = files.map(([name, text]) => ({ name, data: new TextEncoder().encode(text).buffer }));
    work.objectStore("files").put(all, "pulled");
    work.oncomplete = () => { opening.result.close(); done(); };
  };
})"""


class Rides:
    """The page, with somebody who gives it files."""

    def __init__(self, rider):
        self.rider, self.page = rider, rider.page

    def give(self, *files):
        """Choose files in place of all before; what the page says in the end."""
        while self.held():
            self.page.click("#held li:first-child button")
            self.said()
        return self.add(*files)

    def add(self, *files):
        """Choose files; what the page says in the end."""
        self.page.set_input_files("#files", files)
        return self.said()

    def held(self):
        """{name: what the page says of it} of the files that it has."""
        cells = "rows => rows.map((row) => [row.children[0].textContent, row.children[1].textContent])"
        return dict(self.page.eval_on_selector_all("#held li", cells))

    def said(self):
        self.page.wait_for_function("document.querySelector('#work').hidden", timeout=WAIT_MS)
        return self.page.inner_text("#said")

    def saved(self, selector) -> bytes:
        """What a button offers for download."""
        with self.page.expect_download(timeout=WAIT_MS) as download:
            self.page.click(selector)
        return Path(download.value.path()).read_bytes()

    def report(self):
        """The rows of the report as the page shows them."""
        return self.page.eval_on_selector_all(
            "#report tbody tr", "rows => rows.map((row) => [...row.cells].map((cell) => cell.textContent.trim()))"
        )

    def warnings(self):
        return self.page.inner_text("#warnings")


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    """Half a minute, with a speed."""
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), speed_hz=5)


@pytest.fixture(scope="module")
def calibration(ride):
    return ride.with_name("RIDE.cal.json")


@pytest.fixture(scope="module")
def page(chromium, address):
    """One for all tests: Python is loaded once."""
    rider = Rider(chromium, address + "rides.html", **LAPTOP)
    yield Rides(rider)
    away = [url for url in rider.asked if not url.startswith((address, "blob:" + address, "data:"))]
    rider.context.close()
    assert (away, rider.errors) == ([], [])


def test_the_report_is_that_of_the_command(page, ride, calibration):
    assert page.give(ride, calibration) == ""
    told = json.loads(works("report", ride, "--json").out)
    shown = json.loads(page.saved("#save-json"))
    assert shown.pop("ride") == Path(told.pop("ride")).name
    assert_near(shown, told)
    wide = works("report", ride).out.split()
    for row in page.report():
        assert [word for cell in row for word in cell.split() if word not in wide] == []
    assert len(page.report()) == 10
    assert page.warnings() == ""


def test_the_charts_are_those_of_the_command(page, ride, calibration):
    page.give(calibration, ride)
    drawn = charts.figure(overview(open_ride(ride, calibration, smoothed=True)))["data"]
    inside = page.page.frame_locator("#plot")
    inside.locator("#chart .main-svg").first.wait_for()
    shown = json.loads(inside.locator("#chart").evaluate("() => JSON.stringify(CHART.data)"))
    assert [trace.get("name") for trace in shown] == [trace.get("name") for trace in drawn]
    for was, now in zip(drawn, shown):
        for axis in "xy":
            assert near(now[axis], was[axis], 0.002), was.get("name")
    html = page.saved("#save-page").decode()
    assert "Plotly.newPlot" in html and "src=" not in html.split("<body>")[0].rpartition("</script>")[2]
    assert '<script src="' not in html
    frame = page.page.locator("#plot").bounding_box()
    assert frame["height"] > 900  # as high as its charts: nothing to scroll within


def test_the_lean_of_each_sample_is_that_of_the_command(page, ride, calibration, tmp_path):
    page.give(ride, calibration)
    works("smooth", ride, "--out", tmp_path / "lean.csv")
    (tmp_path / "shown.csv").write_bytes(page.saved("#save-lean"))
    was, now = (analysis_rides.table(tmp_path / name) for name in ("lean.csv", "shown.csv"))
    assert now.dtype.names == was.dtype.names and len(now) == len(was) > 1000
    for name in was.dtype.names or ():
        assert near(now[name], was[name], 0.002), name
    assert page.page.is_visible("#report")


def test_what_the_site_does_not_give_is_not_saved(page, ride, calibration):
    page.give(ride, calibration)
    page.page.evaluate(MISSING, "plotly.min.js")
    page.page.click("#save-page")
    assert "plotly.min.js cannot be loaded (HTTP 404)" in page.said()
    page.page.evaluate("given()")
    assert b"Plotly.newPlot" in page.saved("#save-page")


def test_dropped_on_the_page_packed_and_cut_off(page, ride, calibration, tmp_path):
    """A recorder without power leaves half a file: what there is is shown, with a warning."""
    page.give()
    packed = gzip.compress(ride.read_bytes())
    files = [("RIDE.csv.gz", packed[: len(packed) // 2]), ("RIDE.cal.json", calibration.read_bytes())]
    page.page.evaluate(DROP, ["#drop", [[name, base64.b64encode(data).decode()] for name, data in files]])
    assert page.said() == ""
    assert "the file was cut" in page.warnings()
    (tmp_path / "RIDE.csv.gz").write_bytes(files[0][1])
    (tmp_path / "RIDE.cal.json").write_bytes(files[1][1])
    told = json.loads(works("report", tmp_path / "RIDE.csv.gz", "--json").out)
    assert page.report()[0][0] == "Duration" and told["samples"] == json.loads(page.saved("#save-json"))["samples"]


def test_a_log_alone_asks_for_its_calibration(page, ride, calibration):
    """Which may come later, or from the ride, if that is long enough."""
    assert "has no calibration with it" in page.give(ride)
    assert page.page.is_hidden("#report")
    page.page.click("#align")
    assert "of riding: at least" in page.said()
    assert page.add(calibration) == ""
    assert page.page.is_visible("#report")


def test_the_export_of_a_phone_becomes_a_log(page, tmp_path):
    """As `import` makes it; with a calibration it is a ride."""
    path = app_exports.into(tmp_path / "phone.zip", app_exports.phyphox(app_exports.riding().every(4)))
    assert "phone.zip has no calibration with it" in page.give(path)
    (tmp_path / "phone.cal.json").write_text(json.dumps(PHONE_MOUNTED))
    assert page.add(tmp_path / "phone.cal.json") == ""
    works("import", path, "--out", tmp_path / "log.csv")
    was, now = tmp_path / "log.csv", tmp_path / "now.csv"
    now.write_bytes(page.saved("#save-log"))
    for name in analysis_rides.table(was).dtype.names or ():
        assert near(analysis_rides.table(now)[name], analysis_rides.table(was)[name], 2e-6), name
    told = json.loads(works("report", was, "--calibration", tmp_path / "phone.cal.json", "--json").out)
    shown = json.loads(page.saved("#save-json"))
    assert_near({**shown, "ride": ""}, {**told, "ride": ""})
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "unpacked")
    assert page.give(*(tmp_path / "unpacked").glob("*.csv"), tmp_path / "phone.cal.json") == ""
    assert json.loads(page.saved("#save-json"))["samples"] == shown["samples"]


def test_one_of_several_rides_is_chosen(page, ride, calibration, tmp_path):
    files = []
    for name in ("A", "B"):
        files += [tmp_path / f"{name}.csv", tmp_path / f"{name}.cal.json"]
        rows = ride.read_text().splitlines()
        files[-2].write_text("\n".join(rows[: len(rows) if name == "A" else 1500]) + "\n")
        files[-1].write_bytes(calibration.read_bytes())
    page.give(*files)
    first = page.report()[0]
    with page.page.expect_download(timeout=WAIT_MS) as lean:  # which comes though another ride is chosen meanwhile
        page.page.evaluate("document.querySelector('#save-lean').click()")
        page.page.select_option("#ride", "B.csv")
    assert lean.value.suggested_filename == "A.lean.csv"
    page.said()
    assert page.page.inner_text("#report-title") == "B.csv"
    assert page.report()[0] != first


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(8), "picture.png: not text: give what an app has exported"),
        ("table.csv", b"lat,lon\n1,2\n", "table.csv: not a file of an app that is known, and no table of sensors"),
        ("made", b"as what was made is called", "made: not a file of an app that is known"),
        ("note.txt", b"Time flies, so speed,\nand more of it\n", "note.txt: not a file of an app that is known"),
        ("empty.csv", b"", "empty.csv holds no recording: give the file, the folder or the zip"),
        ("slow.csv", b"t_s,ax_g,ay_g,az_g\n0,0,1,0\n", "and no gyro found in it: needed are a time, the acceleration"),
        ("damaged.zip", b"PK\x03\x04\xff" + bytes(40), "damaged.zip is damaged or cut short: copy it again"),
        ("ride.parquet", b"PAR1" + bytes(40), "ride.parquet is Parquet, which this page cannot read: give the ride as"),
        ("report.json", b'{"ride": "A"}', "report.json is no calibration: version is missing: give the"),
    ],
)
def test_what_is_no_ride_is_told_in_one_line_and_does_not_spoil_the_next(
    page, ride, calibration, tmp_path, name, content, words
):
    path = tmp_path / name
    path.write_bytes(content)
    said = page.give(path)
    assert words in said and "\n" not in said and "kickstand" not in said and "--" not in said
    assert page.page.is_hidden("#report") and page.page.is_hidden("#charts")
    assert words in page.held()[name]
    if name == "ride.parquet":
        assert page.add(ride, calibration) == ""
        assert page.page.inner_text("#report-title") == "RIDE.csv"
        assert words in page.add(path)
        assert page.page.is_visible("#report")
        page.give(ride)
        assert words in page.add(path)
        assert page.page.is_visible("#align")  # the ride still waits for its calibration


def test_a_file_that_cannot_be_read_does_not_spoil_the_others(page, ride, calibration, tmp_path):
    """A folder, and one that is written anew after it was given; both fail in the same way."""
    path = tmp_path / "written.csv"
    path.write_bytes(ride.read_bytes())
    page.give(path)
    path.write_text("anew, and of another length")
    assert page.add(ride, calibration) == ""
    assert page.page.inner_text("#report-title") == "RIDE.csv"
    assert "written.csv cannot be read: it is a folder, or was changed" in page.held()["written.csv"]
    assert "not a file of an app" in page.add(path)


def test_files_come_in_any_order_one_by_one_and_go(page, ride, calibration, tmp_path):
    assert "This is a calibration. Now add the ride" in page.give(calibration)
    assert page.add(ride) == ""
    assert page.page.inner_text("#calibration") == "RIDE.cal.json"
    other = tmp_path / "other.csv"
    other.write_bytes(ride.read_bytes())
    assert "other.csv has no calibration" in page.add(other)  # it is beside another ride
    bike = tmp_path / "bike.json"
    bike.write_bytes(calibration.read_bytes())
    assert page.add(bike) == ""
    assert (page.page.inner_text("#report-title"), page.page.inner_text("#calibration")) == ("other.csv", "bike.json")
    assert list(page.held()) == ["bike.json", "other.csv", "RIDE.csv", "RIDE.cal.json"]
    page.page.click("[aria-label='Remove bike.json']")
    assert "other.csv has no calibration" in page.said()
    assert page.page.is_hidden("#report")
    page.page.click("[aria-label='Remove other.csv']")
    page.said()
    assert page.page.inner_text("#report-title") == "RIDE.csv"


def test_the_columns_of_a_table_can_be_named(page, tmp_path):
    """As --columns and --units name them for `import`."""
    log, riding = tmp_path / "log.csv", app_exports.riding().every(4)
    log.write_text(app_exports.any_table(riding).replace("Acc_X", "Quantity 1", 1))
    assert page.give(log).endswith("and no acceleration found in it: say what its columns are.")
    assert page.page.eval_on_selector("[name=ay]", "select => select.value") == "Acc_Y"
    page.page.click("#table button")
    assert page.page.is_visible("#table")  # one is missing
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
    told = json.loads(works("report", tmp_path / "R.csv", "--calibration", tmp_path / "phone.json", "--json").out)
    assert_near({**json.loads(page.saved("#save-json")), "ride": ""}, {**told, "ride": ""})


def test_a_browser_that_keeps_nothing_says_so(chromium, address):
    """A private window of some browsers refuses its store."""
    rider = Rider(chromium, address + "licences.txt", **LAPTOP)
    rider.context.add_init_script("IDBFactory.prototype.open = () => { throw new DOMException('', 'SecurityError'); }")
    rider.page.goto(address + "rides.html#pulled")
    rider.page.wait_for_function("document.querySelector('#said').textContent.startsWith('This browser keeps nothing')")
    assert rider.errors == []
    rider.context.close()


def test_too_little_of_a_ride_is_said_at_its_top(page, calibration, tmp_path):
    """In the words of the command; a bike that stands with its engine running does not ride."""
    random = np.random.default_rng(1)
    readings = random.normal(0.0, [0.03] * 3 + [1.0] * 3, (1200, 6)) + [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    rows = [",".join(f"{value:.4f}" for value in (k / 100.0, *row)) for k, row in enumerate(readings.tolist())]
    (tmp_path / "RIDE.csv").write_text("\n".join([command.HEADER, *rows]) + "\n")
    (tmp_path / "RIDE.cal.json").write_bytes(calibration.read_bytes())
    assert page.give(tmp_path / "RIDE.csv", tmp_path / "RIDE.cal.json") == ""
    said = page.page.inner_text("#too-little")
    assert said == "0:12 of log, all of it standing: too little for a report."
    assert said in works("report", tmp_path / "RIDE.csv").out
    assert page.report()[0][2] == "riding 0:00"
    assert page.page.is_hidden("#terms")


def test_the_charts_follow_the_dark(page, ride, calibration):
    page.give(ride, calibration)
    chart = page.page.frame_locator("#plot").locator("#chart")
    for scheme, filtered, paper in (("dark", True, "rgb(26, 26, 26)"), ("light", False, "rgb(255, 255, 255)")):
        page.page.emulate_media(color_scheme=scheme)
        shown = chart.evaluate(
            "(chart) => [getComputedStyle(chart).filter, getComputedStyle(chart.ownerDocument.body).backgroundColor]"
        )
        assert (shown[0] != "none", shown[1]) == (filtered, paper)


def test_every_remedy_has_words_for_the_page():
    assert remedies.PAGE.keys() == remedies.COMMANDS.keys()
    for name, words in remedies.PAGE.items():
        assert "--" not in words, name
        assert not any(f"kickstand {command}" in words for command in kickstand.commands), name


def test_rides_that_were_pulled_are_opened_once(page, address, ride, calibration):
    page.page.evaluate(PULLED, [[path.name, path.read_text()] for path in (ride, calibration)])
    page.page.goto(address + "licences.txt")
    page.page.goto(address + "rides.html#pulled")
    assert page.said() == ""
    assert page.page.inner_text("#report-title") == "RIDE.csv"
    page.page.goto(address + "licences.txt")
    page.page.goto(address + "rides.html#pulled")
    page.page.wait_for_function("location.hash === ''")
    page.page.wait_for_timeout(500)
    assert page.page.is_hidden("#report") and page.page.is_hidden("#work")


def test_once_used_it_works_without_a_network(chromium, address, ride, calibration):
    rider = Rider(chromium, address + "rides.html", **LAPTOP)
    page = Rides(rider)
    assert page.give(ride, calibration) == ""
    page.page.frame_locator("#plot").locator("#chart .main-svg").first.wait_for()
    rider.context.set_offline(True)
    page.page.reload()
    assert "Now add the ride" in page.give(calibration)
    assert page.give(ride, calibration) == ""
    page.page.frame_locator("#plot").locator("#chart .main-svg").first.wait_for()
    rider.context.close()


def test_what_takes_too_long_can_be_stopped(page, ride, calibration):
    """And other files taken in its place."""
    page.give()
    page.page.set_input_files("#files", [ride, calibration])
    page.page.click("#stop")
    assert page.said() == "Stopped."
    assert len(page.held()) == 2
    page.page.click("#again")
    page.page.wait_for_function("!document.querySelector('#work').hidden")
    before = page.page.workers
    assert page.add(ride, calibration) == ""
    assert page.page.inner_text("#report-title") == "RIDE.csv"
    assert not set(before) & set(page.page.workers)


def test_what_was_stopped_leaves_no_report_whose_buttons_do_nothing(page, ride, calibration):
    page.give(ride, calibration)
    page.page.evaluate("['#save-lean', '#stop'].forEach((button) => document.querySelector(button).click())")
    assert page.said() == "Stopped."
    assert page.page.is_hidden("#report") and page.page.is_hidden("#charts")


def test_axe_finds_nothing(page, ride, calibration):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    for kind in (LAPTOP, PHONE):
        page.page.set_viewport_size(kind["viewport"])
        page.give(ride, calibration)
        for scheme in ("light", "dark"):
            page.page.emulate_media(color_scheme=scheme)
            violations = axe.run(page.page).response["violations"]
            assert [f"{one['id']}: {node['html']}" for one in violations for node in one["nodes"]] == []
        assert page.page.evaluate("document.documentElement.scrollWidth") <= kind["viewport"]["width"]
    page.page.set_viewport_size(LAPTOP["viewport"])


@pytest.mark.long
def test_a_hundred_megabytes_leave_the_page_awake(chromium, address, calibration, tmp_path):
    """Nearly two hours at 200 samples a second: the page answers meanwhile, and its memory hardly grows."""
    short = app_exports.riding()
    readings = np.column_stack((short.force_g, short.rates_dps))
    lines = [",".join(f"{value:.7f}" for value in row) for row in readings.tolist()]
    log = tmp_path / "RIDE.csv"
    with open(log, "w") as file:
        file.write("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n")
        file.writelines(f"{k / 200.0:.3f},{lines[k % len(lines)]}\n" for k in range(1_400_000))
    assert log.stat().st_size > 100e6
    rider = Rider(chromium, address + "rides.html")
    rider.page.evaluate(AWAKE)
    Rides(rider).page.set_input_files("#files", [log, calibration])
    rider.page.wait_for_function("document.querySelector('#work').hidden", timeout=10 * WAIT_MS)
    assert rider.page.inner_text("#said") == ""
    assert rider.page.inner_text("#figures td").startswith("1:56")
    assert rider.page.evaluate("longestMs") < 1500.0
    assert max(rss_mb(process) for process in rider.processes()) < 1000.0
    rider.context.close()


def test_a_singular_matrix_is_told_though_webassembly_has_no_flags():
    silent = rides_guest.raising(lambda matrix: np.full_like(matrix, np.nan))
    with pytest.raises(np.linalg.LinAlgError):
        silent(np.zeros((3, 3)))
    assert np.all(np.isnan(silent(np.full((3, 3), np.nan))))  # as numpy does elsewhere
    assert rides_guest.raising(np.linalg.inv)(2.0 * np.eye(2)).tolist() == [[0.5, 0.0], [0.0, 0.5]]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ("A.csv B.csv A.cal.json", {"A.csv": "A.cal.json", "B.csv": ""}),
        ("A.csv B.csv bike.json", {"A.csv": "bike.json", "B.csv": "bike.json"}),
        ("A.csv bike.json", {"A.csv": "bike.json"}),
        ("A.csv old.json new.json", {"A.csv": "new.json"}),
        ("ride-10.csv ride-9.csv bike.json", {"ride-9.csv": "bike.json", "ride-10.csv": "bike.json"}),
    ],
)
def test_the_calibration_of_another_ride_is_not_taken(ride, tmp_path, monkeypatch, names, expected):
    found = rides_of(tmp_path, monkeypatch, {name: ride.read_text()[:500] for name in names.split()})
    assert list(found.items()) == list(expected.items())


def test_two_recordings_of_single_files_are_two_rides(tmp_path, monkeypatch):
    """Files of an app that are one recording together are one."""
    riding = app_exports.riding().every(4)
    parts = {name: text for name, text in app_exports.phyphox(riding).items() if "/" not in name}
    files = {"b.csv": app_exports.racechrono(riding), "a.csv": app_exports.racechrono(riding), **parts}
    names = ["a.csv", "b.csv", "phyphox recording"]
    assert list(rides_of(tmp_path, monkeypatch, files)) == names


def test_a_file_may_have_the_name_of_the_folder_of_recordings(tmp_path, monkeypatch):
    parts = {name: text for name, text in app_exports.phyphox(app_exports.riding().every(4)).items() if "/" not in name}
    found = rides_of(tmp_path, monkeypatch, {"phyphox recording": "no log", **parts})
    assert list(found) == ["phyphox recording_"]


def rides_of(tmp_path, monkeypatch, files):
    """{log: calibration} of these files, {name: text}."""
    for folder in ("given", "here"):
        (tmp_path / folder).mkdir()
    for name, text in files.items():
        text = json.dumps(analysis_rides.CALIBRATION) if name.endswith(".json") else text
        (tmp_path / "given" / name).write_text(text)
    monkeypatch.chdir(tmp_path / "here")  # where all else is deleted
    found = json.loads(rides_guest.rides(str(tmp_path / "given"), json.dumps(list(files))))
    return {one["log"]: one["calibration"] for one in found["rides"]}


def test_a_ride_past_the_memory_is_told():
    @rides_guest.told
    def too_much():
        raise MemoryError

    assert json.loads(too_much()) == {"refused": rides_guest.TOO_LONG}


def rss_mb(process):
    """Memory of a process, by its number."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


def near(found, wanted, by):
    found, wanted = (np.array(values, dtype=float) for values in (found, wanted))
    return found.shape == wanted.shape and np.allclose(found, wanted, rtol=1e-6, atol=by, equal_nan=True)


def assert_near(found, wanted):
    """The same JSON, but for the last digit of its numbers."""
    assert type(found) is type(wanted) or {type(found), type(wanted)} == {int, float}
    if isinstance(wanted, dict):
        assert found.keys() == wanted.keys()
        for key in wanted:
            assert_near(found[key], wanted[key])
    elif isinstance(wanted, list):
        assert len(found) == len(wanted)
        for one, other in zip(found, wanted):
            assert_near(one, other)
    elif isinstance(wanted, (int, float)):
        assert found == pytest.approx(wanted, abs=0.0021)
    else:
        assert found == wanted
