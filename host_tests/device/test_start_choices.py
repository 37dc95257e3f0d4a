"""What main.py does at power-on and at each kind of end. The app itself is replaced."""

import sys

import pytest
from kickstand_tools.simulated_board.fakes import fake_machine
from kickstand_tools.simulated_board.simulator import Board
from support.board_access import level, on_board


@pytest.fixture
def started(tmp_path, monkeypatch, capsys):
    """Return started(run, fit). The function starts a board whose app is run(settings, lcd, loop).

    fit(board, start): changes the board or the module before the start. Returns how the board ended, the lines of its
    display, what the console printed, and how often the watchdog was stopped.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))

    def main(run, fit=None, loop=None, again=False):
        with Board(level) as board:
            from kickstand import start

            rested = []
            monkeypatch.setattr(start.port, "rest_watchdog", lambda: rested.append(0))
            monkeypatch.setattr(start, "run", run)
            if fit:
                fit(board, start)

            def program():
                if again:
                    board.reset_cause = fake_machine.WDT_RESET
                start.main(loop)

            ended = board.run(program, 30.0)
            return ended, [text.strip() for text in board.lcd.text()], capsys.readouterr().out, len(rested), board

    return main


def ends_with(error):
    def run(chosen, lcd, loop):
        raise error

    return run


def shows(chosen, lcd, loop):
    lcd.flush()


def test_the_app_gets_settings_display_and_loop(started):
    seen = []

    def run(chosen, lcd, loop):
        lcd.flush()
        seen.append((chosen.SAMPLE_HZ, loop))

    ended, lines, printed, rested, _ = started(run, loop=5)
    assert (ended, lines, printed, rested, seen) == ("returned", ["Kickstand", "starting"], "", 0, [(200, 5)])


@pytest.mark.parametrize(
    ("held_s", "again", "safe"), [(0.0, False, False), (0.15, False, True), (0.15, True, False), (0.05, False, False)]
)
def test_a_button_held_at_power_on_prevents_the_start(started, held_s, again, safe):
    """After a reset the button is ignored. A press of 50 ms ends within the 100 ms in which a capacitor charges."""

    def fit(board, start):
        if held_s:
            board.press(0.0, held_s)

    _, lines, printed, _, _ = started(shows, fit, again=again)
    assert lines == (["Safe mode", "Ready for USB"] if safe else ["Kickstand", "starting"])
    assert ("safe mode" in printed) is safe


def test_ctrl_c_stops_the_watchdog_and_says_how_to_continue(started):
    ended, lines, printed, rested, _ = started(ends_with(KeyboardInterrupt()))
    assert (ended, lines, rested) == ("returned", ["Kickstand", "stopped"], 1)
    assert "Ctrl-D starts it again" in printed


def test_incomplete_firmware_ends_at_the_prompt(started):
    ended, lines, printed, rested, _ = started(ends_with(ImportError("no module x")))
    assert (ended, lines, rested) == ("returned", ["Incomplete:", "flash it again"], 1)
    assert "incomplete firmware (no module x). Run kickstand flash." in printed


def test_an_error_is_shown_for_three_seconds_before_the_restart(started):
    ended, lines, _, rested, board = started(ends_with(ZeroDivisionError()))
    assert (ended, lines, rested) == ("reset", ["Error, restarts", "ZeroDivisionErro"], 0)
    assert 3.0 < board.clock.now_us / 1e6 < 3.5


def test_an_error_before_the_display_is_open_is_shown_too(started):
    def fit(board, start):
        def load():
            raise MemoryError

        start.settings.load, kept = load, start.settings.load
        board.at(1.0, lambda: setattr(start.settings, "load", kept))

    ended, lines, _, _, _ = started(shows, fit)
    assert (ended, lines) == ("reset", ["Error, restarts", "MemoryError"])


@pytest.mark.parametrize(
    ("config", "line", "said"),
    [
        ("SIDE = 'up'\n", "SIDE", "SIDE = 'up', but it must be one of"),
        ("\n\n1 / 0\n", "config.py", "config.py cannot be read (line 3: division by zero)"),
        ("x = 1\n\ny = = 2\n", "config.py", "config.py cannot be read (line 3: invalid syntax"),
        ("raise ValueError('mine')\n", "config.py", "config.py cannot be read (line 1: mine)"),
    ],
)
def test_wrong_settings_are_named_with_their_line(started, tmp_path, monkeypatch, config, line, said):
    (tmp_path / "config.py").write_text(config)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.delitem(sys.modules, "config", raising=False)
    try:
        ended, lines, printed, rested, _ = started(shows)
    finally:
        sys.modules.pop("config", None)
    assert (ended, rested) == ("returned", 1) and line in lines[1] + lines[0]
    assert printed.startswith("Kickstand stopped. config.py") and said in printed


def test_an_error_of_the_apps_pins_is_shown_on_the_open_display(started):
    def run(chosen, lcd, loop):
        from kickstand.errors import SettingsError

        raise SettingsError("no-such-pin", "BUTTON_PIN", 99, "invalid pin")

    _, lines, printed, rested, _ = started(run)
    assert "BUTTON_PIN" in "".join(lines) and "BUTTON_PIN = 99 is not a pin of this board" in printed and rested == 1


@pytest.mark.parametrize(
    ("error", "code", "values"),
    [
        (MemoryError("no heap"), "live-memory", ("no heap",)),
        (ImportError("no module"), "incomplete", ("no module",)),
        ("no-radio", "no-radio", ()),
        (None, None, ()),
    ],
)
def test_a_fault_of_the_radio_is_reported_and_harmless(error, code, values, capsys):
    def program(board):
        from kickstand import start
        from kickstand.errors import LiveError

        def open_radio(value):
            if error:
                raise LiveError(error) if isinstance(error, str) else error

        problem = start._live(open_radio, 5)
        found.append((problem and problem.code, problem.values if problem else ()))

    found = []
    assert on_board(program)[0] == "returned"
    assert found == [(code, values)] and bool(capsys.readouterr().out) is bool(code)
