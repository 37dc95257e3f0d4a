"""The start by main.py: safe mode, wrong settings, incomplete firmware, too little memory."""

import re
import sys

import pytest
from support.device_runs import FreshFirmware
from support.mpy import run_mpy

INCOMPLETE, NO_MEMORY = ["Incomplete:     ", "flash it again  "], ["No memory for it", "restart it      "]
RAW = {"lean": [[0, 25]]}
MODULES = """
import gc, micropython
from kickstand_sim.simulated_board.simulator import Board
with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):
    gc.collect()
    from kickstand import start
    for name in start.STEPS + ["app"]:
        __import__("kickstand." + name)
    gc.collect()
    micropython.mem_info()
"""


class Missing:
    """An import hook that raises an error instead of importing one module, `times` times."""

    def __init__(self, name, error, times):
        self.name, self.error, self.times = name, error, times

    def find_spec(self, name, path=None, target=None):
        if name == self.name and self.times:
            self.times -= 1
            raise self.error(f"no module named '{name}'" if self.error is ImportError else "memory allocation failed")


@pytest.fixture
def without():
    """Return without(name, error, times): the firmware is imported again, and its module of this name raises the
    error."""
    hooks = list(sys.meta_path)
    with FreshFirmware():
        yield lambda name, error, times=-1: sys.meta_path.insert(0, Missing("kickstand." + name, error, times))
    sys.meta_path[:] = hooks


def frames_with(record, lines):
    return [t_s for t_s, *displayed in record.frames if displayed == lines]


@pytest.mark.parametrize("charge_us", [0, 7_000, 75_000])
@pytest.mark.parametrize(("held_s", "safe"), [(0.0, False), (0.05, False), (0.15, True), (1.0, True)])
def test_button_held_at_power_on_starts_safe_mode(held_s, safe, charge_us, run):
    """Until a capacitor at the button is charged, the pin reads as pressed."""

    def fit(board):
        board.button.charge_us = charge_us
        if held_s:
            board.press(0.0, held_s)

    record = run({**RAW, "until": 1.9}, fit=fit)
    assert record.ends == ["returned" if safe else "off"]
    if safe:
        assert record.last == ("Safe mode       ", "Ready for USB   ")
        assert "safe mode" in record.console
    else:
        assert record.last[0].startswith("Raw")


def test_closed_button_is_told_from_one_that_is_held(run):
    record = run({**RAW, "presses": [[0.0, 1000.0]], "until": 30})
    assert record.at(4.0) == ["Safe mode       ", "Ready for USB   "]
    assert record.last == ("Button is closed", "check its wires ") and record.ends == ["returned"]
    assert "The button on GPIO 15 stays closed" in record.console


@pytest.mark.parametrize(
    ("config", "line", "words"),
    [
        ("SIDE = 'up'\n", "SIDE", "SIDE = 'up', but it must be one of"),
        ("\n\n1 / 0\n", "config.py", "config.py cannot be read (line 3: division by zero)"),
        ("x = 1\n\ny = = 2\n", "config.py", "config.py cannot be read (line 3: invalid syntax"),
        ("raise ValueError('mine')\n", "config.py", "config.py cannot be read (line 1: mine)"),
        ("BUTTON_PIN = 47\n", "BUTTON_PIN", "BUTTON_PIN = 47 is not a pin of this board"),
        ("SPEED = 'gps'\nGPS_RX = 11\n", "GPS_TX / GPS_RX", "do not belong to UART 1"),
    ],
)
def test_wrong_settings_end_at_the_prompt_with_their_line(config, line, words, run, tmp_path):
    (tmp_path / "config.py").write_text(config)
    record = run({"config": None, "until": 30, "prompt": 20})
    assert record.ends == ["returned"] and line in "".join(record.last)
    assert "Kickstand stopped. config.py" in record.console and words in record.console


