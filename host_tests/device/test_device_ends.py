"""If the firmware ends for any reason, the display says so and shows no lean."""

import pytest

LEAN = {"lean": [[0, 25]], "until": 6}
STOPPED = ("Kickstand       ", "stopped         ")
_USER = """
class Enough(BaseException):
    pass

calls = []
def on_lean(lean_deg, trusted, meter):
    calls.append(trusted)
    if len(calls) == 20:
        raise {}
"""


@pytest.fixture
def boards():
    return []


@pytest.mark.parametrize("kind", ["KeyboardInterrupt", "GeneratorExit", "Enough"])
def test_error_in_user_py_leaves_no_lean(kind, boards, aligned, run):
    (aligned / "user.py").write_text(_USER.format(kind))
    try:
        run(LEAN, fit=boards.append)
    except BaseException as error:
        assert type(error).__name__ == kind
    assert tuple(boards[0].lcd.text()) == STOPPED


def ctrl_c():
    raise KeyboardInterrupt


@pytest.mark.parametrize("after_us", range(0, 10_000, 1250))
@pytest.mark.usefixtures("aligned")
def test_ctrl_c_in_a_transfer_leaves_no_lean(after_us, run):
    """The sensor is read and the display is written at these times. Some of the transfers end within a byte."""
    record = run(LEAN, fit=lambda board: board.at(3.0 + after_us * 1e-6, ctrl_c))
    assert record.ends == ["returned"]
    assert record.last == STOPPED
    assert "Ctrl-D starts it again" in record.console


def test_display_at_another_address_is_found_without_a_loop(aligned, run, status):
    """A backpack with a closed jumper: after Ctrl-C, in safe mode, after a refused setting, and in the status."""
    board = {"lcd_address": 0x24}
    plan = LEAN | {"board": board}
    assert run(plan, fit=lambda board: board.at(4.0, ctrl_c)).last == STOPPED
    assert run(plan | {"presses": [[0.0, 1.0]]}).last[0] == "Safe mode       "
    assert run(plan | {"config": {"SIDE": "up"}}).last == ("config.py: wrong", "SIDE            ")
    assert "Display      LCD at 0x24" in status(**board)
