"""The start by main.py: safe mode, wrong settings, incomplete firmware, too little memory."""

import subprocess
import sys

import pytest
from kickstand.errors import StoreError, report
from kickstand_tools.common import firmware_path
from support import mpy
from support.device_runs import FreshFirmware, take_firmware

INCOMPLETE, NO_MEMORY = ["Incomplete:     ", "flash it again  "], ["No memory for it", "restart it      "]
RAW = {"lean": [[0, 25]]}


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
    """Return without(name, error, times): the firmware is imported anew, and its module of this name raises the
    error."""
    hooks = list(sys.meta_path)
    with FreshFirmware():
        yield lambda name, error, times=-1: sys.meta_path.insert(0, Missing("kickstand." + name, error, times))
    sys.meta_path[:] = hooks


def frames_with(record, lines):
    return [t_s for t_s, *shown in record.frames if shown == lines]


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
    ("module", "entry", "error"),
    [
        ("ui.align_wizard", 0, ImportError),
        ("calibration.pose_taker", 1, MemoryError),
        ("rides.recorder", 4, ImportError),
    ],
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


CARD = {"SD_SPI": 0, "SD_SCK": 18, "SD_MOSI": 19, "SD_MISO": 16, "SD_CS": 17}


@pytest.mark.parametrize(
    ("module", "error", "config", "lines"),
    [
        ("rides.recorder", MemoryError, {"RECORD": True}, NO_MEMORY),
        ("rides.card_trial", ImportError, {"RECORD": True, **CARD}, INCOMPLETE),
        ("live.radio", ImportError, {"LIVE": True}, INCOMPLETE),
        ("live.live", ImportError, {"LIVE": True}, INCOMPLETE),
        ("live.radio", MemoryError, {"LIVE": True}, ["No Bluetooth:   ", "no memory       "]),
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


@pytest.mark.parametrize("error", [ImportError, MemoryError])
@pytest.mark.usefixtures("aligned")
def test_oled_without_its_pictures_shows_lines(error, without, run):
    without("ui.glance", error)
    record = run({**RAW, "board": {"display": "ssd1306"}, "until": 4})
    assert record.ends == ["off"] and record.last[0].startswith("Lean  25° right")
    assert record.console.count("incomplete firmware" if error is ImportError else "no memory for that") == 1


def test_display_without_its_driver_is_probed_less_often(without, run):
    """The pauses between attempts are 0.4, 0.8, 1.6, 3.2, 6.4 and 12.8 s."""
    without("board.oled", ImportError)
    record = run({**RAW, "board": {"display": "ssd1306"}, "until": 30})
    assert record.ends == ["off"] and 6 <= record.console.count("incomplete firmware") <= 8


def test_failed_import_can_be_repeated(tmp_path):
    """If an import is interrupted, MicroPython keeps the incomplete module. The next import must load it again."""
    (tmp_path / "outer.py").write_text("import inner\n\n\nclass Outer:\n    inner = inner.Inner\n")
    (tmp_path / "inner.py").write_text("import memory\n\nmemory.take()\n\n\nclass Inner:\n    pass\n")
    (tmp_path / "memory.py").write_text(
        "left = [0, 1]\n\n\ndef take():\n    if not left.pop():\n        raise MemoryError('none')\n"
    )
    script = f"""
import sys
sys.path[1:1] = [{str(tmp_path)!r}, {firmware_path.search_path()!r}]
import memory
from kickstand.errors import attempt
def use():
    from outer import Outer
    objects.append(Outer())
objects = []
memory.left.reverse()
first = attempt(use)
print(first.code, first.values, objects, sorted(name for name in sys.modules if name in ("outer", "inner", "memory")))
print(attempt(use), len(objects))
"""
    cpython = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    for output in (cpython, mpy.run_mpy(script)):
        assert output.splitlines()[1:] == ["no-memory ('none',) [] ['memory']", "None 1"]


def test_report_without_its_words_gives_its_code(without, on_board, capsys):
    """After a failure of flash or heap, the module with the words may not load."""
    on_board(lambda *_: report(StoreError("not-written", "EIO")))
    take_firmware()
    without("console", ImportError)
    on_board(lambda *_: report(StoreError("not-written", "EIO")))
    assert capsys.readouterr().out == "calibration not saved: EIO; the old one is kept\nnot-written\n"


def test_table_of_settings_leaves_the_heap_again(on_board):
    on_board(lambda board, settings: None)
    assert "kickstand.setting_table" not in sys.modules and not hasattr(sys.modules["kickstand"], "setting_table")