@pytest.mark.parametrize("module", ["app", "lean.lean_filter"])
def test_incomplete_firmware_ends_at_the_prompt(module, without, run):
    """The watchdog does not restart the board there."""
    without(module, ImportError)
    record = run({**RAW, "presses": [[2.0, 0.15]], "until": 60, "prompt": 20})
    assert record.ends == ["returned"]
    assert list(record.last) == INCOMPLETE
    assert "incomplete firmware" in record.console and "Run kickstand flash." in record.console


def test_too_little_memory_for_the_settings_is_shown_before_a_restart(without, run):
    """The display must not keep the lean that it showed before the reset."""
    without("setting_table", MemoryError, times=1)
    record = run({**RAW, "until": 6})
    assert record.ends == ["reset", "off"]
    assert record.at(3.0) == ["Error, restarts ", "MemoryError     "]


@pytest.mark.parametrize(
    ("module", "entry", "error"), [("ui.wizard", 0, ImportError), ("calibration.poses", 1, MemoryError)]
)
def test_failed_import_of_a_menu_entry_is_shown_each_time(module, entry, error, without, run):
    """entry: its position in the menu."""
    without(module, error)
    presses, chosen_s = [], []
    for at_s in (3.0, 15.0):
        presses += [[at_s, 1.2], *([at_s + 2 + k, 0.15] for k in range(entry)), [at_s + 2 + entry, 1.2]]
        chosen_s.append(at_s + 4 + entry)
    record = run({**RAW, "presses": presses, "until": 28})
    shown_s = frames_with(record, INCOMPLETE if error is ImportError else NO_MEMORY)
    for t_s in shown_s:  # the message is shown for 2 s
        assert min(abs(t_s - at_s) for at_s in chosen_s) < 2
    assert min(shown_s) < 12 < max(shown_s)
    assert record.last[0].startswith("Raw")
    assert ("run kickstand flash" if error is ImportError else "no memory for that") in record.console


@pytest.mark.usefixtures("without")
def test_only_the_entry_of_the_menu_loads_the_recorder(run):
    """The modules of the recorder take 9 KB of a board's heap."""
    plan, loaded = {**RAW, "presses": [[2.0, 1.2], *([4.0 + k, 0.15] for k in range(4))], "until": 9}, []

    def look(board):
        for at_s in (6.9, 8.5):  # at the entry before, and at `Record ride`
            board.at(at_s, lambda: loaded.append("kickstand.rides.recorder" in sys.modules))

    assert run(plan, fit=look).at(8.5)[0] == "→Record ride    " and loaded == [False, True]


CARD = {"SD_SPI": 0, "SD_SCK": 18, "SD_MOSI": 19, "SD_MISO": 16, "SD_CS": 17}


@pytest.mark.parametrize(
    ("module", "error", "config", "lines"),
    [
        ("rides.recorder", MemoryError, {"RECORD": True}, NO_MEMORY),
        ("rides.ride_files", ImportError, {"RECORD": True, **CARD}, INCOMPLETE),
        ("live.radio", ImportError, {"LIVE": True}, INCOMPLETE),
        ("live.live", MemoryError, {"LIVE": True}, ["No Bluetooth:   ", "no memory       "]),
    ],
)
def test_lean_continues_without_recorder_or_radio(module, error, config, lines, without, run):
    without(module, error)
    boards = []
    record = run({**RAW, "config": config, "board": {"machine": "pico w"}, "until": 8}, fit=boards.append)
    assert record.ends == ["off"] and record.last[0].startswith("Raw   25°")
    assert len(frames_with(record, lines)) == 1 and record.first(lines[0]) < 2.0
    words = "incomplete firmware (no module" if error is ImportError else "memory allocation"
    assert 1 <= record.console.count(words) <= 2
    assert not boards[0].radio.active


def test_the_modules_lie_close_together_in_the_heap():
    """Each later collection takes as long as it takes to scan the heap up to the last lasting object."""
    found = re.search(r"free: (\d+)\n.* max free sz: (\d+)", run_mpy(MODULES, heap="2M"))
    assert found and int(found[1]) - 32 * int(found[2]) < 120_000  # free bytes before that object; a block has 32 bytes
