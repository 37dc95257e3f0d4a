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

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format, *args):
        pass


@pytest.fixture
def install():
    """Return a function that runs `mpremote mip install --target / PACKAGE` on a board."""
    handler = functools.partial(Quiet, directory=FIRMWARE)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        package = f"http://127.0.0.1:{server.server_address[1]}/package.json"

        def install(transport):
            state = types.SimpleNamespace(transport=transport, did_action=lambda: None, ensure_raw_repl=lambda: None)
            arguments = types.SimpleNamespace(command=["install"], packages=[package], index=None, target="/", mpy=None)
            mip.do_mip(state, arguments)

        yield install
        server.shutdown()
        thread.join()


def sources():
    files = firmware_files.firmware_files()
    return {path: source.read_bytes() for path, source in files.items() if path.startswith("/kickstand/")}


def test_mip_installs_from_a_local_server(install, tmp_path):
    install(fake_board.FakeBoard(tmp_path))
    assert fake_board.files(tmp_path) == sources()


@pytest.mark.long
@pytest.mark.chip
def test_mip_installation_starts_on_the_emulated_pico(install, monkeypatch):
    """The board also gets main.py and config.py, as firmware/docs/settings.md describes."""
    with CHIPS["pico"]() as device:
        emulated_port.plug_in(monkeypatch, device)
        device.run(1.0)
        transport = SerialTransport(emulated_port.NAME, timeout=10)
        transport.enter_raw_repl()
        install(transport)
        for name in ("main.py", "config.py"):
            transport.fs_writefile(name, (FIRMWARE / name).read_bytes())
        assert {f"/{path}" for path in device.files()} >= sources().keys()
        device.power_off()
        device.power_on()
        device.run_until(lambda: "stand" in device.lcd()[0], 10.0)
