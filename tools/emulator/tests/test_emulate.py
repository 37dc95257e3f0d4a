"""Tests the command `kickstand emulate`, and the commands flash and status on an emulated board, through mpremote."""

import socket
import sys

import pytest
from kickstand_emulator import image
from support import command
from support.emulated import need
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
    monkeypatch.setenv(image.ESP32_FOLDER, str(tmp_path))
    refusal = command.refused(tmp_path, *words, words="no emulated ESP32: libqemu-xtensa.so is missing")
    assert str(tmp_path) in refusal
