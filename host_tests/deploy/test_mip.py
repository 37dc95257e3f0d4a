"""`mpremote mip install` takes the firmware's modules from a server in the local network."""

import functools
import http.server
import threading
import types
from pathlib import Path

import pytest
from kickstand_tools.deploy import firmware_files
from mpremote import mip
from support import fake_board

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
