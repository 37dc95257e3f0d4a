"""Parts of the site without a browser: the server, the packed files, the simulated board of the page Try, and
the files given to the page Rides."""

import http.client
import io
import itertools
import json
import os
import sys
import tarfile
import threading
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import bytecode
from kickstand_tools.deploy.firmware_files import firmware_files
from kickstand_tools.logs.reader import read_log
from kickstand_tools.web import archives, npm_packages, rides_given, sample_ride, serve, site
from kickstand_tools.web.device import STATE, WHOLE_TICKS, PageDevice, display
from support.recordings import analysis_rides, app_exports

FILES = {"index.html": b"home", "a b.mjs": b"code", "x/y.unknown": b"?", "empty.txt": b""}


@pytest.fixture(scope="module")
def connection():
    with serve.server(FILES, 0) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield http.client.HTTPConnection(serve.HOST, server.server_address[1], timeout=20)
        server.shutdown()


@pytest.mark.parametrize(
    ("path", "name", "kind"),
    [
        ("/", "index.html", "text/html; charset=utf-8"),
        ("/index.html?x=1#y", "index.html", "text/html; charset=utf-8"),
        ("/a%20b.mjs", "a b.mjs", "text/javascript; charset=utf-8"),
        ("/x/y.unknown", "x/y.unknown", "application/octet-stream"),
        ("/empty.txt", "empty.txt", "text/plain; charset=utf-8"),
        ("/none.html", None, "text/html; charset=utf-8"),
    ],
)
@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_each_file_is_served_with_its_type(connection, method, path, name, kind):
    connection.request(method, path)
    answer = connection.getresponse()
    content = FILES.get(name, b"")
    assert answer.read() == (content if method == "GET" else b"")
    assert answer.status == (404 if name is None else 200)
    assert answer.headers["Content-Type"] == kind
    assert int(answer.headers["Content-Length"]) == len(content)
    assert answer.headers["Cache-Control"] == "no-cache"  # a new version is shown at once
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_an_address_that_is_none_is_answered(connection):
    connection.putrequest("GET", "http://[::1/", skip_host=True)
    connection.endheaders()
    answer = connection.getresponse()
    answer.read()
    assert answer.status == 400


def test_a_used_port_is_replaced_by_a_free_one(monkeypatch):
    with serve.server({}, 0) as first:
        port = first.server_address[1]
        with serve.server({}, port) as second:
            assert second.server_address[1] not in (0, port)

    def refused(*_):
        raise OSError(99, "Cannot assign requested address")

    monkeypatch.setattr(serve, "Server", refused)
    with pytest.raises(OSError, match="Cannot assign"):
        serve.server({})


def test_the_same_files_give_the_same_zip():
    one, other = {"b": b"2" * 1000, "a/c": b"1"}, {"a/c": b"1", "b": b"2" * 1000}
    packed = archives.zipped(one)
    assert packed == archives.zipped(other) and len(packed) < 1000
    archive = zipfile.ZipFile(io.BytesIO(packed))
    assert archive.namelist() == ["a/c", "b"]
    assert {name: archive.read(name) for name in archive.namelist()} == one


def test_only_the_needed_parts_of_numpy_are_kept():
    content = io.BytesIO()
    site_packages = "lib/python3.12/site-packages/"
    names = ["numpy/__init__.py", "numpy/core/a.so", "numpy/a.h", "numpy/tests/b.py", "numpy/random/c.so", "other/d.py"]
    with tarfile.open(fileobj=content, mode="w:gz") as package:
        for name in [*(site_packages + name for name in names), "info/licenses/A", "info/licenses/B"]:
            entry = tarfile.TarInfo(name)
            entry.size = len(name)
            package.addfile(entry, io.BytesIO(name.encode()))
        folder = tarfile.TarInfo(site_packages + "numpy/empty.py")
        folder.type = tarfile.DIRTYPE
        package.addfile(folder)
    archive, licences = archives.numpy_archive(content.getvalue())
    packed = zipfile.ZipFile(io.BytesIO(archive))
    assert packed.namelist() == ["numpy/__init__.py", "numpy/core/a.so"]
    assert packed.read("numpy/__init__.py").decode() == site_packages + "numpy/__init__.py"
    assert licences == b"info/licenses/Ainfo/licenses/B"


