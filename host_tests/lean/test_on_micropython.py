"""The tests of this folder that need nothing but the firmware, once more under MicroPython."""

from pathlib import Path

import pytest
from mpy import run_mpy

HERE = Path(__file__).resolve().parent

RUNNER = """
import sys
sys.path.insert(0, sys.argv[2])
module = __import__(sys.argv[1])
for name in sorted(dir(module)):
    if name.startswith("test_"):
        print(name)
        getattr(module, name)()
"""


@pytest.mark.parametrize("module", ["test_meter_limits"])
def test_under_micropython(module):
    assert run_mpy(RUNNER, module, str(HERE)).count("test_") > 3
