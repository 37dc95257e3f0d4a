"""The start by main.py if a module, the settings or the flash is missing or broken."""

import builtins
import os
import subprocess
import sys

import pytest
from kickstand import errors
from kickstand_tools.common import firmware_path
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted import sensor_errors
from support import mpy


@pytest.fixture
def board(request, tmp_path, monkeypatch):
    """Return a board with an empty flash. The fixture's parameter has the arguments of Board."""
    monkeypatch.chdir(tmp_path)
    fitted = getattr(request, "param", {})
    made = Board(sensor_errors.resting(sensor_errors.Sensor(), (0, 0, 1)), **fitted)
    with made:
        yield made


@pytest.mark.parametrize("module", ["kickstand.app", "kickstand.lean.lean_filter"])
def test_incomplete_firmware_ends_at_the_prompt_and_says_so(module, board, monkeypatch, capsys):
    """The board stays at the prompt and does not restart."""
    from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

    from kickstand import start

    def use_the_console():
        start.main()
        sleep_ms(20_000)  # 20 s, in which a running watchdog would reset the board

    monkeypatch.setitem(sys.modules, module, None)
    board.press(2.0)
    assert board.run(use_the_console, 60.0) == "returned"
    assert board.lcd.text() == ["Incomplete:     ", "flash it again  "]
    assert "Run kickstand flash." in capsys.readouterr().out


@pytest.mark.parametrize("charge_us", [0, 7_000, 75_000])
@pytest.mark.parametrize("held", [False, True])
def test_a_capacitor_at_the_button_is_no_press_at_power_on(held, charge_us, board, capsys):
    """The pin's pull-up needs time to charge the capacitor. Until then the pin reads as pressed. A button that is held
    still prevents the start."""
    from kickstand import start

    board.button.charge_us = charge_us
    if held:
        board.press(0.0, 1.0)
    shown = []
    board.at(1.9, lambda: shown.extend(board.lcd.text()))
    assert board.run(start.main, 2.0) == ("returned" if held else "off")
    if held:
        assert board.lcd.text() == ["Safe mode       ", "Ready for USB   "]
        assert "safe mode" in capsys.readouterr().out
    else:
        assert shown[0].startswith("Raw")


INCOMPLETE, NO_MEMORY = ["Incomplete:     ", "flash it again  "], ["No memory for it", "restart it      "]
ALIGN, SIX, RECORD = 0, 1, 4  # positions in the menu


@pytest.fixture(params=["missing", "no memory"])
def without(request, monkeypatch):
    """Return without(end of a module's name), which blocks the import of this module and returns the expected
    message."""

    def take_away(ending):
        real = builtins.__import__

        def importing(name, globals=None, locals=None, fromlist=(), level=0):
            if ending in (name.rpartition(".")[2], *(fromlist or ())):
                if request.param == "missing":
                    raise ImportError(f"no module named '{name}'")
                raise MemoryError("memory allocation failed")
            return real(name, globals, locals, fromlist, level)

        monkeypatch.setattr(builtins, "__import__", importing)
        return INCOMPLETE if request.param == "missing" else NO_MEMORY

    return take_away


def watch(board):
    """Return a list that will contain (t_s, lines) of each change of the display."""
    seen = []

    def look():
        if not seen or seen[-1][1] != board.lcd.text():
            seen.append((board.clock.now_us / 1e6, board.lcd.text()))

    board.every(0.1, look)
    return seen


def choose(board, at_s, place):
    """Return the presses that choose an entry of the menu. The presses take 8 s. place: position of the entry."""
    for t_s in range(place):
        board.press(at_s + 2 + t_s)
    board.press(at_s, 1.2)
    board.press(at_s + 2 + place, 1.2)


@pytest.mark.parametrize(
    ("module", "place"),
    [("align_wizard", ALIGN), ("pose_taker", SIX), ("recorder", RECORD)],
)
def test_a_failed_import_of_the_menu_is_reported(module, place, without, board, capsys):
    """The display reports the failure each time the rider chooses the entry, and never earlier."""
    from kickstand import start

    if module == "pose_taker":
        for name in ("six_wizard", "wizard"):
            sys.modules.pop("kickstand.ui." + name, None)
    said, seen = without(module), watch(board)
    for at_s in (3, 15):
        choose(board, at_s, place)
    assert board.run(start.main, 28.0) == "off"
    shown_s = [t_s for t_s, lines in seen if lines == said]
    for t_s in shown_s:  # tolerance of 2 s: the message is shown for 2 s, and one sample may be a half-written line
        assert min(abs(t_s - (at_s + 4 + place)) for at_s in (3, 15)) < 2
    assert min(shown_s) < 12 < max(shown_s)
    assert seen[-1][1][0].startswith("Raw")
    assert ("run kickstand flash" if said is INCOMPLETE else "no memory for that") in capsys.readouterr().out


@pytest.mark.parametrize("module", ["recorder", "card_trial"])
def test_a_board_that_cannot_record_still_shows_the_lean(module, without, board, monkeypatch):
    from kickstand import settings, start

    pins = {"SD_SPI": 0, "SD_SCK": 18, "SD_MOSI": 19, "SD_MISO": 16, "SD_CS": 17} if module == "card_trial" else {}
    monkeypatch.setattr(settings, "load", lambda: settings.Settings(type("Config", (), {"RECORD": True, **pins})))
    said, seen = without(module), watch(board)
    assert board.run(start.main, 8.0) == "off"
    assert [t_s for t_s, lines in seen if lines == said] == [pytest.approx(0.6, abs=0.5)]
    assert seen[-1][1][0].startswith("Raw")


