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


MODULES = (
    "test_meter",
    "test_filter_states",
    "test_rest",
    "test_upright_trim",
    "test_measurements",
    "test_known_ride",
)


@pytest.mark.parametrize("module", MODULES)
def test_under_micropython(module):
    assert "test_" in run_mpy(RUNNER, module, str(HERE))
