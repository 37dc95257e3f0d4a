"""flash and status by mpremote against MicroPython's own image for the Pico, in an emulated RP2040."""

import re
import subprocess
import sys
from pathlib import Path

import command
import pytest
from kickstand_tools import deploy

IMAGES = sorted((Path.home() / ".cache" / "rp2040py").glob("RPI_PICO-*-v1.26.1.uf2"))


@pytest.fixture
def port():
    """A freshly booted Pico; its console as a socket."""
    if not IMAGES:
        pytest.skip("no image of the Pico: rp2040py micropython --image 1.26.1 --fetch-fw-only gets it")
    process = subprocess.Popen(
        [sys.executable, "-m", "rp2040py", "micropython", "--image", str(IMAGES[0]), "--tcp-port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        said = ""
        assert process.stdout is not None
        for line in process.stdout:
            said += line
            if found := re.search(r"listening on (\S+?:\d+)", line):
                yield "socket://" + found[1]
                return
        pytest.fail(f"the emulator did not start: {said}")
    finally:
        process.kill()
        process.wait()
        assert process.stdout is not None
        process.stdout.close()


def test_flash_and_status_on_a_pico(port):
    """Onto a chip with an older version, an edited config and a calibration; then its app answers."""
    with deploy.connected(port) as (board, _):
        board.fs_mkdir("/kickstand")
        board.fs_writefile("/kickstand/old_idea.py", b"pass")
        board.fs_writefile("/kickstand/errors.py", b"pass")
        board.fs_writefile("/config.py", b'SIDE = "right"\n')
        board.fs_writefile("/kickstand_a.cal", b"calibration")

    wanted = {path: source.read_bytes() for path, source in deploy.firmware_files().items()}
    result = command.works("flash", "--port", port)
    assert f"Raspberry Pi Pico with RP2040, MicroPython 1.26.1 on {port}" in result.out
    assert "kept: config.py" in result.out
    assert "removed: kickstand/old_idea.py" in result.out
    assert f"copied {len(wanted) - 1} files" in result.out

    result = command.works("status", "--port", port)
    assert "on Raspberry Pi Pico with RP2040, MicroPython 1.26.1" in result.out
    assert "kickstand side right" in result.out
    assert "Sensor       none answers on SDA 4, SCL 5" in result.out

    with deploy.connected(port) as (board, _):
        assert board.fs_readfile("/config.py") == b'SIDE = "right"\n'
        assert board.fs_readfile("/kickstand_a.cal") == b"calibration"
        assert board.fs_readfile("/kickstand/errors.py") == wanted["/kickstand/errors.py"]
        assert not board.fs_exists("/kickstand/old_idea.py")
