"""Repeats the tests of this folder that need only the firmware under MicroPython."""

from pathlib import Path

import pytest
from support.mpy import run_tests

MODULES = (
    "test_meter",
    "test_filter_states",
    "test_rest",
    "test_upright_trim",
    "test_dive",
    "test_consistency",
    "test_known_ride",
)


@pytest.mark.parametrize("module", MODULES)
def test_under_micropython(module):
    run_tests(Path(__file__).with_name(module))
