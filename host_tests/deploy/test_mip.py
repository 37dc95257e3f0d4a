"""`mpremote mip install` takes the firmware's modules from a server in the local network."""

import functools
import http.server
import threading
import types
from pathlib import Path

import pytest
from kickstand_tools.deploy import firmware_files
from mpremote import mip
from mpremote.transport_serial import SerialTransport
from support import emulated_port, fake_board
from support.emulated import CHIPS

ROOT = Path(__file__).resolve().parents[2]


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves a folder without printing a line for each request."""

    def log_message(self, format, *args):
        pass


@pytest.fixture
def package():
    """Return the address of package.json on a server of the folder firmware."""
    handler = functools.partial(Quiet, directory=ROOT / "firmware")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/package.json"
        server.shutdown()


def install(package, transport):
    """Run `mpremote mip install --target / PACKAGE` on the board. transport: its connection, at the prompt."""
    state = types.SimpleNamespace(transport=transport, did_action=lambda: None, ensure_raw_repl=lambda: None)
    words = types.SimpleNamespace(command=["install"], packages=[package], index=None, target="/", mpy=None)
    mip.do_mip(state, words)


def sources():
    """Return {path on the board: content} of the modules that mip installs."""
    files = firmware_files.firmware_files()
    return {path: source.read_bytes() for path, source in files.items() if path.startswith("/kickstand/")}


def test_mip_installs_from_a_local_server(package, tmp_path):
    install(package, fake_board.FakeBoard(tmp_path))
    found = {f"/{path.relative_to(tmp_path).as_posix()}": path for path in tmp_path.rglob("*") if path.is_file()}
    assert {path: file.read_bytes() for path, file in found.items()} == sources()


@pytest.mark.nightly  # slow, because 500 kB are sent through the console
@pytest.mark.chip
def test_mip_installation_starts_on_the_emulated_pico(package, monkeypatch):
    """The board also gets main.py and config.py, as firmware/docs/settings.md describes."""
    with CHIPS["pico"]() as device:
        emulated_port.plug_in(monkeypatch, device)
        device.run(1.0)
        transport = SerialTransport(emulated_port.NAME, timeout=10)
        transport.enter_raw_repl()
        install(package, transport)
        for name in ("main.py", "config.py"):
            transport.fs_writefile(name, (ROOT / "firmware" / name).read_bytes())
        written = device.files()
        assert {f"/{path}" for path in written} >= sources().keys()
        device.power_off()
        device.power_on()
        device.run_until(lambda: "Kickstand" in device.lcd()[0] or "stand" in device.lcd()[0], 10.0)
