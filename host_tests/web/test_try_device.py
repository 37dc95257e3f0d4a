"""The board of the page Try, on CPython and MicroPython: what it does at each order, and the records of each 20 ms."""

import itertools
import json
import re
from pathlib import Path

import pytest
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.lcd import Lcd
from kickstand_tools.web.device import STATE, PageDevice, display
from page_drive import ALIGN, RIDE, SHORT, Drive
from support.mpy import run_mpy
from support.web import page_repeated


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return the board of the page Try. The board's flash is a new folder."""
    monkeypatch.chdir(tmp_path)
    device = PageDevice()
    yield device
    device.board.uninstall()


def ticks(device, until_s):
    device.run_to(until_s)
    return json.loads(device.take())


def press(device):
    device.order("button", True)
    device.order("button", False)


def texts(records):
    return [" ".join(tick["display"]["text"]) for tick in records if "display" in tick]


def last(records, name):
    return next(tick[name] for tick in reversed(records) if name in tick)


def align(device):
    """Press the button in both poses. Returns the records of the 13 s that this takes."""
    begin_s = device.board.clock.now_us / 1e6
    for at_s, pose in ((begin_s, "kickstand"), (begin_s + 6.5, "upright")):
        device.order("pose", pose)
        device.run_to(at_s + 2.0)
        press(device)
        device.run_to(at_s + 6.5)
    return json.loads(device.take())


def test_a_first_visit_is_recorded_every_20_ms(board):
    """The rider presses the button in both poses, and leans in a ride of 15 m/s. Changes of display and state are
    sent."""
    records = align(board)
    assert [round(50 * tick["t_s"]) for tick in records] == list(range(1, 1 + len(records)))
    assert records[0]["phase"] == "kickstand" and records[0]["lean_deg"] == pytest.approx(-12.0, abs=0.1)
    first = records[1]["display"]
    assert first["codes"] == [[0x20] * 16] * 2 and first["shown_deg"] is None
    display = texts(records)
    assert [any(words in text for text in display) for words in ("On stand: press", "Aligned!")] == [True, True]
    assert len(display) < 0.2 * len(records)
    states = [tick["state"] for tick in records if "state" in tick]
    assert states[0]["code"] == "starting" and states[-1]["view"] == "align" and set(states[-1]) == set(STATE)
    assert all(state != other for state, other in itertools.pairwise(states)) and len(states) < 30
    board.order("pose", 15.0)
    records += ticks(board, 20.0)
    board.order("lean", -25.0)
    records += ticks(board, 24.0)
    lean_deg, speed_mps, yaw_rate_dps, phase = board.bike.truth(records[-1]["t_s"])
    assert records[-1]["lean_deg"] == round(lean_deg, 2) and records[-1]["speed_mps"] == round(speed_mps, 2)
    assert records[-1]["yaw_rate_dps"] == round(yaw_rate_dps, 1) > 10.0 and records[-1]["phase"] == phase
    assert last(records, "meter") == [pytest.approx(lean_deg, abs=3.0), pytest.approx(0.0, abs=0.1)]
    assert last(records, "display")["shown_deg"] == pytest.approx(lean_deg, abs=3.0)
    assert board.state()["trusted"] and json.loads(board.take()) == []
    meters = [tick["meter"] for tick in records if "meter" in tick]
    assert meters[0] == [None, None]  # not aligned yet
    for column, digits in enumerate((1, 3)):
        values = [meter[column] for meter in meters if meter[column]]
        assert all(round(value, digits) == value for value in values)
        assert any(round(value, digits - 1) != value for value in values)


def test_wire_power_and_display_may_be_pulled(board):
    board.run_to(2.0)
    for fitted in (False, False, True, True):
        board.order("sensor", fitted)
        records = ticks(board, board.board.clock.now_us / 1e6 + 2.0)
        assert bool(board.state()["fault"]) is not fitted, texts(records)
    board.order("power", False)
    assert board.order("power", False) == pytest.approx(10.0, abs=0.1)  # the board is already off
    board.order("display", "ssd1306")
    records = ticks(board, 12.0)
    assert records[-1]["t_s"] == pytest.approx(12.0, abs=0.021) and not records[-1]["powered"]
    assert "meter" not in records[-1] and board.state() == {"view": "off"} and not last(records, "display")["lit"]
    board.order("power", True)
    assert board.state() == {"view": "starting"}
    records = ticks(board, 15.0)
    display = last(records, "display")
    assert records[-1]["powered"] and display["lit"] and len(display["pixels"]) == 1024
    assert any("On stand" in text for text in texts(records)) and not any("?" in text for text in texts(records))
    for kind, pixels in (("lcd", 0), ("sh1106", 1024)):  # a display that has power lights up after its initialisation
        board.order("display", kind)
        display = last(ticks(board, board.board.clock.now_us / 1e6 + 3.0), "display")
        assert display["lit"] and len(display.get("pixels", [])) == pixels and display["text"][0].startswith("Raw")


