"""The models' own tests, which import nothing that MicroPython lacks, once more under MicroPython."""

from pathlib import Path

import pytest
from mpy import BOARD_HEAP, run_tests

MODULES = sorted(set(Path(__file__).parent.glob("test_board_*.py")) - {Path(__file__)})


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.stem)
def test_under_micropython(module: Path) -> None:
    run_tests(module, BOARD_HEAP)
