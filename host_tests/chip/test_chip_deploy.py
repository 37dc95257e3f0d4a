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


class Flashing:
    """`kickstand flash` to this emulated Pico, in a process of its own."""

    def __init__(self, device, directory):
        from kickstand_tools.emulator.console_server import ConsoleServer

        self.device = device
        self.server = ConsoleServer(device.console, 0)
        device.heard = self.server.say
        port = f"socket://127.0.0.1:{self.server.port}"
        self.process = subprocess.Popen(
            [sys.executable, "-m", "kickstand_tools.cli", "flash", "--port", port],
            cwd=directory,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()
        self.server.close()

    def finish(self):
        """Until the board has been reset, or has lost its power; when that was."""
        resets = self.device.chip.resets
        while self.process.poll() is None and self.device.chip.resets == resets and self.device.powered:
            self.device.run(0.02, self.server.poll)
        return self.device.time_s - 0.02


def test_the_first_lean_stands_there_soon(tmp_path):
    """`kickstand flash` onto a board with an older version and a calibration: within 1.5 s of its reset."""
    wanted = firmware_files.contents(bytecode.PICO)
    formula = "/kickstand/lean/formula"
    older = wanted | {formula + ".mpy": b"old", formula + ".py": b"old"} | calibrated()
    with pico(leaning(20.0), older) as device:
        with Flashing(device, tmp_path) as flashing:
            reset_s = flashing.finish()
            assert device.chip.resets == 1
            device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.0)
            assert device.time_s - reset_s < 1.5
            assert "copied 2 files" in flashing.process.communicate(timeout=20)[0]
        assert device.files() == {path.lstrip("/"): data for path, data in (wanted | calibrated()).items()}


# Modules of version 0.2.0, all in one folder: names that are folders now, that are gone, and that have stayed.
FLAT = "__init__ alignment app calibration driving errors lean lean_filter meter rotation settings speed ui".split()


def test_the_power_goes_while_an_older_version_is_updated(tmp_path):
    """It starts nothing then. Flashed again it starts, and nothing of the older version is left."""
    wanted = firmware_files.contents(bytecode.PICO)
    rest = {"/" + path: data for path, data in calibrated().items()} | {"/kickstand/notes.txt": b"mine"}
    older = {f"/kickstand/{name}.mpy": b"old" * 500 for name in FLAT} | {"/main.py": b"print('old')\n", **rest}
    with pico(leaning(20.0), older) as device:
        with Flashing(device, tmp_path) as flashing:
            device.chip.flash.cut_power(500, 0.5)
            flashing.finish()
            assert not device.powered
        cut = {"/" + path for path in device.files()}
        assert any("/lean/" in path for path in cut)
        assert cut <= (wanted | rest).keys()
        assert "/main.py" not in cut
        device.power_on()
        device.run(2.0)
        assert shown_lean(device.lcd()) is None
        with Flashing(device, tmp_path) as flashing:
            flashing.finish()
            device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.0)
        assert device.files() == {path.lstrip("/"): data for path, data in (wanted | rest).items()}


def test_which_compiled_files_the_image_takes():
    with pico() as device:
        assert device.exec("import sys\nprint(sys.implementation._mpy)") == f"{bytecode.PICO}\n"
