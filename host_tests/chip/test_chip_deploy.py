"""The emulated Pico as a board to deploy to: mpremote over a socket, and how soon the firmware shows a lean."""

import os
import re
import subprocess
import sys

import command
import pytest
from emulated import calibrated, leaning, pico, shown_lean
from kickstand_tools.deploy import bytecode, firmware_files

pytestmark = pytest.mark.chip

_EMULATE = "from kickstand_tools.emulator.emulate import emulate; emulate(0, lambda text: print(text, flush=True))"


def test_flash_onto_the_emulated_pico():
    """`kickstand flash` as onto a board; then the bike's ride begins, and the display says what it is to do."""
    pico()  # or skip
    process = subprocess.Popen(
        [sys.executable, "-c", _EMULATE],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
    )
    try:
        assert process.stdout is not None
        address = re.search(r"socket://\S+?:\d+", process.stdout.readline())
        assert address
        result = command.works("flash", "--port", address[0])
        assert "and verified them" in result.out
        shown = ""
        for line in process.stdout:
            shown += line
            if "Stand: hold" in shown:  # the script's press on the kickstand
                return
        pytest.fail(f"the display never asked to hold still: {shown}")
    finally:
        process.kill()
        process.wait()
        if process.stdout:
            process.stdout.close()


def test_the_first_lean_stands_there_soon(tmp_path):
    """`kickstand flash` onto a board with an older version and a calibration: within 1.5 s of its reset."""
    wanted = firmware_files.contents(bytecode.PICO)
    older = wanted | {"/kickstand/lean.mpy": b"old", "/kickstand/lean.py": b"old"} | calibrated()
    with pico(leaning(20.0), older) as device:
        from kickstand_tools.emulator.console_server import ConsoleServer

        server = ConsoleServer(device.console, 0)
        device.heard = server.say
        process = subprocess.Popen(
            [sys.executable, "-m", "kickstand_tools.cli", "flash", "--port", f"socket://127.0.0.1:{server.port}"],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            while process.poll() is None and not device.chip.resets:
                device.run(0.02, server.poll)
            assert device.chip.resets == 1
            reset_s = device.time_s - 0.02
            device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.0)
            assert device.time_s - reset_s < 1.5
            assert "copied 2 files" in process.communicate(timeout=20)[0]
        finally:
            process.kill()
            server.close()
        assert device.files() == {path.lstrip("/"): data for path, data in (wanted | calibrated()).items()}


def test_which_compiled_files_the_image_takes():
    with pico() as device:
        assert device.exec("import sys\nprint(sys.implementation._mpy)") == f"{bytecode.PICO}\n"
