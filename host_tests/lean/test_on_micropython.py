"""Repeats the tests of this folder that need only the firmware under MicroPython."""

from pathlib import Path

import pytest
from support.mpy import run_tests

MODULES = "test_known_ride", "test_meter"
LONG = "test_filter_states", "test_consistency"


@pytest.mark.parametrize("module", [*MODULES, *(pytest.param(module, marks=pytest.mark.long) for module in LONG)])
def test_under_micropython(module):
    run_tests(Path(__file__).with_name(module))
