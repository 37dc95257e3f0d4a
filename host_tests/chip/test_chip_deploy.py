"""The emulated Pico as a board to deploy to: mpremote over a socket, and how soon the firmware shows a lean."""

import math
import queue
import re
import threading
import time
import types

import command
import emulated_port
import pytest
from emulated import calibrated, leaning, pico, shown_lean
from kickstand_tools.deploy import bytecode, connection, firmware_files
from mpremote import transport_serial

pytestmark = pytest.mark.chip


class Emulating(threading.Thread):
    """`kickstand emulate` beside the test. It ends at end_s of its own time."""

    def __init__(self, patch):
        super().__init__(daemon=True)
        from kickstand_tools.emulator import emulate
        from kickstand_tools.emulator.pico import Pico

        emulating = self

        class Limited(Pico):
            def run(self, seconds, between=None):
                emulating.pico = self
                if self.time_s > emulating.end_s:
                    raise KeyboardInterrupt
                super().run(seconds, between)

        self.pico: Pico | None = None
        self.end_s = math.inf
        self.said = queue.Queue()
        patch.setattr(emulate, "Pico", Limited)
        self._emulate = emulate.emulate

    def run(self):
        try:
            self._emulate(0, self.said.put)
        finally:
            self.said.put(None)

    def time_s(self):
        """The emulated board's."""
        return self.pico.time_s if self.pico else 0.0


@pytest.mark.long
def test_flash_onto_the_emulated_pico(monkeypatch):
    """`kickstand flash` as onto a board; then the bike's ride begins, and the display says what it is to do."""
    pico()  # or skip
    emulating = Emulating(monkeypatch)
    emulating.start()
    try:
        address = re.search(r"socket://\S+?:\d+", emulating.said.get())
        assert address
        clock = types.SimpleNamespace(monotonic=emulating.time_s, sleep=lambda seconds: time.sleep(seconds / 10))
        for module in (transport_serial, connection):
            monkeypatch.setattr(module, "time", clock)
        result = command.works("flash", "--port", address[0])
        assert "and verified them" in result.out
        emulating.end_s = emulating.time_s() + 30.0
        shown = ""
        while "Stand: hold" not in shown:  # the script's press on the kickstand
            text = emulating.said.get()
            assert text is not None, f"the display never asked to hold still: {shown}"
            shown += text
    finally:
        emulating.end_s = 0.0
        emulating.join()


def flash(device):
    """What `kickstand flash` onto this Pico says. The Pico is just about to be reset, or has lost its power."""
    device.run(0.3)  # until its USB port is there
    with pytest.MonkeyPatch.context() as patch:
        emulated_port.plug_in(patch, device)
        patch.setattr(connection, "_RESTART_S", 0)
        return command.run("flash", "--port", emulated_port.NAME)


def test_the_first_lean_stands_there_soon():
    """`kickstand flash` onto a board with an older version and a calibration: within 1.2 s of its reset."""
    wanted = firmware_files.contents(bytecode.PICO)
    formula = "/kickstand/lean/formula"
    older = wanted | {formula + ".mpy": b"old", formula + ".py": b"old"} | calibrated()
    with pico(leaning(20.0), older) as device:
        assert "copied 2 files" in flash(device).out
        device.run_until(lambda: device.chip.resets == 1, 0.5, 0.001)
        reset_s = device.time_s
        device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.0)
        assert device.time_s - reset_s < 1.2
        assert device.files() == {path.lstrip("/"): data for path, data in (wanted | calibrated()).items()}


# Modules of version 0.2.0, all in one folder: names that are folders now, that are gone, and that have stayed.
FLAT = "__init__ alignment app calibration driving errors lean lean_filter meter rotation settings speed ui".split()


@pytest.mark.long
def test_the_power_goes_while_an_older_version_is_updated():
    """It starts nothing then. Flashed again it starts, and nothing of the older version is left."""
    wanted = firmware_files.contents(bytecode.PICO)
    rest = {"/" + path: data for path, data in calibrated().items()} | {"/kickstand/notes.txt": b"mine"}
    older = {f"/kickstand/{name}.mpy": b"old" * 500 for name in FLAT} | {"/main.py": b"print('old')\n", **rest}
    with pico(leaning(20.0), older) as device:
        device.chip.flash.cut_power(500, 0.5)
        assert "connection lost" in flash(device).err
        assert not device.powered
        cut = {"/" + path for path in device.files()}
        assert any("/lean/" in path for path in cut)
        assert cut <= (wanted | rest).keys()
        assert "/main.py" not in cut
        device.power_on()
        device.run(2.0)
        assert shown_lean(device.lcd()) is None
        assert "and verified them" in flash(device).out
        device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.0)
        assert device.files() == {path.lstrip("/"): data for path, data in (wanted | rest).items()}


def test_which_compiled_files_the_image_takes():
    with pico() as device:
        assert device.exec("import sys\nprint(sys.implementation._mpy)") == f"{bytecode.PICO}\n"
