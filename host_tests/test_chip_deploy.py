"""The emulated Pico as a board to deploy to: mpremote over a socket, the display shows the firmware."""

import os
import re
import subprocess
import sys

import command
import pytest
from emulated import pico

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
