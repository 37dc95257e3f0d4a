"""The two engines that run the firmware's mathematics on the host: CPython and MicroPython."""

import json
from pathlib import Path

import pytest
from kickstand.errors import Refusal
from kickstand_tools.calibration import refusals
from kickstand_tools.common import installation

from support import firmware_calls
from support.mpy import run_mpy

SCRIPT = Path(firmware_calls.__file__)

ENGINES = [
    "cpython",
    pytest.param(
        "micropython",
        marks=pytest.mark.skipif(not installation.has_micropython(), reason="no MicroPython unix port for this system"),
    ),
]


def run(engine, calls):
    """Run the calls on this engine. Return their results, decoded from JSON. calls: [(name, arguments), ...]."""
    if engine == "cpython":
        return json.loads(json.dumps([firmware_calls.call(name, arguments) for name, arguments in calls]))
    return json.loads(run_mpy(SCRIPT, stdin=json.dumps(calls)))


def words(answer):
    """Return the terminal's message for a refusal. answer: a result of run()."""
    return refusals.of_firmware(Refusal(answer["refused"], *answer["values"])).line()