def test_the_pages_get_all_modules_that_they_import():
    found = archives.tools("web/device.py")
    assert {"kickstand_tools/web/device.py", "kickstand_tools/simulated_board/clock.py"} <= set(found)
    assert all(name.startswith("kickstand_tools/") and path.is_file() for name, path in found.items())
    assert "kickstand_tools/web/serve.py" not in found
    python = site.python_files()
    assert python["kickstand/app.py"] == (firmware_files()["/kickstand/app.py"]).read_text(encoding="utf-8")
    assert set(found) <= set(python)
    beside = archives.tools("analysis/plot/page.py")
    assert any(name.endswith(".js") for name in beside) and any(name.endswith(".html") for name in beside)


def test_each_architecture_gets_its_machine_code(monkeypatch):
    """Only files with machine code differ between the boards. The third byte of a file says if it has any."""

    def compiled(source, architecture):
        return b"M\x06" + bytes([source.stem.endswith("viper")]) + architecture.encode()

    monkeypatch.setattr(bytecode, "cross_compiled", compiled)
    found = archives._compiled()
    names = {name.split("/", 2)[2] for name in found if name.split("/")[1] == archives.ARCHITECTURES[0]}
    assert names == {
        path.removeprefix("/kickstand/")[:-2] + "mpy" for path in firmware_files() if path.startswith("/kickstand/")
    }
    for other in archives.ARCHITECTURES[1:]:
        theirs = {name.split("/", 2)[2] for name in found if name.split("/")[1] == other}
        assert theirs == {name for name in names if name.endswith("viper.mpy")}
        assert all(data[3:] == other.encode() for name, data in found.items() if name.split("/")[1] == other)

    def lacking(*_):
        raise bytecode.CannotCompile

    monkeypatch.setattr(bytecode, "cross_compiled", lacking)
    assert archives._compiled() == {}


def test_missing_libraries_of_the_page_rides_are_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "fitdecode", None)
    with pytest.raises(InputError, match=r"needs fitdecode and gpxpy: .*web\]"):
        archives.rides_archive()


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        ("npm error code E404\nnpm error 404 Not Found: x\nnpm error more words", "npm says: 404 Not Found: x"),
        ("npm error errno -111\nnpm error syscall connect\n", "npm failed; is there a network?"),
        ("npm warn no error\nnpm error ECONNREFUSED\nnpm error cannot connect", "npm says: cannot connect"),
        ("", "npm failed; is there a network?"),
    ],
)
def test_the_reason_of_npm_is_its_first_sentence(said, reason):
    assert npm_packages._reason(said) == reason


def test_installed_packages_are_used_and_incomplete_ones_named(tmp_path, monkeypatch):
    monkeypatch.setattr(npm_packages.Path, "home", lambda: tmp_path)
    made = []

    def install(kept):
        made.append(kept)
        for package, names in npm_packages.PACKAGES.values():
            for name in names:
                path = kept / "node_modules" / package / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(name.encode())

    monkeypatch.setattr(npm_packages, "_install", install)
    assert npm_packages.find() == npm_packages.find()
    assert npm_packages.find()["esptool/bundle.js"] == b"bundle.js"
    (kept,) = made
    assert kept.is_relative_to(tmp_path)
    (kept / "node_modules" / "esptool-js" / "bundle.js").unlink()
    with pytest.raises(InputError, match="is incomplete: remove it"):
        npm_packages.find()


