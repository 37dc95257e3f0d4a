"""Emulated boards for the tests. Tests of one process that need the same start share one board.

Each test of a Pico runs in a fork of the process, so it changes only its own copy of the board. QEMU cannot be forked.
An ESP32 cannot be forked, so its tests restore its state, or use a board of their own.
"""

import os
import traceback

import pytest
from kickstand_sim.simulated_board.lcd import shown_lean
from support.emulated import CHIPS, calibrated, firmware, leaning, modules, pico

COPIED = {"riding", "at_prompt"}
FIRST_LEAN_S = 1.2


@pytest.fixture(scope="session", params=["pico", pytest.param("esp32", marks=pytest.mark.esp32)])
def riding(request):
    """Return a calibrated board that shows the lean of a bike held at 20 degrees to the right.

    A Pico shows this lean within FIRST_LEAN_S of power-on.
    """
    device = CHIPS[request.param](leaning(20.0), firmware(request.param) | calibrated())
    device.power_on()
    device.run_until(lambda: shown_lean(device.lcd()) == 20.0, FIRST_LEAN_S if request.param == "pico" else 4.0)
    yield device
    device.power_off()


@pytest.fixture(scope="session")
def at_prompt():
    """Return the same board without main.py, waiting for code at the prompt."""
    device = pico(leaning(20.0), modules() | calibrated())
    device.power_on()
    device.exec("pass")
    return device


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """Run a test of a Pico in a fork, so that the next test gets the board unchanged."""
    devices = [pyfuncitem.funcargs[name] for name in COPIED & set(pyfuncitem.fixturenames)]
    if not devices or devices[0].NAME == "ESP32":
        return None
    if not hasattr(os, "fork"):
        pytest.skip("needs os.fork")
    arguments = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
    ended, pipe = os.pipe()
    child = os.fork()
    if child == 0:
        failure = ""
        try:
            pyfuncitem.obj(**arguments)
        except BaseException:
            failure = traceback.format_exc()
        with open(pipe, "w", encoding="utf-8") as to:
            to.write(failure)
        os._exit(0)
    os.close(pipe)
    with open(ended, encoding="utf-8") as of:
        failure = of.read()
    status = os.waitpid(child, 0)[1]
    if failure or status:
        pytest.fail(failure or f"the process ended with {status}", pytrace=False)
    return True
