"""A Pico is started once for all tests of a process that begin alike: each runs in a fork, with a copy of it."""

import os
import traceback

import pytest
from emulated import calibrated, firmware, leaning, modules, pico
from kickstand_tools.simulated_board.lcd import shown_lean

COPIED = {"riding", "at_prompt"}


@pytest.fixture(scope="session")
def riding():
    """A calibrated board that shows the lean of a bike held at 20 degrees to the right."""
    device = pico(leaning(20.0), firmware() | calibrated())
    device.power_on()
    device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.0)
    return device


@pytest.fixture(scope="session")
def at_prompt():
    """The same board without main.py: it waits for code."""
    device = pico(leaning(20.0), modules() | calibrated())
    device.power_on()
    device.exec("pass")
    return device


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """Whatever such a test does to the board, the next one has it as it was."""
    if not COPIED & set(pyfuncitem.fixturenames):
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
