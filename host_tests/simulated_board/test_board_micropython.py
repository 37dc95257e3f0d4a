"""Repeats tests under MicroPython that may differ there: floats and long integers, the heap, its own framebuf."""

from pathlib import Path

import pytest
from support.mpy import BOARD_HEAP, run_tests


@pytest.mark.parametrize("name", ["display", "framebuf", "gps", "wheel"])
def test_under_micropython(name: str) -> None:
    run_tests(Path(__file__).with_name(f"test_{name}.py"), BOARD_HEAP)