@pytest.mark.parametrize("module", ["radio", "live"])
@pytest.mark.parametrize("board", [{"machine": "pico w"}], indirect=True)
def test_without_lives_modules_the_lean_continues(module, without, board, monkeypatch, capsys):
    """The console reports the missing module once. The board does not restart, and the radio is off."""
    from kickstand import settings, start

    monkeypatch.setattr(settings, "load", lambda: settings.Settings(type("Config", (), {"LIVE": True})))
    said, seen = without(module), watch(board)
    assert board.run(start.main, 30.0) == "off"
    assert board.boots == 1 and seen[-1][1][0].startswith("Raw")
    memory = ["No Bluetooth:   ", "no memory       "]
    assert (memory if said == NO_MEMORY else INCOMPLETE) in [lines for _, lines in seen]
    words = "LIVE: too little memory (memory allocation" if said == NO_MEMORY else "incomplete firmware (no module"
    assert capsys.readouterr().out.count(words) == 1
    assert not board.radio.active


@pytest.mark.parametrize("board", [{"display": "ssd1306"}], indirect=True)
def test_without_its_pictures_an_oled_shows_lines(without, board, monkeypatch, capsys):
    from kickstand import start
    from kickstand.board import display
    from kickstand.ui import page_ring

    shown = []
    monkeypatch.setattr(display.Display, "show", lambda _, *lines: shown.append(lines))
    monkeypatch.setattr(page_ring.PageRing, "lines", lambda ring, now_ms: ring._page(page_ring.pages.lean))
    said = without("glance")
    assert board.run(start.main, 5.0) == "off"
    assert board.boots == 1 and ("Lean  --", "not sure yet") in shown
    words = "no memory for that" if said == NO_MEMORY else "incomplete firmware"
    assert capsys.readouterr().out.count(words) == 1


@pytest.mark.parametrize("board", [{"display": "ssd1306"}], indirect=True)
def test_a_display_without_its_driver_is_probed_less_often(without, board, monkeypatch, capsys):
    from kickstand import start
    from kickstand.board import display

    monkeypatch.setattr(display, "MOST_WAIT_MS", 6_400)
    said = without("oled")
    assert board.run(start.main, 31.0) == "off"
    words = "no memory for that" if said == NO_MEMORY else "incomplete firmware"
    times = capsys.readouterr().out.count(words)
    # The pauses between attempts are 0.4, 0.8, 1.6 and 3.2 s, then 6.4 s each
    assert 8 <= times <= 10 and board.boots == 1


@pytest.mark.parametrize("missing", [MemoryError, ImportError])
def test_settings_that_cannot_be_loaded_end_on_the_display(missing, board, monkeypatch, capsys):
    """The display must not keep the lean that it showed before the reset."""
    from kickstand import settings, start

    def load():
        raise missing("in setting_table")

    monkeypatch.setattr(settings, "load", load)
    restarts = missing is MemoryError
    assert board.run(start.main, 6.0) == ("reset" if restarts else "returned")
    assert board.lcd.text() == (["Error, restarts ", "MemoryError     "] if restarts else INCOMPLETE)
    assert "in setting_table" in "".join(capsys.readouterr())


def test_a_failed_import_can_be_repeated(tmp_path):
    """If an import is interrupted, MicroPython keeps the incomplete module. The next import must load the module
    again."""
    (tmp_path / "outer.py").write_text("import inner\n\n\nclass Outer:\n    inner = inner.Inner\n")
    (tmp_path / "inner.py").write_text("import memory\n\nmemory.take()\n\n\nclass Inner:\n    pass\n")
    (tmp_path / "memory.py").write_text(
        "left = [0, 1]\n\n\ndef take():\n    if not left.pop():\n        raise MemoryError('none')\n"
    )
    script = f"""
import sys
sys.path.append({str(tmp_path)!r})
import memory
from kickstand.errors import attempt
def use():
    from outer import Outer
    made.append(Outer())
made = []
memory.left.reverse()
first = attempt(use)
print(first.code, first.values, made, sorted(name for name in sys.modules if name in ("outer", "inner", "memory")))
print(attempt(use), len(made))
"""
    environment = os.environ | {"PYTHONPATH": firmware_path.search_path()}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    for said in (done.stdout, mpy.run_mpy(script)):
        _, first, second = said.splitlines()
        assert first == "no-memory ('none',) [] ['memory']"
        assert second == "None 1"


def test_a_report_that_cannot_be_worded_gives_its_code(board, monkeypatch, capsys):
    """After a failure of flash or heap, the module with the words may not load. The ride continues nevertheless."""
    errors.report(errors.StoreError("not-written", "EIO"))
    monkeypatch.setitem(sys.modules, "kickstand.console", None)
    errors.report(errors.StoreError("not-written", "EIO"))
    assert capsys.readouterr().out == "calibration not saved: EIO; the old one is kept\nnot-written\n"


def test_the_table_of_settings_leaves_the_heap_again(board):
    from kickstand.settings import load

    assert vars(load())["SAMPLE_HZ"] == 200
    assert "kickstand.setting_table" not in sys.modules and not hasattr(sys.modules["kickstand"], "setting_table")
