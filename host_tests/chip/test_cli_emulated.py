"""flash and status by mpremote against MicroPython's own image for the Pico, in an emulated RP2040."""

import socket
import sys

import command
import emulated_port
import pytest
from emulated import pico
from kickstand_tools import firmware_path
from kickstand_tools.deploy import config_check, connection
from kickstand_tools.emulator import image
from kickstand_tools.errors import InputError
from terminal import Terminal


@pytest.fixture
def device(monkeypatch):
    """A freshly booted Pico, at emulated_port.NAME."""
    with pico() as device:
        emulated_port.plug_in(monkeypatch, device)
        device.run(0.5)
        yield device


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
        at.wait_for("Kickstand on an emulated Pico, socket://")
        at.wait_for("No firmware on it yet, so the display is blank. In another terminal:")
        at.wait_for(f"kickstand flash --port socket://127.0.0.1:{free}")
        at.press("B")
        at.wait_for("pressed")
        at.press("q")
        assert at.end() == 0


FIRMWARE = {
    "main.py": "import time\nwhile True:\n    print('running')\n    time.sleep_ms(100)\n",
    "config.py": "# settings\n",
    "kickstand/__init__.py": "def status():\n    import config\n    print('all is well,', config.SIDE)\n",
    "kickstand/lean.py": "# " + "x" * 5000 + "\n",
    "kickstand/errors.py": "# errors\n",
}


@pytest.fixture
def firmware(tmp_path, monkeypatch):
    """A small firmware: copying the real one takes an emulated Pico long."""
    (tmp_path / "kickstand").mkdir()
    for name, text in FIRMWARE.items():
        (tmp_path / name).write_bytes(text.encode())
    monkeypatch.setattr(firmware_path, "directory", lambda: tmp_path)
    monkeypatch.setattr(firmware_path, "PACKAGE", tmp_path / "kickstand")
    judged = config_check.Judged(None, [])
    monkeypatch.setattr(config_check, "judge", lambda *_: judged)  # there is no settings.py to do that with


def running(device):
    """True if main.py is heard of within two seconds."""
    del device.said[:]
    return device.run_until(lambda: b"running" in device.said, 2.0)


@pytest.mark.usefixtures("firmware")
def test_flash_and_status_on_a_pico(device):
    """Onto a chip with an older version, an edited config and a calibration; then its app runs."""
    port = emulated_port.NAME
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

    assert running(device)
    result = command.works("status", "--port", port)
    assert result.out == "all is well, right\n"
    assert running(device)

    with connection.connected(port) as (board, _):
        assert board.fs_exists("/kickstand/lean.mpy")
        assert board.fs_readfile("/config.py") == b'SIDE = "right"\n'
        assert board.fs_readfile("/kickstand_a.cal") == b"calibration"
        assert not board.fs_exists("/kickstand/old_idea.py")


def test_a_board_that_hears_nothing_is_given_up_by_its_own_time(device, monkeypatch):
    """Refused after two tries of ten seconds of the board's time, however long those take here."""
    monkeypatch.setattr(device.console, "send", lambda _data: None)
    began_s = device.time_s
    assert "no MicroPython answers" in command.run("status", "--port", emulated_port.NAME).err
    assert 20.0 <= device.time_s - began_s < 21.0
