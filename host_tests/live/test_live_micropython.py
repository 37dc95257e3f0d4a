"""Runs tests on MicroPython that do not need pytest."""

from pathlib import Path

from support.mpy import BOARD_HEAP, run_tests


def test_the_same_on_micropython():
    run_tests(Path(__file__).with_name("test_live_hostile.py"), BOARD_HEAP)