def test_time_goes_on_in_safe_mode(board):
    """The button is held while the power is switched on. The firmware then ends, until the power is switched off."""
    board.order("power", False)
    board.order("button", True)
    board.order("power", True)
    records = ticks(board, 3.0)
    assert board.state() == last(records, "state") == {"view": "safe"}
    assert any("Safe mode" in text for text in texts(records))
    assert records[-1]["t_s"] == pytest.approx(3.0, abs=0.03) and "meter" not in records[-1]
    board.order("button", False)
    board.order("power", False)
    assert not board.powered and board.state() == {"view": "off"}
    board.order("power", True)
    board.run_to(5.0)
    assert board.state()["view"] != "safe"


@pytest.mark.long
def test_the_supply_is_cut_during_one_save(board):
    """The calibration of the first alignment is lost, and that of the second is kept. A cut can be cancelled."""
    board.order("cut_save", True)
    align(board)
    assert not board.powered
    board.order("power", True)
    records = align(board)
    assert any("On stand: press" in text for text in texts(records))
    assert board.powered and last(records, "meter")[0] == pytest.approx(0.0, abs=1.5)
    board.order("cut_save", True)
    board.order("cut_save", False)
    align(board)
    assert board.powered


# On MicroPython

# The orders include safe mode: the button is held while the power is switched on.
ORDERS = [
    *([1.0, "button", True], [1.0, "button", False], [5.0, "pose", "upright"]),
    *([6.0, "sensor", False], [7.3, "sensor", True]),
    *([9.0, "power", False], [9.5, "button", True], [9.7, "power", True], [11.2, "button", False]),
    *([12.0, "power", False], [12.3, "power", True]),
]


def repeated(kind, orders, flash):
    flash.mkdir()
    plan = json.dumps({"orders": orders, "until_s": 14.0})
    return json.loads(run_mpy(Path(page_repeated.__file__), kind, stdin=plan, directory=flash).splitlines()[-1])


@pytest.mark.long
def test_the_page_turns_the_loop_as_the_firmware_does(tmp_path):
    page = repeated("page", ORDERS, tmp_path / "page")
    loop = repeated("loop", page["orders"], tmp_path / "loop")
    shown = {display["text"][0].rstrip() for _, display in page["displays"]}
    assert {"", "Kickstand", "Stand: hold", "Now upright:", "Calibration", "Safe mode"} <= shown
    assert page["displays"] == loop["displays"]


# Every complete first line that the display can show in this ride
WHOLE = re.compile(
    r" {16}$|Kickstand {7}$|Raw +-?\d+° [+-]\d\.\d\dg *$|Stand: hold {5}$|Now upright: {4}$|Upright: hold {3}$"
    r"|Aligned! +\d+\.\d° *$|Lean  -- {8}$|Lean +\d+° (left|right)? *$|Max left +\d+° *$|(Accel|Brake) +\d\.\d\d g *$"
    r"|Formula +-?\d+° *$| *-?\d\.\d\d *-?\d\.\d\d *-?\d\.\d\dg *$"
)
LASTING_S = 0.08  # the firmware writes a page every 0.1 s, so a text that disappears sooner was not a page


@pytest.mark.long
def test_no_display_is_shown_half_written(tmp_path, monkeypatch):
    """The display of a ride with bends is sampled every 20 ms. The rider turns through the pages."""
    monkeypatch.chdir(tmp_path)
    with Drive() as drive:
        for order in [*ALIGN, RIDE, ("wait", 20)]:
            drive.do(*order)
        for lean_deg in (30, -25, 10, -40, 0, 5, 45, -3):
            for order in [("lean", lean_deg), ("wait", 3), SHORT]:
                drive.do(*order)
    display = [(tick["t_s"], tick["display"]["text"][0]) for tick in drive.records if "display" in tick]
    assert len(display) > 100 and [line for _, line in display if not WHOLE.match(line)] == []
    pages = [(t_s, re.sub(r"[-+\d.°]+|left|right|Brake|Accel", "", line).strip()) for t_s, line in display if t_s > 1.0]
    changes = [pages[0], *(other for state, other in itertools.pairwise(pages) if state[1] != other[1])]
    assert all(other[0] - state[0] > LASTING_S for state, other in itertools.pairwise(changes))


@pytest.mark.parametrize(("on", "two_lines", "letter"), [(True, True, 0x41), (False, True, 0x20), (True, False, 0x20)])
def test_characters_are_sent_only_of_a_display_that_is_on(on, two_lines, letter):
    lcd = Lcd(Clock())
    lcd.ddram[0] = ord("A")
    lcd.on, lcd.two_lines = on, two_lines
    assert display(lcd)["codes"] == [[letter] + [0x20] * 15, [0x20] * 16]
    lcd.ddram[:16] = b"Lean 12\xdf left   "
    assert display(lcd)["cgram"] == [0] * 64
    if on and two_lines:
        assert display(lcd)["shown_deg"] == -12.0
