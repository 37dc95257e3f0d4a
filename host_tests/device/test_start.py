"""What main.py runs, when something is missing or broken."""

import math
import sys

import pytest
from kickstand import errors
from kickstand_tools.bench.boot import in_order
from kickstand_tools.simulated_board.simulator import Board


@pytest.fixture
def board(tmp_path, monkeypatch):
    """A board with nothing in its flash."""
    monkeypatch.chdir(tmp_path)
    made = Board(lambda t_s: (0.002 * math.sin(700 * t_s), 0.0, 1.0, 0.0, 0.0, 0.0, 25.0))
    with made:
        yield made


@pytest.mark.parametrize("module", ["kickstand.app", "kickstand.ui.align_wizard"])
def test_incomplete_firmware_ends_at_the_prompt_and_says_so(module, board, monkeypatch, capsys):
    """Not in restarts for ever: also where what is missing is only imported for the first press."""
    from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

    from kickstand import start

    def use_the_console():
        start.main()
        sleep_ms(20_000)  # a watchdog that is not fed would reset the board

    monkeypatch.setitem(sys.modules, module, None)
    board.press(2.0)
    assert board.run(use_the_console, 60.0) == "returned"
    assert board.lcd.text() == ["Incomplete:     ", "flash it again  "]
    assert "Run kickstand flash." in capsys.readouterr().out


@pytest.mark.parametrize("charge_us", [0, 7_000, 75_000])
@pytest.mark.parametrize("held", [False, True])
def test_a_capacitor_at_the_button_does_not_pass_for_a_press_at_power_on(held, charge_us, board):
    """The pull-up of the pin needs its time to charge it. A button that is held starts nothing all the same."""
    from kickstand import start

    board.button.charge_us = charge_us
    if held:
        board.press(0.0, 1.0)
    shown = []
    board.at(1.9, lambda: shown.extend(board.lcd.text()))
    assert board.run(start.main, 2.0) == ("returned" if held else "off")
    if held:
        assert board.lcd.text() == ["Safe mode       ", "Ready for USB   "]
    else:
        assert shown[0].startswith("Raw")


def test_a_report_that_cannot_be_worded_gives_its_code(board, monkeypatch, capsys):
    """A flash or a heap that has failed may not give the words: that must not end the ride."""
    errors.report(errors.StoreError("not-written", "EIO"))
    monkeypatch.setitem(sys.modules, "kickstand.console", None)
    errors.report(errors.StoreError("not-written", "EIO"))
    assert capsys.readouterr().out == "calibration not saved: EIO; the old one is kept\nnot-written\n"


def test_the_imports_of_the_app_are_in_small_steps(board):
    """Between two of them display and chip are set up. No step may import much more than its own module."""
    from kickstand import start

    loaded = set(in_order("kickstand.start", []))
    for step in start.STEPS:
        found = set(in_order("kickstand." + step, []))
        assert f"kickstand.{step}" not in loaded, step
        assert len(found - loaded) <= 3, (step, found - loaded)
        loaded |= found
    assert start.STEPS[-1] == "app"


def test_what_the_first_lean_does_not_need_is_imported_later():
    early = {name.split(".", 1)[1] for name in in_order("kickstand.app", [])[1:] if "." in name}
    late = {"rides.recorder", "ui.menu", "ui.align_wizard", "lean.formula", "drive_alignment.background", "console"}
    assert not early & late
