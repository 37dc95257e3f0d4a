"""Runs the tests that need no pytest on MicroPython."""

from pathlib import Path

from support.mpy import BOARD_HEAP, run_tests


def test_the_same_on_micropython():
    run_tests(Path(__file__).with_name("test_live_hostile.py"), BOARD_HEAP)
