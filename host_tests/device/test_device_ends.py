"""If the firmware ends for any reason, the display says so and shows no lean."""

import pytest
from kickstand_tools.simulated_board import simulator
from support import device_plans

LEAN = {"lean": [[0, 25]], "until": 10}
STOPPED = ("Kickstand       ", "stopped         ")
_USER = """
class Enough(BaseException):
    pass

calls = []
def on_lean(lean_deg, trusted, meter):
    calls.append(trusted)
    if len(calls) == 40:
        raise {}
"""


@pytest.fixture
def boards(tmp_path, monkeypatch):
    """Return the list of the simulated boards that have run. The flash contains an alignment."""
    device_plans.align(tmp_path)
    made = []
    install = simulator.Board.install
    monkeypatch.setattr(simulator.Board, "install", lambda board: (made.append(board), install(board)))
    return made


@pytest.mark.parametrize("kind", ["KeyboardInterrupt", "GeneratorExit", "Enough"])
def test_after_an_error_in_user_py_no_lean_is_shown(kind, boards, tmp_path, monkeypatch):
    (tmp_path / "user.py").write_text(_USER.format(kind))
    monkeypatch.syspath_prepend(str(tmp_path))
    try:
        device_plans.run("cpython", tmp_path, LEAN)
    except BaseException as error:
        assert type(error).__name__ == kind
    assert tuple(boards[-1].lcd.text()) == STOPPED


@pytest.mark.parametrize("turn", [1, 2, 150, 300])
def test_ctrl_c_in_a_transfer_leaves_no_lean(turn, boards, tmp_path, monkeypatch):
    """Ctrl-C interrupts the transfer of a line to the display, after half of a byte."""
    from kickstand.board import hd44780

    calls = []
    send = hd44780.Lcd.tick

    def interrupted(self, now_ms):
        calls.append(1)
        if len(calls) == turn:
            self._i2c.writeto(0x27, b"\x1c\x18")
            raise KeyboardInterrupt
        send(self, now_ms)

    monkeypatch.setattr(hd44780.Lcd, "tick", interrupted)
    record = device_plans.run("cpython", tmp_path, LEAN)
    assert record.ends == ["returned"]
    assert record.last == STOPPED


def test_a_ride_that_is_streamed_ends_without_a_lean(boards, tmp_path, monkeypatch):
    """`kickstand record` starts the app, not main.py."""
    from kickstand import app

    turn = app.App.turn
    monkeypatch.setattr(app.App, "turn", lambda self: turn(self) if not self.meter.trusted else 1 / 0)
    with pytest.raises(ZeroDivisionError):
        device_plans.run("cpython", tmp_path, LEAN | {"stream": True})
    assert tuple(boards[-1].lcd.text()) == STOPPED