def test_a_finished_installation_of_another_process_is_kept(tmp_path):
    for name in ("mine", "theirs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / name).write_text("")
    npm_packages._rename(str(tmp_path / "mine"), tmp_path / "new")
    assert (tmp_path / "new" / "mine").exists()
    npm_packages._rename(str(tmp_path / "new"), tmp_path / "theirs")
    assert [path.name for path in (tmp_path / "theirs").iterdir()] == ["theirs"]
    with pytest.raises(OSError):
        npm_packages._rename(str(tmp_path / "none"), tmp_path / "other")


def test_the_sites_home_is_that_of_the_package(monkeypatch):
    class Named:
        def get_all(self, _name):
            return ["Issues, https://an.example/issues", "Homepage, https://an.example/a, b"]

    monkeypatch.setattr(metadata, "metadata", lambda _: Named())
    assert site.home() == "https://an.example/a, b"

    def lacking(_):
        raise metadata.PackageNotFoundError

    monkeypatch.setattr(metadata, "metadata", lacking)
    assert site.home() == ""


def test_the_site_has_every_page_filled_in(monkeypatch):
    """Packages, documents and the sample ride are replaced, because making them takes long."""
    packages = {"esptool/LICENSE": b"licence", "plotly/plotly.min.js": b"plot()", "numpy/pkg/numpy.tar.gz": b"conda"}
    monkeypatch.setattr(npm_packages, "find", lambda: dict(packages))
    monkeypatch.setattr(site.documents, "document_files", lambda home: {"docs/a.html": home.encode()})
    monkeypatch.setattr(site.sample_ride, "sample_ride", lambda: {"ride.csv.gz": b"a ride"})
    monkeypatch.setattr(site.sample_ride, "preview", lambda: "<svg/>")
    for name in ("install_archive", "rides_archive", "firmware"):
        monkeypatch.setattr(archives, name, lambda name=name: name.encode())
    monkeypatch.setattr(archives, "numpy_archive", lambda conda: (conda + b" zipped", b"its licence"))
    monkeypatch.setattr(site, "home", lambda: "https://an.example")
    made = site.site_files()
    pages = {name for name in made if name.endswith(".html")}
    assert {"index.html", "live.html", "install.html", "rides.html"} <= pages
    for name in (*pages, "style.css"):
        assert b"{{" not in made[name] and b"{%" not in made[name], name
    assert b'href="https://an.example"' in made["index.html"] and made["docs/a.html"] == b"https://an.example"
    assert made["sample/ride.csv.gz"] == b"a ride"
    assert (made["numpy/numpy.zip"], made["numpy/licence.txt"]) == (b"conda zipped", b"its licence")
    assert made["esptool/licence.txt"] == b"licence" and not set(packages) - {"plotly/plotly.min.js"} & set(made)
    assert (made["install.zip"], made["firmware.zip"], made["rides.zip"]) == (
        b"install_archive",
        b"firmware",
        b"rides_archive",
    )
    sizes = json.loads(made["sizes.json"])
    assert sizes["sample/ride.csv.gz"] == 6 and "index.html" not in sizes
    assert set(json.loads(made["python.json"])) == set(site.python_files())
    worker = made["service_worker.js"].decode()
    kept = json.loads(worker.partition("const FILES = ")[2].partition(";")[0])
    later = {name for name in made if name.startswith((*site.LATER, "docs/"))}
    assert set(kept) == {"./", *made} - {"service_worker.js", "index.html"} - later
    made_later = site.site_files()
    assert made_later["service_worker.js"] == made["service_worker.js"]
    monkeypatch.setattr(site, "home", lambda: "")
    assert site.site_files()["service_worker.js"] != made["service_worker.js"]  # another version of the site


def test_the_tables_of_wiring_name_each_wire():
    tables = site.wiring_tables()
    assert set(tables) == {"pico", "esp32"}
    for title, rows in tables.values():
        assert title and all(len(row) == 3 and all(row) for row in rows)
        assert {"SDA", "SCL"} <= {pin for _, pin, _ in rows}


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return the board of the page Try. Its flash is a new folder."""
    monkeypatch.chdir(tmp_path)
    device = PageDevice()
    yield device
    device.board.uninstall()


def ticks(device, until_s):
    device.run_to(until_s)
    return json.loads(device.take())


def texts(found):
    return [" ".join(tick["display"]["text"]) for tick in found if "display" in tick]


def last(found, name):
    return next(tick[name] for tick in reversed(found) if name in tick)


def test_the_page_gets_a_record_every_20_ms(board):
    found = ticks(board, 2.5)
    assert [round(50 * tick["t_s"]) for tick in found] == list(range(1, 1 + len(found))) and len(found) in (125, 126)
    assert any("On stand: press" in text for text in texts(found))
    assert found[-1]["phase"] == "kickstand" and found[-1]["lean_deg"] == pytest.approx(-12.0, abs=0.1)
    assert found[-1]["powered"] and found[-1]["speed_mps"] == 0.0
    assert last(found, "meter") == [None, None]  # not aligned yet
    assert "display" in found[1]  # the dark display is sent too
    assert sum("display" in tick for tick in found) < 10  # only changes are sent
    shown = last(found, "display")
    assert shown["codes"][0][:4] == list(b"Raw ") and found[1]["display"]["codes"] == [[0x20] * 16] * 2
    assert shown["lit"] and len(shown["cgram"]) == 64 and shown["shown_deg"] is None
    assert json.loads(board.take()) == []


def test_a_display_that_keeps_changing_is_sent_now_and_then(board):
    """Usually a display is sent only if it has not changed for 20 ms."""

    def change():
        board.board.lcd.changes += 1

    board.board.every(0.01, change)
    found = ticks(board, 1.0)
    sent = [k for k, tick in enumerate(found) if "display" in tick]
    assert len(sent) >= 3 and max(b - a for a, b in itertools.pairwise(sent)) <= WHOLE_TICKS + 1 < 12


def test_a_press_aligns_and_the_bike_rides_on(board):
    """The rider presses the button on the kickstand and upright."""
    board.run_to(2.0)
    for pose, until_s in ((None, 6.5), ("upright", 14.0)):
        if pose:
            board.order("pose", pose)
            board.run_to(9.0)
        board.order("button", True)
        assert board.order("button", False) == pytest.approx(9.0 if pose else 2.0, abs=0.1)
        found = ticks(board, until_s)
    assert any("Aligned!" in text for text in texts(found))
    board.order("pose", 15.0)
    board.run_to(20.0)
    board.order("lean", 25.0)
    found = ticks(board, 24.0)
    lean_deg, forward_g = last(found, "meter")
    assert lean_deg == pytest.approx(25.0, abs=3.0) and forward_g == pytest.approx(0.0, abs=0.1)
    assert last(found, "display")["shown_deg"] == pytest.approx(25.0, abs=3.0)
    assert found[-1]["yaw_rate_dps"] < -10.0 and found[-1]["speed_mps"] == pytest.approx(15.0, abs=0.5)
    assert board.state()["trusted"] and set(board.state()) == set(STATE)


def test_power_and_plugs_may_be_pulled(board):
    board.run_to(2.0)
    for fitted in (False, False, True, True):
        board.order("sensor", fitted)
        found = ticks(board, board.board.clock.now_us / 1e6 + 2.0)
        if not fitted:
            assert board.state()["fault"] or "sensor" in texts(found)[-1].lower()
    board.order("power", False)
    found = ticks(board, 12.0)
    assert not board.powered and not found[-1]["powered"] and board.state() == {"view": "off"}
    assert not display(board.board.lcd)["lit"]
    board.order("display", "ssd1306")
    board.order("power", True)
    assert board.state() == {"view": "starting"}
    found = ticks(board, 15.0)
    shown = last(found, "display")
    assert found[-1]["powered"] and shown["lit"] and len(shown["pixels"]) == 1024
    assert any("On stand" in text for text in texts(found))


def test_the_supply_may_be_cut_while_a_calibration_is_saved(board):
    board.run_to(2.0)
    board.order("cut_save", True)
    for at_s, pose in ((2.0, "kickstand"), (8.0, "upright")):
        board.order("pose", pose)
        board.run_to(at_s + 2.0)
        board.order("button", True)
        board.order("button", False)
        board.run_to(at_s + 6.5)
    assert not board.powered
    board.order("power", True)
    assert any("On stand: press" in text for text in texts(ticks(board, 18.0)))


def test_the_sample_ride_is_a_log_with_an_aligned_calibration(tmp_path, monkeypatch):
    """The ride of the page is longer. Its log has the means of two readings each, as a recording of a board has."""
    monkeypatch.setattr(sample_ride, "SECONDS", 20.0)
    sample_ride._ride.cache_clear()
    made = sample_ride._ride()
    for name, content in sample_ride.sample_ride.__wrapped__().items():
        (tmp_path / name).write_bytes(content)
    sample_ride._ride.cache_clear()
    log = read_log(tmp_path / sample_ride.LOG)
    assert log.t_s[-1] == pytest.approx(20.0, abs=0.1)
    assert len(log.t_s) == len(made.time) // 2
    assert log.accel_g[5] == pytest.approx(made.readings[10:12, :3].mean(axis=0), abs=1e-4)
    assert log.gyro_dps[5] == pytest.approx(made.readings[10:12, -3:].mean(axis=0), abs=0.01)
    assert sum(speed == speed for speed in log.speed_mps) >= 15
    calibration = read_calibration(tmp_path / sample_ride.CALIBRATION)
    assert calibration.aligned and calibration.six_done


def given(tmp_path, monkeypatch, **files):
    """Return sorted_out() of these files. files: {name with __ for a dot: content}."""
    monkeypatch.chdir(tmp_path)
    names = []
    for name, text in files.items():
        names.append(name.replace("__", "."))
        Path(names[-1]).write_text(text)
    return rides_given.sorted_out(names)


def test_each_given_file_gets_its_kind_or_its_reason(tmp_path, monkeypatch, ride):
    calibration = json.dumps(analysis_rides.CALIBRATION)
    export = app_exports.racechrono(app_exports.riding().every(4))
    log = ride.read_text()[:3000].rpartition("\n")[0] + "\n"
    table = "a,b\n1,2\n3,4\n"
    found = given(
        tmp_path,
        monkeypatch,
        r10__csv=log,
        r9__csv=log,
        lap__csv=export,
        c__json=calibration,
        d__json="{}",
        n__csv=table,
    )
    assert [one.log for one in found.rides] == ["lap.csv", "r9.csv", "r10.csv"]
    assert found.kinds["r9.csv"] == "log" and found.kinds["c.json"] == "calibration"
    assert found.kinds["lap.csv"].startswith("of RaceChrono")
    assert set(found.refused) == {"d.json", "n.csv"}
    assert {one.calibration for one in found.rides} == {"c.json"}
    assert {one.track for one in found.rides} == {""}


def test_every_ride_gets_the_last_track(tmp_path, monkeypatch, ride):
    point = '<trkpt lat="47.{k}" lon="8"><time>2026-01-01T00:00:{k}Z</time></trkpt>'
    points = "".join(point.replace("{k}", str(k)) for k in range(10, 50))
    track = f'<gpx version="1.1"><trk><trkseg>{points}</trkseg></trk></gpx>'
    log = ride.read_text()[:3000].rpartition("\n")[0] + "\n"
    found = given(tmp_path, monkeypatch, a__csv=log, x__gpx=track, y__GPX=track, b__csv=log)
    assert not found.refused
    assert [one.track for one in found.rides] == ["y.GPX", "y.GPX"]
    assert found.kinds["x.gpx"] == "track"


@pytest.mark.skipif(os.name == "nt", reason="file names on Windows have no capitals of their own")
def test_rides_are_sorted_as_a_reader_counts():
    names = ["ride-10", "Ride-2", "ride-2b", "a", "10", "9"]
    assert sorted(names, key=rides_given._by_number) == ["9", "10", "a", "Ride-2", "ride-2b", "ride-10"]
